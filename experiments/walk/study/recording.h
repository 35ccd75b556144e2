#pragma once
#include <optional>

#include "experiments/walk/study/script.h"

namespace mimesis::walk {

/// What a walker makes of a script, tick by tick.
struct Recording {
  struct Tick {
    int number = -1;     ///< of the action, see Script
    double phase = 0.0;  ///< share of it
    Eigen::VectorXd q;   ///< set-points of all joints
    Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
    walker::PatternSample plan;
  };
  std::vector<Tick> ticks;
  int clipped = 0, failed = 0, limited = 0;  ///< ticks
  std::string trouble;                       ///< first one

  /// First tick of an action, if it comes.
  std::optional<std::size_t> begin(int number) const;
};

/// The walk that pattern generator, filter and stack make of it, without physics and without
/// feedback of balance: what is dynamically feasible of the script's kinematics [M18 3.8.3].
Recording record(const ScriptRobot& robot, Script script);

/// One action of it: `rows` × samples at even phases, linear between ticks. `row`: of a tick.
template <class Row>
Eigen::MatrixXd resample(const Recording& recording, int number, int samples, const Row& row) {
  Eigen::MatrixXd out;
  std::size_t i = recording.begin(number).value();
  for (int k = 0; k < samples; ++k) {
    const double phase = static_cast<double>(k) / samples;
    const auto& t = recording.ticks;
    while (i + 1 < t.size() && t[i + 1].number == number && t[i + 1].phase <= phase) ++i;
    const bool last = i + 1 >= t.size();
    const double next = last || t[i + 1].number != number ? 1.0 : t[i + 1].phase;
    const double u = next > t[i].phase ? (phase - t[i].phase) / (next - t[i].phase) : 0.0;
    const Eigen::VectorXd here = row(t[i]);
    if (k == 0) out.resize(here.size(), samples);
    out.col(k) = last ? here : here + std::clamp(u, 0.0, 1.0) * (row(t[i + 1]) - here).eval();
  }
  return out;
}

/// Training data that a pattern generator has made feasible: the trials of `data` in the same
/// order, with recorded rows.
struct FeasibleData {
  /// Rows as those of `data`: upper-body joints, then kVelocityRows without the sway of a step,
  /// with the travel of the feet.
  synthesizer::DrawerData upper_body;
  synthesizer::DrawerData joints;  ///< angles of all joints
  std::vector<Recording> recordings;
};
FeasibleData make_feasible(const ScriptRobot& robot, const synthesizer::DrawerData& data);

}  // namespace mimesis::walk
