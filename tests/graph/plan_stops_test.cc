// The planner's motions are stopped at random instants in the physics of the simulated drives: the
// planner falls silent, the bridge dies or is told to end, a drive fails. Whatever brakes the arm,
// it touches nothing until it is at rest. Judged by the drives' own positions every half cycle.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "common/model/files.h"
#include "hw/bridge/command_gate.h"
#include "hw/can/testing/memory_wire.h"
#include "hw/cia402/joint_driver.h"
#include "hw/sim/cia402/rack.h"
#include "nodes/planner/task_plan.h"

namespace mimesis {
namespace {

using namespace std::chrono_literals;
using hw::Time;

constexpr Time kCycle = 5ms;
enum class Event { planner_silent, bridge_dies, bridge_ends, drive_fails };

/// Arm, drives and bridge without processes, at rest where a motion begins.
class Cell {
 public:
  Cell(const kin::ArmModel& arm, const planner::PlannedMotion& motion)
      : arm_(arm), playback_(0.95 * arm.a_max) {
    const Eigen::VectorXd start = motion.trajectory.position.col(0);
    std::vector<hw::sim::DriveConfig> drives;
    hw::cia402::JointDriverOptions options;
    for (Eigen::Index j = 0; j < arm.dof(); ++j) {
      options.axes.push_back({.node_id = static_cast<int>(j) + 1});
      drives.push_back(
          {.axis = options.axes.back(),
           .plant = {.v_max_rad_s = 1.2 * arm.v_max[j], .a_max_rad_s2 = 2.0 * arm.a_max[j]},
           .home_rad = start[j],
           .extrapolated_cycles = arm.extrapolated_cycles});
    }
    options.limits = {arm.q_min, arm.q_max, arm.v_max, arm.a_max};
    rack_.emplace(drives, wire_.join());
    driver_.emplace(options, wire_.join());
    gate_.emplace(hw::bridge::GateLimits{.hold_after = 17500us,
                                         .brake_after = 40ms,
                                         .silence = 100ms,
                                         .start_tolerance_rad = 0.02,
                                         .jump_rad = 0.1,
                                         .v_max_rad_s = {arm.v_max.begin(), arm.v_max.end()},
                                         .a_max_rad_s2 = {arm.a_max.begin(), arm.a_max.end()},
                                         .cycle = kCycle,
                                         .extrapolated_cycles = arm.extrapolated_cycles});
    playback_.start(motion.trajectory);
    for (int k = 0; k < 200 && phase_ != hw::Phase::following; ++k) cycle(true, k > 60);
    EXPECT_EQ(phase_, hw::Phase::following);
  }

  /// One cycle; false once the motion has ended.
  bool play() {
    playback_.advance();
    cycle(true, true);
    return !playback_.at_rest();
  }
  /// Lets it come to rest; true if the arm never touches anything.
  bool stop(Event event, planner::CollisionChecker& judge) {
    bool well = true, driver_lives = event != Event::bridge_dies && event != Event::bridge_ends;
    if (event == Event::bridge_ends) driver_->stop();
    if (event == Event::drive_fails) rack_->drives()[2].inject(hw::sim::Trouble::overcurrent);
    const bool planner_lives = event == Event::drive_fails;
    double moving = 1.0;
    for (int k = 0; k < 160 && well && (k < 80 || moving > 0.0); ++k) {
      if (planner_lives) playback_.advance();
      if (driver_lives) {
        cycle(true, planner_lives);
      } else {
        rack_->step(now_ + kCycle / 2);
        now_ += kCycle;
      }
      moving = 0.0;
      Eigen::VectorXd q(arm_.dof());
      for (Eigen::Index j = 0; j < q.size(); ++j) {
        const hw::sim::Drive& drive = rack_->drives()[static_cast<std::size_t>(j)];
        q[j] = drive.position_rad();
        moving = std::max(moving, std::abs(drive.velocity_rad_s()));
      }
      well = judge.free(q);
    }
    EXPECT_LT(moving, 1e-6) << "it does not come to rest";
    return well;
  }

 private:
  void cycle(bool driver, bool command) {
    const hw::Reading& reading = driver_->read(now_);
    phase_ = reading.phase;
    if (command) {
      const Eigen::VectorXd q = playback_.position();
      const Eigen::MatrixXd ahead = playback_.ahead(60);
      gate_->offer(now_, now_, {q.data(), static_cast<std::size_t>(q.size())}, reading,
                   {ahead.data(), static_cast<std::size_t>(ahead.size())});
    }
    if (driver) driver_->write(now_, gate_->decide(now_, reading));
    rack_->step(now_ + kCycle / 2);
    now_ += kCycle;
  }

  const kin::ArmModel& arm_;
  planner::Playback playback_;
  hw::can::MemoryWire wire_;
  std::optional<hw::sim::Rack> rack_;
  std::optional<hw::cia402::JointDriver> driver_;
  std::optional<hw::bridge::CommandGate> gate_;
  hw::Phase phase_ = hw::Phase::starting;
  Time now_ = 1s;
};

TEST(PlanStops, TouchNothingWheneverAndHoweverTheArmIsStopped) {
  using planner::Grip, planner::Transport;
  const char* asked = std::getenv("MIMESIS_STOPS");
  const int trials = asked != nullptr ? std::atoi(asked) : 200;
  const kin::ArmModel arm = model::load_arm("lwr4.yaml");
  const kin::Table table = model::load_table("bridge_table.yaml");
  const planner::TaskSettings settings;
  const planner::Roadmap roadmap = planner::prepare_roadmap(arm, table, settings);
  std::mt19937 random(1);
  int touched = 0, moving = 0;
  std::vector<planner::PlannedMotion> motions;
  for (const planner::Task& task : {planner::Task{Grip::precision, Transport::above, "high"},
                                    planner::Task{Grip::full, Transport::below, "low"},
                                    planner::Task{Grip::full, Transport::below, "high"}}) {
    const auto plan = planner::plan_task(arm, table, roadmap, arm.home, task, settings);
    ASSERT_TRUE(plan) << plan.error().reason;
    motions.insert(motions.end(), plan->motions.begin(), plan->motions.end());
  }
  Eigen::Index samples = 0;
  for (const auto& motion : motions) samples += motion.trajectory.samples();
  for (int trial = 0; trial < trials; ++trial) {
    auto at = static_cast<Eigen::Index>(random() % static_cast<std::uint32_t>(samples));
    std::size_t m = 0;
    while (at >= motions[m].trajectory.samples()) at -= motions[m++].trajectory.samples();
    planner::CollisionChecker judge(arm, motions[m].obstacles, 0.0);
    Cell cell(arm, motions[m]);
    Eigen::Index k = 0;
    while (k < at && cell.play()) ++k;
    moving += motions[m].trajectory.velocity.col(k).norm() > 0.1;
    const auto event = static_cast<Event>(trial % 4);
    const bool well = cell.stop(event, judge);
    EXPECT_TRUE(well) << "trial " << trial << ": motion " << m << ", sample " << k << ", event "
                      << trial % 4;
    touched += !well;
  }
  std::printf("%d of %d stops touched something; the arm moved in %d\n", touched, trials, moving);
  EXPECT_GT(moving, trials / 2);
}

}  // namespace
}  // namespace mimesis
