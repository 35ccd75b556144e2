#include "nodes/synthesizer/drawer_run.h"

#include <cmath>

namespace mimesis::synthesizer {
namespace {

Eigen::Vector2d rotated(const Eigen::Vector2d& p, double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  return {c * p.x() - s * p.y(), s * p.x() + c * p.y()};
}

}  // namespace

tl::expected<DrawerRun, Status> DrawerRun::start(const ActionMaps& maps, const DrawerPlace& place,
                                                 const Eigen::Vector2d& from_W_m, double dt_s) {
  const Eigen::Vector2d way = place.front_W_m - from_W_m;
  DrawerGoal goal;
  goal.front_W_m = way.norm();
  goal.object_depth_m = place.object_depth_m;
  SequenceOptions options;
  options.dt_s = dt_s;
  auto sequence = DrawerSequence::start(maps, goal, options);
  if (!sequence) return tl::make_unexpected(sequence.error());
  DrawerRun run(std::move(*sequence), place, from_W_m, std::atan2(way.y(), way.x()));
  run.step();  // its first posture
  return run;
}

std::string DrawerRun::move(const DrawerPlace& place) {
  const Eigen::Vector2d way = rotated(place.front_W_m - from_, -heading_rad_);
  if (std::abs(way.y()) > kAcross_m) {
    return "the drawer moved " + std::to_string(way.y()) + " m across the way to it";
  }
  DrawerGoal goal;
  goal.front_W_m = way.x();
  goal.object_depth_m = place.object_depth_m;
  goal.object_lateral_m = way.y();
  sequence_.set_goal(goal);
  place_ = place;
  return {};
}

void DrawerRun::step() { sequence_.step(); }

Eigen::Vector2d DrawerRun::position_W_m() const {
  return from_ + rotated(sequence_.state().pelvis_W_m.head<2>(), heading_rad_);
}

const char* DrawerRun::action() const {
  switch (sequence_.state().action) {
    case kNormalStep:
      return "step";
    case kReachingStep:
      return "reach";
    case kStanding:
      break;
  }
  return "take";
}

}  // namespace mimesis::synthesizer
