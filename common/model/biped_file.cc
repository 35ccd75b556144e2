#include <filesystem>

#include "common/error.h"
#include "common/model/files.h"
#include "common/runtime/param_source.h"
#include "common/runtime/params.h"
#include "common/shared_data.h"

namespace mimesis::model {
namespace {

using runtime::ParamVisitor;
namespace fs = std::filesystem;

struct FrameEntry {
  std::string name, link;
  std::vector<double> position_m{0.0, 0.0, 0.0};

  void visit(ParamVisitor& v) {
    v("name", name);
    v("link", link);
    v("position_m", position_m, -10.0, 10.0, 3);
  }
};

struct SoleEntry {
  double back_m = 0.0, front_m = 0.0, inner_m = 0.0, outer_m = 0.0;

  void visit(ParamVisitor& v) {
    v("back_m", back_m, -1.0, 0.0);
    v("front_m", front_m, 0.0, 1.0);
    v("inner_m", inner_m, 0.0, 1.0);
    v("outer_m", outer_m, 0.0, 1.0);
  }
};

struct JointEntry {
  std::string joint;
  double angle_rad = 0.0;

  void visit(ParamVisitor& v) {
    v("joint", joint);
    v("angle_rad", angle_rad, -6.3, 6.3);
  }
};

struct GripperEntry {
  std::string joint;
  double closed_rad = 0.0;

  void visit(ParamVisitor& v) {
    v("joint", joint);
    v("closed_rad", closed_rad, -3.15, 3.15);
  }
};

struct BipedEntry {
  std::string urdf;
  std::vector<FrameEntry> frames;
  std::vector<std::string> soles, hands;
  std::vector<GripperEntry> grippers;
  std::string trunk, head, imu;
  SoleEntry sole;
  std::vector<JointEntry> half_sitting;

  void visit(ParamVisitor& v) {
    v("urdf", urdf);
    list(v, "frames", frames);
    v("soles", soles);
    v("hands", hands);
    list(v, "grippers", grippers);
    v("trunk", trunk);
    v("head", head);
    v("imu", imu);
    v.group("sole", [this](ParamVisitor& g) { sole.visit(g); });
    list(v, "half_sitting", half_sitting);
  }
};

BipedEntry read_entry(const std::string& path) {
  BipedEntry entry;
  runtime::load_params(path, [&](ParamVisitor& v) { entry.visit(v); });
  return entry;
}

std::string urdf_of(const std::string& path, const BipedEntry& entry) {
  const std::string kShared = "shared:";
  const bool shared = entry.urdf.starts_with(kShared);
  const fs::path urdf = shared ? shared_data(entry.urdf.substr(kShared.size()))
                               : fs::path(path).parent_path() / entry.urdf;
  std::error_code ignored;
  if (entry.urdf.empty() || !fs::is_regular_file(urdf, ignored)) {
    throw ConfigError(path + ": urdf: no file '" + urdf.string() +
                      (shared ? "', expected in the shared folder ($MIMESIS_SHARED)"
                              : "', expected one beside this file"));
  }
  return urdf.lexically_normal().string();
}

/// The URDF's robot with the file's frames.
robot::RobotTree tree_of(const std::string& path, const BipedEntry& entry) {
  const robot::RobotTree bare = robot::read_urdf(urdf_of(path, entry));
  std::vector<robot::Link> links = bare.links();
  for (const FrameEntry& frame : entry.frames) {
    robot::Link link;
    link.name = frame.name;
    link.joint = frame.name + "_frame";
    link.parent = bare.require_link(frame.link);
    link.X_PJ.translation() = Eigen::Vector3d::Map(frame.position_m.data());
    links.push_back(std::move(link));
  }
  return {bare.name(), std::move(links)};
}

std::array<std::string, 2> two(const std::vector<std::string>& names, const std::string& key) {
  if (names.size() != 2) {
    throw ConfigError(key + ": " + std::to_string(names.size()) +
                      " entries, expected the left one and the right one");
  }
  return {names[0], names[1]};
}

}  // namespace

robot::Biped load_biped(const std::string& file) {
  const std::string path = runtime::find_model_file(file);
  const BipedEntry entry = read_entry(path);
  try {
    robot::BipedNames names{.sole = two(entry.soles, "soles"),
                            .hand = {},
                            .trunk = entry.trunk,
                            .head = entry.head,
                            .imu = entry.imu,
                            .sole_back_m = entry.sole.back_m,
                            .sole_front_m = entry.sole.front_m,
                            .sole_inner_m = entry.sole.inner_m,
                            .sole_outer_m = entry.sole.outer_m,
                            .half_sitting = {}};
    if (!entry.hands.empty()) names.hand = two(entry.hands, "hands");
    if (!entry.grippers.empty()) {
      std::vector<std::string> joints;
      for (const GripperEntry& gripper : entry.grippers) joints.push_back(gripper.joint);
      names.gripper = two(joints, "grippers");
      names.gripper_closed_rad = {entry.grippers[0].closed_rad, entry.grippers[1].closed_rad};
    }
    for (const JointEntry& j : entry.half_sitting) {
      names.half_sitting.emplace_back(j.joint, j.angle_rad);
    }
    return robot::make_biped(tree_of(path, entry), names);
  } catch (const ConfigError& e) {
    const std::string what = e.what();
    throw ConfigError(what.starts_with(path) ? what : path + ": " + what);
  }
}

std::string urdf_of_biped(const std::string& file) {
  const std::string path = runtime::find_model_file(file);
  return urdf_of(path, read_entry(path));
}

}  // namespace mimesis::model
