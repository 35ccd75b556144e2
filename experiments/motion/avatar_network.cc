#include "experiments/motion/avatar_network.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/math/circle.h"
#include "experiments/motion/styled_walks.h"

namespace mimesis::synthesizer {
namespace {

/// Weakly nonlinear: the limit cycle is a circle within 2 % [M18 3.3.4], and attracts within a few
/// cycles.
std::vector<VanDerPol> oscillators(std::size_t count, double duration_s) {
  const double omega = math::kTwoPi / duration_s;
  return std::vector<VanDerPol>(count, {.nu = 0.4 * omega, .rho = 0.25, .omega_rad_s = omega});
}

}  // namespace

AvatarNetwork::AvatarNetwork(const motion::Pattern& pattern, const std::vector<SourceMap>& maps,
                             double internal_1_s, double phase_rad, double dt_s)
    : pattern_(pattern),
      cos_(pattern.delay_rad.array().cos()),
      sin_(pattern.delay_rad.array().sin()),
      network_(oscillators(maps.size(), pattern.trial.duration_s),
               all_to_all(static_cast<int>(maps.size()), internal_1_s), dt_s),
      maps_(maps) {
  for (int k = 0; k < size(); ++k) network_.set_phase(k, phase_rad);
}

void AvatarNetwork::follow(const AvatarNetwork& leader, double strength_1_s) {
  network_.set_external(0, leader.network_.state(0), strength_1_s);
}

void AvatarNetwork::step() { network_.step(); }

Eigen::VectorXd AvatarNetwork::mix(const Eigen::Matrix2Xd& circle) const {
  Eigen::VectorXd xi = pattern_.mean_rad;
  for (Eigen::Index k = 0; k < circle.cols(); ++k) {
    for (Eigen::Index r = 0; r < xi.size(); ++r) {
      xi[r] += pattern_.weight_rad(r, k) *
               maps_[static_cast<std::size_t>(k)](delayed(circle.col(k), cos_(r, k), sin_(r, k)));
    }
  }
  return xi;
}

Eigen::VectorXd AvatarNetwork::angles() const {
  Eigen::Matrix2Xd circle(2, size());
  for (int k = 0; k < size(); ++k) circle.col(k) = network_.circle(k);
  return mix(circle);
}

Eigen::VectorXd AvatarNetwork::angles_at(double phase_rad) const {
  const Eigen::Vector2d u(std::cos(phase_rad), std::sin(phase_rad));
  return mix(u.replicate(1, size()));
}

namespace {

constexpr int kParts = 4;  // steps of the oscillators in a sample
constexpr double kDt = Transient::kSample_s / kParts;
constexpr double kInStep = 0.1;  // rad

Eigen::MatrixXd own_cycle(const Avatar& avatar) {
  AvatarNetwork alone = avatar.network(0.0, 0.0);
  const motion::Pattern& pattern = avatar.model.patterns.front();
  const auto steps = static_cast<Eigen::Index>(std::ceil(pattern.trial.duration_s / kDt));
  for (Eigen::Index i = 0; i < 5 * steps; ++i) alone.step();  // on its limit cycle
  Eigen::MatrixXd out(pattern.mean_rad.size(), steps);
  for (Eigen::Index i = 0; i < steps; ++i) {
    out.col(i) = alone.angles();
    alone.step();
  }
  return out;
}

double drift(const motion::MotionModel& model, const Eigen::MatrixXd& cycle) {
  GroundedFigure figure(model);
  const auto walk = [&] {
    for (Eigen::Index i = 0; i < cycle.cols(); ++i) figure.step(cycle.col(i), kDt);
    return figure.heading_rad();
  };
  const double from = walk();  // the standing foot is found
  return (walk() - from) / (static_cast<double>(cycle.cols()) * kDt);
}

double rms_about_mean(const Eigen::MatrixXd& x) {
  return (x.colwise() - x.rowwise().mean()).norm() / std::sqrt(static_cast<double>(x.size()));
}

double distance(const Eigen::MatrixXd& cycle, const Eigen::VectorXd& angles) {
  return std::sqrt((cycle.colwise() - angles).colwise().squaredNorm().minCoeff() /
                   static_cast<double>(angles.size()));
}

/// Least swing within any window of one cycle, relative to `steady`.
double least_swing(const std::vector<double>& flexion, double duration_s, double steady) {
  const auto window = static_cast<std::ptrdiff_t>(std::ceil(duration_s / Transient::kSample_s));
  double least = 1.0;
  for (auto at = flexion.begin(); flexion.end() - at >= window; ++at) {
    const auto [low, high] = std::minmax_element(at, at + window);
    least = std::min(least, (*high - *low) / steady);
  }
  return least;
}

Eigen::Index hip_row(const motion::MotionModel& model) {
  const auto found = std::ranges::find(model.rows, "lhip.y");
  if (found == model.rows.end()) throw ConfigError("avatar: the model has no row 'lhip.y'");
  return found - model.rows.begin();
}

/// Phases, artifact and path of this instant.
TransientInstant observe(double time_s, const AvatarNetwork& leader, const AvatarNetwork& follower,
                         double artifact) {
  TransientInstant now{time_s, {}, artifact, Eigen::Vector2d::Zero(), 0.0};
  for (int k = 0; k < follower.size(); ++k) {
    now.phase_rad.push_back(math::wrap_pi(follower.phase(k) - leader.phase(0)));
  }
  return now;
}

void summarise(const motion::MotionModel& model, const std::vector<double>& flexion, double steady,
               Transient& t) {
  for (const TransientInstant& now : t.instants) {
    t.artifact = std::max(t.artifact, now.artifact);
    t.heading_rad = std::max(t.heading_rad, std::abs(now.heading_rad));
    const bool in_step =
        std::ranges::all_of(now.phase_rad, [](double p) { return std::abs(p) < kInStep; });
    if (!in_step) t.synchronised_s = now.time_s + Transient::kSample_s;
  }
  t.least_step = least_swing(flexion, model.patterns.front().trial.duration_s, steady);
}

}  // namespace

Avatar::Avatar(const motion::MotionModel& of)
    : model(of),
      maps(learn_source_maps(of,
                             {.gamma = 5.0, .cost = 100.0, .epsilon = 0.01, .tolerance = 1e-3})) {
  cycle_rad = own_cycle(*this);
  drift_rad_s = drift(model, cycle_rad);
}

AvatarNetwork Avatar::network(double internal_1_s, double phase_rad) const {
  return {model.patterns.front(), maps, internal_1_s, phase_rad, kDt};
}

Transient come_into_step(const Avatar& leads, const Avatar& follows,
                         const TransientSettings& settings) {
  const Eigen::MatrixXd& cycle = follows.cycle_rad;
  const double scale = rms_about_mean(cycle);
  const Eigen::Index hip = hip_row(follows.model);
  AvatarNetwork leader = leads.network(settings.internal_1_s, 0.0);
  AvatarNetwork follower = follows.network(settings.internal_1_s, settings.offset_rad);
  GroundedFigure following(follows.model);
  Transient out;
  std::vector<double> flexion;
  const int samples = static_cast<int>(std::lround(settings.duration_s / Transient::kSample_s));
  for (int s = 0; s < samples; ++s) {
    const Eigen::VectorXd angles = follower.angles();
    following.step(angles, Transient::kSample_s);
    out.instants.push_back(
        observe(s * Transient::kSample_s, leader, follower, distance(cycle, angles) / scale));
    out.instants.back().position_W_m = following.position_W_m();
    out.instants.back().heading_rad =
        following.heading_rad() - follows.drift_rad_s * s * Transient::kSample_s;
    flexion.push_back(angles[hip]);
    for (int i = 0; i < kParts; ++i) {
      follower.follow(leader, settings.external_1_s);
      leader.step();
      follower.step();
    }
  }
  summarise(follows.model, flexion, cycle.row(hip).maxCoeff() - cycle.row(hip).minCoeff(), out);
  return out;
}

}  // namespace mimesis::synthesizer
