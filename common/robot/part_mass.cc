#include "common/robot/part_mass.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/error.h"

namespace mimesis::robot {

PartMass::PartMass(const RobotTree& tree, std::span<const int> dofs, bool with_root) {
  const std::vector<Body> all = bodies_of(tree);
  if (with_root) {
    root_ = all[0].first;
    mass_ = all[0].mass;
  }
  joint_.resize(dofs.size());
  std::iota(joint_.begin(), joint_.end(), Eigen::Index{0});
  const auto dof = [&](Eigen::Index joint) { return dofs[static_cast<std::size_t>(joint)]; };
  std::ranges::sort(joint_, {}, dof);  // parents first
  std::vector<int> here(all.size(), -1);
  for (const Eigen::Index joint : joint_) {
    const auto i = static_cast<std::size_t>(dof(joint)) + 1;
    Body body = all[i];
    MIMESIS_ASSERT(body.parent == 0 || here[static_cast<std::size_t>(body.parent)] >= 0);
    body.parent = body.parent == 0 ? -1 : here[static_cast<std::size_t>(body.parent)];
    here[i] = static_cast<int>(bodies_.size());
    body.subtree_mass = body.mass;
    mass_ += body.mass;
    bodies_.push_back(body);
  }
  for (std::size_t i = bodies_.size(); i-- > 0;) {
    if (bodies_[i].parent < 0) continue;
    bodies_[static_cast<std::size_t>(bodies_[i].parent)].subtree_mass += bodies_[i].subtree_mass;
  }
  moment_.resize(bodies_.size());
}

Eigen::Vector3d PartMass::first_moment(const Eigen::Ref<const Eigen::VectorXd>& q) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) moment_[i] = bodies_[i].first;
  Eigen::Vector3d sum = root_;
  for (std::size_t i = bodies_.size(); i-- > 0;) {
    const Body& body = bodies_[i];
    const double at = q[joint_[i]];
    Eigen::Vector3d moment = moment_[i];  // in J
    if (body.slides) {
      moment.z() += at * body.subtree_mass;
    } else {
      const double c = std::cos(at), s = std::sin(at), x = moment.x();
      moment.x() = c * x - s * moment.y();
      moment.y() = s * x + c * moment.y();
    }
    const Eigen::Vector3d in_parent = body.R_PJ * moment + body.subtree_mass * body.p_PJ;
    (body.parent < 0 ? sum : moment_[static_cast<std::size_t>(body.parent)]) += in_parent;
  }
  return sum;
}

}  // namespace mimesis::robot
