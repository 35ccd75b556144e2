#include "nodes/walker/check/find_biped.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/error.h"
#include "common/math/so3.h"
#include "common/robot/dynamics.h"
#include "common/robot/leg_ik.h"

namespace mimesis::walker {
namespace {

using Eigen::Isometry3d, Eigen::Vector2d, Eigen::Vector3d;
using robot::Kinematics, robot::Link, robot::RobotTree;
using Kind = Finding::Kind;

constexpr std::size_t kLegJoints = 6, kFewArmJoints = 3, kMostArmJoints = 7;
constexpr double kBeside_m = 0.03;  ///< nearer to the pelvis's x-z plane is neither left nor right

std::string text_of(double value, int digits = 3) {
  const double scale = std::pow(10.0, digits);
  std::string text = std::to_string(std::round(value * scale) / scale);
  text.erase(text.find_last_not_of('0') + 1);
  return text.back() == '.' ? text + '0' : text;
}

/// The first names, and how many more.
std::string list_of(const std::vector<std::string>& names) {
  constexpr std::size_t kNamed = 3;
  std::string text = names.front();
  for (std::size_t i = 1; i < std::min(names.size(), kNamed); ++i) text += ", " + names[i];
  if (names.size() > kNamed) text += " and " + std::to_string(names.size() - kNamed) + " more";
  return text;
}

/// Links that joints move, and nothing that moves hangs on them.
std::vector<int> ends_of(const RobotTree& tree) {
  std::vector<bool> bears(tree.links().size(), false);
  for (int i = 0; i < tree.dof(); ++i) {
    for (int l = tree.link(tree.moved_link(i)).parent; l >= 0; l = tree.link(l).parent)
      bears[static_cast<std::size_t>(l)] = true;
  }
  std::vector<int> ends;
  for (int i = 0; i < tree.dof(); ++i) {
    if (!bears[static_cast<std::size_t>(tree.moved_link(i))]) ends.push_back(tree.moved_link(i));
  }
  return ends;
}

/// The two lowest ends on either side of the pelvis, left and right; −1: none.
std::array<int, 2> lowest_ends(const RobotTree& tree) {
  const Kinematics zero(tree);
  std::array<int, 2> lowest{-1, -1};
  for (const int end : ends_of(tree)) {
    const Vector3d& p = zero.X_WL(end).translation();
    int& low = lowest[p.y() > 0.0 ? kLeft : kRight];
    if (low < 0 || p.z() < zero.X_WL(low).translation().z() - 1e-9) low = end;
  }
  return lowest;
}

/// What is no body's in a link's mass and inertia; empty: nothing.
std::string inertia_fault(const Link& link) {
  Link alone;
  alone.name = link.name;
  alone.inertia = link.inertia;
  try {
    RobotTree("robot", {alone}).require_dynamics();
    return {};
  } catch (const ConfigError& e) {
    return std::string(e.what()).substr(std::string("robot: ").size());
  }
}

/// Whether a joint cannot be walked with as it is, and why; empty: it can.
/// `tree`: balanced.
std::string fault_of(const RobotTree& tree, const robot::Body& body) {
  const Link& link = tree.link(body.link);
  if (!(body.mass > 0.0)) return "move no mass";
  if (!inertia_fault(link).empty()) return "move a link with no proper inertia";
  if (!(link.lower < link.upper)) return "have no range";
  if (!(link.max_speed > 0.0)) return "have no limit of velocity";
  return {};
}

class Finder {
 public:
  Finder(const RobotTree& tree, const ContactPoints& contacts, double knee_rad)
      : whole_(tree), contacts_(contacts), knee_rad_(knee_rad) {}

  FoundBiped find() {
    hold_followers();
    find_legs();
    if (!complete_) return std::move(out_);
    hold_hands();
    const RobotTree tree = balanced(robot::merged(robot::held(whole_, out_.fixed)));
    check_masses(tree);
    find_soles(tree);
    find_upper_body(tree);
    if (!complete_) return std::move(out_);
    sit(tree);
    return std::move(out_);
  }

 private:
  void note(Kind kind, std::string part, std::string text) {
    complete_ = complete_ && kind != Kind::missing;
    out_.findings.push_back({kind, std::move(part), std::move(text)});
  }
  void hold(const Link& link, const std::string& why) {
    const double at =
        std::clamp(0.0, std::min(link.lower, link.upper), std::max(link.lower, link.upper));
    out_.fixed.emplace_back(link.joint, at);
    held_[why].push_back(link.joint);
  }
  bool is_held(const std::string& joint) const {
    return std::ranges::any_of(out_.fixed, [&](const auto& f) { return f.first == joint; });
  }

  /// Joints without a drive of their own stay where what they follow is in half-sitting: it is 0
  /// there, or at the limit nearest to it.
  void hold_followers() {
    for (int i = 0; i < whole_.dof(); ++i) {
      const Link& link = whole_.moved(i);
      if (link.mimics.empty()) continue;
      held_["follow others by a gear"].push_back(link.joint);  // robot::held() knows where
    }
  }

  void find_legs() {
    feet_ = lowest_ends(robot::held(whole_, {}));
    const Kinematics zero(whole_);
    for (const Side side : robot::kSides) {
      const std::string part = side == kLeft ? "left leg" : "right leg";
      if (feet_[side] < 0) {
        note(Kind::missing, part,
             "none: no joint's end lies on this side of the root link '" + whole_.link(0).name +
                 "', expected two legs, its x forward and its z up");
        continue;
      }
      std::vector<int> chain = moving_chain(feet_[side]);
      while (chain.size() > kLegJoints) {  // toes
        hold(whole_.link(chain.back()), "move toes");
        chain.pop_back();
      }
      out_.leg_joints[side] = static_cast<int>(chain.size());
      const Vector3d down = zero.X_WL(feet_[side]).translation();
      if (chain.size() < kLegJoints) {
        note(Kind::missing, part,
             std::to_string(chain.size()) + " joints from '" + whole_.link(0).name + "' to '" +
                 whole_.link(feet_[side]).name +
                 "', expected 6: three in the hip, a knee, two in the ankle");
      } else if (!(-down.z() > 2.0 * std::abs(down.x()))) {
        note(Kind::missing, part,
             "its foot '" + whole_.link(feet_[side]).name + "' is at (" + text_of(down.x()) + ", " +
                 text_of(down.y()) + ", " + text_of(down.z()) + ") m of the root link '" +
                 whole_.link(0).name + "' in the zero posture, expected below: x forward, z up");
      } else {
        feet_[side] = chain.back();
        legs_[side] = chain;
      }
    }
    if (complete_ && whole_.link(feet_[kLeft]).parent == whole_.link(feet_[kRight]).parent)
      note(Kind::missing, "legs", "the feet hang on one link, expected two legs");
    if (complete_ && legs_[kLeft].front() == legs_[kRight].front())
      note(Kind::missing, "legs",
           "joint '" + whole_.link(legs_[kLeft].front()).joint +
               "' carries both feet, expected the root link to be the pelvis");
    check_front();
  }

  /// Names that say left and right must agree with the root's axes.
  void check_front() {
    if (!complete_) return;
    const auto is = [](std::string name, const char* word, char initial) {
      std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
      return name.find(word) != std::string::npos ||
             (name.size() > 1 && name[0] == initial && (name[1] == '_' || name[1] == '.'));
    };
    const std::string& name = whole_.link(feet_[kLeft]).name;
    if (is(name, "right", 'r') && is(whole_.link(feet_[kRight]).name, "left", 'l'))
      note(Kind::missing, "pelvis",
           "foot '" + name + "' is on the left of the root link '" + whole_.link(0).name +
               "', expected its x to point forward");
  }

  std::vector<int> moving_chain(int end) const {
    std::vector<int> chain;
    for (const int l : robot::moved_links(whole_, 0, end))
      if (whole_.link(l).mimics.empty()) chain.push_back(l);
    return chain;
  }

  /// Beyond the first branch of an arm or of the neck are fingers and eyes; an arm has seven joints
  /// at most; and what cannot be driven is held with all that it carries.
  void hold_hands() {
    find_trunk();
    const RobotTree whole = robot::balanced(robot::merged(whole_));
    const std::vector<robot::Body> bodies = robot::bodies_of(whole);
    std::vector<int> children(whole_.links().size(), 0);  // those that move
    for (int l = 1; l < static_cast<int>(children.size()); ++l) {
      if (moves(l)) ++children[static_cast<std::size_t>(above(l))];
    }
    for (int i = 0; i < whole_.dof(); ++i) {
      const int l = whole_.moved_link(i);
      if (!moves(l) || in_leg(l)) continue;
      const Link& link = whole_.link(l);
      const int parent = above(l);
      const bool on_limb = !whole_.carries(parent, trunk_);
      const std::string fault = fault_of(whole, bodies[static_cast<std::size_t>(i) + 1]);
      if (parent > 0 && is_held(whole_.link(parent).joint))
        hold(link, "hang on joints that are held");
      else if (link.type != robot::JointType::revolute)
        hold(link, "slide");
      else if (!fault.empty())
        hold(link, fault);
      else if (on_limb && children[static_cast<std::size_t>(parent)] > 1)
        hold(link, "move fingers or eyes");
      else if (on_limb && joints_above(l) >= kMostArmJoints)
        hold(link, "are beyond an arm's seventh");
    }
    for (const auto& [why, joints] : held_) {
      note(Kind::assumed, "held", list_of(joints) + ": they " + why);
    }
  }
  bool moves(int l) const { return whole_.link(l).dof >= 0 && whole_.link(l).mimics.empty(); }
  /// The link above that a joint moves, or the root.
  int above(int l) const {
    for (l = whole_.link(l).parent; l > 0 && !moves(l);) l = whole_.link(l).parent;
    return std::max(l, 0);
  }
  /// Joints of the limb before the one that moves `l`.
  std::size_t joints_above(int l) const {
    std::size_t n = 0;
    for (int a = above(l); !whole_.carries(a, trunk_); a = above(a)) ++n;
    return n;
  }
  bool in_leg(int l) const {
    return std::ranges::any_of(legs_, [&](const std::vector<int>& leg) {
      return !leg.empty() && whole_.carries(leg.front(), l);
    });
  }
  /// The last link that carries the longest chains on either side.
  void find_trunk() {
    const Kinematics zero(whole_);
    std::array<int, 2> end{-1, -1};
    std::array<std::size_t, 2> most{};
    for (const int l : ends_of(whole_)) {
      const double y = zero.X_WL(l).translation().y();
      const std::size_t joints = moving_chain(l).size();
      if (in_leg(l) || std::abs(y) < kBeside_m || joints < kFewArmJoints) continue;
      const Side side = y > 0.0 ? kLeft : kRight;
      if (joints > most[side]) {
        most[side] = joints;
        end[side] = l;
      }
    }
    if (end[kLeft] < 0 || end[kRight] < 0) return;
    for (trunk_ = end[kLeft];
         !whole_.carries(trunk_, end[kRight]) || !(trunk_ == 0 || moves(trunk_));)
      trunk_ = whole_.link(trunk_).parent;
  }

  RobotTree balanced(const RobotTree& tree) {
    std::vector<std::string> changed;
    RobotTree out = robot::balanced(tree, &changed);
    out_.balance_inertias = !changed.empty();
    if (!changed.empty())
      note(Kind::assumed, "mass",
           list_of(changed) +
               ": a moment of inertia exceeds the sum of the other two, which no "
               "body's does: these are raised");
    return out;
  }
  void check_masses(const RobotTree& tree) {
    for (const robot::Body& body : robot::bodies_of(tree)) {
      const Link& link = tree.link(body.link);
      if (const std::string fault = inertia_fault(link); !fault.empty())
        note(Kind::missing, "mass", fault);
      else if (!(body.mass > 0.0))
        note(Kind::missing, "mass", "link '" + link.name + "' has none, nor what is fixed to it");
      if (body.link == 0 || !in_leg(whole_.require_link(link.name))) continue;
      if (link.type != robot::JointType::revolute)
        note(Kind::missing, "legs", "joint '" + link.joint + "' slides, expected one that turns");
      if (!(link.lower < link.upper))
        note(Kind::missing, "limits", "joint '" + link.joint + "' of a leg has no range");
      if (!(link.max_speed > 0.0))
        note(Kind::missing, "limits", "joint '" + link.joint + "' of a leg has no velocity");
      if (!(link.max_effort > 0.0) || std::isinf(link.max_effort))
        note(Kind::assumed, "limits",
             "joint '" + link.joint + "' of a leg has no limit of torque: taken for strong enough");
    }
    note(Kind::found, "mass",
         text_of(tree.mass_kg(), 2) + " kg, " + std::to_string(tree.dof()) + " joints");
  }

  void find_soles(const RobotTree& tree) {
    const Kinematics zero(tree);
    std::array<Vector2d, 2> low, high;  // of the rectangle from below the ankle
    std::array<Vector3d, 2> at;         // of the sole in B
    for (const Side side : robot::kSides) {
      const std::string part = side == kLeft ? "left sole" : "right sole";
      const int foot = tree.require_link(whole_.link(feet_[side]).name);
      std::vector<Vector3d> points;
      for (const auto& [name, own] : contacts_) {
        const int l = tree.find_link(name);
        if (l < 0 || !tree.carries(foot, l)) continue;
        for (const Vector3d& p : own) points.push_back(zero.X_WL(l) * p);
      }
      if (points.empty()) {
        note(Kind::missing, part, "link '" + tree.link(foot).name + "' has no geometry");
        return;
      }
      double ground = points.front().z();
      for (const Vector3d& p : points) ground = std::min(ground, p.z());
      constexpr double kFlat_m = 0.003;
      Eigen::AlignedBox2d box;
      int count = 0;
      for (const Vector3d& p : points) {
        if (p.z() > ground + kFlat_m) continue;
        box.extend(Vector2d(p.head<2>()));
        ++count;
      }
      const Vector3d ankle = ankle_of(zero, foot);
      const Vector2d size = box.sizes();
      if (size.x() < 0.03 || size.y() < 0.02) {
        note(Kind::missing, part,
             "the lowest points of '" + tree.link(foot).name + "' span " + text_of(size.x()) +
                 " by " + text_of(size.y()) +
                 " m, expected a sole that is level in the zero "
                 "posture");
        return;
      }
      at[side] = {ankle.x() + held_middle(tree, foot, box, ankle.x()), ankle.y(), ground};
      if (!box.contains(Vector2d(at[side].head<2>()))) at[side].head<2>() = box.center();
      low[side] = box.min() - at[side].head<2>();
      high[side] = box.max() - at[side].head<2>();
      note(Kind::found, part,
           text_of(size.x()) + " by " + text_of(size.y()) + " m on " + std::to_string(count) +
               " points of '" + tree.link(foot).name + "', " + text_of(ankle.x() - box.min().x()) +
               " m of it behind the ankle, " + text_of(ankle.z() - ground) + " m below it");
    }
    out_.names.sole_back_m = std::max(low[kLeft].x(), low[kRight].x());
    out_.names.sole_front_m = std::min(high[kLeft].x(), high[kRight].x());
    out_.names.sole_outer_m = std::min(high[kLeft].y(), -low[kRight].y());
    out_.names.sole_inner_m = std::min(-low[kLeft].y(), high[kRight].y());
    for (const Side side : robot::kSides) {
      const int foot = tree.require_link(whole_.link(feet_[side]).name);
      const Isometry3d& X_BF = zero.X_WL(foot);
      const std::string name = side == kLeft ? "left_sole" : "right_sole";
      add_frame(tree, name, foot, X_BF.inverse() * at[side], X_BF.linear().transpose());
      out_.names.sole[side] = out_.frames.back().name;
    }
  }
  void add_frame(const RobotTree& tree, std::string name, int link, const Vector3d& p,
                 const Eigen::Matrix3d& R) {
    while (tree.find_link(name) >= 0) name += "_found";
    Vector3d rpy = math::rpy_of(R);
    for (double& x : rpy) x = std::abs(x) < 1e-12 ? 0.0 : x;
    out_.frames.push_back({std::move(name), tree.link(link).name, p, rpy});
  }
  /// How far before the ankle the robot stands: at the middle of where the ankle's motor can hold
  /// its weight on the sole.
  double held_middle(const RobotTree& tree, int foot, const Eigen::AlignedBox2d& sole,
                     double ankle_x) const {
    double most_n_m = std::numeric_limits<double>::infinity();
    const std::vector<int> chain = robot::moved_links(tree, 0, foot);
    const Kinematics zero(tree);
    for (const int l : {chain[chain.size() - 2], chain.back()}) {
      const Link& link = tree.link(l);
      const bool pitches = std::abs((zero.X_WL(l).linear() * link.axis).y()) > 0.7;
      if (pitches && link.max_effort > 0.0) most_n_m = link.max_effort;
    }
    const double reach = most_n_m / (robot::kGravity * tree.mass_kg());
    return 0.5 *
           (std::max(sole.min().x() - ankle_x, -reach) + std::min(sole.max().x() - ankle_x, reach));
  }
  /// Where the last two axes are nearest, in B.
  Vector3d ankle_of(const Kinematics& zero, int foot) const {
    const RobotTree& tree = zero.tree();
    std::vector<robot::Line> lines;
    const std::vector<int> chain = robot::moved_links(tree, 0, foot);
    for (const int l : {chain[chain.size() - 2], chain.back()}) {
      lines.push_back({zero.X_WL(l).translation(), zero.X_WL(l).linear() * tree.link(l).axis});
    }
    return robot::meeting_point(lines, 1e9).value_or(lines.back().point);
  }

  void find_upper_body(const RobotTree& tree) {
    const Kinematics zero(tree);
    std::array<int, 2> hand{-1, -1};
    int head = -1;
    const auto joints_of = [&](int link) {
      return robot::moved_links(tree, tree.require_link(whole_.link(trunk_).name), link).size();
    };
    for (const int end : ends_of(tree)) {
      const int l = whole_.require_link(tree.link(end).name);
      if (in_leg(l) || whole_.carries(l, trunk_)) continue;
      const Vector3d& p = zero.X_WL(end).translation();
      if (std::abs(p.y()) < kBeside_m) {
        if (head < 0 || p.z() > zero.X_WL(head).translation().z()) head = end;
      } else if (int& mine = hand[p.y() > 0.0 ? kLeft : kRight];
                 mine < 0 || joints_of(end) > joints_of(mine)) {
        mine = end;
      }
    }
    if (hand[kLeft] >= 0 && hand[kRight] >= 0) {
      for (const Side side : robot::kSides) out_.names.hand[side] = tree.link(hand[side]).name;
      note(Kind::found, "arms",
           std::to_string(joints_of(hand[kLeft])) + " and " +
               std::to_string(joints_of(hand[kRight])) + " joints, hands '" +
               out_.names.hand[kLeft] + "' and '" + out_.names.hand[kRight] + "'");
    } else {
      note(Kind::assumed, "arms", "none found: the robot walks without, and opens no drawer");
    }
    out_.names.trunk = whole_.link(trunk_).name;
    note(Kind::found, "trunk",
         "'" + out_.names.trunk + "' on " +
             std::to_string(
                 robot::moved_links(tree, 0, tree.require_link(out_.names.trunk)).size()) +
             " joints of the waist");
    if (head > 0) {
      out_.names.head = tree.link(head).name;
      note(Kind::found, "head", "'" + out_.names.head + "'");
    }
    out_.names.imu = tree.link(0).name;
    for (const Link& link : tree.links()) {
      std::string name = link.name;
      std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
      const bool on_pelvis =
          link.dof < 0 && robot::moved_links(tree, 0, tree.find_link(link.name)).empty();
      if (on_pelvis && name.find("imu") != std::string::npos) out_.names.imu = link.name;
    }
    note(out_.names.imu == tree.link(0).name ? Kind::assumed : Kind::found, "imu",
         "in '" + out_.names.imu + "'");
  }

  /// Half-sitting: knees bent, soles level and side by side below the hips, the CoM above
  /// their origins, all else at 0 or at the limit nearest to it.
  void sit(const RobotTree& bare) {
    std::vector<Link> links = bare.links();
    for (const FoundFrame& frame : out_.frames) {
      Link link;
      link.name = frame.name;
      link.joint = frame.name + "_frame";
      link.parent = bare.require_link(frame.link);
      link.X_PJ.translation() = frame.position_m;
      link.X_PJ.linear() = math::rotation_of_rpy(frame.rpy_rad);
      links.push_back(std::move(link));
    }
    const RobotTree tree(bare.name(), links);
    std::vector<std::pair<std::string, double>> rest;
    for (int i = 0; i < tree.dof(); ++i) {
      const Link& link = tree.moved(i);
      const double at = std::clamp(0.0, link.lower, link.upper);
      if (at != 0.0 && !in_leg(whole_.require_link(link.name))) rest.emplace_back(link.joint, at);
    }
    // The search may pass through what the limits exclude.
    for (Link& link : links) {
      if (link.dof < 0 || !in_leg(whole_.require_link(link.name))) continue;
      link.lower = std::min(link.lower, 0.0);
      link.upper = std::max(link.upper, 0.0);
    }
    out_.names.half_sitting = rest;
    try {
      const robot::Biped straight =
          robot::make_biped(RobotTree(bare.name(), std::move(links)), out_.names);
      for (const auto& [joint, angle] : bent_legs(straight))
        out_.names.half_sitting.emplace_back(joint, angle);
      if (!complete_) return;
      out_.biped = robot::make_biped(tree, out_.names);
    } catch (const ConfigError& e) {
      note(Kind::missing, "half-sitting", e.what());
      return;
    }
    note(Kind::found, "half-sitting",
         "knees bent by " + text_of(knee_rad_, 2) + " rad, CoM " +
             text_of(out_.biped->com_height_m) + " m high, feet " +
             text_of(out_.biped->feet_distance_m) + " m apart");
    for (const Side side : robot::kSides) {
      const robot::LegIk ik(*out_.biped, side);
      note(Kind::found, side == kLeft ? "left leg" : "right leg",
           std::string("6 joints, ") + text_of(robot::leg_length_m(*out_.biped)) + " m long, " +
               (ik.closed_form() ? "axes meet in hip and ankle: closed form"
                                 : "axes do not meet as in HRP-2: numeric inverse kinematics"));
    }
  }

  std::vector<std::pair<std::string, double>> bent_legs(const robot::Biped& biped) {
    const std::array<robot::LegIk, 2> ik{robot::LegIk(biped, kLeft), robot::LegIk(biped, kRight)};
    const double length = robot::leg_length_m(biped);
    const double apart = std::max(biped.feet_distance_m, 2.0 * out_.names.sole_inner_m + 0.04);
    Kinematics kinematics(biped.tree);
    Eigen::VectorXd q = biped.half_sitting;
    const Isometry3d X_BS = biped.X_WB_half_sitting.inverse();  // the middle of the soles
    double forward = X_BS.translation().x();
    std::array<robot::LegIk::Result, 2> leg;
    const auto place = [&](double height) {
      for (const Side side : robot::kSides) {
        const Vector3d p(forward, X_BS.translation().y() + robot::sign(side) * 0.5 * apart,
                         -height);
        leg[side] = ik[side].solve(Isometry3d(Eigen::Translation3d(p)));
      }
      return leg[kLeft].stretched ? 0.0 : leg[kLeft].bend_rad;
    };
    const double longest = -X_BS.translation().z();
    for (int pass = 0; pass < 12; ++pass) {
      double low = longest - 0.6 * length, high = longest;
      for (int i = 0; i < 40; ++i) {
        const double middle = 0.5 * (low + high);
        (place(middle) > knee_rad_ ? low : high) = middle;
      }
      for (const Side side : robot::kSides) {
        for (std::size_t i = 0; i < kLegJoints; ++i)
          q[biped.leg[side].dof[i]] = leg[side].q[static_cast<Eigen::Index>(i)];
      }
      kinematics.update(Isometry3d::Identity(), q);
      forward = kinematics.com().x();
    }
    place(-kinematics.X_WL(biped.leg[kLeft].sole).translation().z());
    std::vector<std::pair<std::string, double>> out;
    for (const Side side : robot::kSides) {
      if (leg[side].stretched || std::abs(leg[side].bend_rad - knee_rad_) > 1e-2)
        note(Kind::missing, "half-sitting",
             "no posture with knees bent by " + text_of(knee_rad_, 2) +
                 " rad found: the knee has " + text_of(leg[side].bend_rad, 2));
      for (std::size_t i = 0; i < kLegJoints; ++i) {
        const Link& own = biped.tree.moved(biped.leg[side].dof[i]);
        const Link& real = whole_.link(whole_.require_link(own.name));
        const double angle = leg[side].q[static_cast<Eigen::Index>(i)];
        if (angle < real.lower - 1e-9 || angle > real.upper + 1e-9)
          note(Kind::missing, "half-sitting",
               "joint '" + own.joint + "' would be at " + text_of(angle) + " rad, its limits are " +
                   text_of(real.lower) + " .. " + text_of(real.upper));
        out.emplace_back(own.joint, angle);
      }
    }
    return out;
  }

  const RobotTree& whole_;
  const ContactPoints& contacts_;
  double knee_rad_;
  bool complete_ = true;
  int trunk_ = 0;                                         ///< link in whole_
  std::array<int, 2> feet_{-1, -1};                       ///< links, in whole_
  std::array<std::vector<int>, 2> legs_;                  ///< links that joints move, in whole_
  std::map<std::string, std::vector<std::string>> held_;  ///< why: joints
  FoundBiped out_;
};

}  // namespace

std::vector<std::string> foot_links(const RobotTree& tree) {
  std::vector<std::string> names;
  for (const int end : lowest_ends(robot::held(tree, {}))) {
    if (end < 0) continue;
    // the last two, as toes may be held
    const std::vector<int> chain = robot::moved_links(tree, 0, end);
    const int first = chain.size() > kLegJoints ? chain[kLegJoints - 1] : chain.back();
    for (int l = first; l < static_cast<int>(tree.links().size()); ++l)
      if (tree.carries(first, l)) names.push_back(tree.link(l).name);
  }
  return names;
}

FoundBiped find_biped(const RobotTree& tree, const ContactPoints& contacts, double knee_rad) {
  return Finder(tree, contacts, knee_rad).find();
}

}  // namespace mimesis::walker
