#include "nodes/synthesizer/sequence/trials.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/math/so3.h"
#include "nodes/synthesizer/sequence/performer.h"

namespace mimesis::synthesizer {

namespace {

constexpr double kMeanNormalLength = 1.57;   // m: two of three steps of 0.385 (2.64 m − 0.6 m)
constexpr double kNormalDeviation = 0.042;   // m
constexpr double kMeanFinalDistance = 0.60;  // m
constexpr double kFrontObject = 0.15, kBackObject = 0.33, kSideObject = 0.11;  // m

// Noise of action 1's length: what of it goes with the distance is taken out and put back in the
// share that R² asks for.
Eigen::VectorXd normal_lengths(const Eigen::VectorXd& distance_m, double r_squared, Draw& draw) {
  const Eigen::VectorXd d = (distance_m.array() - distance_m.mean()).matrix().normalized();
  Eigen::VectorXd e(d.size());
  for (double& x : e) x = draw.normal();
  e.array() -= e.mean();
  e -= d.dot(e) * d;
  const double size = kNormalDeviation * std::sqrt(static_cast<double>(d.size()));
  const Eigen::VectorXd noise =
      size * (std::sqrt(r_squared) * d + std::sqrt(1.0 - r_squared) * e.normalized());
  return noise.array() + kMeanNormalLength;
}

Manner draw_manner(Draw& draw) {
  Manner m;
  m.half_width_m = draw.around(0.09, 0.006);
  m.sway_m = draw.around(0.022, 0.002);
  m.pelvis_turn_rad = draw.around(0.08, 0.008);
  m.pelvis_list_rad = draw.around(0.04, 0.004);
  m.arm_swing_rad = draw.around(0.38, 0.03);
  m.elbow_rad = draw.around(0.40, 0.03);
  m.lean_rad = draw.around(0.05, 0.01);
  m.extra_lean_rad = std::abs(draw.around(0.0, 0.02));
  m.toe_out_rad = draw.around(0.10, 0.01);
  m.clearance_m = draw.around(0.05, 0.003);
  m.drift_rad = draw.around(0.010, 0.002);
  m.drift_phase_rad = 2.0 * std::numbers::pi * draw.uniform();
  m.first_step_share = draw.around(0.5, 0.006);
  return m;
}

TrialPlan at_pace(TrialPlan plan, double pace) {
  plan.pace = pace;
  plan.normal_length_m *= pace;
  plan.reaching_length_m *= pace;
  return plan;
}

constexpr double kNever = std::numeric_limits<double>::infinity();

// Where the feet end: apart, left in front, since the left hand pulls, and more so after a longer
// step. A short action 2 leaves the left foot nearly where it is and the right one behind.
struct LastPrints {
  double left, right;
  explicit LastPrints(const TrialPlan& p) {
    constexpr double kLeast = 0.03, kSoftness = 0.05;  // m
    const double apart = 0.04 + 0.30 * std::max(0.0, p.reaching_length_m - 0.2);
    const double end = p.normal_length_m + p.reaching_length_m;
    const double front =
        0.5 * (1.0 - p.manner.first_step_share) * p.normal_length_m + p.normal_length_m;
    left = front + kLeast +
           kSoftness * std::log1p(std::exp((end + apart - front - kLeast) / kSoftness));
    right = 2.0 * end - left;
  }
};

using Eigen::Vector3d;
constexpr double kHoldAfter = 0.5;  // s

Eigen::VectorXd sample_times(const TrialTimes& t, int samples) {
  const double starts[] = {-t.t1, 0.0, t.t1, t.reached, t.done, t.done + kHoldAfter};
  Eigen::VectorXd times(5 * samples);
  for (int a = 0; a < 5; ++a)
    for (int k = 0; k < samples; ++k)
      times(a * samples + k) = starts[a] + (starts[a + 1] - starts[a]) * k / samples;
  return times;
}

// The pelvis rises and falls as the legs allow: the lower envelope of their limits, rounded, but
// never above it (the mean over a window of the least over the same window).
Eigen::VectorXd rounded_below(const Eigen::VectorXd& highest, int window) {
  const auto n = highest.size();
  auto over_window = [n](const Eigen::VectorXd& x, int half, bool least) {
    Eigen::VectorXd y(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto from = std::max<Eigen::Index>(0, i - half), to = std::min(n - 1, i + half);
      const auto part = x.segment(from, to - from + 1);
      y(i) = least ? part.minCoeff() : part.mean();
    }
    return y;
  };
  return over_window(over_window(over_window(highest, 2 * window, true), window, false), window,
                     false);
}

/// Names of the rows of DrawerData.
std::vector<std::string> drawer_rows() {
  std::vector<std::string> rows;
  for (int row = 0; row < mocap::kBodyRows; ++row) rows.push_back(mocap::body_row_name(row));
  for (const char* row : {"pelvis.x", "pelvis.y", "pelvis.z"}) rows.emplace_back(row);
  return rows;
}

}  // namespace

double Draw::normal() {
  for (;;) {
    const double r = std::sqrt(-2.0 * std::log(uniform()));
    const double x = r * std::cos(2.0 * std::numbers::pi * uniform());
    if (std::abs(x) <= 2.0) return x;
  }
}

mocap::Trial action_trial(const TrialPlan& p, int a, double length_m, double distance_m,
                          std::uint64_t seed, Eigen::Index first_frame, Eigen::Index samples) {
  return {
      .clip = "generated " + std::to_string(seed) + "/" + std::to_string(p.recording),
      .style = std::array{"normal step", "reaching step", "standing"}[static_cast<std::size_t>(a)],
      .cycle = a,
      .first_frame = first_frame,
      .last_frame = first_frame + samples - 1,
      .duration_s = p.duration_s[a],
      .step_length_m = length_m,
      .turn_rad = 0.0,
      .task = {distance_m, p.final_distance_m, p.object_depth_m, p.object_lateral_m}};
}

std::vector<TrialPlan> draw_plans(const GeneratorSettings& settings) {
  Draw draw(settings.seed);
  const int n = settings.trials;
  const Eigen::VectorXd distance =
      Eigen::VectorXd::LinSpaced(n, settings.nearest_m, settings.farthest_m);
  const Eigen::VectorXd normal = normal_lengths(distance, settings.length_r_squared, draw);
  std::vector<TrialPlan> plans;
  for (int i = 0; i < n; ++i) {
    TrialPlan p;
    p.recording = i;
    // the order of places 0 3 1 2 keeps depth and side apart from the distance
    const int place = std::array{0, 3, 1, 2}[static_cast<std::size_t>(i % 4)];
    p.object_depth_m = place < 2 ? kFrontObject : kBackObject;
    p.object_lateral_m = place % 2 == 0 ? kSideObject : -kSideObject;
    p.normal_length_m = normal(i);
    p.final_distance_m = kMeanFinalDistance + draw.around(0.0, 0.008) +
                         0.15 * (p.object_depth_m - 0.5 * (kFrontObject + kBackObject));
    p.reaching_length_m = distance(i) - p.normal_length_m - p.final_distance_m;
    p.duration_s[kNormalStep] =
        1.12 * std::sqrt(p.normal_length_m / kMeanNormalLength) * draw.around(1.0, 0.025);
    p.duration_s[kReachingStep] =
        1.25 * draw.around(1.0, 0.03) + 0.25 * (p.reaching_length_m - 0.47);
    p.duration_s[kStanding] = 1.60 * draw.around(1.0, 0.04) + 0.4 * (p.object_depth_m - 0.24);
    p.manner = draw_manner(draw);
    plans.push_back(p);
  }
  for (double pace : settings.paces)
    for (int i = 0; i < n; ++i) plans.push_back(at_pace(plans[static_cast<std::size_t>(i)], pace));
  return plans;
}

std::vector<Footprint> prints_of(mocap::Side side, const TrialPlan& p, const TrialTimes& t) {
  const double length = p.normal_length_m, t1 = t.t1;
  const double left0 = 0.5 * (1.0 - p.manner.first_step_share) * length;
  const double right0 = left0 + p.manner.first_step_share * length - length;  // before action 1
  const LastPrints last(p);
  const bool left = side == mocap::kLeft;
  const double y = left ? p.manner.half_width_m : -p.manner.half_width_m;
  // strike, and the other foot's strike after it, after which this one may lift
  struct Stand {
    double x, strike, other;
  };
  const std::vector<Stand> stands = left ? std::vector<Stand>{{left0 - length, -t1, -0.5 * t1},
                                                              {left0, 0.0, 0.5 * t1},
                                                              {left0 + length, t1, t.right_strike},
                                                              {last.left, t.left_strike, kNever}}
                                         : std::vector<Stand>{{right0 - length, -1.5 * t1, -t1},
                                                              {right0, -0.5 * t1, 0.0},
                                                              {right0 + length, 0.5 * t1, t1},
                                                              {last.right, t.right_strike, kNever}};
  std::vector<Footprint> prints;
  for (std::size_t i = 0; i < stands.size(); ++i) {
    // feet roll with long strides and are put down flat with short ones
    auto roll = [&](std::size_t k) {
      const double stride = k == 0              ? length
                            : k < stands.size() ? stands[k].x - stands[k - 1].x
                                                : 0.0;
      return std::clamp(stride / 1.4, 0.15, 1.0);
    };
    const double lift = stands[i].other + 0.11 * t1;
    prints.push_back({.x_m = stands[i].x,
                      .y_m = y,
                      .strike_s = stands[i].strike,
                      .flat_s = stands[i].strike + 0.10 * t1,
                      .heel_off_s = lift - 0.31 * t1,
                      .lift_s = lift,
                      .strike_pitch_rad = -0.30 * roll(i),
                      .lift_pitch_rad = 0.95 * roll(i + 1)});
  }
  return prints;
}

RenderedTrial render(const mocap::Body& body, const TrialPlan& plan, const Drawer& drawer,
                     int samples) {
  Performer performer(body, plan, drawer);
  RenderedTrial r;
  r.time_s = sample_times(performer.times(), samples);
  const auto n = r.time_s.size();
  Eigen::VectorXd height(n);
  for (int pass = 0; pass < 2; ++pass) {  // the lean moves the hips a little, hence the height
    Eigen::VectorXd highest(n);
    for (Eigen::Index i = 0; i < n; ++i) highest(i) = performer.highest_pelvis(r.time_s(i));
    height = rounded_below(highest, std::max(1, samples / 22));
    performer.lean_to_reach([&](double t) {
      const auto i = std::lower_bound(r.time_s.begin(), r.time_s.end(), t) - r.time_s.begin();
      return height(std::min<Eigen::Index>(i, n - 1));
    });
  }
  r.angle_rad.resize(mocap::kBodyRows, n);
  r.pelvis_W_m.resize(3, n);
  r.handle_W_m.resize(3, n);
  r.object_W_m.resize(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = r.time_s(i);
    r.angle_rad.col(i) = performer.posture(t, height(i), &r.short_by_m);
    r.pelvis_W_m.col(i) = performer.ground_track(t) + Vector3d(0.0, 0.0, height(i));
    r.contact.push_back(
        {performer.foot(mocap::kLeft, t).contact, performer.foot(mocap::kRight, t).contact});
    r.handle_W_m.col(i) = performer.handle(t);
    r.object_W_m.col(i) = performer.object(t);
  }
  for (Eigen::Index i = 1; i < n; ++i)  // axis-angle without jumps
    for (int j = 0; j < mocap::kBodyJoints; ++j) {
      const Vector3d before = r.angle_rad.block<3, 1>(3 * j, i - 1);
      const Vector3d now = r.angle_rad.block<3, 1>(3 * j, i);
      r.angle_rad.block<3, 1>(3 * j, i) = math::nearest_axis_angle(now, before);
    }
  return r;
}

DrawerData generate_drawer_data(const mocap::Body& body, const Drawer& drawer,
                                const GeneratorSettings& settings) {
  const auto plans = draw_plans(settings);
  const Eigen::Index samples = settings.samples;
  DrawerData data{.body = body, .drawer = drawer, .action = {}};
  for (auto& set : data.action) {
    set.rows = drawer_rows();
    set.task_names.assign(kTaskNames.begin(), kTaskNames.end());
    set.samples.resize(static_cast<Eigen::Index>(plans.size()) * kDrawerRows, samples);
  }
  for (std::size_t i = 0; i < plans.size(); ++i) {
    const TrialPlan& p = plans[i];
    const RenderedTrial r = render(body, p, drawer, settings.samples);
    double distance = p.initial_distance_m();
    for (int a = 0; a < kActions; ++a) {
      auto& set = data.action[static_cast<std::size_t>(a)];
      const double length = a == kNormalStep     ? p.normal_length_m
                            : a == kReachingStep ? p.reaching_length_m
                                                 : 0.0;
      const auto first = (a + 1) * samples;
      auto block = set.samples.middleRows(static_cast<Eigen::Index>(i) * kDrawerRows, kDrawerRows);
      block.topRows(mocap::kBodyRows) = r.angle_rad.middleCols(first, samples);
      block.bottomRows(kPelvisRows) = r.pelvis_W_m.middleCols(first, samples);
      const double start = r.pelvis_W_m(0, first);
      for (Eigen::Index k = 0; k < samples; ++k)
        block(mocap::kBodyRows, k) -=
            start + length * static_cast<double>(k) / static_cast<double>(samples);
      set.trials.push_back(action_trial(p, a, length, distance, settings.seed, first, samples));
      distance -= length;
    }
  }
  return data;
}

}  // namespace mimesis::synthesizer
