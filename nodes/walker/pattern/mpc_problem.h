#pragma once
#include <vector>

#include "common/qp/dual_qp.h"
#include "nodes/walker/pattern/steps.h"

namespace mimesis::walker {

/// Weights of the squares in the MPC's cost, each with ½ [Naveau 2017; docs/walking.md 2.3].
struct MpcWeights {
  double velocity = 5.0, zmp = 1e3, jerk = 1e-8;  ///< α, β, γ
  double foot = 1e-6;                             ///< δ: distance of a landing from the last plan
  double spacing = 2000.0;  ///< σ: distance of a step from the one that belongs to the velocity
  double landing = 1e6;     ///< λ: distance of a landing from the wished one
  double yaw = 1e6;         ///< η: yaw of the feet; nonlinear form only
};

/// Everything that one problem is made from, all in W.
struct MpcInput {
  ComState com;
  double yaw_rad = 0.0;  ///< yaw of the waist
  FeasibleWish wish;
  struct Landing {
    Footprint plan;  ///< last plan; linear form: its yaw is decided, nonlinear: linearised about it
    double wished_yaw_rad = 0.0;           ///< nonlinear form
    std::optional<Eigen::Vector2d> p_W_m;  ///< wished landing
    Eigen::Vector2d step_W_m;              ///< without a wished landing: step from the foot before
  };
  std::array<Landing, 2> foot;                ///< next landing, and the one after it
  std::vector<Eigen::Vector2d> zmp_plan_W_m;  ///< last plan's ZMP at the samples; nonlinear form
};

/// Sides of the convex hull of the rectangles with half sizes `half_m` about two feet, n · z ≤ b,
/// at most 8. Replaces the contents of `sides`; does not allocate if that has room for 8.
void support_polygon(const Footprint& a, const Footprint& b, const Eigen::Vector2d& half_m,
                     std::vector<HalfPlane>& sides);

/// Linear MPC with automatic foot placement [Herdt 2010] and its extension by the yaw of the feet,
/// linearised about the last plan: one Gauss-Newton step per tick [Naveau 2017].
/// Unknowns x = (U, F₁, F₂ in x; U, F₁, F₂ in y; Δθ₁, Δθ₂): jerk U of the CoM over N intervals, two
/// landings F, and in the nonlinear form two yaw increments Δθ of the landings. The first interval
/// ends at the next sample of the step's grid, the others last T = 0.1 s.
/// Rows: 5 + 5 for the landings, 2 for yaws, 2 two-sided ones for each ZMP sample (more where both
/// feet carry). With N = 16: 36 or 38 unknowns, 74 or 78 inequalities. Up to 5 more rows are our
/// own and keep the plan viable: at the end of the horizon the capture point must be where one more
/// step catches it (or no step, when the feet are to stand then). Without them a sequence of wishes
/// can lead to a state from which the robot cannot stop. Equations: docs/walking.md 2.
class MpcProblem {
 public:
  MpcProblem(const GaitSettings& settings, bool yaw_free, const MpcWeights& weights);

  /// Does not allocate. The result refers to this object's memory.
  qp::Problem build(const MpcInput& input, const Steps& steps);

  /// Largest change that the yaw of the next landing may still make.
  double yaw_freedom_rad(const Steps& steps) const;

  int samples() const { return N_; }
  int variables() const { return 2 * axis_ + (yaw_free_ ? 2 : 0); }
  int most_rows() const { return 20 + 8 * N_; }
  /// Parts of a solution x: jerk of interval k [m/s³], landings in W, yaw increments.
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
  /// How velocity v and ZMP z at the samples depend on the jerks U, for a first interval of r
  /// ticks.
  struct Horizon {
    double first_s;           ///< t₁, length of the first interval
    RowMatrix Pv, Pz;         ///< v = v⁰ + Pv U, z = z⁰ + Pz U; N × N
    Eigen::RowVectorXd Pxi;   ///< ξ = ξ⁰ + Pξ U, capture point at the last sample
    Eigen::MatrixXd hessian;  ///< α PvᵀPv + β PzᵀPz + γ I
  };

  /// Capture point ξ = p + r ṗ at the end of the horizon, r = √(h/g). If the ZMP moves evenly from
  /// z there to z' one sample later, then ξ' = E ξ − w z − w' z' [docs/walking.md eq. 2.9].
  struct Capture {
    double root_s, end_s;                                  ///< r; length of the horizon
    double growth, zmp, next_zmp;                          ///< E, w, w'
    Eigen::Vector2d free;                                  ///< ξ⁰: without jerk, from the origin
    Eigen::Vector2d known_foot = Eigen::Vector2d::Zero();  ///< c⁰: decided part of the support
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
  /// s: share of a foot in the middle of the support; 0 standing foot, 1 and 2 landings.
  double part(const Support& support, int foot) const {
    return 0.5 * (support.i == foot) + 0.5 * (support.j == foot);
  }

  GaitSettings settings_;
  MpcWeights weights_;
  Footsteps footsteps_;
  bool yaw_free_;
  int N_, axis_;  // samples; unknowns per axis
  std::vector<Horizon> horizon_;

  Eigen::Vector2d origin_ =
      Eigen::Vector2d::Zero();  // the standing foot: results do not depend on W
  std::array<Footprint, 3> feet_;  // standing foot and F̄₁, F̄₂ of the last plan, from the origin
  std::vector<Support> support_;
  Eigen::MatrixXd free_zmp_;     // N × 2: z⁰
  std::vector<HalfPlane> hull_;  // bounds of the ZMP while both feet stand
  Eigen::Vector2d middle_;       // middle of the feet that stand
  Eigen::RowVectorXd coast_;     // (E Pξ − w Pz) / (E − w): ξ one sample after the horizon
  Eigen::MatrixXd H_;
  Eigen::VectorXd g_, lower_, upper_, x_lower_, x_upper_;
  RowMatrix A_;
  int rows_ = 0;
};

}  // namespace mimesis::walker
