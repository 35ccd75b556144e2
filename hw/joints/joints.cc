#include "hw/joints/joints.h"

#include <fmt/core.h>

#include <cmath>
#include <utility>

#include "common/error.h"
#include "common/model/files.h"
#include "common/robot/robot_tree.h"
#include "common/runtime/param_source.h"

namespace mimesis::hw {
namespace {

constexpr double kUnlimited_rad = 1e3;  // a joint without ends: what fits into 607Dh

[[noreturn]] void refuse_sliding(const std::string& file, const std::string& joint) {
  throw ConfigError(file + ": joint '" + joint +
                    "' slides; the bridge and its drives move joints that turn [rad]");
}

Joints arm_joints(const kin::ArmModel& model, const std::string& file) {
  Joints joints{.names = {},
                .limits = {.q_min = model.q_min,
                           .q_max = model.q_max,
                           .v_max = model.v_max,
                           .a_max = model.a_max},
                .home = model.home,
                .effort_n_m = Eigen::VectorXd::Zero(model.dof()),
                .drives = model.drives,
                .rate_hz = model.rate_hz,
                .extrapolated_cycles = model.extrapolated_cycles};
  for (int i = 1; i <= model.dof(); ++i) {
    joints.names.push_back("A" + std::to_string(i));
    if (model.links[static_cast<std::size_t>(i - 1)].slides)
      refuse_sliding(file, joints.names.back());
  }
  return joints;
}

Joints tree_joints(const robot::RobotTree& tree, const Eigen::VectorXd& home,
                   const model::BipedDrives& drives, const std::string& file) {
  const Eigen::Index n = tree.dof();
  Joints joints{.names = tree.joint_names(),
                .limits = {.q_min = tree.lower().cwiseMax(-kUnlimited_rad),
                           .q_max = tree.upper().cwiseMin(kUnlimited_rad),
                           .v_max = tree.max_speed(),
                           .a_max = Eigen::VectorXd::Constant(n, drives.a_max_rad_s2)},
                .home = home,
                .effort_n_m = Eigen::VectorXd::Zero(n),
                .walks = true,
                .drives = drives.kind,
                .rate_hz = drives.rate_hz};
  for (int i = 0; i < tree.dof(); ++i) {
    joints.effort_n_m[i] = tree.moved(i).max_effort;
    if (tree.moved(i).type == robot::JointType::prismatic)
      refuse_sliding(file, joints.names[static_cast<std::size_t>(i)]);
    if (!(joints.limits.q_min[i] < joints.limits.q_max[i]))
      throw ConfigError(file + ": joint '" + joints.names[static_cast<std::size_t>(i)] +
                        "': expected limits with lower below upper");
    if (!(joints.limits.v_max[i] > 0.0 && std::isfinite(joints.limits.v_max[i]))) {
      throw ConfigError(file + ": joint '" + joints.names[static_cast<std::size_t>(i)] +
                        "': expected a velocity limit, is " +
                        std::to_string(joints.limits.v_max[i]));
    }
  }
  return joints;
}

}  // namespace

Joints load_joints(const std::string& file) {
  if (model::is_urdf(file)) {
    const robot::RobotTree tree = robot::read_urdf(runtime::find_model_file(file));
    return tree_joints(tree, Eigen::VectorXd::Zero(tree.dof()), {}, file);
  }
  if (model::is_biped(file)) {
    const robot::Biped biped = model::load_biped(file);
    return tree_joints(biped.tree, biped.half_sitting, model::drives_of_biped(file), file);
  }
  return arm_joints(model::load_arm(file), file);
}

std::vector<BusShare> complete(std::vector<BusShare> buses, const std::string& can,
                               const Joints& joints) {
  if (buses.empty()) return {{.can = can, .joints = joints.count()}};
  int carried = 0;
  for (std::size_t i = 0; i < buses.size(); ++i) {
    carried += buses[i].joints;
    for (std::size_t j = 0; j < i; ++j) {
      if (buses[i].can != buses[j].can) continue;
      throw ConfigError("buses[" + std::to_string(i) + "].can: '" + buses[i].can +
                        "' is used by buses[" + std::to_string(j) + "]");
    }
  }
  if (carried != joints.count()) {
    throw ConfigError("buses: carry " + std::to_string(carried) + " joints, the robot has " +
                      std::to_string(joints.count()));
  }
  return buses;
}

std::vector<cia402::Axis> complete(std::vector<cia402::Axis> axes, const Joints& joints) {
  const bool given = !axes.empty();
  axes = cia402::complete(std::move(axes), joints.count());
  for (std::size_t i = 0; !given && i < axes.size(); ++i) {
    const double effort = joints.effort_n_m[static_cast<Eigen::Index>(i)];
    if (effort > 0.0) axes[i].rated_torque_n_m = effort;
  }
  return axes;
}

std::string text_of(const std::string& robot, std::span<const cia402::Axis> axes) {
  std::string text = robot.substr(robot.rfind('/') + 1) + ": nodes";
  const auto scale = [&](std::size_t i) {
    return std::pair(axes[i].sign * axes[i].increments_per_rad, axes[i].offset_rad);
  };
  for (std::size_t i = 0; i < axes.size(); ++i) {
    text += fmt::format(" {}", axes[i].node_id);
    if (i + 1 < axes.size() && scale(i + 1) == scale(i)) continue;
    text += fmt::format(" at {:.6g}/rad", scale(i).first);
    if (scale(i).second != 0.0) text += fmt::format(" from {:.4g} rad", scale(i).second);
  }
  return text;
}

JointLimits part_of(const JointLimits& limits, int first, int count) {
  return {.q_min = limits.q_min.segment(first, count),
          .q_max = limits.q_max.segment(first, count),
          .v_max = limits.v_max.segment(first, count),
          .a_max = limits.a_max.segment(first, count),
          .j_max = limits.j_max.size() == 0 ? limits.j_max
                                            : Eigen::VectorXd(limits.j_max.segment(first, count))};
}

}  // namespace mimesis::hw
