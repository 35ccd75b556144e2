#include "experiments/motion/styled_walks.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <stdexcept>

#include "common/error.h"
#include "common/math/circle.h"
#include "common/motion/demix/sisa.h"
#include "common/motion/mocap/body_map.h"
#include "common/motion/mocap/clip_file.h"
#include "common/motion/mocap/cycles.h"
#include "common/motion/model/motion_model.h"
#include "common/shared_data.h"
#include "experiments/motion/rotation_branches.h"

namespace mimesis::synthesizer {
namespace {

std::string folder() { return shared_data("data/mocap/").string(); }

}  // namespace

std::string absent_clip(const std::vector<std::string>& clips) {
  for (const std::string& clip : clips) {
    if (!std::filesystem::exists(folder() + clip)) return folder() + clip;
  }
  return "";
}

RecordedWalks recorded_walks(const std::vector<std::string>& clips) {
  RecordedWalks out;
  std::vector<mocap::Trials> sets;
  for (const std::string& name : clips) {
    const mocap::BodyClip clip = mocap::to_body(mocap::read_clip(folder() + name));
    if (sets.empty()) out.body = clip.body;
    auto cycles = mocap::cut_cycles(clip);
    if (!cycles) throw std::runtime_error(name + ": " + cycles.error().reason);
    sets.push_back(std::move(*cycles));
  }
  out.trials = mocap::merge(sets);
  return out;
}

reproduce::Report report_absent(const std::string& clip) {
  reproduce::Report report;
  report.rows = {reproduce::holds("the recordings are there", false, reproduce::goal(),
                                  clip + " is absent; MIMESIS_SHARED names the folder")};
  return report;
}

namespace {

/// By row of the model the body's row.
std::vector<int> body_rows(const motion::MotionModel& model) {
  std::vector<int> out;
  for (const std::string& row : model.rows) {
    int at = 0;
    while (at < mocap::kBodyRows && mocap::body_row_name(at) != row) ++at;
    if (at == mocap::kBodyRows) {
      throw ConfigError("row '" + row + "' is none of a body, expected one as lhip.x");
    }
    out.push_back(at);
  }
  return out;
}

}  // namespace

GroundedFigure::GroundedFigure(const motion::MotionModel& model)
    : body_(model.body), body_row_(body_rows(model)) {
  angles_.setZero();
}

void GroundedFigure::step(const Eigen::VectorXd& angles_rad, double /*dt_s*/) {
  for (std::size_t r = 0; r < body_row_.size(); ++r) {
    angles_[body_row_[r]] = angles_rad[static_cast<Eigen::Index>(r)];
  }
  const mocap::BodyPose pose = mocap::forward_kinematics(
      body_, std::span<const double, mocap::kBodyRows>(angles_.data(), mocap::kBodyRows),
      Eigen::Vector3d::Zero());
  Eigen::Matrix<double, 3, 4> now;
  for (const std::size_t side : {0U, 1U}) {
    const int ankle = side == mocap::kLeft ? mocap::kLeftAnkle : mocap::kRightAnkle;
    now.col(2 * static_cast<int>(side)) = pose.point(ankle, body_.heel_m[side]);
    now.col(2 * static_cast<int>(side) + 1) = pose.point(ankle, body_.toe_m[side]);
  }
  const double left = now.row(2).head(2).minCoeff(), right = now.row(2).tail(2).minCoeff();
  if (std::abs(left - right) > 0.005) support_ = left < right ? mocap::kLeft : mocap::kRight;
  if (feet_) {
    const int heel = 2 * support_;
    const Eigen::Vector2d a = feet_->col(heel + 1) - feet_->col(heel),
                          b = (now.col(heel + 1) - now.col(heel)).head<2>();
    const double turn = std::atan2(b.x() * a.y() - b.y() * a.x(), a.dot(b));
    const int lower = now(2, heel) < now(2, heel + 1) ? heel : heel + 1;
    const Eigen::Vector2d moved =
        feet_->col(lower) - Eigen::Rotation2Dd(turn) * now.col(lower).head<2>();
    position_ += Eigen::Rotation2Dd(heading_) * moved;
    heading_ += turn;
  }
  feet_ = now.topRows<2>();
}

namespace {

constexpr double kFirst = 0.04, kLast = 0.55;  // part of the cycle in which a foot stands

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

mocap::Trials styled_cycles(const RecordedWalks& walks) {
  mocap::Trials trials = without_straight_ends(walks.trials);
  align_rotation_branches(trials);
  return trials;
}

motion::MotionModel styled_walks(const RecordedWalks& walks, int sources) {
  const mocap::Trials trials = styled_cycles(walks);
  demix::SisaOptions options;
  options.sources = sources;
  options.tied = true;
  const demix::SisaResult result = demix::sisa(trials, options);
  return motion::average_styles(motion::make_model(trials, result.mixture, true, walks.body));
}

int pattern_of(const motion::MotionModel& model, const std::string& style) {
  for (std::size_t p = 0; p < model.patterns.size(); ++p) {
    if (model.patterns[p].trial.style == style) return static_cast<int>(p);
  }
  throw ConfigError("the model has no style '" + style + "'");
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
