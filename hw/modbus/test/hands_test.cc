// Profiles against servers of four grippers (hands.py): each is read right, or refused as another
// device; none is misread.
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <memory>
#include <sstream>
#include <thread>

#include "hw/modbus/hand.h"

namespace mimesis::hw::modbus {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

struct Case {
  std::string kind, habit;
  int delay_ms;
  std::string profile;
  bool fits;
};

const std::array<std::pair<const char*, const char*>, 4> kHands = {
    {{"3f", "robotiq_3f"}, {"2f", "robotiq_2f"}, {"rg2", "onrobot_rg2"}, {"rh56", "inspire_rh56"}}};

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const auto& [kind, own] : kHands) {
    for (const int delay_ms : {5, 10, 20, 50, 100, 200})
      all.push_back({kind, "plain", delay_ms, own, true});
    for (const char* habit : {"chunks", "twice", "foreign"})
      all.push_back({kind, habit, 10, own, true});
    all.push_back({kind, "lost", 10, own, false});
    for (const auto& [other, profile] : kHands) {
      if (other == std::string(kind)) continue;
      for (const int delay_ms : {5, 200}) all.push_back({kind, "plain", delay_ms, profile, false});
    }
  }
  all.push_back({"2f", "short", 5, "robotiq_3f", false});
  all.push_back({"2f", "short", 5, "robotiq_2f", true});
  return all;
}

/// The servers; they end with the test.
class Servers {
 public:
  explicit Servers(const std::vector<Case>& all) {
    std::string command = "exec /usr/bin/python3 " MIMESIS_SOURCE_DIR "/hw/modbus/test/hands.py";
    for (const Case& c : all)
      command += " " + c.kind + ":" + c.habit + ":" + std::to_string(c.delay_ms);
    std::array<int, 2> in{}, out{};
    if (pipe(in.data()) != 0 || pipe(out.data()) != 0) return;
    if (fork() == 0) {
      dup2(in[0], 0);
      dup2(out[1], 1);
      for (const int fd : {in[0], in[1], out[0], out[1]}) close(fd);
      execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
      _exit(127);
    }
    close(in[0]);
    close(out[1]);
    life_ = in[1];
    std::string line;
    for (char c; ::read(out[0], &c, 1) == 1 && c != '\n';) line += c;
    close(out[0]);
    std::istringstream numbers(line);
    for (int port; numbers >> port;) ports.push_back(port);
  }
  ~Servers() { close(life_); }
  std::vector<int> ports;

 private:
  int life_ = -1;
};

TEST(Hands, AreReadRightOrRefused) {
  if (access("/usr/bin/python3", X_OK) != 0) GTEST_SKIP() << "no python3";
  const std::vector<Case> all = cases();
  const Servers servers(all);
  ASSERT_EQ(servers.ports.size(), all.size());
  std::vector<std::unique_ptr<HandDriver>> drivers;
  for (std::size_t i = 0; i < all.size(); ++i)
    drivers.push_back(std::make_unique<HandDriver>(
        parse_address("tcp:127.0.0.1:" + std::to_string(servers.ports[i]), ""),
        load_hand_profile("hands/" + all[i].profile + ".yaml"), HandDriver::Options{}));
  const HandSetpoint close_it{.move = true, .closure = 1.0, .force = 0.5};
  std::vector<HandReading> last(all.size());
  int misread = 0;
  // Patience for a machine that is busy; those that do not fit are watched for 5 s.
  const auto begin = Clock::now();
  const auto met = [&](std::size_t i) { return last[i].object_detected && !last[i].moving; };
  for (bool waits = true; waits && Clock::now() - begin < 60s; std::this_thread::sleep_for(5ms)) {
    waits = Clock::now() - begin < 5s;
    for (std::size_t i = 0; i < all.size(); ++i) {
      last[i] = drivers[i]->exchange(0s, close_it);
      const HandReading& r = last[i];
      const bool wrong = all[i].fits ? r.object_detected && std::abs(r.closure - 0.47) > 0.01
                                     : r.active || r.object_detected;
      if (wrong && misread++ == 0)
        ADD_FAILURE() << all[i].kind << " as " << all[i].profile << ": " << r.closure << r.fault;
      waits = waits || (all[i].fits && !met(i));
    }
  }
  EXPECT_EQ(misread, 0);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Case& c = all[i];
    SCOPED_TRACE(c.kind + " " + c.habit + " " + std::to_string(c.delay_ms) + " ms as " + c.profile);
    if (c.fits) {
      EXPECT_TRUE(met(i) && last[i].active) << last[i].fault;
      EXPECT_NEAR(last[i].closure, 0.47, 0.01);
    } else {
      const bool named = last[i].fault.find(": is no ") != std::string::npos ||
                         last[i].fault.find(": this is no ") != std::string::npos ||
                         last[i].fault.find(": is it a ") != std::string::npos;
      EXPECT_TRUE(named) << last[i].fault;
    }
  }
}

}  // namespace
}  // namespace mimesis::hw::modbus
