#include "experiments/motion/styled_walks.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "common/math/circle.h"
#include "nodes/synthesizer/control/rotation_branches.h"
#include "common/motion/demix/sisa.h"
#include "experiments/motion/grounded_figure.h"
#include "common/motion/model/make_model.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kFirst = 0.04, kLast = 0.55;  // of the cycle: a foot stands

/// Where a style turns, the cycle that turns most; elsewhere all.
mocap::Trials without_straight_ends(const mocap::Trials& all) {
  mocap::Trials some{all.rows, all.task_names, {}, {}};
  const Eigen::Index rows = all.rows_per_trial();
  std::vector<Eigen::Index> kept;
  for (std::size_t i = 0; i < all.trials.size(); ++i) {
    const mocap::Trial& t = all.trials[i];
    const bool turns = t.style.find("turn") != t.style.npos;
    const bool most = std::ranges::none_of(all.trials, [&](const mocap::Trial& other) {
      return other.style == t.style && std::abs(other.turn_rad) > std::abs(t.turn_rad);
    });
    if (!turns || most) kept.push_back(static_cast<Eigen::Index>(i));
  }
  some.samples.resize(static_cast<Eigen::Index>(kept.size()) * rows, all.samples.cols());
  for (std::size_t k = 0; k < kept.size(); ++k) {
    some.trials.push_back(all.trials[static_cast<std::size_t>(kept[k])]);
    some.samples.middleRows(static_cast<Eigen::Index>(k) * rows, rows) =
        all.samples.middleRows(kept[k] * rows, rows);
  }
  return some;
}

}  // namespace

MotionModel styled_walks(const RecordedWalks& walks, int sources) {
  mocap::Trials trials = without_straight_ends(walks.trials);
  align_rotation_branches(trials);
  demix::SisaOptions options;
  options.sources = sources;
  options.tied = true;
  const demix::SisaResult result = demix::sisa(trials, options);
  return average_styles(make_model(trials, result.mixture, true, walks.body));
}

int pattern_of(const MotionModel& model, const std::string& style) {
  for (std::size_t p = 0; p < model.patterns.size(); ++p) {
    if (model.patterns[p].trial.style == style) return static_cast<int>(p);
  }
  throw ConfigError("the model has no style '" + style + "'");
}

mocap::BodyPose character_pose(const MotionModel& model, const CharacterBatch& batch, int i) {
  Eigen::Matrix<double, mocap::kBodyRows, 1> angles = decltype(angles)::Zero();
  const std::vector<int> rows = body_rows(model);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    angles[rows[r]] = static_cast<double>(batch.angles(i)[r]);
  }
  const RootPose root = batch.root(i);
  return figure_pose(model.body, angles,
                     {root.position_W_m.x(), root.position_W_m.y(), root.height_m},
                     root.heading_rad);
}

void FootSlide::observe(const CharacterBatch& batch, int i) {
  for (const int side : {mocap::kLeft, mocap::kRight}) {
    const Eigen::Vector3d heel = batch.heel_W_m(i, side), toe = batch.toe_W_m(i, side);
    Point now;
    now.toe = toe.z() < heel.z();
    const Eigen::Vector3d& lower = now.toe ? toe : heel;
    const double since = math::wrap_two_pi(batch.phase(i) - side * std::numbers::pi) / math::kTwoPi;
    now.stands = since > kFirst && since < kLast;
    now.p_W = lower.head<2>();
    const Point& was = before_[side];
    if (now.stands && was.stands && now.toe == was.toe) {
      path_ += (now.p_W - was.p_W).norm();
      ++count_;
    }
    before_[side] = now;
  }
}

}  // namespace mimesis::synthesizer
