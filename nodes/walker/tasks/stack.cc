#include "nodes/walker/tasks/stack.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/math/so3.h"
#include "nodes/walker/tasks/limits.h"
#include "nodes/walker/tasks/task_rows.h"

namespace mimesis::walker {
namespace {

// Newton steps within a tick, all with the Jacobian of its beginning. The first makes the tick's
// displacement, the others remove the error that its curvature has left.
constexpr int kPasses = 4;
// Limits on the passes in which bounds are active: for lower levels, while the legs are too short,
// for the first level.
constexpr int kBoundedPasses = 3, kLimitedPasses = 2, kKeptPasses = 1;
constexpr double kExact = 1e-9;     // [m], [rad]: error that needs no further pass
constexpr double kLimited = 1e-6;   // [m], [rad]: error of the first level that counts as limited
constexpr std::size_t kLine = 200;  // characters of a reason

}  // namespace

struct Stack::Parts {
  Parts(const robot::Biped& of, const StackSettings& settings)
      : biped(of),
        limits(of, settings),
        rows(of, make_tasks(of, settings)),
        cascade(6 + of.tree.dof(), rows.most_rows(), rows.levels(), settings.damping),
        posture(of.tree),
        start(of.tree.dof()),
        b(rows.most_rows()),
        out_of_reach(rows.most_rows()),
        lower(6 + of.tree.dof()),
        upper(6 + of.tree.dof()),
        x(6 + of.tree.dof()),
        sum(6 + of.tree.dof()) {}

  const robot::Biped& biped;
  Limits limits;
  TaskRows rows;
  Cascade cascade;
  Posture posture;
  Eigen::Isometry3d X_start = Eigen::Isometry3d::Identity();
  Eigen::VectorXd start, b, out_of_reach, lower, upper, x, sum;
  bool kept = false;  ///< in the last tick a bound kept the first level from its aim
};

Stack::Stack(const robot::Biped& biped, const StackSettings& settings)
    : parts_(std::make_unique<Parts>(biped, settings)) {
  state_.reason.reserve(kLine);
  state_.q.resize(biped.tree.dof());
  state_.dq.resize(biped.tree.dof());
  reset(biped.X_WB_half_sitting, biped.half_sitting);
}

Stack::~Stack() = default;

void Stack::reset(const Eigen::Isometry3d& X_WB, const Eigen::Ref<const Eigen::VectorXd>& q) {
  MIMESIS_ASSERT(q.size() == state_.q.size());
  Parts& p = *parts_;
  state_.X_WB = p.posture.X_WB = X_WB;
  state_.q = p.posture.q = q;
  state_.dq.setZero();
  state_.com_error_m = state_.foot_error_m = 0.0;
  state_.limited = false;
  state_.reason.clear();
  p.posture.update();
  p.rows.forget();
  p.kept = false;
  p.cascade.forget_residuals();
}

const StackState& Stack::step(const TaskGoals& goals, double dt_s) {
  Parts& p = *parts_;
  const char* reason = fault(goals, dt_s);
  if (reason == nullptr && move(goals, dt_s)) {
    state_.reason.clear();
    state_.dq = (p.posture.q - state_.q) / dt_s;
    state_.q = p.posture.q;
    state_.X_WB = p.posture.X_WB;
  } else {
    if (reason == nullptr) reason = qp::name(p.cascade.outcome());
    state_.reason = "stack of tasks: ";
    state_.reason += reason;
    state_.dq.setZero();
    state_.limited = false;
    p.posture.q = state_.q;
    p.posture.X_WB = state_.X_WB;
    p.posture.update();
    p.rows.forget();
  }
  measure(goals);
  return state_;
}

const char* Stack::fault(const TaskGoals& goals, double dt_s) const {
  if (!(dt_s > 0.0 && dt_s <= 0.1)) return "dt is no time between 0 and 0.1 s";
  if (!goals.com_W_m.allFinite() || !goals.com_v_W.allFinite())
    return "the CoM's goal is no number";
  for (const FootState& foot : goals.foot) {
    if (!foot.X_WS.matrix().allFinite() || !foot.v_W.allFinite() ||
        !std::isfinite(foot.yaw_rate_rad_s)) {
      return "a foot's goal is no number";
    }
  }
  if (!goals.R_W_trunk.allFinite()) return "the trunk's goal is no number";
  const auto joints = static_cast<Eigen::Index>(parts_->biped.upper_body.size());
  if (goals.upper_body.size() != joints) return "the upper body's goal is of another size";
  if (goals.upper_body_rate.size() != 0 && goals.upper_body_rate.size() != joints) {
    return "the upper body's rate is of another size";
  }
  if (!goals.upper_body.allFinite() || !goals.upper_body_rate.allFinite()) {
    return "the upper body's goal is no number";
  }
  for (const TaskGoals::Hand& hand : goals.hand) {
    if (!hand.p_W_m.allFinite() || !std::isfinite(hand.share)) return "a hand's goal is no number";
  }
  return nullptr;
}

bool Stack::move(const TaskGoals& goals, double dt_s) {
  Parts& p = *parts_;
  p.limits.bounds(p.posture.q, dt_s, p.lower, p.upper);
  p.rows.aim(p.posture, goals, dt_s, p.lower, p.upper);
  p.rows.fill(p.posture, p.cascade);
  if (p.kept) ease(dt_s);
  p.start = p.posture.q;
  p.X_start = p.posture.X_WB;
  p.sum.setZero();
  const int rows = p.cascade.rows(), first = p.rows.first_level_rows();
  auto b = p.b.head(rows);
  p.rows.missing(p.posture, b);
  if (!p.cascade.solve(b, p.lower, p.upper, p.x)) return false;
  const bool bounded = p.cascade.bounded();
  p.kept = bounded && p.cascade.first_residual() > kLimited;
  state_.limited = p.kept || p.rows.missing_height_m() > kLimited;
  p.cascade.remember_residuals();
  p.cascade.residual(b, p.out_of_reach.head(rows));
  advance();
  int programs = bounded ? 1 : 0;
  const int most = p.kept ? kKeptPasses : state_.limited ? kLimitedPasses : kBoundedPasses;
  for (int pass = 1; pass < kPasses && programs < most; ++pass) {
    p.rows.missing(p.posture, b);
    b.head(first) -= p.out_of_reach.head(first);
    // Errors that limits leave to lower tasks are not tried again in this pass.
    if (bounded) b.tail(rows - first).setZero();
    if (b.head(first).lpNorm<Eigen::Infinity>() < kExact) break;  // 0 of no rows
    if (!p.cascade.solve(b, p.lower, p.upper, p.x)) break;
    programs += p.cascade.bounded() ? 1 : 0;
    advance();
  }
  p.posture.X_WB.linear() =
      Eigen::Quaterniond(p.posture.X_WB.linear()).normalized().toRotationMatrix();
  return true;
}

/// While a limit keeps the first level from its goal, Newton's method does not come to rest: bounds
/// the joints' accelerations, as far as their limits permit.
void Stack::ease(double dt_s) {
  constexpr double kEased_rad_s2 = 100.0;
  Parts& p = *parts_;
  const double most = kEased_rad_s2 * dt_s * dt_s;
  for (Eigen::Index i = 0; i < state_.dq.size(); ++i) {
    const double way = state_.dq[i] * dt_s, lower = p.lower[6 + i], upper = p.upper[6 + i];
    p.lower[6 + i] = std::clamp(way - most, lower, upper);
    p.upper[6 + i] = std::clamp(way + most, lower, upper);
  }
}

void Stack::advance() {
  Parts& p = *parts_;
  p.sum += p.x;
  p.lower -= p.x;  // the rest of the tick's displacement
  p.upper -= p.x;
  p.posture.q = p.start + p.sum.tail(p.start.size());
  p.posture.X_WB.translation() = p.X_start.translation() + p.sum.head<3>();
  p.posture.X_WB.linear() = math::exp_so3(p.x.segment<3>(3)) * p.posture.X_WB.linear();
  p.posture.update();
}

void Stack::measure(const TaskGoals& goals) {
  const Parts& p = *parts_;
  state_.com_error_m = (goals.com_W_m - p.posture.com_W).norm();
  state_.foot_error_m = 0.0;
  for (std::size_t side = 0; side < 2; ++side) {
    const auto& X = p.posture.kinematics.X_WL(p.biped.leg[side].sole);
    state_.foot_error_m = std::max(state_.foot_error_m,
                                   (goals.foot[side].X_WS.translation() - X.translation()).norm());
  }
}

}  // namespace mimesis::walker
