#include "common/robot/robot_tree.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/error.h"

namespace mimesis::robot {
namespace {

std::string number(double value) {
  std::string text = std::to_string(value);
  text.erase(text.find_last_not_of('0') + 1);
  return text.back() == '.' ? text + '0' : text;
}

void check_joint(const Link& link, int index, const std::string& where) {
  if (index == 0 ? link.parent != -1 : (link.parent < 0 || link.parent >= index)) {
    throw ConfigError(where + "parent " + std::to_string(link.parent) +
                      ", expected one before link " + std::to_string(index));
  }
  if (!link.X_PJ.matrix().allFinite()) throw ConfigError(where + "its place is not finite");
  if (link.type == JointType::fixed) return;
  if (!(std::abs(link.axis.norm() - 1.0) < 1e-9)) {
    throw ConfigError(where + "axis, expected a unit vector");
  }
}

void check_range(const Link& link, const std::string& where) {
  if (link.type == JointType::fixed) return;
  if (!(link.lower < link.upper)) {  // also NaN
    throw ConfigError(where + "limits " + number(link.lower) + " to " + number(link.upper) +
                      ", expected lower < upper");
  }
  if (!(link.max_speed > 0.0)) {
    throw ConfigError(where + "velocity limit " + number(link.max_speed) + ", expected above 0");
  }
}

constexpr double kRoundingOfMoments = 1e-6;

void check_inertia(const Inertia& inertia, const std::string& where) {
  if (!(inertia.mass_kg >= 0.0) || !std::isfinite(inertia.mass_kg) || !inertia.com_m.allFinite()) {
    throw ConfigError(where + "mass " + number(inertia.mass_kg) + " kg, expected 0 or more");
  }
  const Eigen::Matrix3d& I = inertia.about_com_kg_m2;
  if (!I.allFinite() || (inertia.mass_kg == 0.0 && !I.isZero(0.0))) {
    throw ConfigError(where + "inertia, expected finite, and zero without a mass");
  }
  if (inertia.mass_kg == 0.0) return;
  const Eigen::Vector3d moments = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>()
                                      .computeDirect(I, Eigen::EigenvaluesOnly)
                                      .eigenvalues();
  // No principal moment of a body exceeds the sum of the other two
  if (!(moments[0] > 0.0) || moments[2] > (moments[0] + moments[1]) * (1.0 + kRoundingOfMoments)) {
    throw ConfigError(where + "inertia with principal moments " + number(moments[0]) + ", " +
                      number(moments[1]) + ", " + number(moments[2]) +
                      " kg m², expected those of a body");
  }
}

}  // namespace

Eigen::Isometry3d Link::at(double q) const {
  Eigen::Isometry3d X = X_PJ;
  if (type == JointType::revolute) X.rotate(Eigen::AngleAxisd(q, axis));
  if (type == JointType::prismatic) X.translate(q * axis);
  return X;
}

RobotTree::RobotTree(std::string name, std::vector<Link> links)
    : name_(std::move(name)), links_(std::move(links)) {
  if (links_.empty()) throw ConfigError(name_ + ": no link, expected one at least");
  std::vector<std::string> names, joints;
  for (std::size_t i = 0; i < links_.size(); ++i) {
    Link& link = links_[i];
    check_joint(link, static_cast<int>(i),
                name_ + ": joint '" + link.joint + "' of link '" + link.name + "': ");
    link.dof = -1;
    if (link.type != JointType::fixed) {
      link.dof = dof();
      moved_.push_back(static_cast<int>(i));
    }
    names.push_back(link.name);
    if (i > 0) joints.push_back(link.joint);
  }
  for (auto* list : {&names, &joints}) {
    std::ranges::sort(*list);
    if (const auto twice = std::ranges::adjacent_find(*list); twice != list->end()) {
      throw ConfigError(name_ + ": '" + *twice + "' occurs twice, expected names of their own");
    }
  }
}

void RobotTree::require_dynamics() const {
  for (const Link& link : links_) {
    check_range(link, name_ + ": joint '" + link.joint + "' of link '" + link.name + "': ");
    check_inertia(link.inertia, name_ + ": link '" + link.name + "': ");
  }
}

double RobotTree::mass_kg() const {
  double sum = 0.0;
  for (const Link& link : links_) sum += link.inertia.mass_kg;
  return sum;
}

std::vector<std::string> RobotTree::joint_names() const {
  std::vector<std::string> names;
  for (int i = 0; i < dof(); ++i) names.push_back(moved(i).joint);
  return names;
}

Eigen::VectorXd RobotTree::lower() const {
  return Eigen::VectorXd::NullaryExpr(
      dof(), [this](Eigen::Index i) { return moved(static_cast<int>(i)).lower; });
}
Eigen::VectorXd RobotTree::upper() const {
  return Eigen::VectorXd::NullaryExpr(
      dof(), [this](Eigen::Index i) { return moved(static_cast<int>(i)).upper; });
}
Eigen::VectorXd RobotTree::max_speed() const {
  return Eigen::VectorXd::NullaryExpr(
      dof(), [this](Eigen::Index i) { return moved(static_cast<int>(i)).max_speed; });
}

int RobotTree::find_link(std::string_view name) const {
  const auto it = std::ranges::find(links_, name, &Link::name);
  return it == links_.end() ? -1 : static_cast<int>(it - links_.begin());
}

int RobotTree::find_joint(std::string_view name) const {
  for (int i = 0; i < dof(); ++i) {
    if (moved(i).joint == name) return i;
  }
  return -1;
}

int RobotTree::require_link(std::string_view name) const {
  const int index = find_link(name);
  if (index < 0) throw ConfigError(name_ + ": no link '" + std::string(name) + "'");
  return index;
}

int RobotTree::require_joint(std::string_view name) const {
  const int index = find_joint(name);
  if (index < 0) throw ConfigError(name_ + ": no joint '" + std::string(name) + "' that moves");
  return index;
}

bool RobotTree::carries(int ancestor, int index) const {
  while (index > ancestor) index = link(index).parent;
  return index == ancestor;
}

namespace {

const double* place_of(const JointPlaces& places, const std::string& joint) {
  const auto it = std::ranges::find(places, joint, &JointPlaces::value_type::first);
  return it == places.end() ? nullptr : &it->second;
}

/// Where a joint is that is held, or that others follow.
double place_of(const RobotTree& tree, const std::string& joint, const JointPlaces& fixed,
                const JointPlaces& posture, int depth = 0) {
  if (const double* at = place_of(fixed, joint)) return *at;
  const Link& link = tree.moved(tree.require_joint(joint));
  double at = 0.0;
  if (!link.mimics.empty()) {
    if (depth > tree.dof()) {
      throw ConfigError(tree.name() + ": joint '" + joint +
                        "' follows itself, expected another joint in its <mimic>");
    }
    at = link.mimic_factor * place_of(tree, link.mimics, fixed, posture, depth + 1) +
         link.mimic_offset;
  } else if (const double* asked = place_of(posture, joint)) {
    at = *asked;
  }
  if (!std::isfinite(at)) {
    throw ConfigError(tree.name() + ": joint '" + joint + "' follows '" + link.mimics +
                      "' by no number, expected a multiplier and an offset");
  }
  return link.lower <= link.upper ? std::clamp(at, link.lower, link.upper) : at;
}

}  // namespace

RobotTree held(const RobotTree& tree, const JointPlaces& fixed, const JointPlaces& posture) {
  for (const auto& [joint, at] : fixed) {
    const Link& link = tree.moved(tree.require_joint(joint));
    constexpr double kRounding = 1e-6;
    if (at >= link.lower - kRounding && at <= link.upper + kRounding) continue;
    throw ConfigError(tree.name() + ": fixed: joint '" + joint + "' at " + number(at) +
                      ", expected within its limits " + number(link.lower) + " .. " +
                      number(link.upper));
  }
  std::vector<Link> links = tree.links();
  for (Link& link : links) {
    if (link.dof < 0 || (link.mimics.empty() && place_of(fixed, link.joint) == nullptr)) continue;
    link.X_PJ = link.at(place_of(tree, link.joint, fixed, posture));
    link.type = JointType::fixed;
    link.mimics.clear();
  }
  return {tree.name(), std::move(links)};
}

RobotTree merged(const RobotTree& tree) {
  std::vector<Link> links = tree.links();
  for (std::size_t i = links.size(); i-- > 1;) {
    if (links[i].dof >= 0) continue;
    const Inertia own = std::exchange(links[i].inertia, {});
    if (!(own.mass_kg >= 0.0) || !std::isfinite(own.mass_kg)) {
      throw ConfigError(tree.name() + ": link '" + links[i].name + "': mass " +
                        number(own.mass_kg) + " kg, expected 0 or more");
    }
    if (own.mass_kg == 0.0) continue;
    Inertia& to = links[static_cast<std::size_t>(links[i].parent)].inertia;
    const double mass = to.mass_kg + own.mass_kg;
    const Eigen::Matrix3d& R = links[i].X_PJ.linear();
    const Eigen::Vector3d own_com = links[i].X_PJ * own.com_m;
    const Eigen::Vector3d com = (to.mass_kg * to.com_m + own.mass_kg * own_com) / mass;
    const auto about = [&](double m, const Eigen::Vector3d& p) -> Eigen::Matrix3d {
      const Eigen::Vector3d d = p - com;
      return m * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
    };
    to.about_com_kg_m2 += about(to.mass_kg, to.com_m) + R * own.about_com_kg_m2 * R.transpose() +
                          about(own.mass_kg, own_com);
    to.mass_kg = mass;
    to.com_m = com;
  }
  return {tree.name(), std::move(links)};
}

RobotTree balanced(const RobotTree& tree, std::vector<std::string>* changed) {
  std::vector<Link> links = tree.links();
  for (Link& link : links) {
    Eigen::Matrix3d& I = link.inertia.about_com_kg_m2;
    if (!I.allFinite()) continue;
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    Eigen::Vector3d m = solver.computeDirect(I).eigenvalues();
    const double sum = m[0] + m[1];
    if (!(m[0] > 0.0) || m[2] <= sum * (1.0 + kRoundingOfMoments)) continue;
    m.head<2>() *= m[2] / sum;
    const Eigen::Matrix3d R = solver.eigenvectors();
    I = R * m.asDiagonal() * R.transpose();
    if (changed != nullptr) changed->push_back(link.name);
  }
  return {tree.name(), std::move(links)};
}

}  // namespace mimesis::robot
