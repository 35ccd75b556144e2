// When a drive stops by itself, and how it can continue.
#include <gtest/gtest.h>

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
  EXPECT_EQ(out[0], cia402::emergency(4, 0x8250, 0x10));
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
  EXPECT_EQ(ask(cia402::sdo_upload(4, error_register)).value, 1u);
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

}  // namespace
}  // namespace mimesis::hw::sim
