#include "nodes/synthesizer/biped/upper_body_tree.h"

#include "common/robot/kinematics.h"

namespace mimesis::synthesizer {
namespace {

bool in_leg(const robot::RobotTree& tree, const retarget::RobotFigure& figure, int link) {
  const int pelvis = tree.require_link(figure.pelvis);  // the root, or fixed to it
  for (const std::string& hip : figure.hip) {
    int top = tree.require_link(hip);
    while (tree.link(top).parent > 0 && tree.link(top).parent != pelvis) {
      top = tree.link(top).parent;
    }
    if (tree.carries(top, link)) return true;
  }
  return false;
}

}  // namespace

std::vector<std::string> upper_body_joints(const robot::RobotTree& tree,
                                           const retarget::RobotFigure& figure) {
  return upper_body_tree(tree, figure).joint_names();
}

robot::RobotTree upper_body_tree(const robot::RobotTree& tree,
                                 const retarget::RobotFigure& figure) {
  std::vector<robot::Link> links;
  std::vector<int> number(tree.links().size(), -1);
  for (std::size_t i = 0; i < tree.links().size(); ++i) {
    if (in_leg(tree, figure, static_cast<int>(i))) continue;
    robot::Link link = tree.links()[i];
    if (link.parent >= 0) link.parent = number[static_cast<std::size_t>(link.parent)];
    number[i] = static_cast<int>(links.size());
    links.push_back(std::move(link));
  }
  return {tree.name(), std::move(links)};
}

double easy_pelvis_height(const robot::RobotTree& tree, const retarget::RobotFigure& figure) {
  robot::Kinematics kinematics(tree);
  Eigen::VectorXd q = Eigen::VectorXd::Zero(tree.dof());
  for (const auto& [joint, angle] : figure.start_rad) q[tree.require_joint(joint)] = angle;
  kinematics.update(Eigen::Isometry3d::Identity(), q);
  const auto& X = kinematics.X_WL(tree.require_link(figure.ankle[0]));
  return -(X * figure.heel_m[0]).z();
}

}  // namespace mimesis::synthesizer
