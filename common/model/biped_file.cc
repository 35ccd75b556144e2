#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>

#include "common/error.h"
#include "common/math/so3.h"
#include "common/model/files.h"
#include "common/robot/dynamics.h"
#include "common/runtime/param_source.h"
#include "common/runtime/params.h"
#include "common/shared_data.h"

namespace mimesis::model {

namespace fs = std::filesystem;
using runtime::ParamVisitor;

std::string urdf_of(const std::string& path, const std::string& urdf_name) {
  const std::string kShared = "shared:";
  const bool shared = urdf_name.starts_with(kShared);
  const fs::path urdf = shared ? shared_data(urdf_name.substr(kShared.size()))
                               : fs::path(path).parent_path() / urdf_name;
  std::error_code ignored;
  if (urdf_name.empty() || !fs::is_regular_file(urdf, ignored)) {
    throw ConfigError(path + ": urdf: no file '" + urdf.string() +
                      (shared ? "', expected in the shared folder ($MIMESIS_SHARED)"
                              : "', expected one beside this file"));
  }
  return urdf.lexically_normal().string();
}

namespace {

struct FrameEntry {
  std::string name, link;
  std::vector<double> position_m{0.0, 0.0, 0.0}, rpy_rad{0.0, 0.0, 0.0};

  void visit(ParamVisitor& v) {
    v("name", name);
    v("link", link);
    v("position_m", position_m, -10.0, 10.0, 3);
    v("rpy_rad", rpy_rad, -6.3, 6.3, 3);
  }
};

struct HeldEntry {
  std::string joint;
  double at = 0.0;

  void visit(ParamVisitor& v) {
    v("joint", joint);
    v("at", at, -6.3, 6.3);
  }
};

struct PostureEntry {
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
  bool balance_inertias = false;
  std::vector<HeldEntry> fixed;
  std::vector<FrameEntry> frames;
  std::vector<std::string> soles, hands;
  std::vector<GripperEntry> grippers;
  std::vector<PostureEntry> half_sitting;
  robot::BipedNames names;  // without the part above
  BipedDrives drives;

  void visit(ParamVisitor& v) {
    v("urdf", urdf);
    v("balance_inertias", balance_inertias);
    list(v, "fixed", fixed);
    list(v, "frames", frames);
    v("soles", soles);
    v("hands", hands);
    list(v, "grippers", grippers);
    v("trunk", names.trunk);
    v("head", names.head);
    v("imu", names.imu);
    v.group("sole", [this](ParamVisitor& g) {
      g("back_m", names.sole_back_m, -1.0, 0.0);
      g("front_m", names.sole_front_m, 0.0, 1.0);
      g("inner_m", names.sole_inner_m, 0.0, 1.0);
      g("outer_m", names.sole_outer_m, 0.0, 1.0);
    });
    list(v, "half_sitting", half_sitting);
    v("step_s", names.step_s, 0.4, 1.2);
    v.group("gait", [this](ParamVisitor& g) {
      g("step_height_m", names.gait.step_height_m, 0.0, 0.2);
      g("most_forward_m_s", names.gait.most_forward_m_s, 0.0, 2.0);
      g("most_sideways_m_s", names.gait.most_sideways_m_s, 0.0, 1.0);
      g("most_turn_rad_s", names.gait.most_turn_rad_s, 0.0, 2.0);
    });
    v("drives", drives.kind);
    v("rate_hz", drives.rate_hz, kLeastRate_hz, kMostRate_hz);
    v("a_max_rad_s2", drives.a_max_rad_s2, 1.0, 1e5);
  }
};

BipedEntry read_entry(const std::string& path) {
  BipedEntry entry;
  runtime::load_params(path, [&](ParamVisitor& v) { entry.visit(v); });
  return entry;
}

/// The URDF's robot with the file's frames and held joints, and without masses of fixed links.
robot::RobotTree tree_of(const std::string& path, const BipedEntry& entry) {
  const std::string urdf = urdf_of(path, entry.urdf);
  robot::JointPlaces fixed, posture;
  for (const HeldEntry& joint : entry.fixed) fixed.emplace_back(joint.joint, joint.at);
  for (const PostureEntry& j : entry.half_sitting) posture.emplace_back(j.joint, j.angle_rad);
  robot::RobotTree bare = robot::merged(robot::held(robot::read_urdf(urdf), fixed, posture));
  if (entry.balance_inertias) bare = robot::balanced(bare);
  try {
    bare.require_dynamics();
  } catch (const ConfigError& e) {
    throw ConfigError(urdf + ": " + e.what());
  }
  std::vector<robot::Link> links = bare.links();
  for (const FrameEntry& frame : entry.frames) {
    robot::Link link;
    link.name = frame.name;
    link.joint = frame.name + "_frame";
    link.parent = bare.require_link(frame.link);
    link.X_PJ.translation() = Eigen::Vector3d::Map(frame.position_m.data());
    link.X_PJ.linear() = math::rotation_of_rpy(Eigen::Vector3d::Map(frame.rpy_rad.data()));
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
  if (!is_biped(file)) {
    throw ConfigError(
        file + (is_urdf(file)
                    ? ": is a URDF, expected a biped's file, which `mimesis robot check` writes"
                    : ": has no urdf:, expected a biped's file, did you mean 'biped.yaml'?"));
  }
  const BipedEntry entry = read_entry(path);
  try {
    robot::BipedNames names = entry.names;
    names.sole = two(entry.soles, "soles");
    if (!entry.hands.empty()) names.hand = two(entry.hands, "hands");
    if (!entry.grippers.empty()) {
      std::vector<std::string> joints;
      for (const GripperEntry& gripper : entry.grippers) joints.push_back(gripper.joint);
      names.gripper = two(joints, "grippers");
      names.gripper_closed_rad = {entry.grippers[0].closed_rad, entry.grippers[1].closed_rad};
    }
    for (const PostureEntry& j : entry.half_sitting) {
      names.half_sitting.emplace_back(j.joint, j.angle_rad);
    }
    robot::Biped biped = robot::make_biped(tree_of(path, entry), names);
    for (const robot::Body& body : robot::bodies_of(biped.tree)) {
      if (body.mass > 0.0) continue;
      throw ConfigError("link '" + biped.tree.link(body.link).name +
                        "' has no mass, expected one on every link that moves");
    }
    return biped;
  } catch (const ConfigError& e) {
    const std::string what = e.what();
    throw ConfigError(what.starts_with(path) ? what : path + ": " + what);
  }
}

BipedDrives drives_of_biped(const std::string& file) {
  return read_entry(runtime::find_model_file(file)).drives;
}

bool is_biped(const std::string& file) {
  std::ifstream in(runtime::find_model_file(file));
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("urdf:")) return true;
  }
  return false;
}

bool is_urdf(const std::string& file) {
  std::string ending = fs::path(file).extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending == ".urdf";
}

double rate_of_robot(const std::string& file) {
  if (is_urdf(file)) return BipedDrives{}.rate_hz;
  return is_biped(file) ? drives_of_biped(file).rate_hz : load_arm(file).rate_hz;
}

std::string urdf_of_biped(const std::string& file) {
  const std::string path = runtime::find_model_file(file);
  return urdf_of(path, read_entry(path).urdf);
}

}  // namespace mimesis::model
