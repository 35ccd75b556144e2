// When a drive stops by itself, and how it can continue.
#include <gtest/gtest.h>

#include <cmath>

#include "hw/can/testing/memory_wire.h"
#include "hw/sim/cia402/drive.h"
#include "hw/sim/cia402/test/one_drive.h"

namespace mimesis::hw::sim {
namespace {

using Watchdogs = OneDrive;

TEST_F(Watchdogs, NoSetPointsForLongerThanTheDeadlineIsAQuickStop) {
  set(obj::kRpdo1Deadline, 100, 2);
  set(obj::kAbortOption, 3, 2);
  set(obj::kQuickStopOption, 6, 2);  // stays powered
  enable();
  out.clear();
  pass(100ms);
  EXPECT_EQ(drive.state(), DriveState::operation_enabled);
  EXPECT_TRUE(out.empty());
  pass(1ms);
  EXPECT_EQ(drive.state(), DriveState::quick_stop_active);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0], cia402::emergency(4, 0x8250, 0x11));
}

/// The graph's clock may be set back; what a drive waits for comes all the same.
TEST_F(Watchdogs, HaveATimeOfTheirOwn) {
  set(obj::kRpdo1Deadline, 100, 2);
  set(obj::kHeartbeatTime, 60, 2);
  set(obj::kAbortOption, 3, 2);
  enable();
  pass(60ms);
  now -= 10s;
  out.clear();
  drive.advance(now, out);
  pass(40ms);
  EXPECT_EQ(drive.state(), DriveState::operation_enabled);
  EXPECT_EQ(out.size(), 1u) << "its heartbeat";
  pass(1ms);
  EXPECT_NE(drive.state(), DriveState::operation_enabled);
}

/// Enabled by a SYNC alone, long after the last set-point.
TEST_F(Watchdogs, SetPointsAreWatchedFromTheMomentItIsEnabled) {
  set(obj::kRpdo1Deadline, 100, 2);
  set(obj::kAbortOption, 3, 2);
  set(obj::kQuickStopOption, 6, 2);
  tell(cia402::Nmt::start);
  command(cia402::controlword::kShutdown);
  command(cia402::controlword::kSwitchOn);
  hear(cia402::controlword::kEnableOperation);
  pass(150ms);
  sync();
  ASSERT_EQ(drive.state(), DriveState::operation_enabled);
  pass(100ms);
  EXPECT_EQ(drive.state(), DriveState::operation_enabled);
  pass(1ms);
  EXPECT_EQ(drive.state(), DriveState::quick_stop_active);
}

TEST_F(Watchdogs, ALostMasterIsAFaultUnlessItIsToldOtherwise) {
  set(obj::kMasterHeartbeat, 0x7F0032, 4);
  enable();
  drive.handle(cia402::heartbeat(0x7F, cia402::NmtState::operational), out);
  pass(53ms);
  EXPECT_EQ(drive.state(), DriveState::fault);
}

TEST_F(Watchdogs, WithoutPdosNobodySteers) {
  for (const cia402::Nmt what : {cia402::Nmt::stop, cia402::Nmt::pre_operational}) {
    SetUp();
    enable();
    tell(what);
    EXPECT_EQ(drive.state(), DriveState::quick_stop_active);
    pass(10ms);
    tell(cia402::Nmt::start);
    command(cia402::controlword::kDisableVoltage);
  }
}

TEST_F(Watchdogs, SetPointsBeforeOperationalAreNotTaken) {
  hear(cia402::controlword::kShutdown);
  tell(cia402::Nmt::start);
  sync();
  EXPECT_EQ(drive.state(), DriveState::switch_on_disabled);
  tell(cia402::Nmt::stop);
  hear(cia402::controlword::kShutdown);
  tell(cia402::Nmt::start);
  sync();
  EXPECT_EQ(drive.state(), DriveState::switch_on_disabled);
}

TEST_F(Watchdogs, TheErrorRegisterIsClearedWithTheFault) {
  const cia402::Object error_register{0x1001, 0};
  enable();
  drive.inject(Trouble::overcurrent);
  pass(2ms);
  ASSERT_EQ(drive.state(), DriveState::fault);
  EXPECT_EQ(ask(cia402::sdo_upload(4, error_register)).value, 3u);
  command(cia402::controlword::kFaultReset);
  EXPECT_EQ(drive.state(), DriveState::switch_on_disabled);
  EXPECT_EQ(ask(cia402::sdo_upload(4, error_register)).value, 0u);
}

/// A master may ask more in a cycle than the rack takes in at once.
TEST(Rack, AnswersAllThatHasArrived) {
  can::MemoryWire wire;
  const auto master = wire.join();
  Rack rack({{.axis = {.node_id = 1}}, {.axis = {.node_id = 2}}}, wire.join());
  rack.step(1s);
  std::vector<can::Frame> frames(1000), asked(600, cia402::sdo_upload(2, obj::kDeviceType));
  while (master->receive(frames) > 0) {
  }
  master->send(asked);
  rack.step(1005ms);
  std::size_t answers = 0;
  for (std::size_t n = master->receive(frames); n > 0; n = master->receive(frames)) answers += n;
  EXPECT_EQ(answers, 600u);
}

/// Fastest motion [rad/s] with commands of 5 ms each, if the process takes in `together` of them at
/// once.
double fastest_when_taken(int together) {
  can::MemoryWire wire;
  const auto master = wire.join();
  Rack rack({{.axis = {.node_id = 1}}}, wire.join());
  const cia402::Axis axis{};
  std::vector<can::Frame> frames{cia402::nmt(cia402::Nmt::start, 1)};
  const auto step = [&](int cycle) {
    master->send(frames);
    frames.clear();
    rack.step(1s + cycle * 5ms);
  };
  const auto write = [&](cia402::Object object, std::uint32_t value, int bytes) {
    frames.push_back(cia402::sdo_download(1, object, value, bytes));
  };
  write(obj::kPeriodValue, 5, 1);
  write(obj::kPeriodExponent, 0xFD, 1);
  step(0);
  const auto command = [&](std::uint16_t word, double rad) {
    write(obj::kTarget, static_cast<std::uint32_t>(axis.to_increments(rad)), 4);
    frames.push_back(cia402::rpdo(1, 1));
    cia402::append(frames.back(), word, 2);
    frames.push_back(cia402::sync());
  };
  int cycle = 0;
  for (const int word : {0x06, 0x07, 0x0F, 0x0F}) {
    command(static_cast<std::uint16_t>(word), 0.0);
    step(++cycle);
  }
  double most = 0.0;
  for (int k = 1; k <= 80; ++k) {  // 0.1 rad in 0.2 s, then it stands
    command(0x0F, 0.05 * (1.0 - std::cos(M_PI * std::min(k, 40) / 40.0)));
    if (++cycle % together == 0) step(cycle);
    most = std::max(most, std::abs(rack.drives()[0].velocity_rad_s()));
  }
  EXPECT_EQ(rack.drives()[0].state(), DriveState::operation_enabled);
  EXPECT_NEAR(rack.drives()[0].position_rad(), 0.1, 1e-4) << together;
  return most;
}

/// The machine lets the process wait for 10 or 20 ms: a drive follows its set-points all the same.
TEST(Rack, FollowsSetPointsThatItTakesInLate) {
  const double most = fastest_when_taken(1);
  EXPECT_NEAR(most, 0.05 * M_PI / 0.2, 0.01);
  EXPECT_NEAR(fastest_when_taken(2), most, 0.005);
  EXPECT_NEAR(fastest_when_taken(4), most, 0.005);
}

}  // namespace
}  // namespace mimesis::hw::sim
