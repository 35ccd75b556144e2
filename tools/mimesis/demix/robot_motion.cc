#include "tools/mimesis/demix/robot_motion.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/model/files.h"

namespace mimesis::tool {
namespace {

/// The robot with limits moved inwards.
robot::RobotTree narrowed(const robot::RobotTree& tree, double margin_rad) {
  std::vector<robot::Link> links = tree.links();
  for (robot::Link& link : links) {
    if (link.type == robot::JointType::prismatic) {
      throw ConfigError(tree.name() + ": joint " + link.joint + " slides, expected joints that " +
                        "turn: a motion model holds angles");
    }
    if (link.type != robot::JointType::revolute || !std::isfinite(link.upper - link.lower)) {
      continue;
    }
    const double margin = std::min(margin_rad, 0.25 * (link.upper - link.lower));
    link.lower += margin;
    link.upper -= margin;
  }
  return {tree.name(), std::move(links)};
}

}  // namespace

Robot::Robot(const RobotChoice& choice)
    : Robot(model::load_biped(choice.file), choice.limit_margin_rad) {}

Robot::Robot(const robot::Biped& biped, double limit_margin_rad)
    : tree_(biped.tree),
      narrow_(narrowed(tree_, limit_margin_rad)),
      figure_(retarget::figure_of(biped)) {}

tl::expected<mocap::Trials, Status> Robot::cut(const mocap::BodyClip& recorded,
                                               const mocap::CycleOptions& options) {
  const retarget::RobotClip motion = retarget::retarget(recorded, narrow_, figure_);
  const retarget::FigureClip figure = retarget::figure_clip(motion, recorded, tree_, figure_);
  clips_.push_back({.file = recorded.name,
                    .frames = static_cast<long>(motion.frames()),
                    .report = motion.report,
                    .ankle_m = figure.ankle_m,
                    .wrist_m = figure.wrist_m});
  return mocap::cut_cycles(figure.clip, options, {motion.joints, motion.q});
}

std::vector<std::optional<motion::RowLimits>> Robot::limits(
    const std::vector<std::string>& rows) const {
  std::vector<std::optional<motion::RowLimits>> out;
  for (const std::string& row : rows) {
    const int joint = tree_.find_joint(row);
    out.emplace_back();
    if (joint < 0) continue;
    const robot::Link& link = tree_.moved(joint);
    if (std::isfinite(link.lower) && std::isfinite(link.upper))
      out.back() = {link.lower, link.upper};
  }
  return out;
}

}  // namespace mimesis::tool
