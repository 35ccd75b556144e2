#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>

#include "common/error.h"
#include "common/kin/dh_rows.h"
#include "common/model/files.h"
#include "common/robot/bodies.h"
#include "common/runtime/param_source.h"
#include "common/runtime/params.h"
#include "common/shared_data.h"

namespace mimesis::model {
namespace {

namespace fs = std::filesystem;
using runtime::ParamVisitor;

constexpr double kLeastRate_hz = 10.0, kMostRate_hz = 1000.0;
constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

struct JointEntry {
  std::string type = "turns";
  double a_m = 0.0, alpha_rad = 0.0, d_m = 0.0, offset_rad = 0.0;
  // Out of their ranges: a file that leaves one out is refused by its name. [rad], or [m]
  double q_min = kMissing, q_max = kMissing, v_max = kMissing, a_max = kMissing;
  double j_max = 0.0;  // 0: no limit
  double home = 0.0;

  bool slides() const { return type == "slides"; }
  void visit(ParamVisitor& v) {
    v("type", type, {"turns", "slides"});
    v("a_m", a_m, -10.0, 10.0);
    v("alpha_rad", alpha_rad, -3.15, 3.15);
    v("d_m", d_m, -10.0, 10.0);
    v("offset_rad", offset_rad, -6.3, 6.3);
    const double most = slides() ? 10.0 : 6.3;
    v(slides() ? "q_min_m" : "q_min_rad", q_min, -most, most);
    v(slides() ? "q_max_m" : "q_max_rad", q_max, -most, most);
    v(slides() ? "v_max_m_s" : "v_max_rad_s", v_max, 1e-3, 100.0);
    v(slides() ? "a_max_m_s2" : "a_max_rad_s2", a_max, 1e-3, 1000.0);
    v(slides() ? "j_max_m_s3" : "j_max_rad_s3", j_max, 0.0, 1e9);
    v(slides() ? "home_m" : "home_rad", home, -most, most);
  }
};

/// Joints of a URDF, from one link to another.
struct ChainEntry {
  std::string urdf, base, tip;
  // Of each joint, which the URDF has not; j_max and home may be left out.
  std::vector<double> a_max_rad_s2, j_max_rad_s3, home_rad;

  void visit(ParamVisitor& v) {
    v("urdf", urdf);
    v("base", base);
    v("tip", tip);
    v("a_max_rad_s2", a_max_rad_s2, 1e-3, 1000.0, 0);
    v("j_max_rad_s3", j_max_rad_s3, 0.0, 1e9, 0);
    v("home_rad", home_rad, -6.3, 6.3, 0);
  }
};

struct BallEntry {
  int frame = 0;
  std::string link, group;  // link: of the chain's URDF, instead of a frame
  std::vector<double> center_m;
  double radius_m = 0.0;

  void visit(ParamVisitor& v) {
    v("frame", frame, 0, 100);
    v("link", link);
    v("group", group);
    v("center_m", center_m, -10.0, 10.0, 3);
    v("radius_m", radius_m, 1e-4, 1.0);
  }
};

struct PairEntry {
  std::string a, b;

  void visit(ParamVisitor& v) {
    v("a", a);
    v("b", b);
  }
};

struct ArmFile {
  kin::ArmModel arm;  // figures that need no check; the others are added to it
  std::string convention = "standard";
  std::vector<double> base_m{0.0, 0.0, 0.0}, base_rpy_rad{0.0, 0.0, 0.0};
  std::vector<double> tool_m{0.0, 0.0, 0.0}, tool_rpy_rad{0.0, 0.0, 0.0};
  std::vector<JointEntry> joints;
  ChainEntry chain;
  std::vector<std::string> obstacle_groups;
  std::vector<PairEntry> self_pairs;
  std::vector<BallEntry> balls;

  void visit(ParamVisitor& v) {
    v("name", arm.name);
    v("drives", arm.drives);
    v("rate_hz", arm.rate_hz, kLeastRate_hz, kMostRate_hz);
    v("extrapolated_cycles", arm.extrapolated_cycles, 0, 10);
    v("convention", convention, {"standard", "modified"});
    v("base_m", base_m, -10.0, 10.0, 3);
    v("base_rpy_rad", base_rpy_rad, -6.3, 6.3, 3);
    v("tool_m", tool_m, -10.0, 10.0, 3);
    v("tool_rpy_rad", tool_rpy_rad, -6.3, 6.3, 3);
    list(v, "joints", joints);
    v.group("chain", [this](ParamVisitor& g) { chain.visit(g); });
    v("groups", arm.groups);
    v("obstacle_groups", obstacle_groups);
    list(v, "self_pairs", self_pairs);
    list(v, "balls", balls);
  }
};

/// As in a URDF: Rz(yaw) Ry(pitch) Rx(roll).
Eigen::Isometry3d pose(const std::vector<double>& position_m, const std::vector<double>& rpy_rad) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = Vector3d::Map(position_m.data());
  if (Vector3d::Map(rpy_rad.data()).isZero(0.0)) return X;
  X.linear() =
      (AngleAxisd(rpy_rad[2], Vector3d::UnitZ()) * AngleAxisd(rpy_rad[1], Vector3d::UnitY()) *
       AngleAxisd(rpy_rad[0], Vector3d::UnitX()))
          .matrix();
  return X;
}

/// Path of the URDF that a file names.
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

class Builder {
 public:
  Builder(const std::string& file, const ArmFile& entry) : file_(file), entry_(entry) {}

  kin::ArmModel build() {
    kin::ArmModel arm = entry_.arm;
    arm.X_WB = pose(entry_.base_m, entry_.base_rpy_rad);
    arm.X_LE = pose(entry_.tool_m, entry_.tool_rpy_rad);
    if (entry_.joints.empty() == entry_.chain.urdf.empty())
      fail("joints", "there is none, expected joints, or a chain of a URDF");
    entry_.joints.empty() ? add_chain(arm) : add_joints(arm);
    add_balls(arm);
    for (const std::string& group : entry_.obstacle_groups) {
      arm.env_groups.push_back(group_index("obstacle_groups", group));
    }
    for (const PairEntry& pair : entry_.self_pairs) {
      arm.self_pairs.emplace_back(group_index("self_pairs", pair.a),
                                  group_index("self_pairs", pair.b));
    }
    return arm;
  }

 private:
  [[noreturn]] void fail(const std::string& key, const std::string& what) const {
    throw ConfigError(file_ + ": " + key + ": " + what);
  }

  int group_index(const std::string& key, const std::string& group) const {
    const auto it = std::ranges::find(entry_.arm.groups, group);
    if (it == entry_.arm.groups.end()) fail(key, "'" + group + "' is not one of groups");
    return static_cast<int>(it - entry_.arm.groups.begin());
  }

  void add_joints(kin::ArmModel& arm) const {
    const auto n = static_cast<Eigen::Index>(entry_.joints.size());
    for (Eigen::VectorXd* v : {&arm.q_min, &arm.q_max, &arm.v_max, &arm.a_max, &arm.home})
      v->resize(n);
    std::vector<double> jerk;
    for (Eigen::Index i = 0; i < n; ++i) {
      const JointEntry& j = entry_.joints[static_cast<std::size_t>(i)];
      const std::string key = "joints[" + std::to_string(i) + "]";
      const std::string unit = j.slides() ? "_m" : "_rad";
      if (j.q_min >= j.q_max) fail(key, "q_min" + unit + " is not below q_max" + unit);
      if (j.home < j.q_min || j.home > j.q_max)
        fail(key, "home" + unit + " is outside q_min" + unit + " .. q_max" + unit);
      arm.links.push_back({.a = j.a_m,
                           .alpha = j.alpha_rad,
                           .d = j.d_m,
                           .offset = j.offset_rad,
                           .modified = entry_.convention == "modified",
                           .slides = j.slides()});
      arm.q_min[i] = j.q_min;
      arm.q_max[i] = j.q_max;
      arm.v_max[i] = j.v_max;
      arm.a_max[i] = j.a_max;
      arm.home[i] = j.home;
      jerk.push_back(j.j_max);
    }
    set_jerk(arm, jerk);
  }

  static void set_jerk(kin::ArmModel& arm, const std::vector<double>& j_max) {
    if (std::ranges::all_of(j_max, [](double j) { return j == 0.0; })) return;
    arm.j_max = Eigen::VectorXd::Map(j_max.data(), std::ssize(j_max));
    arm.j_max =
        (arm.j_max.array() == 0.0).select(std::numeric_limits<double>::infinity(), arm.j_max);
  }

  void add_chain(kin::ArmModel& arm) {
    const ChainEntry& chain = entry_.chain;
    const robot::RobotTree tree =
        robot::read_urdf(urdf_of(runtime::find_model_file(file_), chain.urdf));
    const int base = tree.require_link(chain.base);
    std::vector<int> way;
    for (int l = tree.require_link(chain.tip); l != base; l = tree.link(l).parent) {
      if (l < 0) fail("chain", "link '" + chain.base + "' does not carry '" + chain.tip + "'");
      way.insert(way.begin(), l);
    }
    Eigen::Isometry3d X_BL = Eigen::Isometry3d::Identity();
    std::vector<kin::JointAxis> axes;
    std::vector<const robot::Link*> moved;
    links_[chain.base] = {0, X_BL};
    for (const int l : way) {
      const robot::Link& link = tree.link(l);
      X_BL = X_BL * link.X_PJ;
      if (link.type != robot::JointType::fixed) {
        axes.push_back({X_BL.translation(), X_BL.linear() * link.axis,
                        link.type == robot::JointType::prismatic});
        moved.push_back(&link);
      }
      links_[link.name] = {static_cast<int>(axes.size()), X_BL};
    }
    if (axes.empty()) fail("chain", "no joint moves");
    set_limits(arm, moved);
    const kin::DhRows rows = kin::dh_rows(axes);
    arm.links = rows.links;
    arm.X_WB = arm.X_WB * rows.frames.front();
    arm.X_LE = rows.frames.back().inverse() * X_BL * arm.X_LE;
    for (auto& [name, place] : links_)
      place.X_FL = rows.frames[static_cast<std::size_t>(place.frame)].inverse() * place.X_FL;
  }

  void set_limits(kin::ArmModel& arm, const std::vector<const robot::Link*>& moved) const {
    constexpr double kWholeTurn = 6.28;
    const ChainEntry& chain = entry_.chain;
    const auto n = static_cast<Eigen::Index>(moved.size());
    if (std::ssize(chain.a_max_rad_s2) != n) {
      fail("chain", std::to_string(chain.a_max_rad_s2.size()) +
                        " numbers in a_max_rad_s2, expected " + std::to_string(n) +
                        ", one for each joint that moves");
    }
    for (const auto& [key, values] :
         {std::pair("home_rad", &chain.home_rad), {"j_max_rad_s3", &chain.j_max_rad_s3}}) {
      if (!values->empty() && std::ssize(*values) != n)
        fail("chain", "expected " + std::to_string(n) + " numbers in " + key + ", or none");
    }
    set_jerk(arm, chain.j_max_rad_s3);
    for (Eigen::VectorXd* v : {&arm.q_min, &arm.q_max, &arm.v_max, &arm.a_max, &arm.home})
      v->setZero(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const robot::Link& link = *moved[static_cast<std::size_t>(i)];
      arm.q_min[i] = std::max(link.lower, -kWholeTurn);
      arm.q_max[i] = std::min(link.upper, kWholeTurn);
      arm.v_max[i] = link.max_speed;
      if (!(link.max_speed > 0.0) || std::isinf(link.max_speed) || arm.q_min[i] >= arm.q_max[i])
        fail("chain", "joint '" + link.joint + "' has no limits of angle and velocity");
      arm.a_max[i] = chain.a_max_rad_s2[static_cast<std::size_t>(i)];
      if (!chain.home_rad.empty()) arm.home[i] = chain.home_rad[static_cast<std::size_t>(i)];
      if (arm.home[i] < arm.q_min[i] || arm.home[i] > arm.q_max[i])
        fail("chain", "home_rad of joint '" + link.joint + "' is outside its limits");
    }
  }

  void add_balls(kin::ArmModel& arm) const {
    for (std::size_t i = 0; i < entry_.balls.size(); ++i) {
      const BallEntry& ball = entry_.balls[i];
      const std::string key = "balls[" + std::to_string(i) + "]";
      if (ball.frame > arm.dof()) fail(key, "frame is above the number of joints");
      LinkPlace place{ball.frame, Eigen::Isometry3d::Identity()};
      if (!ball.link.empty() || !links_.empty()) {
        const auto found = links_.find(ball.link);
        if (found == links_.end()) fail(key, "no link '" + ball.link + "' in the chain of joints");
        place = found->second;
      }
      arm.balls.push_back({.frame = place.frame,
                           .group = group_index(key, ball.group),
                           .center = place.X_FL * Eigen::Vector3d::Map(ball.center_m.data()),
                           .radius = ball.radius_m});
    }
  }

  struct LinkPlace {
    int frame = 0;  // Denavit-Hartenberg
    Eigen::Isometry3d X_FL;
  };

  const std::string& file_;
  const ArmFile& entry_;
  std::map<std::string, LinkPlace> links_;  // of the chain
};

}  // namespace

kin::ArmModel load_arm(const std::string& file) {
  if (is_biped(file))
    throw ConfigError(file + ": is a biped's, expected an arm's file, did you mean 'lwr4.yaml'?");
  ArmFile entry;
  runtime::load_params(file, [&](ParamVisitor& v) { entry.visit(v); });
  return Builder(file, entry).build();
}

namespace {

struct FrameEntry {
  std::string name, link;
  std::vector<double> position_m{0.0, 0.0, 0.0};

  void visit(ParamVisitor& v) {
    v("name", name);
    v("link", link);
    v("position_m", position_m, -10.0, 10.0, 3);
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
  std::vector<FrameEntry> frames;
  std::vector<std::string> soles, hands;
  std::vector<GripperEntry> grippers;
  std::vector<PostureEntry> half_sitting;
  robot::BipedNames names;  // without the part above
  BipedDrives drives;

  void visit(ParamVisitor& v) {
    v("urdf", urdf);
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

/// The URDF's robot with the file's frames.
robot::RobotTree tree_of(const std::string& path, const BipedEntry& entry) {
  const robot::RobotTree bare = robot::read_urdf(urdf_of(path, entry.urdf));
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
  if (!is_biped(file)) {
    throw ConfigError(file + ": has no urdf:, expected a biped's file, did you mean 'biped.yaml'?");
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

double rate_of_robot(const std::string& file) {
  if (file.ends_with(".urdf")) return BipedDrives{}.rate_hz;
  return is_biped(file) ? drives_of_biped(file).rate_hz : load_arm(file).rate_hz;
}

std::string urdf_of_biped(const std::string& file) {
  const std::string path = runtime::find_model_file(file);
  return urdf_of(path, read_entry(path).urdf);
}

}  // namespace mimesis::model
