#include "nodes/synthesizer/biped/learned_actions.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/math/circle.h"

namespace mimesis::synthesizer {
namespace {

/// Source k at phase φ: the ramp in closed form, periodic ones by a cubic through four samples.
double source(const MotionModel& model, Eigen::Index k, double phase_rad) {
  if (k < model.fixed) return std::cos(0.5 * phase_rad);
  const Eigen::Index n = model.sources.cols();
  const double at = math::wrap_two_pi(phase_rad) / math::kTwoPi * static_cast<double>(n);
  const Eigen::Index i = std::min(static_cast<Eigen::Index>(at), n - 1);
  const double u = at - static_cast<double>(i);
  const auto s = [&](Eigen::Index j) { return model.sources(k, (i + j + n) % n); };
  const double before = s(-1), p = s(0), q = s(1), after = s(2);
  return p + 0.5 * u *
                 (q - before +
                  u * (2.0 * before - 5.0 * p + 4.0 * q - after +
                       u * (3.0 * (p - q) + after - before)));
}

}  // namespace

LearnedActions::LearnedActions(const DrawerData& data, const DrawerModelOptions& options)
    : maps_(learn_drawer_model(data, options)) {}

void LearnedActions::at(const MotionParameters& p, double phase_rad,
                        Eigen::Ref<Eigen::VectorXd> out) const {
  const MotionModel& model = maps_.model().action[0];
  out = p.mean_rad;
  for (Eigen::Index k = 0; k < p.weight_rad.cols(); ++k) {
    for (Eigen::Index r = 0; r < out.size(); ++r) {
      if (p.weight_rad(r, k) == 0.0) continue;
      out[r] += p.weight_rad(r, k) * source(model, k, phase_rad - p.delay_rad(r, k));
    }
  }
}

Eigen::MatrixXd LearnedActions::played(const MotionParameters& parameters) const {
  const Eigen::Index samples = maps_.model().action[0].sources.cols();
  Eigen::MatrixXd rows(row_count(), samples);
  for (Eigen::Index t = 0; t < samples; ++t) {
    at(parameters, math::kTwoPi * static_cast<double>(t) / static_cast<double>(samples),
       rows.col(t));
  }
  return rows;
}

Eigen::MatrixXd LearnedActions::reconstruct(Action action, std::size_t trial) const {
  return played(parameters_of(maps_.model().action[action].patterns.at(trial)));
}

Eigen::MatrixXd LearnedActions::infer(Action action, const ActionTask& task) const {
  return played(maps_.at(action, task));
}

double travel_m(const std::vector<std::string>& names, const Eigen::MatrixXd& rows,
                double duration_s) {
  const auto found = std::ranges::find(names, "pelvis.forward_m_s");
  if (found == names.end()) throw ConfigError("no row 'pelvis.forward_m_s'");
  return duration_s * rows.row(found - names.begin()).mean();
}

}  // namespace mimesis::synthesizer
