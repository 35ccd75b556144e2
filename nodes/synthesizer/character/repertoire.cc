#include "nodes/synthesizer/character/repertoire.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/error.h"
#include "common/math/circle.h"
#include "nodes/synthesizer/character/courses.h"
#include "nodes/synthesizer/character/delay_ambiguity.h"
#include "nodes/synthesizer/dynamics/character_batch.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kTurning = 0.2;            // rad a cycle: a pattern that turns by more is a turn
constexpr double kMinSimilarity = 0.95;     // similarity of sources, see remove_delay_ambiguities
constexpr double kBentKnee = 0.2;           // rad: straight legs leave the foot lock no room
constexpr double kMeasureDt = 1.0 / 120.0;  // s

/// Angle of a row that carries the body while it stands; nothing for other rows.
std::optional<double> carrying(const std::string& row) {
  for (const int joint : {mocap::kRoot, mocap::kLeftHip, mocap::kLeftKnee, mocap::kLeftAnkle,
                          mocap::kRightHip, mocap::kRightKnee, mocap::kRightAnkle}) {
    const bool knee = joint == mocap::kLeftKnee || joint == mocap::kRightKnee;
    const double bend = joint == mocap::kRoot ? 0.0 : knee ? kBentKnee : -0.5 * kBentKnee;
    for (int axis = 0; axis < 3; ++axis) {
      if (row == mocap::body_row_name(3 * joint + axis)) return axis == 1 ? bend : 0.0;
    }
  }
  return {};
}

MotionParameters standing(const motion::MotionModel& model, const MotionParameters& walk) {
  MotionParameters still = walk;
  still.weight_rad.setZero();
  for (std::size_t r = 0; r < model.rows.size(); ++r) {
    const auto angle = carrying(model.rows[r]);
    if (angle) still.mean_rad[static_cast<Eigen::Index>(r)] = *angle;
  }
  return still;
}

enum class Turn { none, left, right };

Turn turn_of(const motion::Pattern& pattern) {
  if (std::abs(pattern.trial.turn_rad) <= kTurning) return Turn::none;
  return pattern.trial.turn_rad > 0.0 ? Turn::left : Turn::right;
}

}  // namespace

Repertoire::Repertoire(const motion::MotionModel& model) : model_(model) {
  if (model.patterns.empty()) throw ConfigError(model.name + ": the model has no pattern");
  std::vector<MotionParameters> parts;
  for (const motion::Pattern& pattern : model.patterns) parts.push_back(parameters_of(pattern));
  if (!model.tied) remove_delay_ambiguities(model.sources, model.fixed, parts, kMinSimilarity);

  model_.patterns.clear();
  model_.tied = true;
  for (const motion::Pattern& pattern : model.patterns) {
    if (find(pattern.trial.style) < 0) styles_.push_back({.name = pattern.trial.style});
  }
  for (StyleMotions& style : styles_) {
    for (const Turn turn : {Turn::none, Turn::left, Turn::right}) {
      std::vector<MotionParameters> same;
      for (std::size_t p = 0; p < parts.size(); ++p) {
        const motion::Pattern& pattern = model.patterns[p];
        if (pattern.trial.style == style.name && turn_of(pattern) == turn) same.push_back(parts[p]);
      }
      if (same.empty()) continue;
      MotionParameters mean = same.front();
      blend(same, std::vector<double>(same.size(), 1.0 / static_cast<double>(same.size())), mean);
      const int m = add(mean, style.name);
      (turn == Turn::none ? style.straight : turn == Turn::left ? style.left : style.right) = m;
    }
    if (style.straight < 0) style.straight = style.left >= 0 ? style.left : style.right;
    style.standing = add(standing(model, motion(style.straight).parameters), style.name);
  }
  measure();
}

int Repertoire::add(const MotionParameters& parameters, const std::string& style) {
  motion::Pattern pattern;
  pattern.trial.style = style;
  pattern.trial.duration_s = math::kTwoPi / parameters.frequency_rad_s;
  pattern.mean_rad = parameters.mean_rad;
  pattern.weight_rad = parameters.weight_rad;
  pattern.delay_rad = parameters.delay_rad;
  model_.patterns.push_back(pattern);
  const auto same = std::ranges::find_if(motions_, [&](const RepertoireMotion& other) {
    return other.parameters.delay_rad == parameters.delay_rad;
  });
  const int delays = same == motions_.end() ? static_cast<int>(motions_.size()) : same->delays;
  motions_.push_back({parameters, delays});
  return static_cast<int>(motions_.size()) - 1;
}

void Repertoire::measure() {
  CharacterBatch batch(model_, 1, {.dt_s = kMeasureDt});
  for (std::size_t m = 0; m < motions_.size(); ++m) {
    RepertoireMotion& motion = motions_[m];
    const double omega = motion.parameters.frequency_rad_s;
    const int steps = static_cast<int>(std::ceil(math::kTwoPi / (omega * kMeasureDt)));
    batch.set_pattern(0, static_cast<int>(m));
    batch.set_frequency(0, omega);
    batch.set_phase(0, 0.0);
    for (int k = 0; k < steps; ++k) batch.step();  // the standing foot is found
    const RootPose from = batch.root(0);
    for (int k = 0; k < steps; ++k) batch.step();
    const RootPose to = batch.root(0);
    const double cycles = steps * kMeasureDt * omega / math::kTwoPi;
    motion.turn_rad = (to.heading_rad - from.heading_rad) / cycles;
    motion.step_length_m = 0.5 * (to.position_W_m - from.position_W_m).norm() / cycles;
  }
  for (StyleMotions& style : styles_) style.closing_share = measure_closing(style);
}

/// Walks a cycle, stops at its end, and measures from there.
double Repertoire::measure_closing(const StyleMotions& style) const {
  CharacterBatch batch(model_, 1, {.dt_s = kMeasureDt});
  const RepertoireMotion& walk = motion(style.straight);
  if (walk.step_length_m < 1e-3) return 0.5;
  batch.set_pattern(0, style.straight);
  batch.set_frequency(0, walk.parameters.frequency_rad_s);
  StepCourse course(true);
  const auto standing = static_cast<std::size_t>(style.standing);
  std::vector<double> beta(motions_.size());
  Eigen::Vector2d from = Eigen::Vector2d::Zero();
  for (int lands = 0; !course.standing(); batch.step()) {
    if (course.advance(batch.phase(0), lands < 2) != Strike::none) ++lands;
    if (course.stage() == StepCourse::Stage::walking) from = batch.root(0).position_W_m;
    const double g = course.share();
    std::ranges::fill(beta, 0.0);
    beta[static_cast<std::size_t>(style.straight)] += g;
    beta[standing] += 1.0 - g;
    batch.set_blend(0, beta);
  }
  return (batch.root(0).position_W_m - from).norm() / walk.step_length_m;
}

bool Repertoire::same_delays(std::span<const double> beta) const {
  int delays = -1;
  for (std::size_t m = 0; m < beta.size(); ++m) {
    if (beta[m] == 0.0) continue;
    if (delays >= 0 && motions_[m].delays != delays) return false;
    delays = motions_[m].delays;
  }
  return true;
}

int Repertoire::find(const std::string& style) const {
  const auto found = std::ranges::find(styles_, style, &StyleMotions::name);
  return found == styles_.end() ? -1 : static_cast<int>(found - styles_.begin());
}

std::string Repertoire::known() const {
  std::string names;
  for (const StyleMotions& style : styles_) {
    names += (names.empty() ? "" : ", ") + (style.name.empty() ? "''" : style.name);
  }
  return names;
}

}  // namespace mimesis::synthesizer
