#include "experiments/dmp/power_law.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "common/error.h"

namespace mimesis::dmp {
namespace {

/// An even number of points on the ellipse: sums over them are exact integrals of its smooth
/// periodic functions.
constexpr int kPoints = 4096;

void check(bool good, const char* what, double value, const char* expected) {
  if (good) return;
  throw ConfigError(std::string("power-law path: ") + what + " " + std::to_string(value) +
                    ", expected " + expected);
}

}  // namespace

PowerLawField::PowerLawField(const PowerLawPath& path) : path_(path) {
  check(path.short_m > 0.0, "short axis", path.short_m, "above 0 m");
  check(path.long_m >= path.short_m && std::isfinite(path.long_m), "long axis", path.long_m,
        "the short one at least");
  check(path.mean_speed_m_s > 0.0, "mean speed", path.mean_speed_m_s, "above 0 m/s");
  check(path.attraction > 0.0, "attraction", path.attraction, "above 0");
  check(std::abs(path.beta) <= 1.0, "exponent", path.beta, "-1 to 1");
  map_ = Eigen::Rotation2Dd(path.heading_rad).toRotationMatrix() *
         Eigen::Vector2d(path.long_m, path.short_m).asDiagonal();
  inverse_ = map_.inverse();
  least_curvature_ = path.short_m / (path.long_m * path.long_m);
  most_curvature_ = path.long_m / (path.short_m * path.short_m);

  // A lap takes ∮ ds/v = ∮ κ^β ds / γ
  double weighted_m = 0.0;
  for (int i = 0; i < kPoints; ++i) {
    const Eigen::Vector2d p = on_path(2.0 * std::numbers::pi * i / kPoints);
    const double ds = flow(p).rate.norm() * 2.0 * std::numbers::pi / kPoints;
    length_m_ += ds;
    weighted_m += ds * std::pow(curvature(p), path.beta);
  }
  lap_s_ = length_m_ / path.mean_speed_m_s;
  gain_ = weighted_m / lap_s_;
}

Eigen::Vector2d PowerLawField::on_path(double phi_rad) const {
  return path_.center_W_m + map_ * Eigen::Vector2d(std::cos(phi_rad), std::sin(phi_rad));
}

PowerLawField::Flow PowerLawField::flow(const Eigen::Vector2d& p_W_m) const {
  // ρ = 1/r² and ω = 1 give r' = α r (1 − r²)/2, so x' = J x + α/2 (1 − r²) x
  const Eigen::Vector2d x = inverse_ * (p_W_m - path_.center_W_m);
  const double r2 = x.squaredNorm(), pull = 0.5 * path_.attraction * (1.0 - r2);
  const Eigen::Matrix2d J = (Eigen::Matrix2d() << 0.0, -1.0, 1.0, 0.0).finished();
  const Eigen::Vector2d rate = J * x + pull * x;
  const double pull_rate = -path_.attraction * x.dot(rate);
  return {map_ * rate, map_ * (J * rate + pull * rate + pull_rate * x)};
}

double PowerLawField::curvature(const Eigen::Vector2d& p_W_m) const {
  const Flow f = flow(p_W_m);
  const double speed = f.rate.norm();
  if (speed == 0.0) return 0.0;
  return (f.rate.x() * f.acceleration.y() - f.rate.y() * f.acceleration.x()) /
         (speed * speed * speed);
}

Eigen::Vector2d PowerLawField::velocity(const Eigen::Vector2d& p_W_m) const {
  const Eigen::Vector2d rate = flow(p_W_m).rate;
  const double speed = rate.norm();
  if (!(speed > 0.0)) return Eigen::Vector2d::Zero();
  // Near the ellipse all trajectories are curved; elsewhere a robot must not race or stop
  const double kappa = std::clamp(curvature(p_W_m), 0.5 * least_curvature_, 2.0 * most_curvature_);
  return gain_ * std::pow(kappa, -path_.beta) / speed * rate;
}

}  // namespace mimesis::dmp
