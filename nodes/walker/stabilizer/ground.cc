#include "nodes/walker/stabilizer/ground.h"

#include <algorithm>

#include "nodes/walker/stabilizer/estimator.h"

namespace mimesis::walker {
namespace {

Eigen::Vector2d to_sole(const FootState& foot, const Eigen::Vector2d& v_W) {
  const double yaw = std::atan2(foot.X_WS(1, 0), foot.X_WS(0, 0));
  return Eigen::Rotation2Dd(-yaw) * v_W;
}

Eigen::Vector2d to_world(const FootState& foot, const Eigen::Vector2d& p_S) {
  const double yaw = std::atan2(foot.X_WS(1, 0), foot.X_WS(0, 0));
  return foot.X_WS.translation().head<2>() + Eigen::Rotation2Dd(yaw) * p_S;
}

}  // namespace

Eigen::Vector2d Ground::on_sole(Side side, const Eigen::Vector2d& p_S_m) const {
  const robot::Biped::Leg& leg = biped_->leg[side];
  const Eigen::Vector2d low = leg.min_S_m.array() + margin_, high = leg.max_S_m.array() - margin_;
  return p_S_m.cwiseMax(low).cwiseMin(high);
}

Eigen::Vector2d Ground::reachable(const PatternSample& plan, const Eigen::Vector2d& zmp_W_m) const {
  std::array<Eigen::Vector2d, Polygon::kMost> corner;
  std::size_t n = 0;
  for (Side s : robot::kSides) {
    if (!plan.contact[s]) continue;
    for (double x : {-1.0, 1.0}) {
      for (double y : {-1.0, 1.0}) {  // beyond every edge, then cut
        corner[n++] = to_world(plan.foot[s], on_sole(s, {x * 1e3, y * 1e3}));
      }
    }
  }
  if (n == 0) return zmp_W_m;
  return Polygon({corner.data(), n}).nearest(zmp_W_m);
}

Ground::Shares Ground::distribute(const PatternSample& plan, const Eigen::Vector2d& zmp_W_m) const {
  const Eigen::Vector2d left = plan.foot[kLeft].X_WS.translation().head<2>();
  const Eigen::Vector2d right = plan.foot[kRight].X_WS.translation().head<2>();
  Shares shares;
  shares.left = left_weight(plan);
  if (plan.contact[kLeft] && plan.contact[kRight]) {
    const Eigen::Vector2d across = left - right;
    const double length2 = std::max(across.squaredNorm(), 1e-6);
    shares.left = std::clamp((zmp_W_m - right).dot(across) / length2, 0.0, 1.0);
  }
  const Eigen::Vector2d rest = zmp_W_m - (shares.left * left + (1.0 - shares.left) * right);
  for (Side s : robot::kSides) shares.cop_S_m[s] = on_sole(s, to_sole(plan.foot[s], rest));
  return shares;
}

std::optional<Eigen::Vector2d> measured_zmp(const PatternSample& plan,
                                            const std::array<robot::Wrench, 2>& foot_S,
                                            double least_n) {
  double normal = 0.0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (Side s : robot::kSides) {
    const robot::Wrench& w = foot_S[s];
    if (w.force.z() <= 0.0) continue;
    normal += w.force.z();
    const Eigen::Vector2d cop(-w.moment.y() / w.force.z(), w.moment.x() / w.force.z());
    sum += w.force.z() * to_world(plan.foot[s], cop);
  }
  if (normal < least_n) return std::nullopt;
  return sum / normal;
}

}  // namespace mimesis::walker
