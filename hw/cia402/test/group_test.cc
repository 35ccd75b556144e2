// Two buses as one robot, its drives on a wire in memory each.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "hw/can/testing/memory_wire.h"
#include "hw/cia402/joint_driver.h"
#include "hw/sim/cia402/drive.h"

namespace mimesis::hw::cia402 {
namespace {

using namespace std::chrono_literals;

constexpr Time kGroupCycle = 5ms;

class Group : public ::testing::Test {
 protected:
  static constexpr std::array kOnBus = {2, 1};

  std::vector<Axis> axes(std::size_t bus) const {
    if (bus == 0) return {{.node_id = 1}, {.node_id = 2, .sign = -1}};
    return {{.node_id = 3}};
  }
  void plug(std::size_t bus) {
    std::vector<sim::DriveConfig> configs;
    for (const Axis& axis : axes(bus)) configs.push_back({.axis = axis, .home_rad = 0.1});
    racks[bus].emplace(configs, wires[bus].join());
  }
  void connect(QuickStop quick_stop) {
    std::vector<std::unique_ptr<JointDriver>> parts;
    for (std::size_t bus = 0; bus < 2; ++bus) {
      const auto all = [&](double x) { return Eigen::VectorXd::Constant(kOnBus[bus], x); };
      JointDriverOptions options{
          .axes = axes(bus),
          .limits = {.q_min = all(-2), .q_max = all(2), .v_max = all(1.5), .a_max = all(5)},
          .quick_stop = quick_stop};
      if (bus == 0) options.names = {"hip", "knee"};
      if (bus == 1) options.names = {"elbow"};
      parts.push_back(std::make_unique<JointDriver>(options, wires[bus].join()));
    }
    driver.emplace(std::move(parts));
  }
  void cycle(Mode mode) {
    if (driver) {
      reading = driver->read(now);
      driver->write(now, {.mode = mode, .position_rad = target});
    }
    for (auto& rack : racks) {
      if (rack) rack->step(now + kGroupCycle / 2);
    }
    now += kGroupCycle;
  }
  void run(Mode mode, Time duration) {
    for (const Time end = now + duration; now < end;) cycle(mode);
  }
  void enable(QuickStop quick_stop) {
    plug(0);
    plug(1);
    connect(quick_stop);
    run(Mode::idle, 500ms);
    ASSERT_EQ(reading.phase, Phase::idle) << reading.reason;
    run(Mode::follow, 100ms);
    ASSERT_EQ(reading.phase, Phase::following) << reading.reason;
  }
  sim::Drive& drive(int i) {
    return i < 2 ? racks[0]->drives()[static_cast<std::size_t>(i)] : racks[1]->drives()[0];
  }
  /// Drives in `state`, hip first: "110" if hip and knee are.
  std::string in(DriveState state) {
    std::string out;
    for (int i = 0; i < 3; ++i) out += drive(i).state() == state ? '1' : '0';
    return out;
  }

  std::array<can::MemoryWire, 2> wires;
  std::array<std::optional<sim::Rack>, 2> racks;
  std::optional<GroupDriver> driver;
  Reading reading;
  Time now = 1s;
  std::vector<double> target = {0.1, 0.1, 0.1};
};

TEST_F(Group, FollowsInTheRobotsOrder) {
  enable(QuickStop::disables);
  for (int k = 1; k <= 200; ++k) {
    const double s = 0.1 * (1.0 - std::cos(M_PI * k / 200.0));
    target = {0.1 + s, 0.1 - s, 0.1 + 2.0 * s};
    cycle(Mode::follow);
  }
  run(Mode::follow, 100ms);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(drive(i).position_rad(), target[static_cast<std::size_t>(i)], 1e-3);
    EXPECT_NEAR(reading.joints[static_cast<std::size_t>(i)].position_rad,
                target[static_cast<std::size_t>(i)], 1e-3);
  }
  EXPECT_EQ(reading.limited, 0u);
  target[0] = target[2] = 1.9;  // both buses are limited in the same cycles
  run(Mode::follow, 100ms);
  EXPECT_EQ(reading.limited, 19u) << "cycles, not buses; the last was read before it was written";
}

TEST_F(Group, NobodyMovesBeforeAllFollow) {
  plug(0);
  plug(1);
  connect(QuickStop::disables);
  run(Mode::idle, 500ms);
  target = {0.4, 0.1, 0.1};
  double moved = 0.0;
  // A foreign hand keeps the other bus from switching on for a while.
  auto tap = wires[1].join();
  for (int k = 0; k < 40; ++k) {
    cycle(Mode::follow);
    can::Frame frame = rpdo(1, 3);
    append(frame, controlword::kShutdown, 2);
    append(frame, 0, 4);
    std::vector<can::Frame> answers;
    for (const can::Frame& foreign : {frame, sync()})
      racks[1]->drives()[0].handle(foreign, answers);  // on the wire its SYNC would be heard
    tap->send(answers);
    moved = std::max(moved, std::abs(drive(0).position_rad() - 0.1));
    EXPECT_NE(reading.phase, Phase::following);
  }
  EXPECT_EQ(in(DriveState::operation_enabled), "110");
  EXPECT_LT(moved, 1e-6) << "waits, powered";
  run(Mode::follow, 1s);
  EXPECT_EQ(reading.phase, Phase::following) << reading.reason;
  EXPECT_NEAR(drive(0).position_rad(), 0.4, 1e-3);
}

TEST_F(Group, NoHalfOfARobotSetsOut) {
  plug(0);
  connect(QuickStop::disables);
  run(Mode::idle, 500ms);
  run(Mode::follow, 500ms);
  EXPECT_EQ(reading.phase, Phase::starting);
  EXPECT_EQ(racks[0]->drives()[0].state(), DriveState::switch_on_disabled);
  plug(1);
  run(Mode::idle, 500ms);
  run(Mode::follow, 200ms);
  EXPECT_EQ(reading.phase, Phase::following) << reading.reason;
}

TEST_F(Group, AFaultOnOneBusStopsAll) {
  enable(QuickStop::disables);
  drive(2).inject(sim::Trouble::overcurrent);
  run(Mode::follow, 20ms);
  EXPECT_EQ(reading.phase, Phase::fault);
  EXPECT_EQ(reading.reason.find("elbow (node 3): expected operation enabled, is fault"), 0u)
      << reading.reason;
  run(Mode::follow, 200ms);
  EXPECT_EQ(in(DriveState::operation_enabled), "000");
  run(Mode::idle, 10ms);
  run(Mode::follow, 200ms);
  EXPECT_EQ(reading.phase, Phase::following) << reading.reason;
}

TEST_F(Group, TheFirstCauseIsTheReason) {
  enable(QuickStop::disables);
  drive(2).inject(sim::Trouble::overcurrent);
  run(Mode::follow, 20ms);
  drive(0).inject(sim::Trouble::overcurrent);
  run(Mode::idle, 20ms);
  EXPECT_EQ(reading.reason.find("elbow"), 0u) << reading.reason;
}

TEST_F(Group, ALostBusStopsTheOther) {
  enable(QuickStop::disables);
  racks[1].reset();
  run(Mode::follow, 200ms);
  EXPECT_EQ(reading.phase, Phase::fault);
  EXPECT_EQ(reading.reason, "elbow (node 3): no feedback for 0.1 s");
  EXPECT_EQ(racks[0]->drives()[0].state(), DriveState::switch_on_disabled);
  run(Mode::idle, 3s);
  EXPECT_EQ(reading.phase, Phase::fault) << "searched again, not found";
  run(Mode::follow, 100ms);
  EXPECT_NE(racks[0]->drives()[0].state(), DriveState::operation_enabled)
      << "no half of a robot sets out";
  plug(1);
  run(Mode::idle, 2s);
  ASSERT_EQ(reading.phase, Phase::idle) << reading.reason;
  run(Mode::follow, 200ms);
  EXPECT_EQ(reading.phase, Phase::following) << reading.reason;
}

TEST_F(Group, AQuickStopThatStaysPoweredKeepsThePosture) {
  enable(QuickStop::stays_powered);
  target = {1.5, 1.5, 1.5};
  run(Mode::follow, 300ms);
  ASSERT_GT(drive(0).velocity_rad_s(), 0.5);
  run(Mode::idle, kGroupCycle);
  run(Mode::idle, 20ms);
  EXPECT_EQ(reading.phase, Phase::stopping);
  run(Mode::idle, 5s);
  EXPECT_EQ(reading.phase, Phase::holding);
  EXPECT_EQ(in(DriveState::quick_stop_active), "111") << "for as long as nobody says otherwise";
  target.assign(3, 0.0);
  for (std::size_t i = 0; i < 3; ++i) target[i] = drive(static_cast<int>(i)).position_rad();
  for (int k = 0; k < 20; ++k) {
    cycle(Mode::follow);
    EXPECT_EQ(in(DriveState::switch_on_disabled), "000") << "never without power";
  }
  EXPECT_EQ(reading.phase, Phase::following) << reading.reason;
}

TEST_F(Group, IsEnabledAgainOnlyAfterItsRamp) {
  enable(QuickStop::stays_powered);
  target = {1.5, 1.5, 0.1};
  run(Mode::follow, 300ms);
  ASSERT_GT(drive(0).velocity_rad_s(), 0.5);
  drive(2).inject(sim::Trouble::overcurrent);
  run(Mode::follow, 20ms);
  ASSERT_EQ(reading.phase, Phase::fault);
  run(Mode::idle, 2 * kGroupCycle);
  for (int k = 0; k < 100; ++k) {
    const double v = drive(0).velocity_rad_s();
    cycle(Mode::follow);
    EXPECT_LE(std::abs(drive(0).velocity_rad_s() - v), 1.5 * 5.0 * 5e-3) << k;
    EXPECT_NE(drive(0).state(), DriveState::switch_on_disabled);
  }
  EXPECT_EQ(reading.phase, Phase::following) << reading.reason;
}

TEST_F(Group, DrivesThatLoseTheirMasterStayPoweredIfToldSo) {
  enable(QuickStop::stays_powered);
  driver.reset();
  run(Mode::idle, 1s);
  EXPECT_EQ(in(DriveState::quick_stop_active), "111");
  connect(QuickStop::stays_powered);
  run(Mode::idle, 1s);
  EXPECT_EQ(reading.phase, Phase::holding) << reading.reason;
  EXPECT_EQ(in(DriveState::quick_stop_active), "111");
  run(Mode::follow, 200ms);
  EXPECT_EQ(reading.phase, Phase::following) << reading.reason;
}

TEST_F(Group, DrivesThatStoppedByThemselvesAreNotEnabledByTheNextSetPoint) {
  for (const QuickStop quick_stop : {QuickStop::stays_powered, QuickStop::disables}) {
    enable(quick_stop);
    target = {1.5, 1.5, 1.5};
    run(Mode::follow, 300ms);
    ASSERT_GT(drive(0).velocity_rad_s(), 0.5);
    for (int k = 0; k < 200; ++k) {  // the bridge's process stands still
      now += kGroupCycle;
      for (auto& rack : racks) rack->step(now);
    }
    ASSERT_EQ(in(DriveState::operation_enabled), "000");
    const double q = drive(0).position_rad();
    for (int k = 0; k < 100; ++k) {
      cycle(Mode::follow);
      ASSERT_EQ(in(DriveState::operation_enabled), "000") << k;
    }
    EXPECT_EQ(drive(0).position_rad(), q);
    EXPECT_EQ(reading.phase, Phase::fault);
    EXPECT_EQ(reading.reason, "no cycle for 1 s");
    run(Mode::idle, 100ms);
    run(Mode::follow, 100ms);
    EXPECT_EQ(reading.phase, Phase::following) << "after it was told to rest";
  }
}

TEST_F(Group, APauseIsAFaultBeforeTheDrivesDeadline) {
  enable(QuickStop::stays_powered);
  now += 70ms;
  cycle(Mode::follow);
  EXPECT_EQ(reading.phase, Phase::following) << reading.reason;
  now += 80ms;
  cycle(Mode::follow);
  EXPECT_EQ(reading.reason, "no cycle for 0.085 s");
  run(Mode::follow, 100ms);
  EXPECT_EQ(in(DriveState::operation_enabled), "000");
}

TEST_F(Group, StopGoesToEveryBus) {
  enable(QuickStop::disables);
  std::array taps = {wires[0].join(), wires[1].join()};
  driver->stop();
  for (std::size_t bus = 0; bus < 2; ++bus) {
    std::array<can::Frame, 16> frames;
    const std::size_t count = taps[bus]->receive(frames);
    ASSERT_EQ(count, static_cast<std::size_t>(kOnBus[bus]) + 1);
    EXPECT_EQ(frames[0].data[0], controlword::kQuickStop);
    EXPECT_EQ(frames[count - 1].id, sync().id);
  }
}

}  // namespace
}  // namespace mimesis::hw::cia402
