#include "experiments/walk/trial/trial.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <random>

#include "common/error.h"
#include "common/math/so3.h"
#include "common/model/files.h"
#include "experiments/walk/mujoco/mujoco_world.h"

namespace mimesis::walk {
namespace {

using Clock = std::chrono::steady_clock;
using walker::kTick_s;
using walker::Side;

/// Time of standing before a trial, see TrialSpec.
double settle_s(const TrialSpec& spec) { return spec.walker.stabilizer.imu_attitude ? 0.0 : 3.0; }

double seconds(Clock::duration d) { return std::chrono::duration<double>(d).count(); }

walker::Sensors to_walker(const hw::sim::BodySensors& s) {
  return {s.q, s.dq, s.R_WI, s.gyro_I, s.specific_force_I, s.foot_S};
}

/// Sums over a trial.
class Observer {
 public:
  explicit Observer(double omega_1_s) : omega_(omega_1_s) {}

  void tick(const walker::WalkerOutput& out, const hw::sim::BodyTruth& truth) {
    const hw::sim::PlannedGround plan = planned_ground(out.pattern);
    judge_.tick(truth, plan);
    if (!truth.fell) {
      add_dcm(hw::sim::truth_to_plan(plan, truth), out, truth);
      const Eigen::Vector3d up_B = truth.X_WB.linear().row(2).transpose();
      const double tilt_rad = out.stabilizer.X_WB.linear().row(2).transpose().cross(up_B).norm();
      tilt_squares_ += tilt_rad * tilt_rad;
      result_.tilt_error_max_rad = std::max(result_.tilt_error_max_rad, tilt_rad);
    }
    for (Side s : robot::kSides) {
      if (out.pattern.contact[s] && !contact_[s]) judge_landing(s, out.pattern);
      contact_[s] = out.pattern.contact[s];
    }
    result_.limited_ticks += out.limited;
    result_.clipped_ticks += out.clipped;
    result_.failed_ticks += out.failed;
    result_.saturated_ticks += out.stabilizer.saturated;
    if (result_.trouble.empty()) result_.trouble = out.trouble;
    if (truth.fell && result_.fell_at_s == 0.0) result_.fell_at_s = truth.time_s;
  }

  TrialResult result() {
    result_.figures = judge_.figures();
    if (count_ > 0) {
      result_.dcm_rms_m = (squares_ / double(count_)).cwiseSqrt();
      result_.tilt_error_rms_rad = std::sqrt(tilt_squares_ / double(count_));
    }
    return result_;
  }

 private:
  void add_dcm(const Eigen::Isometry2d& X_PT, const walker::WalkerOutput& out,
               const hw::sim::BodyTruth& truth) {
    const Eigen::Vector2d error = X_PT * truth.com_W_m.head<2>() - out.com.p_W_m +
                                  (X_PT.linear() * truth.com_v_W.head<2>() - out.com.v_W) / omega_;
    squares_ += error.cwiseAbs2();
    ++count_;
    result_.dcm_max_m = std::max(result_.dcm_max_m, error.norm());
  }
  void judge_landing(Side side, const walker::PatternSample& plan) {
    const Eigen::Isometry3d& other = plan.foot[robot::other(side)].X_WS;
    judge_.step({side, plan.foot[side].X_WS.translation().head<2>(), other.translation().head<2>(),
                 math::yaw_of(other.linear()), std::nullopt});
  }

  double omega_;
  hw::sim::WalkJudge judge_;
  std::array<bool, 2> contact_{true, true};
  Eigen::Vector2d squares_ = Eigen::Vector2d::Zero();
  double tilt_squares_ = 0.0;
  long count_ = 0;
  TrialResult result_;
};

void add_times(std::vector<double>& times, TrialResult& result) {
  if (times.empty()) return;
  std::ranges::sort(times);
  const auto at = [&](double share) {
    return times[std::size_t(share * double(times.size() - 1))];
  };
  result.tick_p50_s = at(0.5);
  result.tick_p99_s = at(0.99);
  result.tick_max_s = times.back();
}

/// `watch(out, ends)`: after every tick.
template <class World, class Watch>
TrialResult walk_in(World& world, const TrialSpec& spec, const Watch& watch) {
  const robot::Biped& biped = spec.robot->biped;
  walker::Walker walker(biped, spec.walker);
  for (hw::sim::Push push : spec.pushes) {
    push.at_s += settle_s(spec);
    world.push(push);
  }
  Observer observer(std::sqrt(robot::kGravity / biped.com_height_m));

  const int ticks = static_cast<int>(std::lround(spec.duration_s / kTick_s)),
            settles = static_cast<int>(std::lround(settle_s(spec) / kTick_s));
  std::deque<walker::Sensors> on_their_way(std::size_t(spec.delay_ticks),
                                           to_walker(world.sensors()));
  std::mt19937_64 losses(spec.body.seed);
  const auto lost = [&] { return double(losses() >> 11) * 0x1p-53 < spec.lost_share; };
  const double omega_1_s = std::sqrt(robot::kGravity / biped.com_height_m);
  const walker::GaitSettings gait =
      spec.walker.gait ? *spec.walker.gait : walker::gait_settings(biped);
  std::optional<Capturability> pushed;
  std::vector<double> times;
  times.reserve(std::size_t(ticks));
  Clock::duration physics{};
  walker::WalkerWish wish;
  const hw::sim::BodyTruth& truth = world.truth();
  const Eigen::Vector2d start = truth.X_WB.translation().head<2>();
  bool ends = false;
  for (int k = -settles; k < ticks && !truth.fell && !ends; ++k) {
    if (spec.wish) wish = spec.wish(std::max(k, 0) * kTick_s);
    on_their_way.push_back(lost() ? on_their_way.back() : to_walker(world.sensors()));
    const auto before = Clock::now();
    const walker::WalkerOutput& out = walker.step(wish, on_their_way.front());
    const auto after = Clock::now();
    on_their_way.pop_front();
    world.step({out.q.data(), std::size_t(out.q.size())}, kTick_s);
    physics += Clock::now() - after;
    if (k < 0) continue;
    times.push_back(seconds(after - before));
    observer.tick(out, truth);
    if (!spec.pushes.empty() && !pushed &&
        k * kTick_s >= spec.pushes.front().at_s + spec.pushes.front().duration_s) {
      const Eigen::Isometry2d X_PT = hw::sim::truth_to_plan(planned_ground(out.pattern), truth);
      pushed = capturability(
          biped, gait, out.pattern,
          X_PT * truth.com_W_m.head<2>() + X_PT.linear() * truth.com_v_W.head<2>() / omega_1_s,
          omega_1_s);
    }
    watch(out, ends);
  }
  TrialResult result = observer.result();
  result.name = spec.name;
  result.pushed = pushed;
  if (result.fell_at_s > 0.0) result.fell_at_s -= settle_s(spec);
  result.self = truth.self;
  result.furniture = truth.furniture;
  result.walked_m = (truth.X_WB.translation().head<2>() - start).norm();
  for (Side s : robot::kSides) {
    if (wish.hand[s].share < 1.0) continue;
    result.reach_error_m =
        std::max(result.reach_error_m, (truth.hand_W_m[s] - wish.hand[s].p_W_m).norm());
  }
  result.real_time_factor = double(times.size()) * kTick_s / seconds(physics);
  add_times(times, result);
  return result;
}

}  // namespace

hw::sim::PlannedGround planned_ground(const walker::PatternSample& plan) {
  hw::sim::PlannedGround ground{.zmp_W_m = plan.zmp_W_m};
  for (const Side side : robot::kSides) {
    const Eigen::Isometry3d& X_WS = plan.foot[side].X_WS;
    ground.foot_W_m[side] = X_WS.translation().head<2>();
    ground.foot_yaw_rad[side] = math::yaw_of(X_WS.linear());
  }
  return ground;
}

Robot load_robot(const std::string& name) {
  const std::string file = name.ends_with(".yaml") ? name : name + ".yaml";
  return {name, model::urdf_of_biped(file), model::load_biped(file)};
}

TrialResult run_trial(const TrialSpec& spec, const std::function<void(const TrialTick&)>& watch) {
  MIMESIS_ASSERT(spec.robot != nullptr);
  if (spec.engine == Engine::mujoco) {
    MIMESIS_ASSERT(!watch);
    MujocoWorld world(spec.robot->biped, spec.body);
    return walk_in(world, spec, [](const walker::WalkerOutput&, bool&) {});
  }
  hw::sim::BodyWorld world(spec.robot->biped, spec.robot->urdf_file, spec.body);
  return walk_in(world, spec, [&](const walker::WalkerOutput& out, bool& ends) {
    if (watch)
      watch({world.time_s() - settle_s(spec), out, world.truth(), world.sensors(), world, ends});
  });
}

}  // namespace mimesis::walk
