#pragma once
#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>

#include "nodes/planner/collision.h"
#include "nodes/planner/smooth_path.h"

namespace mimesis::planner {

/// A motion sampled at a fixed period; first and last sample at rest.
struct JointTrajectory {
  double period_s = 0.005;
  Eigen::MatrixXd position;  ///< n × samples [rad]
  Eigen::MatrixXd velocity;  ///< n × samples [rad/s]

  Eigen::Index samples() const { return position.cols(); }
  double duration_s() const { return period_s * static_cast<double>(samples() - 1); }
};

/// Tells whether these stops are free.
using Stoppable = std::function<bool(const Stops&)>;

/// Fastest motion along q(s) with |q̇ⱼ| ≤ vⱼ and |q̈ⱼ| ≤ aⱼ, at rest at every stop of the path, slow
/// enough to be stopped everywhere.
///
/// With x = ṡ² and u = s̈ the limits are linear: |q'ⱼ u + q''ⱼ x| ≤ aⱼ, x ≤ (vⱼ/q'ⱼ)², and x' = x +
/// 2 u Δs from one grid point to the next (u constant between). Backwards from the end: the largest
/// x from which the rest can be driven; then forwards: the largest u that stays below it.
/// (Reachability analysis on the phase plane, Pham & Pham 2018.) Where `stoppable` refuses the
/// speed, x is lowered until it agrees; it is told where the motion was `alone_s` before (0: not).
/// Of a line it is asked for up to `most_pieces` of the grid at once, and where it refuses, piece
/// by piece. The duration is then stretched to a whole number of periods. O(grid points × n ×
/// bisections). Empty if not even a slow motion can be stopped, or if it is interrupted.
///
/// With limits of the jerk, s(t) is then averaged over a window T = max aⱼ/jⱼ: what stays below a
/// then changes by at most 2a/T, and by a/T = j where s̈ keeps its sign or is 0 for T in between. So
/// speeds are capped around every sample whose differences are beyond a limit, and the motion is
/// made again, until none is; what little is left stretches the time. a is then lowered as long as
/// that makes the motion shorter: short ones do not reach it. On a straight line this is the
/// profile of seven segments [docs/planner.md#jerk].
std::optional<JointTrajectory> time_optimal(const SmoothPath& path,
                                            const Eigen::VectorXd& v_max_rad_s,
                                            const Eigen::VectorXd& a_max_rad_s2, double period_s,
                                            const Stoppable& stoppable, double alone_s = 0.0,
                                            const Eigen::VectorXd& j_max_rad_s3 = {},
                                            const Interrupt& interrupt = {},
                                            std::size_t most_pieces = 1);
/// The same without stops.
JointTrajectory time_optimal(const SmoothPath& path, const Eigen::VectorXd& v_max_rad_s,
                             const Eigen::VectorXd& a_max_rad_s2, double period_s,
                             const Eigen::VectorXd& j_max_rad_s3 = {});

/// Plays a trajectory q(σ(t)), period by period; brakes and goes on without leaving the path.
class Playback {
 public:
  /// @param a_max_rad_s2  accelerations within which the pace σ̇ changes, n [rad/s²]
  explicit Playback(Eigen::VectorXd a_max_rad_s2) : a_max_(std::move(a_max_rad_s2)) {}

  void start(JointTrajectory trajectory);
  /// The pace falls or rises to `pace` from now on: 1 as planned, 0 at rest.
  void aim_at(double pace) { wanted_ = pace; }
  /// Advances by one period.
  void advance();
  bool ended() const { return at_ >= trajectory_->duration_s(); }
  /// At the end, or braked to rest.
  bool at_rest() const { return ended() || (wanted_ <= 0.0 && pace_ <= 0.0); }
  /// The positions of the next periods, up to rest: n × at most `periods` [rad].
  Eigen::MatrixXd ahead(Eigen::Index periods) const;

  double place_s() const { return at_; }  ///< σ
  Eigen::VectorXd position() const;       ///< [rad]
  Eigen::VectorXd velocity() const;       ///< [rad/s]

 private:
  /// Sample before `at_` and the part of a period since then.
  std::pair<Eigen::Index, double> sample() const;

  Eigen::VectorXd a_max_;
  std::shared_ptr<const JointTrajectory> trajectory_ = std::make_shared<JointTrajectory>();
  double at_ = 0.0;    // σ [s]
  double pace_ = 0.0;  // σ̇ [1]
  double wanted_ = 1.0;
};

}  // namespace mimesis::planner
