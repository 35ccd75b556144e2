#pragma once
// FCL on the solids of a URDF: what our convex parts and balls are judged by.
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "common/model/files.h"
#include "common/robot/kinematics.h"

namespace mimesis::planner::peer {

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  double in(double a, double b) { return std::uniform_real_distribution(a, b)(random_); }
  int below(int n) { return std::uniform_int_distribution(0, n - 1)(random_); }
  Eigen::VectorXd posture(const kin::ArmModel& arm) {
    Eigen::VectorXd q(arm.dof());
    for (Eigen::Index j = 0; j < q.size(); ++j) q[j] = in(arm.q_min[j], arm.q_max[j]);
    return q;
  }
  /// Up to seven balls and boxes around the base.
  kin::Table table() {
    kin::Table table;
    for (int i = 2 + below(6); i-- > 0;) {
      const double away = in(0.35, 0.8), turn = in(-M_PI, M_PI);
      const Eigen::Vector3d at(away * std::cos(turn), away * std::sin(turn), in(0.1, 1.0));
      if (below(2) == 0) {
        table.balls.push_back({at, in(0.03, 0.12)});
      } else {
        table.boxes.push_back({at, {in(0.02, 0.12), in(0.02, 0.12), in(0.02, 0.12)}, "box"});
      }
    }
    return table;
  }

 private:
  std::mt19937_64 random_;
};

/// Links placed by the kinematics of the URDF's tree; the chain's base is W.
class FclJudge {
 public:
  /// `fixed`: joints beside the chain that are not at 0. Of groups that the arm checks.
  FclJudge(const std::string& urdf, const model::CoveredArm& covered, const std::string& base = {},
           const std::string& tip = {},
           const std::vector<std::pair<std::string, double>>& fixed = {})
      : tree_(robot::read_urdf(urdf)),
        kinematics_(tree_),
        covered_(covered),
        base_(base.empty() ? 0 : tree_.require_link(base)),
        q_(Eigen::VectorXd::Zero(tree_.dof())) {
    for (const auto& [joint, at] : fixed) q_[tree_.require_joint(joint)] = at;
    for (const robot::Link& link : tree_.links())
      if (const int leader = tree_.find_joint(link.mimics); leader >= 0 && link.dof >= 0)
        q_[link.dof] = link.mimic_factor * q_[leader] + link.mimic_offset;
    if (tip.empty()) {
      for (int j = 0; j < covered.arm.dof(); ++j) dofs_.push_back(j);
    } else {
      for (int l = tree_.require_link(tip); l != base_; l = tree_.link(l).parent)
        if (tree_.link(l).dof >= 0) dofs_.insert(dofs_.begin(), tree_.link(l).dof);
    }
    std::vector<std::string> names;
    for (const auto& link : covered.links) names.push_back(link.link);
    for (const auto& [name, solids] : robot::link_solids(urdf, names, true)) {
      for (const robot::Solid& solid : solids)
        parts_.push_back({group_of(name), tree_.find_link(name), solid.X_LS, shape_of(solid)});
    }
  }

  void set_obstacles(const kin::Table& table) {
    obstacles_.clear();
    for (const kin::Ball& b : table.balls)
      obstacles_.push_back({std::make_shared<fcl::Sphered>(b.radius), b.center});
    for (const kin::Box& b : table.boxes)
      obstacles_.push_back(
          {std::make_shared<fcl::Boxd>(Eigen::Vector3d(2.0 * b.half_extent)), b.center});
  }

  bool touches(const Eigen::VectorXd& q) {
    return any_pair(q, [](const Shape& a, const Eigen::Isometry3d& X_WA, const Shape& b,
                          const Eigen::Isometry3d& X_WB) {
      fcl::CollisionResultd result;
      return fcl::collide(a.get(), X_WA, b.get(), X_WB, fcl::CollisionRequestd(), result) > 0;
    });
  }
  /// Something is nearer than this.
  bool nearer(const Eigen::VectorXd& q, double least) {
    return touches(q) || any_pair(q, [least](const Shape& a, const Eigen::Isometry3d& X_WA,
                                             const Shape& b, const Eigen::Isometry3d& X_WB) {
             fcl::DistanceResultd result;
             return fcl::distance(a.get(), X_WA, b.get(), X_WB, fcl::DistanceRequestd(), result) <
                    least;
           });
  }

 private:
  using Shape = std::shared_ptr<fcl::CollisionGeometryd>;
  struct Part {
    int group, link;
    Eigen::Isometry3d X_LS;
    Shape shape;
  };

  static Shape shape_of(const robot::Solid& solid) {
    using Kind = robot::Solid::Kind;
    const Eigen::Vector3d edges = 2.0 * solid.half_m;
    if (solid.kind == Kind::box) return std::make_shared<fcl::Boxd>(edges);
    if (solid.kind == Kind::ball) return std::make_shared<fcl::Sphered>(solid.half_m.x());
    if (solid.kind == Kind::cylinder)
      return std::make_shared<fcl::Cylinderd>(solid.half_m.x(), edges.z());
    auto mesh = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
    mesh->beginModel();
    for (const auto& t : solid.mesh->triangles()) mesh->addTriangle(t[0], t[1], t[2]);
    mesh->endModel();
    return mesh;
  }

  template <class Meets>
  bool any_pair(const Eigen::VectorXd& q, const Meets& meets) {
    for (std::size_t j = 0; j < dofs_.size(); ++j) q_[dofs_[j]] = q[static_cast<Eigen::Index>(j)];
    kinematics_.update(Eigen::Isometry3d::Identity(), q_);
    const Eigen::Isometry3d X_WR = kinematics_.X_WL(base_).inverse();
    const auto& arm = covered_.arm;
    for (const Part& part : parts_) {
      const Eigen::Isometry3d X_WS = X_WR * kinematics_.X_WL(part.link) * part.X_LS;
      if (std::ranges::count(arm.env_groups, part.group) > 0) {
        for (const auto& [shape, center] : obstacles_)
          if (meets(part.shape, X_WS, shape, Eigen::Isometry3d(Eigen::Translation3d(center))))
            return true;
      }
      for (const Part& other : parts_) {
        if (std::ranges::count(arm.self_pairs, std::pair(part.group, other.group)) > 0 &&
            meets(part.shape, X_WS, other.shape, X_WR * kinematics_.X_WL(other.link) * other.X_LS))
          return true;
      }
    }
    return false;
  }
  int group_of(const std::string& link) const {
    return std::ranges::find(covered_.links, link, &model::CoveredLink::link)->group;
  }

  robot::RobotTree tree_;
  robot::Kinematics kinematics_;
  const model::CoveredArm& covered_;
  int base_;
  Eigen::VectorXd q_;
  std::vector<int> dofs_;
  std::vector<Part> parts_;
  std::vector<std::pair<Shape, Eigen::Vector3d>> obstacles_;
};

}  // namespace mimesis::planner::peer
