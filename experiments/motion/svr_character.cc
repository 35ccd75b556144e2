#include "experiments/motion/svr_character.h"

#include "common/error.h"
#include "common/math/circle.h"

namespace mimesis::synthesizer {
namespace {

std::vector<AndronovHopf> oscillators(const motion::MotionModel& model) {
  if (model.patterns.empty()) throw ConfigError("motion model \"" + model.name + "\": no pattern");
  const double duration = model.patterns.front().trial.duration_s;
  const double omega = math::kTwoPi / (duration > 0.0 ? duration : 1.0);
  const auto n = static_cast<std::size_t>(1 + model.sources.rows() - model.fixed);
  return std::vector<AndronovHopf>(n, AndronovHopf{omega});
}

}  // namespace

SvrCharacter::SvrCharacter(const motion::MotionModel& model, double coupling_1_s, double dt_s,
                           const SvrSettings& settings)
    : fixed_(model.fixed),
      network_(oscillators(model),
               star(static_cast<int>(1 + model.sources.rows() - model.fixed), coupling_1_s), dt_s),
      maps_(learn_source_maps(model, settings)) {
  set_pattern(model.patterns.front());
}

void SvrCharacter::set_pattern(const motion::Pattern& pattern) {
  MIMESIS_ASSERT(pattern.weight_rad.cols() == static_cast<Eigen::Index>(maps_.size()) &&
                 pattern.weight_rad.rows() == pattern.mean_rad.size() &&
                 pattern.delay_rad.rows() == pattern.mean_rad.size() &&
                 pattern.delay_rad.cols() == pattern.weight_rad.cols());
  pattern_ = pattern;
  angles_.resize(pattern.mean_rad.size());
  synthesize();
}

void SvrCharacter::set_frequency(double omega_rad_s) {
  for (int i = 0; i < network_.size(); ++i) network_.set_frequency(i, omega_rad_s);
}

void SvrCharacter::step() {
  network_.step();
  synthesize();
}

void SvrCharacter::synthesize() {
  const double half = 0.5 * network_.phase(0);
  const Eigen::Vector2d locked(std::cos(half), std::sin(half));
  for (Eigen::Index r = 0; r < angles_.size(); ++r) {
    double sum = pattern_.mean_rad[r];
    for (int k = 0; k < static_cast<int>(maps_.size()); ++k) {
      const double phi = pattern_.delay_rad(r, k);
      const Eigen::Vector2d state =
          k < fixed_ ? locked
                     : delayed(network_.circle(1 + k - fixed_), std::cos(phi), std::sin(phi));
      sum += pattern_.weight_rad(r, k) * maps_[static_cast<std::size_t>(k)](state);
    }
    angles_[r] = sum;
  }
}

}  // namespace mimesis::synthesizer
