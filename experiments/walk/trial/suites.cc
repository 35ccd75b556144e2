#include "experiments/walk/trial/suites.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "common/error.h"
#include "common/robot/kinematics.h"
#include "experiments/walk/trial/trial.h"
#include "tools/mimesis/table.h"

namespace mimesis::walk {
namespace {

using walker::WalkerWish;

constexpr double kStart_s = 1.0;  ///< standing before

/// First moment of mass of an arm about its shoulder over the robot's mass, half-sitting [m]:
/// measures how much its swing disturbs the robot.
double arm_moment_m(const robot::Biped& biped, int shoulder_link) {
  robot::Kinematics kinematics(biped.tree);
  kinematics.update(biped.X_WB_half_sitting, biped.half_sitting);
  const Eigen::Vector3d shoulder = kinematics.X_WL(shoulder_link).translation();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int l = 0; l < static_cast<int>(biped.tree.links().size()); ++l) {
    if (!biped.tree.carries(shoulder_link, l)) continue;
    const robot::Inertia& inertia = biped.tree.link(l).inertia;
    sum += inertia.mass_kg * (kinematics.X_WL(l) * inertia.com_m - shoulder);
  }
  return sum.norm() / biped.tree.mass_kg();
}

/// Swings the arms at the shoulders, one against the other. Amplitudes hold for biped.urdf; heavier
/// arms swing less, so that they disturb their robot no more.
struct Arms {
  Arms(const robot::Biped& biped, double amplitude_rad, double frequency_hz)
      : amplitude(amplitude_rad), rate(2.0 * std::numbers::pi * frequency_hz) {
    rest = biped.half_sitting(biped.upper_body);
    for (robot::Side s : robot::kSides) {
      shoulder[s] = first_of_arm(biped, s);
      if (shoulder[s] < 0) continue;
      const int link =
          biped.tree.moved_link(biped.upper_body[static_cast<std::size_t>(shoulder[s])]);
      share = std::min(share, kMoment_m / arm_moment_m(biped, link));
    }
  }
  static constexpr double kMoment_m =
      0.0193;  ///< lag of biped.urdf, rounded up: it swings as far as asked
  static int first_of_arm(const robot::Biped& biped, robot::Side side) {
    for (std::size_t i = 0; i < biped.upper_body.size(); ++i) {
      const int link = biped.tree.moved_link(biped.upper_body[i]);
      const bool mine = biped.hand[side] >= 0 && biped.tree.carries(link, biped.hand[side]);
      const robot::Side other = robot::other(side);
      const bool others = biped.hand[other] >= 0 && biped.tree.carries(link, biped.hand[other]);
      if (mine && !others) return static_cast<int>(i);
    }
    return -1;
  }
  void wish(double t, WalkerWish& w) const {
    const double grow = std::clamp((t - kStart_s) / 2.0, 0.0, 1.0);
    w.upper_body = rest;
    w.upper_body_rate = Eigen::VectorXd::Zero(rest.size());
    for (robot::Side s : robot::kSides) {
      if (shoulder[s] < 0) continue;
      const double a = grow * share * amplitude * robot::sign(s), phase = rate * (t - kStart_s);
      w.upper_body[shoulder[s]] += a * std::sin(phase);
      w.upper_body_rate[shoulder[s]] = a * rate * std::cos(phase);
    }
  }
  double amplitude, rate, share = 1.0;
  Eigen::VectorXd rest;
  std::array<int, 2> shoulder{-1, -1};
};

struct Walk {
  Eigen::Vector2d velocity_m_s = Eigen::Vector2d::Zero();
  double turn_rad_s = 0.0;
  double until_s = 12.0;                    ///< it stops then
  double change_at_s = 1e9, change_to = 1;  ///< share of the forward speed from then on
};

std::function<WalkerWish(double)> wish_of(const Walk& walk, const Arms& arms) {
  return [walk, arms](double t) {
    WalkerWish w;
    w.walk.walk = t >= kStart_s && t < walk.until_s;
    w.walk.velocity_m_s = walk.velocity_m_s;
    if (t >= walk.change_at_s) w.walk.velocity_m_s.x() *= walk.change_to;
    w.walk.yaw_rate_rad_s = walk.turn_rad_s;
    arms.wish(t, w);
    return w;
  };
}

hw::sim::Push push(double at_s, double impulse_ns, double direction_rad) {
  hw::sim::Push p;
  p.at_s = at_s;
  p.impulse_W_ns = {impulse_ns * std::cos(direction_rad), impulse_ns * std::sin(direction_rad), 0};
  return p;
}

TrialSpec plain(const Robot& robot, const SuiteOptions& o, std::size_t number) {
  TrialSpec spec;
  spec.robot = &robot;
  spec.engine = o.engine;
  set_up(o, number, spec.body, spec.walker);
  spec.delay_ticks = o.delay_ticks;
  return spec;
}

/// Plates of 0.5 m × 1 m on every other place at random, none where the robot starts.
std::vector<hw::sim::Plate> draw_plates(Draw& draw) {
  std::vector<hw::sim::Plate> plates;
  for (int i = -8; i <= 8; ++i) {
    for (int j = -4; j <= 4; ++j) {
      const bool here = draw.coin();
      const Eigen::Vector2d center(0.5 * i, 1.0 * j + (i % 2 == 0 ? 0.0 : 0.5));
      if (here && (std::abs(center.x()) > 0.45 || std::abs(center.y()) > 0.8)) {
        plates.push_back({center, {0.25, 0.5}, 0.005});
      }
    }
  }
  return plates;
}

/// Impulses are those of biped.urdf, for the mass of another robot as much more or less.
double push_share(const Robot& robot) {
  constexpr double kMass_kg = 58.0;
  return std::round(1e6 * robot.biped.tree.mass_kg() / kMass_kg) / 1e6;  // 1 for biped.urdf
}

/// `push_n_s`: every push is as large; 0: of up to 5 N s.
std::vector<TrialSpec> thirty(const Robot& robot, const SuiteOptions& o, bool plates,
                              double push_n_s = 0.0) {
  std::vector<TrialSpec> trials;
  Draw draw(o.seed);
  for (double speed : {0.1, 0.2, 0.3}) {
    for (int i = 0; i < 10; ++i) {
      TrialSpec spec = plain(robot, o, trials.size());
      Walk walk;
      walk.velocity_m_s = {speed, draw.between(-0.05, 0.05)};
      walk.turn_rad_s = draw.between(-0.15, 0.15);
      walk.change_at_s = draw.between(4.0, 9.0);
      walk.change_to = draw.between(0.3, 1.0);
      const Arms arms(robot.biped, draw.between(0.3, 1.5), draw.between(0.3, 0.6));
      spec.wish = wish_of(walk, arms);
      spec.duration_s = 16.0;
      for (double at = 2.5; at < 14.0; at += 3.37) {
        const double when = at + draw.between(0.0, 1.0), drawn = draw.between(0.0, 5.0);
        spec.pushes.push_back(push(when, push_share(robot) * (push_n_s > 0.0 ? push_n_s : drawn),
                                   draw.between(-std::numbers::pi, std::numbers::pi)));
      }
      if (plates) spec.body.plates = draw_plates(draw);
      spec.name = fmt::format("{} m/s {}", speed, i);
      trials.push_back(std::move(spec));
    }
  }
  return trials;
}

std::vector<TrialSpec> pushes(const Robot& robot, const SuiteOptions& o) {
  std::vector<TrialSpec> trials;
  const Arms arms(robot.biped, 0.0, 0.5);
  for (double speed : {0.0, 0.2}) {
    // walking: in double support, at lift-off, in the middle of a swing, before landing; a step of
    // one foot, then of the other
    const int instants = speed > 0.0 ? 8 : 1;
    for (int direction = 0; direction < 8; ++direction) {
      for (int k = 0; k < instants; ++k) {
        TrialSpec spec = plain(robot, o, trials.size());
        const double at = speed > 0.0 ? 5.05 + 0.2 * k : 3.0,
                     angle = direction * std::numbers::pi / 4.0;
        Walk walk;
        walk.velocity_m_s.x() = speed;
        if (speed == 0.0) walk.until_s = 0.0;
        spec.wish = wish_of(walk, arms);
        spec.duration_s = speed > 0.0 ? 9.0 : 7.0;
        spec.pushes.push_back(push(at, push_share(robot) * (speed > 0.0 ? 10.0 : 15.0), angle));
        spec.name = fmt::format("{} towards {} deg at {:.2f} s",
                                speed > 0.0 ? "walking" : "standing", 45 * direction, at);
        trials.push_back(std::move(spec));
      }
    }
  }
  return trials;
}

/// Bounds: see make_suite(). Draws in one order, so that a trial is the same whatever its number of
/// companions.
std::vector<TrialSpec> random200(const Robot& robot, const SuiteOptions& o) {
  constexpr int kTrials = 200;
  std::vector<TrialSpec> trials;
  Draw draw(o.seed);
  for (int i = 0; i < kTrials; ++i) {
    TrialSpec spec = plain(robot, o, trials.size());
    const bool stands = draw.between(0.0, 1.0) < 0.2;
    Walk walk;
    walk.velocity_m_s = {draw.between(0.0, 0.3), draw.between(-0.05, 0.05)};
    walk.turn_rad_s = draw.between(-0.15, 0.15);
    if (stands) walk.until_s = 0.0;
    spec.wish = wish_of(walk, Arms(robot.biped, draw.between(0.0, 1.0), draw.between(0.3, 0.6)));
    spec.duration_s = 12.0;
    const double at_s = draw.between(3.0, 8.0), n_s = draw.between(5.0, 20.0);
    hw::sim::Push one =
        push(at_s, push_share(robot) * n_s, draw.between(-std::numbers::pi, std::numbers::pi));
    one.duration_s = draw.between(0.05, 0.5);
    spec.pushes.push_back(one);
    spec.body.friction = draw.between(0.4, 0.9);
    spec.body.payload_kg = draw.between(0.0, 0.1) * robot.biped.tree.mass_kg();
    spec.delay_ticks = draw.coin() ? o.delay_ticks : o.delay_ticks + 1;
    spec.lost_share = draw.between(0.0, 0.2);
    spec.name = fmt::format("{} {}: {:.0f} N s in {:.2f} s", stands ? "stands" : "walks", i, n_s,
                            one.duration_s);
    trials.push_back(std::move(spec));
  }
  return trials;
}

std::vector<TrialSpec> speeds(const Robot& robot, const SuiteOptions& o) {
  struct Case {
    const char* name;
    double forward, left, turn, arms_rad;
  };
  static constexpr Case kCases[] = {
      {"on the spot", 0, 0, 0, 0},
      {"0.1 m/s", 0.1, 0, 0, 0},
      {"0.2 m/s", 0.2, 0, 0, 0},
      {"0.3 m/s", 0.3, 0, 0, 0},
      {"-0.2 m/s", -0.2, 0, 0, 0},
      {"left 0.1 m/s", 0, 0.1, 0, 0},
      {"right 0.1 m/s", 0, -0.1, 0, 0},
      {"turn 0.2 rad/s", 0, 0, 0.2, 0},
      {"0.2, turn 0.15", 0.2, 0, 0.15, 0},
      {"arms 1.5 rad, 0.1", 0.1, 0, 0, 1.5},
      {"arms 1.5 rad, 0.2", 0.2, 0, 0, 1.5},
      {"arms 1.5 rad, 0.3", 0.3, 0, 0, 1.5},
  };
  std::vector<TrialSpec> trials;
  for (const Case& c : kCases) {
    TrialSpec spec = plain(robot, o, trials.size());
    spec.name = c.name;
    spec.wish = wish_of({.velocity_m_s = {c.forward, c.left}, .turn_rad_s = c.turn},
                        Arms(robot.biped, c.arms_rad, 0.5));
    spec.duration_s = 16.0;
    trials.push_back(std::move(spec));
  }
  return trials;
}

std::vector<TrialSpec> naive(const Robot& robot, const SuiteOptions& o) {
  std::vector<TrialSpec> trials = speeds(robot, o);
  for (TrialSpec& spec : trials) {
    spec.walker.stabilize = spec.walker.filter = false;
    spec.duration_s = 24.0;
  }
  return trials;
}

}  // namespace

void use_real_senses(hw::sim::BodyOptions& body, walker::StabilizerSettings& walker) {
  body.senses = hw::sim::kRealSenses;
  walker.imu_attitude = false;
  walker.velocity_filter_s = 0.02;
  walker.com_offset_s = 5.0;
  // nominal, of the plant [docs/walking.md 7.3]
  const bool springs = body.plant == hw::sim::Plant::springs;
  walker.hip_stiffness_n_m_rad = springs ? 6000.0 : 0.0;
  walker.knee_stiffness_n_m_rad = 6000.0;
  walker.ankle_stiffness_n_m_rad = springs ? 6000.0 : 1500.0;
}

SuiteOptions::SuiteOptions(hw::sim::Plant plant, bool real_senses) {
  body.plant = plant;
  // ankles of 1500 N m/rad: half of the default's loop gain A dt k [docs/walking.md 6.5]
  if (plant == hw::sim::Plant::servo) walker.stabilizer.cop_rad_s_n_m = 0.03;
  if (real_senses) use_real_senses(body, walker.stabilizer);
}

void set_up(const SuiteOptions& options, std::size_t number, hw::sim::BodyOptions& body,
            walker::WalkerSettings& walker) {
  body = options.body;
  body.seed = 1000 * options.seed + number;
  walker = options.walker;
  Draw draw(body.seed);
  walker::StabilizerSettings& s = walker.stabilizer;
  for (double* k :
       {&s.hip_stiffness_n_m_rad, &s.knee_stiffness_n_m_rad, &s.ankle_stiffness_n_m_rad}) {
    *k *= 1.0 + draw.between(-options.stiffness_error, options.stiffness_error);
  }
}

const std::vector<std::string>& suite_names() {
  static const std::vector<std::string> names{"steps30",   "plates30", "walks30", "pushes",
                                              "random200", "speeds",   "naive"};
  return names;
}

std::vector<TrialSpec> make_suite(const std::string& name, const Robot& robot,
                                  const SuiteOptions& options) {
  if (name == "steps30") return thirty(robot, options, false);
  if (name == "plates30") return thirty(robot, options, true);
  if (name == "walks30") return thirty(robot, options, false, 10.0);
  if (name == "pushes") return pushes(robot, options);
  if (name == "random200") return random200(robot, options);
  if (name == "speeds") return speeds(robot, options);
  if (name == "naive") return naive(robot, options);
  throw ConfigError("--suite: there is no '" + name + "'");
}

void run_trials(std::span<const TrialSpec> trials, int jobs,
                const std::function<void(const TrialResult&)>& done) {
  in_order<TrialResult>(
      trials.size(), jobs, [&](std::size_t i) { return run_trial(trials[i]); }, done);
}

using nlohmann::ordered_json;

namespace {

ordered_json collisions_json(const hw::sim::Collisions& c) {
  return {{"steps", c.steps}, {"deepest_m", c.deepest_m}, {"between", c.deepest_between}};
}

}  // namespace

ordered_json to_json(const TrialResult& r) {
  const hw::sim::WalkFigures& f = r.figures;
  ordered_json j{{"name", r.name}, {"fell", f.fell}};
  if (f.fell) {
    j["how"] = f.how;
    j["fell_at_s"] = r.fell_at_s;
  }
  j["steps"] = f.steps;
  j["walked_m"] = r.walked_m;
  j["step_error_rms_m"] = f.step_error_rms_m;
  j["step_error_max_m"] = f.step_error_max_m;
  j["dcm_rms_m"] = {r.dcm_rms_m.x(), r.dcm_rms_m.y()};
  j["dcm_max_m"] = r.dcm_max_m;
  j["tilt_error_rms_rad"] = r.tilt_error_rms_rad;
  j["tilt_error_max_rad"] = r.tilt_error_max_rad;
  j["zmp_error_rms_m"] = {f.zmp_error_rms_m.x(), f.zmp_error_rms_m.y()};
  j["ankle_pitch_peak_n_m"] = f.ankle_pitch_peak_n_m;
  j["ankle_pitch_slow_peak_n_m"] = f.ankle_pitch_slow_peak_n_m;
  j["normal_peak_n"] = f.normal_peak_n;
  j["raw_normal_peak_n"] = f.raw_normal_peak_n;
  j["reach_error_m"] = r.reach_error_m;
  j["limited_ticks"] = r.limited_ticks;
  j["clipped_ticks"] = r.clipped_ticks;
  j["failed_ticks"] = r.failed_ticks;
  j["saturated_ticks"] = r.saturated_ticks;
  j["self_collisions"] = collisions_json(r.self);
  j["furniture_collisions"] = collisions_json(r.furniture);
  if (r.pushed) {
    j["capturable"] = r.pushed->capturable;
    j["beyond_capture_m"] = r.pushed->beyond_m;
  }
  j["trouble"] = r.trouble;
  j["tick_s"] = {{"p50", r.tick_p50_s}, {"p99", r.tick_p99_s}, {"max", r.tick_max_s}};
  j["real_time_factor"] = r.real_time_factor;
  return j;
}

ordered_json summary_json(std::span<const TrialResult> results) {
  ordered_json falls = ordered_json::array();
  int self = 0, furniture = 0, capturable = 0, captured = 0, pushed = 0;
  double step = 0.0, dcm = 0.0, ankle = 0.0, ankle_slow = 0.0, normal = 0.0, p99 = 0.0, tilt = 0.0;
  for (const TrialResult& r : results) {
    const hw::sim::WalkFigures& f = r.figures;
    pushed += r.pushed.has_value();
    const bool can = r.pushed && r.pushed->capturable;
    capturable += can;
    captured += can && !f.fell;
    if (f.fell) {
      falls.push_back({{"name", r.name}, {"how", f.how}, {"at_s", r.fell_at_s}});
      continue;  // measures of a falling robot do not describe walking
    }
    step = std::max(step, f.step_error_max_m);
    self += r.self.steps > 0;
    furniture += r.furniture.steps > 0;
    dcm = std::max(dcm, r.dcm_max_m);
    ankle = std::max(ankle, f.ankle_pitch_peak_n_m);
    ankle_slow = std::max(ankle_slow, f.ankle_pitch_slow_peak_n_m);
    normal = std::max(normal, f.normal_peak_n);
    p99 = std::max(p99, r.tick_p99_s);
    tilt = std::max(tilt, r.tilt_error_max_rad);
  }
  return {{"trials", results.size()},
          {"falls", falls.size()},
          {"fell", falls},
          {"pushed", pushed},
          {"capturable", capturable},
          {"captured", captured},
          {"step_error_max_m", step},
          {"dcm_max_m", dcm},
          {"tilt_error_max_rad", tilt},
          {"ankle_pitch_peak_n_m", ankle},
          {"ankle_pitch_slow_peak_n_m", ankle_slow},
          {"normal_peak_n", normal},
          {"self_collisions", self},
          {"furniture_collisions", furniture},
          {"tick_p99_s", p99}};
}

void print_table(std::span<const TrialResult> results, std::ostream& out, bool bold_heading) {
  tool::TextTable table({"trial", "fell", "steps", "m", "step err mm rms (max)",
                         "DCM mm rms x/y (max)", "ZMP mm x/y", "ankle Nm (20 ms)", "Fz N",
                         "limited", "tick us p50/p99"});
  for (const TrialResult& r : results) {
    const hw::sim::WalkFigures& f = r.figures;
    table.row(
        {r.name, f.fell ? fmt::format("{:.1f} s", r.fell_at_s) : "no", std::to_string(f.steps),
         fmt::format("{:.2f}", r.walked_m),
         fmt::format("{:.1f} ({:.1f})", 1e3 * f.step_error_rms_m, 1e3 * f.step_error_max_m),
         fmt::format("{:.1f}/{:.1f} ({:.0f})", 1e3 * r.dcm_rms_m.x(), 1e3 * r.dcm_rms_m.y(),
                     1e3 * r.dcm_max_m),
         fmt::format("{:.1f}/{:.1f}", 1e3 * f.zmp_error_rms_m.x(), 1e3 * f.zmp_error_rms_m.y()),
         fmt::format("{:.0f} ({:.0f})", f.ankle_pitch_peak_n_m, f.ankle_pitch_slow_peak_n_m),
         fmt::format("{:.0f}", f.normal_peak_n), std::to_string(r.limited_ticks),
         fmt::format("{:.0f}/{:.0f}", 1e6 * r.tick_p50_s, 1e6 * r.tick_p99_s)});
  }
  table.print(out, bold_heading);
}

}  // namespace mimesis::walk
