// The planner's motions are stopped at random instants in the physics of the simulated drives: the
// planner falls silent, the bridge dies, waits or is told to end, drives, wires and controllers
// fail, somebody presses the emergency stop. Whatever brakes the arm, it touches nothing until it
// is at rest. Judged by the drives' own positions every half cycle. MIMESIS_STOPS: number of
// trials; MIMESIS_STOPS_SEED: other ones.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "common/model/files.h"
#include "hw/bridge/command_gate.h"
#include "hw/can/testing/faulty_wire.h"
#include "hw/can/testing/memory_wire.h"
#include "hw/cia402/joint_driver.h"
#include "hw/sim/cia402/drive.h"
#include "nodes/planner/task_plan.h"

namespace mimesis {
namespace {

using namespace std::chrono_literals;
using hw::Time;

constexpr Time kCycle = 5ms;
enum class Event {
  planner_silent,
  bridge_dies,
  bridge_ends,
  drive_fails,
  emergency_stop,
  drive_mute,
  drive_without_power,
  drive_hangs,
  frames_lost,
  frames_late,
  frames_damaged,
  controller_bus_off,
  bridge_waits,
};
constexpr std::array kEvents{
    "planner silent", "bridge dies",        "bridge ends", "drive fails", "emergency stop",
    "cable cut",      "no supply",          "drive hangs", "frames lost", "frames late",
    "frames damaged", "controller bus-off", "bridge waits"};

struct Stopped {
  bool touched = false, stopped = false;
  double farthest_rad = 0.0;  // a joint went until it stood, or by the end of the motion
  int cycles = 0;             // until it stood
};

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
    options.feedback_timeout_s = 1.5 * to_seconds(kCycle);
    options.tracking_window_rad = 0.1;
    rack_.emplace(drives, theirs_.join());
    driver_.emplace(options, ours_.join());
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
    for (int k = 0; k < 200 && phase_ != hw::Phase::following; ++k) cycle(k > 60);
    EXPECT_EQ(phase_, hw::Phase::following);
  }

  /// One cycle; false once the motion has ended.
  bool play() {
    playback_.advance();
    cycle(true);
    return !playback_.at_rest();
  }
  /// Lets it come to rest, or go on to the end of the motion if the event does not matter.
  Stopped stop(Event event, std::mt19937& random, planner::CollisionChecker& judge,
               std::optional<std::size_t> which = {}) {
    const auto share = [&] { return static_cast<double>(random() % 1000 + 1) / 1000.0; };
    const auto some = which.value_or(static_cast<std::size_t>(random() % 7));
    int waits = 0;
    begin(event, some, share, waits, random);
    const bool driver_lives = event != Event::bridge_dies && event != Event::bridge_ends;
    const bool planner_lives = event != Event::planner_silent;
    Stopped result;
    const Eigen::VectorXd before = posture();
    for (int k = 0; k < 4000 && !result.touched && !(k >= 80 && result.stopped); ++k) {
      if (planner_lives) playback_.advance();
      if (driver_lives && waits-- <= 0) {
        cycle(planner_lives);
      } else {
        answer();
      }
      double moving = 0.0;
      for (const hw::sim::Drive& drive : rack_->drives())
        moving = std::max(moving, std::abs(drive.velocity_rad_s()));
      result.touched = !judge.free(posture());
      result.farthest_rad =
          std::max(result.farthest_rad, (posture() - before).cwiseAbs().maxCoeff());
      const bool stands = moving < 1e-6 && (phase_ != hw::Phase::following || !driver_lives ||
                                            !planner_lives || playback_.at_rest());
      if (stands && !result.stopped) result.cycles = k;
      result.stopped = stands;
    }
    const bool tolerated = phase_ == hw::Phase::following && planner_lives && driver_lives;
    if (tolerated) result.farthest_rad = result.cycles = 0;
    return result;
  }

 private:
  template <class Share>
  void begin(Event event, std::size_t drive, const Share& share, int& waits, std::mt19937& random) {
    using hw::sim::Trouble;
    const auto inject = [&](Trouble trouble) {
      rack_->drives()[drive].inject(trouble, 200ms + static_cast<int>(random() % 60) * kCycle);
    };
    const auto damage = [&](const hw::can::WireFaults& faults) {
      out_.change(faults);
      in_.change(faults);
    };
    switch (event) {
      case Event::bridge_ends:
        return driver_->stop();
      case Event::drive_fails:
        return inject(Trouble::overcurrent);
      case Event::emergency_stop:
        return gate_->emergency_stop("somebody presses it");
      case Event::drive_mute:
        return inject(Trouble::mute);
      case Event::drive_without_power:
        return inject(Trouble::power);
      case Event::drive_hangs:
        return inject(Trouble::stall);
      case Event::frames_lost:
        return damage({.lose = share()});
      case Event::frames_late:
        return damage({.delay = share(), .delay_by = static_cast<int>(1 + random() % 40) * kCycle});
      case Event::frames_damaged:
        return damage({.corrupt = 0.3 * share()});
      case Event::controller_bus_off:
        near_->send(
            std::array{hw::can::Frame{.id = hw::can::kErrorFlag | hw::can::kBusOff, .length = 8}});
        return damage({.lose = 1.0});
      case Event::bridge_waits:
        waits = static_cast<int>(1 + random() % 100);
        return;
      default:
        return;
    }
  }
  Eigen::VectorXd posture() const {
    Eigen::VectorXd q(arm_.dof());
    for (Eigen::Index j = 0; j < q.size(); ++j)
      q[j] = rack_->drives()[static_cast<std::size_t>(j)].position_rad();
    return q;
  }
  void carry(hw::can::Bus& from, hw::can::Bus& to, hw::can::FaultyWire& wire) {
    std::array<hw::can::Frame, 256> frames;
    const std::size_t count = from.receive(frames);
    const auto out = wire.carry(now_, std::span(frames).first(count));
    if (!out.empty()) to.send(out);
  }
  /// The second half of a cycle: frames to the drives, what they do, and their answers.
  void answer() {
    carry(*near_, *far_, out_);
    rack_->step(now_ + kCycle / 2);
    carry(*far_, *near_, in_);
    now_ += kCycle;
  }
  void cycle(bool command) {
    const hw::Reading& reading = driver_->read(now_);
    phase_ = reading.phase;
    if (command) {
      const Eigen::VectorXd q = playback_.position();
      const Eigen::MatrixXd ahead = playback_.ahead(60);
      gate_->offer(now_, now_, {q.data(), static_cast<std::size_t>(q.size())}, reading,
                   {ahead.data(), static_cast<std::size_t>(ahead.size())});
    }
    driver_->write(now_, gate_->decide(now_, reading));
    answer();
  }

  const kin::ArmModel& arm_;
  planner::Playback playback_;
  hw::can::MemoryWire ours_, theirs_;
  std::unique_ptr<hw::can::Bus> near_ = ours_.join(), far_ = theirs_.join();
  hw::can::FaultyWire out_{{}, 1}, in_{{}, 2};
  std::optional<hw::sim::Rack> rack_;
  std::optional<hw::cia402::JointDriver> driver_;
  std::optional<hw::bridge::CommandGate> gate_;
  hw::Phase phase_ = hw::Phase::starting;
  Time now_ = 1s;
};

int number_of(const char* variable, int otherwise) {
  const char* asked = std::getenv(variable);
  return asked != nullptr ? std::atoi(asked) : otherwise;
}

/// The motions of the demo's three tasks.
std::vector<planner::PlannedMotion> planned_motions(const kin::ArmModel& arm) {
  using task::Grip, task::Transport;
  const kin::Table table = model::load_table("bar_table.yaml");
  const planner::TaskSettings settings;
  const planner::Roadmap roadmap = planner::prepare_roadmap(arm, table, settings);
  std::vector<planner::PlannedMotion> motions;
  for (const planner::Task& task : {planner::Task{Grip::precision, Transport::above, "high"},
                                    planner::Task{Grip::full, Transport::below, "low"},
                                    planner::Task{Grip::full, Transport::below, "high"}}) {
    const auto plan = planner::plan_task(arm, table, roadmap, arm.home, task, settings);
    EXPECT_TRUE(plan) << plan.error().reason;
    if (plan) motions.insert(motions.end(), plan->motions.begin(), plan->motions.end());
  }
  return motions;
}

/// Each of the drives, while the others go on until the bridge knows.
TEST(PlanStops, TouchNothingWhereverOneDriveHangs) {
  const kin::ArmModel arm = model::load_arm("lwr4.yaml");
  const auto motions = planned_motions(arm);
  std::mt19937 random(1);
  constexpr Eigen::Index kPlaces = 12;
  for (std::size_t m = 0; m < motions.size(); ++m) {
    const bool carries =
        motions[m].phase == planner::Phase::transport && motions[m].obstacles.supports.empty();
    if (!carries) continue;
    planner::CollisionChecker judge(arm, motions[m].obstacles, 0.0);
    for (Eigen::Index place = 1; place < kPlaces; ++place) {
      for (std::size_t drive = 0; drive < 7; ++drive) {
        Cell cell(arm, motions[m]);
        const Eigen::Index k = place * motions[m].trajectory.samples() / kPlaces;
        for (Eigen::Index i = 0; i < k; ++i) cell.play();
        EXPECT_FALSE(cell.stop(Event::drive_hangs, random, judge, drive).touched)
            << "motion " << m << ", sample " << k << ", drive " << drive;
      }
    }
  }
}

TEST(PlanStops, TouchNothingWheneverAndHoweverTheArmIsStopped) {
  const int trials = number_of("MIMESIS_STOPS", 200);
  const kin::ArmModel arm = model::load_arm("lwr4.yaml");
  const std::vector<planner::PlannedMotion> motions = planned_motions(arm);
  std::mt19937 random(static_cast<unsigned>(number_of("MIMESIS_STOPS_SEED", 1)));
  const bool wires = number_of("MIMESIS_STOPS_WIRES", 0) != 0;
  const auto first = wires ? static_cast<std::size_t>(Event::frames_lost) : 0;
  const std::size_t kinds = wires ? 3 : kEvents.size();
  int touched = 0, moving = 0;
  std::array<std::tuple<int, int, double, int>, kEvents.size()> rows{};
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
    const auto number = first + static_cast<std::size_t>(trial) % kinds;
    const auto event = static_cast<Event>(number);
    const Stopped stopped = cell.stop(event, random, judge);
    EXPECT_FALSE(stopped.touched) << "trial " << trial << ": motion " << m << ", sample " << k
                                  << ", " << kEvents[number];
    EXPECT_TRUE(stopped.touched || stopped.stopped)
        << "trial " << trial << ", " << kEvents[number] << ": it does not come to rest";
    touched += stopped.touched;
    auto& [count, contacts, farthest, longest] = rows[number];
    ++count;
    contacts += stopped.touched;
    farthest = std::max(farthest, stopped.farthest_rad);
    longest = std::max(longest, stopped.cycles);
  }
  std::printf("%d of %d stops touched something; the arm moved in %d\n", touched, trials, moving);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto& [count, contacts, farthest, longest] = rows[i];
    std::printf(
        "%-20s %4d trials, %d touch, stood after at most %4.0f ms, went %.3f rad meanwhile\n",
        kEvents[i], count, contacts, 5.0 * longest, farthest);
  }
  EXPECT_GT(moving, trials / 2);
}

}  // namespace
}  // namespace mimesis
