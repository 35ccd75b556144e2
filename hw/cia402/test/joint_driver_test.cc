#include <dlfcn.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <utility>

#include "common/runtime/log.h"
#include "common/testing/loopback.h"
#include "common/testing/no_malloc.h"
#include "hw/cia402/test/joint_driver_bench.h"

namespace {
thread_local bool locks_refused = false;
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define MIMESIS_REFUSES_LOCKS
extern "C" int pthread_mutex_lock(pthread_mutex_t* mutex) {
  using Lock = int (*)(pthread_mutex_t*);
  static const auto lock = reinterpret_cast<Lock>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));
  if (std::exchange(locks_refused, false)) {
    static constexpr char kLine[] = "a lock where none is allowed\n";
    [[maybe_unused]] const auto written = write(STDERR_FILENO, kLine, sizeof kLine - 1);
    std::abort();
  }
  return lock(mutex);
}
#endif

namespace mimesis::hw::cia402 {
namespace {

TEST_F(Bench, BootsConfiguresEnablesAndFollows) {
  enable();
  for (std::size_t i = 0; i < kAxes; ++i) {
    EXPECT_NEAR(reading().joints[i].position_rad, target[i], 1e-4);
  }
  const std::vector<double> start = target;
  for (int k = 1; k <= 200; ++k) {
    for (std::size_t i = 0; i < kAxes; ++i) {
      target[i] = start[i] + 0.4 * (1.0 - std::cos(M_PI * k / 200.0)) * (i == 1 ? -1.0 : 1.0);
    }
    cycle({.mode = Mode::follow, .position_rad = target});
  }
  follow(100ms);
  for (std::size_t i = 0; i < kAxes; ++i) {
    EXPECT_NEAR(reading().joints[i].position_rad, target[i], 1e-3);
    EXPECT_NEAR(rack->drives()[i].position_rad(), target[i], 1e-3);
  }
  EXPECT_EQ(reading().limited, 0u);
}

TEST_F(Bench, SaysWhichDrivesAreMissingAndTakesThemLater) {
  plug(1);
  connect();
  idle(2050ms);
  EXPECT_EQ(reading().phase, Phase::starting);
  idle(200ms);
  EXPECT_EQ(reading().phase, Phase::fault);
  EXPECT_EQ(reading().reason, "no answer within 2 s from A2 (node 5), A3 (node 9)");
  follow(100ms);
  EXPECT_FALSE(any_enabled());
  rack.reset();
  plug();
  idle(1s);
  EXPECT_EQ(reading().phase, Phase::idle) << reading().reason;
  follow(100ms);
  EXPECT_EQ(reading().phase, Phase::following) << reading().reason;
}

TEST_F(Bench, NobodyOnTheBus) {
  connect();
  idle(2200ms);
  EXPECT_EQ(reading().reason, "no answer within 2 s from A1 (node 1), A2 (node 5), A3 (node 9)");
}

TEST_F(Bench, RefusesADriveThatIsTooSlow) {
  target.assign(kAxes, 0.0);
  rack.emplace(std::vector<sim::DriveConfig>{{.axis = axes()[0], .plant = {.v_max_rad_s = 1.0}}},
               wire.join());
  connect();
  idle(200ms);
  EXPECT_EQ(reading().phase, Phase::fault);
  EXPECT_EQ(reading().reason,
            "A1 (node 1): SDO 607F:00 (the robot's velocity limit): expected at least 0x3A980, is "
            "0x27100");
}

TEST_F(Bench, ReportsAnSdoAbortInWords) {
  connect();
  auto stubborn = wire.join();
  for (int k = 0; k < 40; ++k) {
    cycle({.mode = Mode::idle});
    std::array<can::Frame, 256> in;
    const std::size_t count = stubborn->receive(in);
    for (const can::Frame& f : std::span(in).first(count)) {
      const Identity id = identify(f);
      if (id.kind != Identity::Kind::sdo_request || id.node != 5) continue;
      stubborn->send(std::array{sdo_abort(
          5, {static_cast<std::uint16_t>(f.data[1] | f.data[2] << 8), f.data[3]}, 0x06020000)});
    }
  }
  EXPECT_EQ(
      reading().reason,
      "A2 (node 5): SDO 1000:00 (a drive of profile 402): object does not exist (0x06020000)");
}

/// Another program on the bus weakens what stops a drive: noticed while it runs, and mended.
TEST_F(Bench, StopsWhenTheProtectionOfADriveIsChanged) {
  enable();
  follow(30s);  // all of it has been read once
  ASSERT_EQ(reading().phase, Phase::following) << reading().reason;
  struct Case {
    Object object;
    std::uint32_t value;
    int bytes;
  };
  for (const Case& c :
       {Case{object::kAbortOption, 0, 2}, Case{object::kMasterHeartbeat, 0x7F'7530, 4},
        Case{object::kRpdo1Deadline, 30'000, 2}, Case{object::kFollowingWindow, 0xFFFFFFFF, 4}}) {
    tap->send(std::array{sdo_download(5, c.object, c.value, c.bytes)});
    for (int k = 0; k < 6000 && reading().phase == Phase::following; ++k) follow(kCycle);
    EXPECT_EQ(reading().phase, Phase::fault) << text(c.object);
    EXPECT_TRUE(reading().reason.starts_with("A2 (node 5): SDO " + text(c.object)))
        << reading().reason;
    EXPECT_NE(reading().reason.find("another program on the bus"), std::string::npos);
    idle(1s);
    EXPECT_FALSE(any_enabled());
    EXPECT_EQ(driver->reset_faults(), "");
    idle(2s);
    ASSERT_EQ(reading().phase, Phase::idle) << reading().reason;
    follow(40s);
    ASSERT_EQ(reading().phase, Phase::following) << reading().reason;
  }
}

TEST_F(Bench, ADriveFaultStopsAllAxes) {
  enable();
  rack->drives()[1].inject(sim::Trouble::overcurrent);
  follow(20ms);
  EXPECT_EQ(reading().phase, Phase::fault);
  EXPECT_NE(reading().reason.find("A2 (node 5): expected operation enabled, is fault"),
            std::string::npos)
      << reading().reason;
  EXPECT_NE(reading().reason.find("continuous over-current (0x2310)"), std::string::npos);
  follow(100ms);  // repeated requests have no effect
  EXPECT_FALSE(any_enabled());
  idle(10ms);
  follow(100ms);
  EXPECT_EQ(reading().phase, Phase::following) << reading().reason;
}

TEST_F(Bench, AJammedJointIsAFollowingError) {
  enable();
  rack->drives()[0].inject(sim::Trouble::jam);
  for (int k = 0; k < 100; ++k) {
    target[0] += 0.002;
    cycle({.mode = Mode::follow, .position_rad = target});
  }
  EXPECT_EQ(reading().phase, Phase::fault);
  EXPECT_NE(reading().reason.find("following error (0x8611)"), std::string::npos)
      << reading().reason;
  EXPECT_FALSE(any_enabled());
}

TEST_F(Bench, AJointThatDoesNotFollowIsNoticedBeforeItsDriveDoes) {
  JointDriverOptions options{.axes = axes(), .limits = limits(), .tracking_window_rad = 0.04};
  plug();
  driver.emplace(options, wire.join());
  idle(1s);
  follow(200ms);
  ASSERT_EQ(reading().phase, Phase::following) << reading().reason;
  for (int k = 0; k < 200; ++k) {  // as fast as it may
    target[0] -= kV * 0.005;
    target[0] = std::max(target[0], -1.5);
    cycle({.mode = Mode::follow, .position_rad = target});
  }
  EXPECT_EQ(reading().phase, Phase::following) << reading().reason;
  rack->drives()[0].inject(sim::Trouble::jam);
  int cycles = 0;
  for (; reading().phase == Phase::following; ++cycles) {
    target[0] += 0.004;
    cycle({.mode = Mode::follow, .position_rad = target});
  }
  EXPECT_LE(cycles, 25) << "0.04 rad and four cycles behind at 0.8 rad/s are 0.056 rad";
  EXPECT_EQ(reading().reason.find("A1 (node 1): is 0.0"), 0u) << reading().reason;
}

TEST_F(Bench, TwoUnansweredSyncsAreALostDrive) {
  enable();
  rack->drives()[2].inject(sim::Trouble::mute);
  cycle({.mode = Mode::follow, .position_rad = target});  // its last answer is on the wire
  cycle({.mode = Mode::follow, .position_rad = target});
  EXPECT_EQ(reading().phase, Phase::following) << "one cycle may be lost";
  cycle({.mode = Mode::follow, .position_rad = target});
  EXPECT_EQ(reading().phase, Phase::fault);
}

/// A wire that now and then loses an answer of one drive, never two in a row.
TEST_F(Bench, ThreeUnansweredSyncsOfTwentyAreALostDrive) {
  for (const auto& [every, phase] : {std::pair{8, Phase::fault}, std::pair{12, Phase::following}}) {
    rack.reset();
    enable();
    for (int k = 1; k <= 200 && reading().phase == Phase::following; ++k) {
      if (k % every == 0) rack->drives()[2].inject(sim::Trouble::mute, 7ms);
      cycle({.mode = Mode::follow, .position_rad = target});
    }
    EXPECT_EQ(reading().phase, phase) << "each " << every << "th: " << reading().reason;
  }
}

/// When one drive is lost, the others stop without set-points and without SYNC.
TEST_F(Bench, ALostDriveHaltsTheOthers) {
  enable();
  rack->drives()[2].inject(sim::Trouble::mute);
  while (reading().phase == Phase::following) cycle({.mode = Mode::follow, .position_rad = target});
  seen();
  follow(90ms);
  for (const can::Frame& f : seen()) {
    EXPECT_NE(f.id, sync().id);
    EXPECT_NE(f.id & ~0xFu, 0x200u) << "a set-point";
  }
  EXPECT_FALSE(any_enabled());
  follow(100ms);
  EXPECT_EQ(reading().joints[0].drive, DriveState::switch_on_disabled) << "it is seen again";
}

/// Drives that were halted are found again, also if they do not hear that the halt is over, or the
/// controller fails meanwhile.
TEST_F(Bench, HaltedDrivesComeBackAfterABadWire) {
  for (const bool bus_off : {false, true}) {
    rack.reset();
    enable();
    rack->drives()[2].inject(sim::Trouble::mute, 30ms);
    follow(50ms);
    ASSERT_EQ(reading().phase, Phase::fault);
    if (bus_off) {
      tap->send(std::array{can::Frame{.id = can::kErrorFlag | can::kBusOff, .length = 8}});
      idle(100ms);
    } else {
      for (auto& drive : rack->drives()) drive.inject(sim::Trouble::mute, 200ms);
      idle(200ms);
    }
    idle(4s);
    EXPECT_EQ(reading().phase, Phase::idle) << bus_off << ": " << reading().reason;
    follow(200ms);
    EXPECT_EQ(reading().phase, Phase::following) << bus_off << ": " << reading().reason;
  }
}

TEST_F(Bench, ALateMachineIsNoLostDrive) {
  enable();
  for (int k = 0; k < 40; ++k) {  // all drives are late by up to 60 ms, now and then
    auto late = std::move(rack);
    rack.reset();
    for (int i = 0; i < k % 13; ++i) cycle({.mode = Mode::follow, .position_rad = target});
    rack = std::move(late);
    cycle({.mode = Mode::follow, .position_rad = target});
    cycle({.mode = Mode::follow, .position_rad = target});
  }
  EXPECT_EQ(reading().phase, Phase::following) << reading().reason;
}

TEST_F(Bench, AnErrorPassiveControllerIsSilencedToo) {
  enable();
  can::Frame frame{.id = can::kErrorFlag | can::kControllerState, .length = 8};
  frame.data[1] = 0x08;  // warning
  tap->send(std::array{frame});
  follow(50ms);
  EXPECT_EQ(reading().phase, Phase::following) << reading().reason;
  frame.data[1] = 0x20;  // passive, of transmission
  tap->send(std::array{frame});
  follow(10ms);
  EXPECT_EQ(reading().reason, "A1 (node 1): the CAN controller is error-passive");
  seen();
  follow(100ms);
  for (const can::Frame& f : seen()) EXPECT_NE(f.id & ~0xFu, 0x200u) << "a set-point";
}

TEST_F(Bench, ACutCableStopsBothSides) {
  enable();
  rack->drives()[2].inject(sim::Trouble::mute);
  follow(150ms);
  EXPECT_EQ(reading().phase, Phase::fault);
  EXPECT_EQ(reading().reason, "A3 (node 9): no feedback on 2 SYNCs that others have answered");
  follow(200ms);
  EXPECT_FALSE(any_enabled()) << "the cut one by its own watchdog";
}

TEST_F(Bench, DrivesStopWhenTheDriverIsGone) {
  enable();
  driver.reset();
  Time gone = now;
  while (any_enabled() && now - gone < 1s) cycle({});
  EXPECT_LE(now - gone, 300ms);
  EXPECT_FALSE(any_enabled());
}

TEST_F(Bench, LimitsWhateverIsAsked) {
  enable();
  target = {1.9, -1.9, 5.0};
  follow(4s);
  EXPECT_LE(fastest_motion, kV * 1.01);
  EXPECT_LE(fastest_change, kA * 1.5);  // the drives' own loop adds a little
  EXPECT_GT(reading().limited, 0u);
  EXPECT_NEAR(reading().joints[0].position_rad, 1.9, 1e-3);
  EXPECT_NEAR(reading().joints[2].position_rad, 2.0, 1e-3) << "at the joint's end";
}

/// The machine skips three of every ten cycles.
TEST_F(Bench, CyclesThatAreLeftOutAreNoJerks) {
  goes_on = 4;
  enable();
  const std::vector<double> start = target;
  double off = 0.0;
  for (int k = 1; k <= 200; ++k) {
    for (std::size_t i = 0; i < kAxes; ++i)
      target[i] = start[i] + 0.4 * (1.0 - std::cos(M_PI * k / 200.0));
    cycle({.mode = Mode::follow, .position_rad = target, .missed = k % 10 == 7 ? 3 : 0},
          k % 10 > 3 && k % 10 < 7);
    for (std::size_t i = 0; i < kAxes; ++i)
      off = std::max(off, std::abs(rack->drives()[i].position_rad() - target[i]));
  }
  EXPECT_LE(fastest_change, kA * 2.0) << "or the motors brake as hard as they can";
  EXPECT_LE(off, 0.02);
  EXPECT_EQ(reading().phase, Phase::following);
}

TEST_F(Bench, HoldComesToRestPowered) {
  enable();
  target = {1.5, 1.5, 1.5};
  follow(300ms);
  for (int k = 0; k < 100; ++k) cycle({.mode = Mode::hold});
  EXPECT_EQ(reading().phase, Phase::following);
  EXPECT_NEAR(reading().joints[0].velocity_rad_s, 0.0, 1e-3);
  EXPECT_LE(fastest_change, kA * 1.5);
}

TEST_F(Bench, ReArmsAtTheActualPosture) {
  enable();
  target = {1.5, 1.5, 1.5};
  follow(300ms);
  ASSERT_GT(reading().joints[0].velocity_rad_s, 0.5);
  idle(500ms);
  EXPECT_EQ(reading().phase, Phase::idle);
  EXPECT_FALSE(any_enabled());
  fastest_motion = fastest_change = 0.0;
  follow(100ms);  // the old, far target
  ASSERT_EQ(reading().phase, Phase::following);
  EXPECT_LE(fastest_change, kA * 1.5);
  EXPECT_LE(fastest_motion, kA * 0.1) << "from rest, not by a jump";
}

TEST_F(Bench, ReArmsWithoutAJumpEvenWhileStillBraking) {
  enable();
  target = {1.5, 1.5, 1.5};
  follow(300ms);
  ASSERT_GT(reading().joints[0].velocity_rad_s, 0.5);
  rack->drives()[1].inject(sim::Trouble::overcurrent);
  follow(15ms);
  ASSERT_EQ(reading().phase, Phase::fault);
  idle(kCycle);
  follow(2 * kCycle);
  ASSERT_EQ(reading().phase, Phase::enabling);
  EXPECT_GT(rack->drives()[0].velocity_rad_s(), 0.3) << "still braking";
  follow(400ms);
  EXPECT_EQ(reading().phase, Phase::following) << reading().reason;
  EXPECT_LE(fastest_change, kA * 1.5);
}

TEST_F(Bench, SendsQuickStopFirstAndLastAndNothingAfter) {
  plug();
  connect();
  idle(150ms);
  for (const can::Frame& f : seen()) EXPECT_EQ(f.id & 0x780, 0x700u) << "it listens first";
  cycle({.mode = Mode::idle});
  const auto first = seen();
  ASSERT_GT(first.size(), std::size_t{kAxes + 1});
  EXPECT_EQ(first[0].id, 0x201u);
  EXPECT_EQ(first[0].data[0], controlword::kQuickStop);
  idle(500ms);
  follow(200ms);
  ASSERT_EQ(reading().phase, Phase::following);
  seen();
  driver->stop();
  const auto last = seen();
  ASSERT_EQ(last.size(), std::size_t{kAxes + 1});
  for (std::size_t i = 0; i < kAxes; ++i) EXPECT_EQ(last[i].data[0], controlword::kQuickStop);
  EXPECT_EQ(last.back().id, sync().id);
  rack->step(now);
  seen();
  driver.reset();
  EXPECT_TRUE(seen().empty());
  idle(200ms);
  EXPECT_FALSE(any_enabled());
}

TEST_F(Bench, ReadOnlyNeverSends) {
  enable();
  JointDriver listener({.axes = axes(), .limits = limits(), .readonly = true}, wire.join());
  Reading heard;
  for (int k = 0; k < 20; ++k) {
    follow(kCycle);
    heard = listener.read(now);
    listener.write(now, {.mode = Mode::follow, .position_rad = target});
  }
  listener.stop();
  EXPECT_EQ(listener.counters().sent + listener.counters().errors, 0u);
  EXPECT_EQ(heard.phase, Phase::idle);
  EXPECT_NEAR(heard.joints[0].position_rad, target[0], 1e-3);
}

TEST_F(Bench, ARestartedDriveIsConfiguredAgain) {
  enable();
  tap->send(std::array{nmt(Nmt::reset_node, 5)});
  follow(20ms);
  EXPECT_EQ(reading().phase, Phase::fault);
  EXPECT_EQ(reading().reason, "A2 (node 5): the drive has restarted");
  follow(20ms);
  EXPECT_FALSE(any_enabled());
  idle(500ms);
  EXPECT_EQ(reading().phase, Phase::idle) << reading().reason;
  follow(100ms);
  EXPECT_EQ(reading().phase, Phase::following);
}

TEST_F(Bench, BusOffSilencesThenRecovers) {
  enable();
  seen();
  tap->send(std::array{can::Frame{.id = can::kErrorFlag | can::kBusOff, .length = 8}});
  idle(10ms);
  EXPECT_EQ(reading().phase, Phase::fault);
  EXPECT_EQ(reading().reason, "A1 (node 1): the CAN controller is bus-off");
  idle(300ms);
  EXPECT_FALSE(any_enabled()) << "by the drives' own watchdogs";
  idle(2s);
  follow(100ms);
  EXPECT_EQ(reading().phase, Phase::following) << reading().reason;
}

TEST_F(Bench, SaysWhereTheEnableSequenceHangs) {
  enable();
  idle(200ms);
  for (const Time end = now + 2100ms;
       now < end;) {  // a foreign hand keeps one drive from switching on
    cycle({.mode = Mode::follow, .position_rad = target});
    can::Frame foreign = rpdo(1, 9);
    append(foreign, controlword::kShutdown, 2);
    append(foreign, 0, 4);
    std::vector<can::Frame> answers;
    for (const can::Frame& frame : {foreign, sync()})
      rack->drives()[2].handle(frame, answers);  // on the wire its SYNC would be heard
    tap->send(answers);
  }
  EXPECT_EQ(reading().phase, Phase::fault);
  EXPECT_NE(reading().reason.find("A3 (node 9): expected"), std::string::npos) << reading().reason;
}

/// While one lives, a lock on this thread aborts; a log takes one, too.
class NoLock {
 public:
  NoLock() { locks_refused = true; }
  ~NoLock() { locks_refused = false; }
  NoLock(const NoLock&) = delete;
  NoLock& operator=(const NoLock&) = delete;
};

/// Thirty axes on four buses, from the first cycle in which they follow.
TEST(Driver, CycleNeitherAllocatesNorLocksNorLogs) {
  testing::Loopback graph;
  std::vector<sim::Rack> racks;
  std::vector<std::unique_ptr<JointDriver>> parts;
  int node = 0;
  for (const int count : {6, 6, 9, 9}) {
    const std::string address = fmt::format("embedded:bus{}", parts.size());
    const auto all = [&](double x) { return Eigen::VectorXd::Constant(count, x); };
    JointDriverOptions options{
        .limits = {.q_min = all(-1), .q_max = all(1), .v_max = all(1), .a_max = all(5)},
        .tracking_window_rad = 0.1};
    std::vector<sim::DriveConfig> drives;
    for (int i = 0; i < count; ++i) {
      options.axes.push_back({.node_id = ++node});
      drives.push_back({.axis = options.axes.back()});
    }
    racks.emplace_back(drives, can::open(address, graph.directory()));
    parts.push_back(std::make_unique<JointDriver>(options, can::open(address, graph.directory())));
  }
  GroupDriver driver(std::move(parts));
  const std::vector<double> q(30, 0.0);
  Phase phase = Phase::starting;
  for (Time now = 1s; now < 4s; now += kCycle) {
    const Setpoint setpoint = {.mode = now < 2s ? Mode::idle : Mode::follow, .position_rad = q};
    const auto cycle = [&] {
      phase = driver.read(now).phase;
      driver.write(now, setpoint);
    };
    if (phase == Phase::following) {
      const testing::NoMalloc no_malloc;
      const NoLock no_lock;
      cycle();
    } else {
      cycle();
    }
    for (sim::Rack& rack : racks) rack.step(now + kCycle / 2);
  }
  EXPECT_EQ(phase, Phase::following);
#ifdef MIMESIS_REFUSES_LOCKS
  const auto log = [] {
    const NoLock no_lock;
    runtime::warn("a line");
  };
  EXPECT_DEATH(log(), "a lock where none is allowed");
#endif
}

TEST(Period, IsWhatTheDriveCanHold) {
  EXPECT_EQ(period_of(200.0).value, 5);
  EXPECT_EQ(period_of(200.0).exponent, -3);
  EXPECT_EQ(period_of(400.0).value, 25);
  EXPECT_EQ(period_of(400.0).exponent, -4);
  EXPECT_THROW(period_of(300.0), ConfigError);
}

}  // namespace
}  // namespace mimesis::hw::cia402
