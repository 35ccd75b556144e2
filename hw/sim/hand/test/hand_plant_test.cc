#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <vector>

#include "common/testing/loopback.h"
#include "hw/modbus/hand.h"
#include "hw/sim/hand/hand.h"
#include "hw/sim/hand/hand_node.h"

namespace mimesis::hw::sim {
namespace {

using namespace std::chrono_literals;

const modbus::HandProfile k3f = modbus::load_hand_profile("hands/robotiq_3f.yaml");
constexpr modbus::HandSetpoint kSetpoint{.move = true, .closure = 1.0, .force = 1.0};
constexpr HandOutput kClose{
    .activate = true, .go = true, .position = 255, .speed = 255, .force = 255};

void run(HandPlant& plant, double seconds, const HandOutput& output,
         std::optional<double> contact = {}) {
  for (int i = 0; i < std::lround(seconds * 100); ++i) plant.step(0.01, output, contact);
}

TEST(HandPlant, MustBeActivatedFirst) {
  HandPlant plant({});
  run(plant, 0.1, {.go = true, .position = 255});
  EXPECT_EQ(plant.input().fault, 0x7);
  run(plant, 0.4, {.activate = true});
  EXPECT_EQ(plant.input().initialisation, Initialisation::activating);
  run(plant, 0.2, {.activate = true});
  EXPECT_EQ(plant.input().initialisation, Initialisation::done);
  EXPECT_EQ(plant.closure(), 0.0);
}

TEST(HandPlant, ClosesInItsTime) {
  HandPlant plant({.closing_time_s = 1.0, .activation_time_s = 0.0});
  run(plant, 0.02, {.activate = true});
  run(plant, 0.5, kClose);
  EXPECT_NEAR(plant.closure(), 0.5, 1e-9);
  EXPECT_EQ(plant.input().motion, Motion::moving);
  run(plant, 0.5, kClose);
  EXPECT_EQ(plant.closure(), 1.0);
  EXPECT_EQ(plant.input().motion, Motion::at_request);
  HandOutput slow = kClose;
  slow.position = 0;
  slow.speed = 0;
  run(plant, 1.0, slow);
  EXPECT_NEAR(plant.closure(), 0.8, 1e-9);
}

TEST(HandPlant, HoldsAnObjectAndClosesOnWhenItIsGone) {
  HandPlant plant({.activation_time_s = 0.0});
  run(plant, 0.02, {.activate = true});
  run(plant, 1.0, kClose, 0.4);
  EXPECT_EQ(plant.closure(), 0.4);
  EXPECT_EQ(plant.input().contact, Contact::while_closing);
  EXPECT_EQ(plant.input().current, 100);
  run(plant, 1.0, kClose);
  EXPECT_EQ(plant.closure(), 1.0);
  EXPECT_EQ(plant.input().contact, Contact::at_request);
}

TEST(HandPlant, ModeChangeTakesItsTimeAndNoFingerMoves) {
  HandPlant plant({.activation_time_s = 0.0, .mode_time_s = 0.3});
  run(plant, 0.02, {.activate = true});
  HandOutput pinch = kClose;
  pinch.mode = HandMode::pinch;
  run(plant, 0.3, pinch);
  EXPECT_EQ(plant.input().initialisation, Initialisation::changing_mode);
  EXPECT_EQ(plant.closure(), 0.0);
  run(plant, 0.1, pinch);
  EXPECT_EQ(plant.input().mode, HandMode::pinch);
  EXPECT_GT(plant.closure(), 0.0);
}

TEST(HandNode, WaitsForNobodysRequest) {
  testing::Loopback graph;
  HandNode node({}, graph);
  const modbus::Address address = modbus::parse_address("unix:hand", graph.directory());
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  ASSERT_LT(address.path.size(), sizeof name.sun_path);
  std::ranges::copy(address.path, name.sun_path);
  std::vector<int> others;
  const auto connect_other = [&](std::string_view bytes) {
    others.push_back(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    ASSERT_EQ(connect(others.back(), reinterpret_cast<sockaddr*>(&name), sizeof name), 0);
    ASSERT_EQ(write(others.back(), bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  };
  using namespace std::string_view_literals;
  for (int i = 0; i < 3; ++i) connect_other("\0\1\0"sv);  // half a header
  connect_other("\0\1\0\0\0\x6\x9"sv);                    // no function
  connect_other("\0\1\0\0\xff\xff\x9\x3"sv);              // too long
  modbus::HandClient client(address, k3f, 300ms);
  for (runtime::Time now = 1s; now < 1100ms; now += 10ms) {
    const auto answer = client.exchange(now, kSetpoint);
    EXPECT_TRUE(answer.has_value()) << answer.error().reason;
  }
  // A request in pieces is answered.
  connect_other("\0\1\0\0\0\x6"sv);
  connect_other("\0\2\0\0\0\x6\x9\x4\x7\xd0\0\x1"sv);
  ASSERT_EQ(write(others[5], "\x9\x4\x7\xd0\0\x1", 6), 6);
  for (const int other : {others[5], others[6]}) {
    std::array<char, 16> answer{};
    EXPECT_EQ(recv(other, answer.data(), answer.size(), 0), 11);  // one register
  }
  for (const int other : others) close(other);
}

TEST(HandNode, ObeysRegistersAndMeetsTheObjectOfTheWorld) {
  testing::Loopback graph;
  HandNode node({}, graph);
  modbus::HandClient client(modbus::parse_address("unix:hand", graph.directory()), k3f, 5000ms);
  v1::HandContact contact;
  contact.set_reachable(true);
  contact.set_contact_closure(0.3);
  graph.send("contact", contact, 1s);
  v1::HandState hand;
  for (runtime::Time now = 1s; now < 3s; now += 10ms) {
    ASSERT_TRUE(client.exchange(now, kSetpoint).has_value());
    node.step(now + 2500us);
    hand = *graph.take<v1::HandState>("hand");
  }
  EXPECT_TRUE(hand.active());
  EXPECT_TRUE(hand.object_detected());
  EXPECT_DOUBLE_EQ(hand.closure(), 0.3);
}

}  // namespace
}  // namespace mimesis::hw::sim
