#include "hw/sim/world/world.h"

#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "common/error.h"
#include "common/kin/arm.h"

namespace mimesis::world {
namespace {

constexpr double kGravity_m_s2 = 9.81;
constexpr double kDrop_m = 0.02;    // from higher the object topples on landing
constexpr double kFloor_m = -0.76;  // of the room, beside the table
constexpr double kSink_m = 0.005;   // a support so far above the lowest point still carries it
// Below the contact's closure: still holds, two steps of 8 bits; is let go.
constexpr double kClosing = 0.008, kOpening = 0.03;
constexpr double kKnock_m = 0.005;  // a push deeper than this knocks the object over

bool between(double lo, double x, double hi) { return lo <= x && x <= hi; }

bool from_above(const HandShape& hand, const Eigen::Isometry3d& X_EO, const Cylinder& object) {
  const Eigen::Vector3d p = X_EO * Eigen::Vector3d(0, 0, object.height / 2);
  return -X_EO.linear()(2, 2) >= std::cos(hand.max_tilt) &&
         std::abs(p.x()) <= hand.aperture / 2 - object.radius && std::abs(p.y()) <= hand.pad &&
         between(-hand.palm, p.z(), hand.tips - hand.overlap);
}

bool from_the_side(const HandShape& hand, const Eigen::Isometry3d& X_EO, const Cylinder& object) {
  const Eigen::Vector3d p = X_EO.translation();
  return std::abs(X_EO.linear()(1, 2)) >= std::cos(hand.max_tilt) &&
         std::abs(p.x()) <= hand.aperture / 2 - object.radius &&
         std::abs(p.y()) <= object.height / 2 - hand.pad &&
         between(object.radius - hand.palm, p.z(), hand.tips - hand.overlap);
}

double top(const kin::Box& box) { return box.center.z() + box.half_extent.z(); }

/// Horizontal distance of `p` from the box's outline, 0 inside [m].
double beside(const kin::Box& box, const Eigen::Vector3d& p) {
  return ((p - box.center).cwiseAbs() - box.half_extent).head<2>().cwiseMax(0.0).norm();
}

/// Why the object is not where it should be, as the world saw it.
std::string observed(const ObjectModel& object, const kin::GoalPlace* goal, double error) {
  if (!object.mishap().empty()) return "object " + object.mishap();
  if (!object.was_held()) return "object not grasped";
  if (object.state() == ObjectState::held) return "object not released";
  if (goal == nullptr) return "no goal was decided";
  return "placed " + millimetres(error) + " from goal " + goal->name + " (radius " +
         millimetres(goal->radius) + ")";
}

using Eigen::Vector3d;

/// Whether the arm's safety balls keep this far from bar and boxes.
bool clear(const kin::ArmModel& arm, const kin::Table& table, const Eigen::VectorXd& q,
           double spare_m) {
  std::vector<Eigen::Isometry3d> X;
  kin::forward(arm, q, X);
  Eigen::Matrix3Xd centers;
  kin::ball_centers(arm, X, centers);
  for (std::size_t i = 0; i < arm.balls.size(); ++i) {
    if (std::ranges::find(arm.env_groups, arm.balls[i].group) == arm.env_groups.end()) continue;
    const Vector3d at = centers.col(static_cast<Eigen::Index>(i));
    const double away = arm.balls[i].radius + spare_m;
    const bool touches =
        std::ranges::any_of(
            table.balls,
            [&](const kin::Ball& b) { return (b.center - at).norm() < b.radius + away; }) ||
        std::ranges::any_of(table.boxes,
                            [&](const kin::Box& b) { return signed_distance(b, at) < away; }) ||
        std::ranges::any_of(table.hulls, [&](const kin::Hull& h) {
          const math::ConvexPart ball{at.transpose(), away};
          return math::gap_between(ball, h.shape, Eigen::Isometry3d::Identity()).at_most < 0.0;
        });
    if (touches) return false;
  }
  return true;
}

/// One draw.
template <class Draw>
kin::Table scattered(kin::Table table, const Draw& draw) {
  const auto move = [&table](const std::string& name, const Vector3d& by) {
    for (kin::Box& box : table.boxes) {
      if (box.name != name) continue;
      box.center.head<2>() += by.head<2>();
      box.center.z() += 0.5 * by.z();  // its foot stays where it is
      box.half_extent.z() += 0.5 * by.z();
    }
  };
  const double x = draw(), y = draw();
  table.object += Vector3d(x, y, 0.0);
  move("plinth", {x, y, 0.0});
  for (kin::GoalPlace& goal : table.goals) {
    const double gx = draw(), gy = draw(), gz = draw();
    goal.position += Vector3d(gx, gy, gz);
    move(goal.name + " stand", {gx, gy, gz});
  }
  return table;
}

}  // namespace

GraspContact grasp_contact(const HandShape& hand, Grip grip, const Eigen::Isometry3d& X_WE,
                           const Cylinder& object) {
  GraspContact contact;
  contact.closure = 1.0 - 2.0 * object.radius / hand.aperture;
  if (grip == Grip::unknown || contact.closure < 0.0 || tilt(object) > hand.max_tilt)
    return contact;
  const Eigen::Isometry3d X_EO = X_WE.inverse() * object.X_WO;
  contact.reachable =
      grip == Grip::precision ? from_above(hand, X_EO, object) : from_the_side(hand, X_EO, object);
  return contact;
}

ObjectModel::ObjectModel(const kin::Table& table) : boxes_(table.boxes), balls_(table.balls) {
  cylinder_.X_WO.translation() = table.object;
  cylinder_.radius = table.object_radius;
  cylinder_.height = table.object_height;
}

void ObjectModel::grasp(const Eigen::Isometry3d& X_WE) {
  MIMESIS_ASSERT(state_ != ObjectState::held);
  X_EO_ = X_WE.inverse() * cylinder_.X_WO;
  X_EO_.translation().x() = 0.0;
  state_ = ObjectState::held;
  moved_ = was_held_ = true;
  carry(X_WE);
}

void ObjectModel::carry(const Eigen::Isometry3d& X_WE) {
  MIMESIS_ASSERT(state_ == ObjectState::held);
  cylinder_.X_WO = X_WE * X_EO_;
}

void ObjectModel::release() {
  MIMESIS_ASSERT(state_ == ObjectState::held);
  state_ = ObjectState::falling;
  velocity_ = 0.0;
  plan_landing();
}

void ObjectModel::plan_landing() {
  const Eigen::Vector3d p = cylinder_.X_WO.translation();
  const double bottom = lowest_point(cylinder_);
  const double reachable = bottom + kSink_m;
  landing_z_ = kFloor_m;
  std::string support = "floor";
  for (const kin::Box& box : boxes_) {
    if (beside(box, p) == 0.0 && top(box) <= reachable && top(box) > landing_z_) {
      landing_z_ = top(box);
      support = box.name;
    }
  }

  will_topple_.clear();
  const double fall = bottom - landing_z_;
  const double lean = tilt(cylinder_);
  if (fall > kDrop_m) will_topple_ = "dropped from " + millimetres(fall) + " onto " + support;
  if (lean > std::atan2(cylinder_.radius, cylinder_.height / 2)) {
    will_topple_ =
        "released leaning by " + std::to_string(std::lround(lean * 180.0 / M_PI)) + " degrees";
  }
  if (cylinder_.X_WO.linear()(2, 2) < 0.0) will_topple_ = "released upside down";
  for (const kin::Box& box : boxes_) {
    if (beside(box, p) > 0.0 && beside(box, p) < cylinder_.radius && top(box) <= reachable &&
        top(box) > landing_z_) {
      will_topple_ = "released across the edge of " + box.name;
    }
  }
  for (const kin::Ball& ball : balls_) {
    const double aside = (ball.center - p).head<2>().norm();
    if (aside < ball.radius + cylinder_.radius && ball.center.z() < bottom &&
        ball.center.z() + ball.radius > landing_z_) {
      will_topple_ = "released above the bar";
    }
  }
}

void ObjectModel::step(double dt) {
  if (state_ != ObjectState::falling) return;
  double& z = cylinder_.X_WO.translation().z();
  z -= velocity_ * dt + 0.5 * kGravity_m_s2 * dt * dt;
  velocity_ += kGravity_m_s2 * dt;
  if (lowest_point(cylinder_) <= landing_z_) land();
}

void ObjectModel::land() {
  state_ = ObjectState::resting;
  velocity_ = 0.0;
  upright_ = will_topple_.empty();
  Eigen::Isometry3d& X_WO = cylinder_.X_WO;
  if (upright_) {
    X_WO.linear() = Eigen::Matrix3d::Identity();
    X_WO.translation().z() = landing_z_ + cylinder_.height / 2;
  } else {
    mishap_ = will_topple_;
    X_WO.linear() = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY()).toRotationMatrix();
    X_WO.translation().z() = landing_z_ + cylinder_.radius;
  }
}

void ObjectModel::knock_over(const std::string& by) {
  MIMESIS_ASSERT(state_ != ObjectState::held);
  moved_ = true;
  plan_landing();
  will_topple_ = "knocked over by " + by;
  land();
}

Verdict judge(const TaskEnd& end, const ObjectModel& object,
              const std::vector<kin::GoalPlace>& goals) {
  MIMESIS_ASSERT(object.state() != ObjectState::falling);
  const auto goal = std::find_if(goals.begin(), goals.end(),
                                 [&](const kin::GoalPlace& g) { return g.name == end.goal; });
  Verdict verdict;
  if (goal != goals.end()) {
    verdict.placement_error = (object.cylinder().X_WO.translation() - goal->position).norm();
    verdict.placed = object.was_held() && object.state() == ObjectState::resting &&
                     object.upright() && verdict.placement_error <= goal->radius;
  }
  if (!end.done) {
    verdict.reason = end.reason.empty() ? "the planner failed without a reason" : end.reason;
  } else if (!verdict.placed) {
    verdict.reason =
        observed(object, goal == goals.end() ? nullptr : &*goal, verdict.placement_error);
  }
  return verdict;
}

World::World(kin::ArmModel arm, const kin::Table& table)
    : arm_(std::move(arm)), object_(table), collisions_(arm_, table) {}

void World::step(double dt) { object_.step(dt); }

void World::step(double dt, const Eigen::Ref<const Eigen::VectorXd>& q, const Hand& hand) {
  kin::forward(arm_, q, X_);
  handle_object(tool(), hand);
  object_.step(dt);
  collisions_.update(X_, {.cylinder = object_.cylinder(),
                          .held = object_.state() == ObjectState::held,
                          .between_fingers = contact_.reachable,
                          .falling = object_.state() == ObjectState::falling});
  if (object_.state() == ObjectState::resting && object_.upright() &&
      collisions_.push().depth > kKnock_m) {
    object_.knock_over(collisions_.push().name);
  }
}

void World::handle_object(const Eigen::Isometry3d& X_WE, const Hand& hand) {
  if (object_.state() == ObjectState::held) {
    object_.carry(X_WE);
    if (hand.closure < contact_.closure - kOpening) object_.release();
    return;  // a held object stays between the fingers
  }
  contact_ = grasp_contact({}, hand.grip, X_WE, object_.cylinder());
  if (contact_.reachable && object_.state() == ObjectState::resting &&
      hand.closure >= contact_.closure - kClosing) {
    object_.grasp(X_WE);
  }
}

std::string out_of_reach(const kin::ArmModel& arm, const kin::Table& table) {
  constexpr double kBelowTop = 0.02, kHigh = 0.09, kStep = 0.01, kSpare = 0.005;  // [m]
  constexpr int kStarts = 20;
  const auto reached = [&](const Vector3d& center) {
    for (int i = 0; i * kStep < kHigh + 0.5 * kStep; ++i) {
      const double up = 0.5 * table.object_height - kBelowTop + i * kStep;
      const kin::IkGoal hand{center + up * Vector3d::UnitZ(),
                             {{Vector3d::UnitZ(), -Vector3d::UnitZ()}}};
      const auto postures = kin::solve_ik_anywhere(arm, hand, kStarts, 1);
      const bool free = std::ranges::any_of(
          postures, [&](const Eigen::VectorXd& q) { return clear(arm, table, q, kSpare); });
      if (!free) return false;
    }
    return true;
  };
  if (!reached(table.object)) return "the object";
  for (const kin::GoalPlace& goal : table.goals) {
    if (goal.name == "high" && !reached(goal.position)) return "the high goal";
  }
  return "";
}

kin::Table random_table(const kin::ArmModel& arm, const kin::Table& usual, std::uint64_t seed) {
  constexpr double kAside = 0.015;  // [m]
  constexpr int kDraws = 100;
  std::mt19937_64 random(seed);
  const auto draw = [&random] {
    return kAside * (2.0 * static_cast<double>(random() >> 11) * 0x1.0p-53 - 1.0);
  };
  std::string missed;
  for (int i = 0; i < kDraws; ++i) {
    kin::Table table = scattered(usual, draw);
    missed = out_of_reach(arm, table);
    if (missed.empty()) return table;
  }
  throw ConfigError(fmt::format("scene: random: in {} draws around the table {} was out of reach",
                                kDraws, missed));
}

}  // namespace mimesis::world
