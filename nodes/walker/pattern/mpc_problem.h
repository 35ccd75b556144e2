#pragma once
#include <vector>

#include "common/qp/dual_qp.h"
#include "nodes/walker/pattern/footsteps.h"
#include "nodes/walker/pattern/steps.h"

namespace mimesis::walker {

/// Weights of the MPC's squares, each with ½ [Naveau 2017; walking.md 1.3, 8.6.0].
struct MpcWeights {
  double velocity = 5.0, zmp = 1e3, jerk = 1e-8, foot = 1e-6;
  double spacing = 2000.0;  ///< step from foot to foot as the velocity wants it
  double landing = 1e6;     ///< wished landing
  double yaw = 1e6;         ///< of the feet; nonlinear form only
};

/// What one problem is made from, all in W.
struct MpcInput {
  ComState com;
  double yaw_rad = 0.0;  ///< of the waist
  FeasibleWish wish;
  struct Foot {
    Footprint plan;                        ///< last plan; its yaw is decided, or linearised about
    double wished_yaw_rad = 0.0;           ///< nonlinear form
    std::optional<Eigen::Vector2d> p_W_m;  ///< wished landing
    Eigen::Vector2d step_W_m;              ///< else: from the foot before
  };
  std::array<Foot, 2> foot;                   ///< next landing, and the one after it
  std::vector<Eigen::Vector2d> zmp_plan_W_m;  ///< of the last plan at the samples; nonlinear form
};

/// Linear MPC with automatic foot placement [Herdt 2010] and its extension by the yaw of the feet,
/// linearised about the last plan: one step of Gauss and Newton [Naveau 2017].
/// Unknowns: jerk of the CoM over N intervals, two landings, per axis; yaw increments of the
/// landings. The first interval ends at the next sample of the step's grid, the others last 0.1 s.
/// Rows: 5 + 5 for the landings, 2 for yaws, two-sided 2 for each ZMP sample (more where both feet
/// carry). For N = 16: 36 or 38 unknowns, 74 or 78 inequalities. 5 more, ours, keep the plan
/// viable: at the end of the horizon the capture point is where one more step catches it (or none,
/// when the feet are to stand then). Without them wishes can lead where the robot cannot stop.
class MpcProblem {
 public:
  MpcProblem(const GaitSettings& settings, bool yaw_free, const MpcWeights& weights);

  /// Does not allocate. The result refers to this object's memory.
  qp::Problem build(const MpcInput& input, const Steps& steps);

  /// By how much the yaw of the next landing may still change.
  double yaw_freedom_rad(const Steps& steps) const;

  int samples() const { return N_; }
  int variables() const { return 2 * axis_ + (yaw_free_ ? 2 : 0); }
  int most_rows() const { return 20 + 8 * N_; }
  /// Of a solution x: jerk of interval k [m/s³], landings in W, yaw increments.
  Eigen::Vector2d jerk(const Eigen::Ref<const Eigen::VectorXd>& x, int k) const {
    return {x(k), x(axis_ + k)};
  }
  Eigen::Vector2d landing_W_m(const Eigen::Ref<const Eigen::VectorXd>& x, int i) const {
    return origin_ + Eigen::Vector2d(x(N_ + i), x(axis_ + N_ + i));
  }
  double yaw_increment_rad(const Eigen::Ref<const Eigen::VectorXd>& x, int i) const {
    return yaw_free_ ? x(2 * axis_ + i) : 0.0;
  }

 private:
  using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  /// Dependence of the samples' velocity and ZMP on the jerks, for a first interval of r ticks.
  struct Horizon {
    double first_s;
    RowMatrix velocity, zmp;
    Eigen::RowVectorXd capture;  // of the capture point ξ = p + ṗ √(h/g) at the last sample
    Eigen::MatrixXd hessian;     // αPvᵀPv + βPzᵀPz + γI
  };

  /// Capture point ξ at the end of the horizon. If the ZMP moves evenly from z there to z' a sample
  /// later, then ξ' = growth · ξ − zmp · z − next_zmp · z'.
  struct Capture {
    double root_s, end_s;  // √(h/g); of the horizon
    double growth, zmp, next_zmp;
    Eigen::Vector2d free;                                  // ξ without jerk, from the origin
    Eigen::Vector2d known_foot = Eigen::Vector2d::Zero();  // part of the support that is decided
  };

  void set_cost(const MpcInput& in, const Horizon& h);
  void set_feet_cost(const MpcInput& in);
  void set_limits_of_landings(const Steps& steps);
  void set_limits_of_zmp(const MpcInput& in, const Horizon& h);
  void set_limits_of_capture(const MpcInput& in, const Horizon& h, const Steps& steps);
  Capture capture_at_end(const MpcInput& in, const Horizon& h);
  void limit_next_capture(const Capture& c, const Eigen::Vector2d& n, double edge, double most);
  void set_limits_of_next_step(const Horizon& h, const Capture& c, const Steps& steps);
  void set_row(const Eigen::Ref<const Eigen::RowVectorXd>& of_jerk, const Support& support,
               const Eigen::Vector2d& n);
  void set_zmp_row(const Horizon& h, int k, const Eigen::Vector2d& n, double yaw_slope);
  double part(const Support& support, int foot) const {
    return 0.5 * (support.i == foot) + 0.5 * (support.j == foot);
  }

  GaitSettings settings_;
  MpcWeights weights_;
  Footsteps footsteps_;
  bool yaw_free_;
  int N_, axis_;  // samples; unknowns of an axis
  std::vector<Horizon> horizon_;

  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();  // near the robot, so that W's is far or near
  std::array<Footprint, 3> feet_;                     // as linearised about, from the origin
  std::vector<Support> support_;
  Eigen::MatrixXd free_zmp_;     // N × 2, without jerk
  std::vector<HalfPlane> hull_;  // of both feet that stand
  Eigen::Vector2d middle_;
  Eigen::RowVectorXd coast_;  // ξ a sample after the horizon, of the jerks, over growth − zmp
  Eigen::MatrixXd H_;
  Eigen::VectorXd g_, lower_, upper_, x_lower_, x_upper_;
  RowMatrix A_;
  int rows_ = 0;
};

}  // namespace mimesis::walker
