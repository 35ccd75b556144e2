#include "nodes/synthesizer/drawer/trial_generator.h"

#include <algorithm>
#include <string>

#include "common/math/so3.h"
#include "nodes/synthesizer/drawer/performer.h"

namespace mimesis::synthesizer {
namespace {

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

// The pelvis rises and falls as the legs allow: the lower envelope of what they allow, rounded, but
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

}  // namespace

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
    for (int row = 0; row < mocap::kBodyRows; ++row) set.rows.push_back(mocap::body_row_name(row));
    for (const char* row : {"pelvis.x", "pelvis.y", "pelvis.z"}) set.rows.emplace_back(row);
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
      set.trials.push_back(
          {.clip = "generated " + std::to_string(settings.seed) + "/" + std::to_string(p.recording),
           .style =
               std::array{"normal step", "reaching step", "standing"}[static_cast<std::size_t>(a)],
           .cycle = a,
           .first_frame = first,
           .last_frame = first + samples - 1,
           .duration_s = p.duration_s[a],
           .step_length_m = length,
           .turn_rad = 0.0,
           .task = {distance, p.final_distance_m, p.object_depth_m, p.object_lateral_m}});
      distance -= length;
    }
  }
  return data;
}

}  // namespace mimesis::synthesizer
