#pragma once
#include <Eigen/Core>

namespace mimesis::dmp {

/// Closed path to walk: an ellipse, and how fast its parts are walked.
struct PowerLawPath {
  Eigen::Vector2d center_W_m = Eigen::Vector2d::Zero();
  double long_m = 2.0, short_m = 1.2;  ///< semi-axes, long_m along `heading_rad`
  double heading_rad = 0.0;
  double beta = 1.0 / 3.0;      ///< exponent of v = γ κ^−β; −1/3 to 2/3 in [M18 fig. 4.14]
  double mean_speed_m_s = 0.2;  ///< over a lap of the ellipse; gives γ
  double attraction = 1.0;      ///< α/ω of the oscillator: how fast strays come back [1]
};

/// Velocity field over the plane whose trajectories wind counter-clockwise onto the ellipse and
/// keep the power law all the way [M18 4.5.1]: an Andronov-Hopf oscillator with inverted squared
/// radius, φ' = ω, ρ' = α(1 − ρ) [M18 eq. 4.50], morphed onto the ellipse by an affine map; its
/// speed is set to γ κ^−β, κ being the curvature of the trajectory through the point. The direction
/// is that of the oscillator, so its radial contraction [M18 eq. 4.53] stays. For β = 1/3 the law
/// is equi-affine: the field of the ellipse is then the image of that of the circle of equal area.
class PowerLawField {
 public:
  /// @throws ConfigError for axes, speed or attraction that are not positive, and for an exponent
  ///         beyond ±1
  explicit PowerLawField(const PowerLawPath& path);

  /// [m/s] in W. Where the trajectory is not curved to the left (far outside, and next to the
  /// centre), the speed is that of the nearest curvature of the ellipse. Zero at the centre itself.
  Eigen::Vector2d velocity(const Eigen::Vector2d& p_W_m) const;
  /// Curvature of the trajectory through `p_W_m` [1/m], + to the left.
  double curvature(const Eigen::Vector2d& p_W_m) const;
  /// Point of the ellipse at the angle φ of the oscillator.
  Eigen::Vector2d on_path(double phi_rad) const;

  double gain() const { return gain_; }          ///< γ, [m^(1−β)/s]
  double lap_s() const { return lap_s_; }        ///< time of one lap on the ellipse
  double length_m() const { return length_m_; }  ///< circumference of the ellipse

 private:
  struct Flow {
    /// derivatives of the trajectory, in the oscillator's time, W
    Eigen::Vector2d rate, acceleration;
  };
  Flow flow(const Eigen::Vector2d& p_W_m) const;

  PowerLawPath path_;
  Eigen::Matrix2d map_, inverse_;  ///< unit circle to ellipse and back
  double gain_ = 1.0, lap_s_ = 0.0, length_m_ = 0.0;
  /// bounds of the ellipse's curvature [1/m]
  double least_curvature_ = 0.0, most_curvature_ = 0.0;
};

}  // namespace mimesis::dmp
