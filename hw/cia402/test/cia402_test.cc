#include "hw/cia402/cia402.h"

#include <gtest/gtest.h>

#include "common/testing/refusal.h"
#include "hw/cia402/axis.h"

namespace mimesis::hw::cia402 {
namespace {

using enum DriveState;

TEST(Statusword, TableOfTheProfile) {
  for (const unsigned others : {0x0000u, 0x0010u, 0x0080u, 0xFF90u}) {  // bits without a say
    const auto state = [&](unsigned bits) {
      return decode_statusword(static_cast<std::uint16_t>(bits | others));
    };
    EXPECT_EQ(state(0x00), not_ready_to_switch_on);
    EXPECT_EQ(state(0x20), not_ready_to_switch_on);
    EXPECT_EQ(state(0x40), switch_on_disabled);
    EXPECT_EQ(state(0x60), switch_on_disabled);
    EXPECT_EQ(state(0x21), ready_to_switch_on);
    EXPECT_EQ(state(0x23), switched_on);
    EXPECT_EQ(state(0x27), operation_enabled);
    EXPECT_EQ(state(0x07), quick_stop_active);
    EXPECT_EQ(state(0x0F), fault_reaction_active);
    EXPECT_EQ(state(0x2F), fault_reaction_active);
    EXPECT_EQ(state(0x08), fault);
    EXPECT_EQ(state(0x28), fault);
    EXPECT_EQ(state(0x03), unknown);
  }
}

TEST(StateMachine, TableOfTransitions) {
  using namespace controlword;
  struct Row {
    DriveState from;
    std::uint16_t word;
    DriveState to;
  };
  const Row table[] = {
      {switch_on_disabled, kShutdown, ready_to_switch_on},         // 2
      {ready_to_switch_on, kSwitchOn, switched_on},                // 3
      {switched_on, kEnableOperation, operation_enabled},          // 4
      {operation_enabled, kSwitchOn, switched_on},                 // 5
      {switched_on, kShutdown, ready_to_switch_on},                // 6
      {ready_to_switch_on, kQuickStop, switch_on_disabled},        // 7
      {operation_enabled, kShutdown, ready_to_switch_on},          // 8
      {operation_enabled, kDisableVoltage, switch_on_disabled},    // 9
      {switched_on, kQuickStop, switch_on_disabled},               // 10
      {operation_enabled, kQuickStop, quick_stop_active},          // 11
      {quick_stop_active, kDisableVoltage, switch_on_disabled},    // 12
      {fault, kFaultReset, switch_on_disabled},                    // 15
      {switch_on_disabled, kEnableOperation, switch_on_disabled},  // no short cut
      {fault, kEnableOperation, fault},
      {quick_stop_active, kEnableOperation, quick_stop_active},
      {not_ready_to_switch_on, kShutdown, not_ready_to_switch_on},
  };
  for (const Row& row : table) {
    EXPECT_EQ(transition(row.from, row.word, 0), row.to) << name(row.from) << " by " << row.word;
  }
  EXPECT_EQ(transition(fault, kFaultReset, kFaultReset), fault) << "only the edge resets";
}

TEST(StateMachine, ControlwordsLeadFromEveryStateToEnabled) {
  for (const DriveState from :
       {switch_on_disabled, ready_to_switch_on, switched_on, quick_stop_active, fault}) {
    DriveState state = from;
    std::uint16_t previous = controlword::kFaultReset;  // worst case: no edge left
    for (int i = 0; i < 6 && state != operation_enabled; ++i) {
      const std::uint16_t word = towards_enabled(state, previous);
      state = transition(state, word, previous);
      previous = word;
    }
    EXPECT_EQ(state, operation_enabled) << "from " << name(from);
  }
}

TEST(StateMachine, AQuickStopThatStaysPoweredIsLeftWithoutLosingPower) {
  using enum QuickStop;
  const std::uint16_t word = towards_enabled(quick_stop_active, 0, stays_powered);
  EXPECT_EQ(transition(quick_stop_active, word, 0, stays_powered), operation_enabled);  // 16
  EXPECT_EQ(next_towards_enabled(quick_stop_active, stays_powered), operation_enabled);
  EXPECT_EQ(next_towards_enabled(quick_stop_active, disables), switch_on_disabled);
  for (const std::uint16_t stays : {controlword::kQuickStop, controlword::kSwitchOn}) {
    EXPECT_EQ(transition(quick_stop_active, stays, 0, stays_powered), quick_stop_active);
  }
  EXPECT_EQ(transition(quick_stop_active, controlword::kDisableVoltage, 0, stays_powered),
            switch_on_disabled);
}

TEST(Axis, ConvertsWithSignAndSaturates) {
  const Axis axis{.node_id = 1, .increments_per_rad = 1000.0, .sign = -1, .rated_torque_n_m = 50.0};
  EXPECT_EQ(axis.to_increments(0.5), -500);
  EXPECT_DOUBLE_EQ(axis.to_rad(-500), 0.5);
  EXPECT_DOUBLE_EQ(axis.to_torque(200), -10.0);
  EXPECT_EQ(axis.to_increments(-1e9), 2147483647);
}

std::string refusal(std::vector<Axis> axes, int joints) {
  return testing::refusal([&] { complete(std::move(axes), joints); }, "accepted");
}

TEST(Axis, TableIsChecked) {
  EXPECT_EQ(complete({}, 7).back().node_id, 7);
  EXPECT_EQ(refusal({{.node_id = 1}}, 2), "axes: 1 given, the robot has 2 joints");
  EXPECT_EQ(refusal({{.node_id = 4}, {.node_id = 4}}, 2), "axes[1].node_id: 4 is used by axes[0]");
  EXPECT_EQ(refusal({{.node_id = 4, .sign = 0}}, 1), "axes[0].sign: expected -1 or 1, is 0");
}

}  // namespace
}  // namespace mimesis::hw::cia402
