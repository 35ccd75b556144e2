// Client, driver and simulated hand over real sockets.
#include "hw/modbus/hand.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <thread>

#include "common/testing/loopback.h"
#include "hw/modbus/testing/odd_hand.h"
#include "hw/sim/hand/hand.h"

namespace mimesis::hw::modbus {
namespace {

using namespace std::chrono_literals;

const HandProfile k3f = load_hand_profile("hands/robotiq_3f.yaml");
constexpr auto kPatience = 2s;  // the machine may be busy; nothing here depends on it

/// A graph's directory and a hand in it, stepped by the test at 100 Hz.
class Hand : public ::testing::Test {
 protected:
  testing::Loopback graph;
  Address address = parse_address("unix:hand", graph.directory());
  std::unique_ptr<sim::HandServer> server = std::make_unique<sim::HandServer>(address);
  sim::HandPlant plant{{}};
  std::optional<double> contact;
  Time now = 1s;

  void run(HandDriver& driver, const HandSetpoint& setpoint, Time duration) {
    for (const Time end = now + duration; now < end; now += 10ms) {
      reading = driver.exchange(now, setpoint);
      plant.step(0.01, server->exchange(plant.input()), contact);
    }
  }
  HandReading reading;
};

TEST_F(Hand, ActivatesClosesAndMeetsTheObject) {
  HandDriver driver(address, k3f, {.threaded = false, .timeout = kPatience});
  run(driver, {}, 700ms);
  EXPECT_TRUE(reading.active) << reading.fault;
  EXPECT_EQ(reading.closure, 0.0);

  contact = 0.6;
  const HandSetpoint close{.move = true, .mode = HandMode::basic, .closure = 1.0, .force = 0.5};
  run(driver, close, 300ms);
  EXPECT_TRUE(reading.moving);
  EXPECT_FALSE(reading.object_detected);
  EXPECT_NEAR(reading.closure, 0.28, 0.03);
  run(driver, close, 500ms);
  EXPECT_FALSE(reading.moving);
  EXPECT_TRUE(reading.object_detected);
  EXPECT_NEAR(reading.closure, 0.6, 0.5 / 255);

  run(driver, {.move = true, .mode = HandMode::basic, .closure = 0.0, .force = 0.5}, 800ms);
  EXPECT_FALSE(reading.object_detected);
  EXPECT_EQ(reading.closure, 0.0);
}

TEST_F(Hand, WithoutAnObjectItClosesWholly) {
  HandDriver driver(address, k3f, {.threaded = false, .timeout = kPatience});
  const HandSetpoint close{.move = true, .mode = HandMode::pinch, .closure = 1.0, .force = 1.0};
  run(driver, close, 2200ms);
  EXPECT_EQ(reading.mode, HandMode::pinch);
  EXPECT_EQ(reading.closure, 1.0);
  EXPECT_FALSE(reading.object_detected);
  EXPECT_FALSE(reading.moving);
}

TEST(HandDriver, DoesNotWaitLongForASilentHandWhenItStops) {
  testing::Loopback graph;
  const Address address = parse_address("unix:silent", graph.directory());
  const int silent = listen(address);  // takes connections, never answers
  HandDriver driver(address, k3f, {.threaded = false, .timeout = 1min});
  const auto begin = std::chrono::steady_clock::now();
  driver.stop();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 30s);
  close(silent);
}

TEST_F(Hand, StopLeavesTheFingersWhereTheyAre) {
  HandDriver driver(address, k3f, {.threaded = false, .timeout = kPatience});
  run(driver, {.move = true, .closure = 1.0}, 1000ms);
  const double half = plant.closure();
  EXPECT_GT(half, 0.2);
  driver.stop();
  for (int i = 0; i < 100; ++i) plant.step(0.01, server->exchange(plant.input()), contact);
  EXPECT_DOUBLE_EQ(plant.closure(), half);
}

/// In the middle of a grip the hand dies, stalls, or answers rubbish; the driver says so, within
/// 0.5 s and without waiting for it, and goes on when the hand is back.
TEST_F(Hand, FailsInTheMiddleOfAGrip) {
  using Clock = std::chrono::steady_clock;
  const std::string other_function("\0\1\0\0\0\3\x09\x83\2", 9),
      no_modbus = "HTTP/1.0 400 Bad Request\r\n\r\n", endless(4096, '\xFF'), half("\0\1\0", 3);
  const std::pair<const char*, const std::string*> ways[] = {
      {"dies", nullptr},          {"stalls", nullptr},   {"exception", &other_function},
      {"not Modbus", &no_modbus}, {"babbles", &endless}, {"half an answer", &half}};
  for (const auto& [way, answer] : ways) {
    SCOPED_TRACE(way);
    server.reset();
    server = std::make_unique<sim::HandServer>(address);
    plant = sim::HandPlant{{}};
    HandDriver driver(address, k3f, {.threaded = true, .timeout = 50ms});
    const HandSetpoint close{.move = true, .closure = 1.0, .force = 0.5};
    const auto cycle = [&] {
      const auto before = Clock::now();
      reading = driver.exchange(now += 10ms, close);
      const auto took = Clock::now() - before;
      if (server) plant.step(0.01, server->exchange(plant.input()), 0.5);
      std::this_thread::sleep_until(before + 5ms);
      return took;
    };
    const auto until = [&](const auto& done) {
      for (const auto end = Clock::now() + 20s; Clock::now() < end && !done();) cycle();
      return done();
    };
    ASSERT_TRUE(until([&] { return reading.moving; })) << reading.fault;
    server.reset();
    std::optional<OddHand> odd;
    int silent = -1;
    if (answer != nullptr) odd.emplace(address, *answer);
    if (way == std::string("stalls")) silent = listen(address);
    const auto failed = Clock::now();
    ASSERT_TRUE(until([&] { return !reading.fault.empty(); }));
    RecordProperty(way, static_cast<int>((Clock::now() - failed) / 1ms));
    EXPECT_FALSE(reading.active);
    EXPECT_FALSE(reading.moving);
    for (int k = 0; k < 20; ++k) EXPECT_LT(cycle(), 10s) << "the arm never waits";
    odd.reset();
    if (silent >= 0) ::close(silent);
    server = std::make_unique<sim::HandServer>(address);
    ASSERT_TRUE(until([&] { return reading.active; })) << reading.fault;
  }
}

TEST_F(Hand, ReconnectsWithGrowingPauses) {
  HandClient client(address, k3f, 2000ms);
  ASSERT_TRUE(client.exchange(1s, {}).has_value());
  server.reset();
  EXPECT_FALSE(client.exchange(1s + 10ms, {}).has_value());
  const std::uint64_t errors = client.errors();
  EXPECT_FALSE(client.exchange(1s + 20ms, {}).has_value());
  EXPECT_EQ(client.errors(), errors) << "no attempt within the first pause of 0.1 s";
  const auto absent = client.exchange(1s + 120ms, {});
  ASSERT_FALSE(absent.has_value());
  EXPECT_EQ(absent.error().reason, "hand at unix:hand: nobody serves there");
  EXPECT_EQ(client.errors(), errors + 1);
  server = std::make_unique<sim::HandServer>(address);
  EXPECT_FALSE(client.exchange(1s + 200ms, {}).has_value()) << "the second pause is 0.2 s";
  EXPECT_TRUE(client.exchange(1s + 400ms, {}).has_value());
}

TEST_F(Hand, AMuteHandCostsOneTimeout) {
  const Address mute = parse_address("unix:mute", graph.directory());
  const int listener = listen(mute);
  HandClient client(mute, k3f, 50ms);
  const auto before = std::chrono::steady_clock::now();
  const auto answer = client.exchange(1s, {});
  EXPECT_GE(std::chrono::steady_clock::now() - before, 50ms);
  ASSERT_FALSE(answer.has_value());
  EXPECT_EQ(answer.error().reason,
            "hand at unix:mute: registers 2000 to 2007: no answer of unit 9 within 50 ms: is it a "
            "three-finger gripper (Robotiq 3F)?");
  close(listener);
}

TEST_F(Hand, ServerSurvivesNoise) {
  const auto fd = connect(address, 2000ms);
  ASSERT_TRUE(fd.has_value());
  ASSERT_GT(send(*fd, "GET / HTTP/1.1\r\n\r\n", 18, MSG_NOSIGNAL), 0);
  close(*fd);
  HandClient client(address, k3f, 2000ms);
  EXPECT_TRUE(client.exchange(1s, {}).has_value());
}

TEST_F(Hand, TwoServersAtOneAddressAreRefused) {
  EXPECT_THROW(sim::HandServer second(address), ConfigError);
}

TEST_F(Hand, OnAThreadTheCallerNeverWaits) {
  HandDriver driver(address, k3f, {.threaded = true, .timeout = kPatience});
  const auto deadline = std::chrono::steady_clock::now() + 10s;
  while (!reading.active && std::chrono::steady_clock::now() < deadline) {
    reading = driver.exchange(now, {});
    plant.step(0.01, server->exchange(plant.input()), contact);
    std::this_thread::yield();
  }
  EXPECT_TRUE(reading.active) << reading.fault;
}

TEST(Tcp, SameOverTheLoopbackInterface) {
  std::unique_ptr<sim::HandServer> server;
  Address address;
  for (int port = 20502; !server && port < 20602; ++port) {
    address = parse_address("tcp:127.0.0.1:" + std::to_string(port), "");
    try {
      server = std::make_unique<sim::HandServer>(address);
    } catch (const ConfigError&) {  // in use
    }
  }
  ASSERT_NE(server, nullptr);
  HandClient client(address, k3f, 2000ms);
  const auto first = client.exchange(1s, {.move = true, .closure = 0.2});
  ASSERT_TRUE(first.has_value()) << first.error().reason;
  EXPECT_EQ(server->exchange({.activated = true, .position = 51}).position, 51);
  EXPECT_EQ(client.exchange(1s, {.move = true, .closure = 0.2})->closure, 0.2);
}

TEST(Address, SaysWhatItExpects) {
  EXPECT_TRUE(parse_address("unix:hand", "/run").local);
  EXPECT_EQ(parse_address("unix:hand", "/run").path, "/run/hand.modbus");
  EXPECT_EQ(parse_address("tcp:[::1]:502", "").port, "502");
  for (const char* bad : {"hand", "tcp:host", "tcp::502", "unix:", "unix:a/b", "serial:x"}) {
    EXPECT_THROW(parse_address(bad, "/run"), ConfigError) << bad;
  }
}

TEST(LatestSlot, GivesTheNewestOnce) {
  LatestSlot<int> slot;
  int value = 0;
  EXPECT_FALSE(slot.take(value));
  slot.put(1);
  slot.put(2);
  EXPECT_TRUE(slot.take(value));
  EXPECT_EQ(value, 2);
  EXPECT_FALSE(slot.take(value));
}

TEST(LatestSlot, NeverTearsNorGoesBack) {
  struct Pair {
    long a = 0, b = 0;
  };
  LatestSlot<Pair> slot;
  constexpr long kCount = 200'000;
  std::thread writer([&] {
    for (long i = 1; i <= kCount; ++i) slot.put({i, -i});
  });
  Pair p;
  long last = 0;
  while (last < kCount) {
    if (!slot.take(p)) continue;
    ASSERT_EQ(p.a, -p.b);
    ASSERT_GT(p.a, last);
    last = p.a;
  }
  writer.join();
}

}  // namespace
}  // namespace mimesis::hw::modbus
