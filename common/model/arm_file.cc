#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>

#include "common/error.h"
#include "common/kin/arm.h"
#include "common/math/so3.h"
#include "common/model/files.h"
#include "common/robot/convex_parts.h"
#include "common/robot/robot_tree.h"
#include "common/runtime/param_source.h"
#include "common/runtime/params.h"

namespace mimesis::model {
namespace {

using runtime::ParamVisitor;

constexpr double kLeastFit_m = 1e-3;
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

/// Where a joint beside the chain stays.
struct FixedEntry {
  std::string joint;
  double at = kMissing;  // [rad], or [m]

  void visit(ParamVisitor& v) {
    v("joint", joint);
    v("at", at, -10.0, 10.0);
  }
};

/// Names of meshes that begin so begin otherwise: robot::MeshPaths.
struct MeshPathEntry {
  std::string from, to;

  void visit(ParamVisitor& v) {
    v("from", from);
    v("to", to);
  }
};

/// Joints of a URDF, from one link to another.
struct ChainEntry {
  std::string urdf, base, tip;
  std::vector<FixedEntry> fixed;  // fingers, another arm
  std::vector<MeshPathEntry> mesh_paths;
  bool use_visual = false;                    // of links without collision geometry
  std::vector<std::string> without_geometry;  // of these nothing is checked, nor proven
  // One value per joint, which a URDF does not have; j_max and home may be left out.
  std::vector<double> v_max_rad_s, a_max_rad_s2, j_max_rad_s3, home_rad;
  robot::PartSettings fit;  // of parts fitted to its geometry

  void visit(ParamVisitor& v) {
    v("urdf", urdf);
    v("base", base);
    v("tip", tip);
    v("v_max_rad_s", v_max_rad_s, 1e-3, 100.0, 0);
    v("a_max_rad_s2", a_max_rad_s2, 1e-3, 1000.0, 0);
    v("j_max_rad_s3", j_max_rad_s3, 0.0, 1e9, 0);
    v("home_rad", home_rad, -6.3, 6.3, 0);
    list(v, "fixed", fixed);
    list(v, "mesh_paths", mesh_paths);
    v("use_visual", use_visual);
    v("without_geometry", without_geometry);
    v("fitted_m", fit.tolerance_m, kLeastFit_m, 1.0);
    v("most_parts", fit.most_parts, 1, 200);
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

/// Convex part: the hull of points, rounded.
struct PartEntry {
  int frame = 0;
  std::string link, group;
  double fitted_m = 0.0;  // not 0: the parts that the link's geometry needs, with this tolerance
  std::vector<double> points_m;  // x y z, x y z, ...
  double radius_m = 0.0;

  void visit(ParamVisitor& v) {
    v("frame", frame, 0, 100);
    v("link", link);
    v("group", group);
    v("fitted_m", fitted_m, 0.0, 1.0);
    if (fitted_m > 0.0) return;
    v("points_m", points_m, -10.0, 10.0, 0);
    v("radius_m", radius_m, 0.0, 1.0);
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
  std::vector<PartEntry> parts;

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
    list(v, "parts", parts);
  }
};

Eigen::Isometry3d pose(const std::vector<double>& position_m, const std::vector<double>& rpy_rad) {
  const Eigen::Vector3d rpy = Eigen::Vector3d::Map(rpy_rad.data());
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = Eigen::Vector3d::Map(position_m.data());
  if (!rpy.isZero(0.0)) X.linear() = math::rotation_of_rpy(rpy);
  return X;
}

class Builder {
 public:
  Builder(const std::string& file, const ArmFile& entry) : file_(file), entry_(entry) {}

  CoveredArm build() {
    kin::ArmModel arm = entry_.arm;
    arm.X_WB = pose(entry_.base_m, entry_.base_rpy_rad);
    arm.X_LE = pose(entry_.tool_m, entry_.tool_rpy_rad);
    if (entry_.joints.empty() == entry_.chain.urdf.empty())
      fail("joints", "there is none, expected joints, or a chain of a URDF");
    entry_.joints.empty() ? add_chain(arm) : add_joints(arm);
    const bool all_fitted =
        entry_.balls.empty() && entry_.parts.empty() && !entry_.chain.urdf.empty();
    all_fitted ? fit_all(arm) : add_given(arm);
    add_hulls(arm);
    for (const std::string& group : entry_.obstacle_groups) {
      arm.env_groups.push_back(group_index(arm, "obstacle_groups", group));
    }
    for (const PairEntry& pair : entry_.self_pairs) {
      arm.self_pairs.emplace_back(group_index(arm, "self_pairs", pair.a),
                                  group_index(arm, "self_pairs", pair.b));
    }
    if (all_fitted) add_default_checks(arm);
    require_checks(arm);
    out_.arm = std::move(arm);
    out_.urdf = urdf_;
    out_.base = entry_.chain.base;
    out_.tip = entry_.chain.tip;
    out_.use_visual = entry_.chain.use_visual;
    out_.mesh_paths = mesh_paths();
    return std::move(out_);
  }

  /// Afterwards: compares the shape of each link with its geometry.
  void compare(CoveredArm& covered) {
    for (CoveredLink& link : covered.links) {
      const auto& solids = solids_of(link.link);
      if (!solids.empty()) link.over = robot::over_coverage(solids, link.parts);
    }
  }

 private:
  robot::MeshPaths mesh_paths() const {
    robot::MeshPaths paths;
    for (const MeshPathEntry& entry : entry_.chain.mesh_paths) {
      if (entry.from.empty()) fail("chain.mesh_paths", "from is missing, expected how names begin");
      paths.emplace_back(entry.from, entry.to);
    }
    return paths;
  }
  [[noreturn]] void fail(const std::string& key, const std::string& what) const {
    throw ConfigError(file_ + ": " + key + ": " + what);
  }

  int group_index(const kin::ArmModel& arm, const std::string& key,
                  const std::string& group) const {
    const auto it = std::ranges::find(arm.groups, group);
    if (it == arm.groups.end()) fail(key, "'" + group + "' is not one of groups");
    return static_cast<int>(it - arm.groups.begin());
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
    urdf_ = urdf_of(runtime::find_model_file(file_), chain.urdf);
    const robot::RobotTree tree = robot::read_urdf(urdf_);
    const int base = tree.require_link(chain.base);
    std::vector<int> way;
    for (int l = tree.require_link(chain.tip); l != base; l = tree.link(l).parent) {
      if (l < 0) fail("chain", "link '" + chain.base + "' does not carry '" + chain.tip + "'");
      way.insert(way.begin(), l);
    }
    Eigen::Isometry3d X_BL = Eigen::Isometry3d::Identity();
    std::vector<kin::JointAxis> axes;
    std::vector<const robot::Link*> moved;
    put(chain.base, {0, X_BL});
    for (const int l : way) {
      const robot::Link& link = tree.link(l);
      X_BL = X_BL * link.X_PJ;
      if (link.type != robot::JointType::fixed) {
        axes.push_back({X_BL.translation(), X_BL.linear() * link.axis,
                        link.type == robot::JointType::prismatic});
        moved.push_back(&link);
        joints_.insert(link.joint);
      }
      put(link.name, {static_cast<int>(axes.size()), X_BL});
    }
    add_branches(tree);
    if (axes.empty()) fail("chain", "no joint moves");
    const kin::DhRows rows = kin::dh_rows(axes);
    arm.links = rows.links;
    set_limits(arm, moved);
    arm.X_WB = arm.X_WB * rows.frames.front();
    arm.X_LE = rows.frames.back().inverse() * X_BL * arm.X_LE;
    for (auto& [name, place] : links_)
      place.X_FL = rows.frames[static_cast<std::size_t>(place.frame)].inverse() * place.X_FL;
  }

  void set_limits(kin::ArmModel& arm, const std::vector<const robot::Link*>& moved) const {
    const ChainEntry& chain = entry_.chain;
    const auto n = static_cast<Eigen::Index>(moved.size());
    if (std::ssize(chain.a_max_rad_s2) != n) {
      fail("chain", std::to_string(chain.a_max_rad_s2.size()) +
                        " numbers in a_max_rad_s2, expected " + std::to_string(n) +
                        ", one for each joint that moves");
    }
    for (const auto& [key, values] : {std::pair("home_rad", &chain.home_rad),
                                      {"v_max_rad_s", &chain.v_max_rad_s},
                                      {"j_max_rad_s3", &chain.j_max_rad_s3}}) {
      if (!values->empty() && std::ssize(*values) != n)
        fail("chain", "expected " + std::to_string(n) + " numbers in " + key + ", or none");
    }
    set_jerk(arm, chain.j_max_rad_s3);
    for (Eigen::VectorXd* v : {&arm.q_min, &arm.q_max, &arm.v_max, &arm.a_max, &arm.home})
      v->setZero(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const robot::Link& link = *moved[static_cast<std::size_t>(i)];
      const bool turns = link.type == robot::JointType::revolute;
      const double most = turns ? 2.0 * M_PI : std::numeric_limits<double>::infinity();
      arm.links[static_cast<std::size_t>(i)].endless =
          turns && std::isinf(link.lower) && std::isinf(link.upper);
      arm.q_min[i] = std::max(link.lower, -most);
      arm.q_max[i] = std::min(link.upper, most);
      arm.v_max[i] = chain.v_max_rad_s.empty() ? link.max_speed : chain.v_max_rad_s[std::size_t(i)];
      if (!link.mimics.empty())
        fail("chain", "joint '" + link.joint + "' mimics '" + link.mimics +
                          "', expected joints that move by themselves");
      if (!(arm.v_max[i] > 0.0) || std::isinf(arm.v_max[i]))
        fail("chain", "joint '" + link.joint + "' has no limit of velocity, expected v_max_rad_s");
      if (!(arm.q_min[i] < arm.q_max[i]) || std::isinf(arm.q_max[i] - arm.q_min[i]))
        fail("chain", "joint '" + link.joint + "' has no range between its limits");
      arm.a_max[i] = chain.a_max_rad_s2[static_cast<std::size_t>(i)];
      if (!chain.home_rad.empty()) arm.home[i] = chain.home_rad[static_cast<std::size_t>(i)];
      if (arm.home[i] < arm.q_min[i] || arm.home[i] > arm.q_max[i])
        fail("chain", "home_rad of joint '" + link.joint + "' is outside its limits");
    }
  }

  struct LinkPlace {
    int frame = 0;  // Denavit-Hartenberg
    Eigen::Isometry3d X_FL = Eigen::Isometry3d::Identity();
  };

  void put(const std::string& link, const LinkPlace& where) {
    links_[link] = where;
    order_.push_back(link);
  }

  /// Links beside the way from base to tip: what is fixed to it moves along.
  void add_branches(const robot::RobotTree& tree) {
    std::map<std::string, double> fixed;
    for (const FixedEntry& entry : entry_.chain.fixed) {
      const auto link = std::ranges::find(tree.links(), entry.joint, &robot::Link::joint);
      if (link == tree.links().end() || link->type == robot::JointType::fixed)
        fail("chain.fixed", "no joint '" + entry.joint + "' that moves");
      if (links_.contains(link->name))
        fail("chain.fixed", "joint '" + entry.joint + "' is in the chain, expected one beside it");
      if (!(entry.at >= link->lower && entry.at <= link->upper))
        fail("chain.fixed",
             "at of joint '" + entry.joint + "', expected a value within its limits");
      if (const std::string leader = leader_of(tree, *link); !leader.empty())
        fail("chain.fixed", "joint '" + entry.joint + "' moves with '" + leader +
                                "' of the chain, expected one that stays");
      fixed[entry.joint] = entry.at;
    }
    for (const robot::Link& link : tree.links()) {
      if (link.parent < 0 || links_.contains(link.name)) continue;
      const auto carrier = links_.find(tree.link(link.parent).name);
      const std::optional<double> at = stays_at(link, fixed);
      if (carrier != links_.end() && at) {
        put(link.name, {carrier->second.frame, carrier->second.X_FL * link.at(*at)});
      } else if (carrier != links_.end() || loose_.contains(tree.link(link.parent).name)) {
        loose_[link.name] =
            carrier != links_.end() ? link.joint : loose_.at(tree.link(link.parent).name);
      }
    }
  }

  /// Joint of the chain that the joint of a link follows, perhaps by others; empty: none.
  std::string leader_of(const robot::RobotTree& tree, const robot::Link& link) const {
    std::string leader = link.mimics;
    for (std::size_t n = 0; !leader.empty() && n < tree.links().size(); ++n) {
      if (joints_.contains(leader)) return leader;
      const auto next = std::ranges::find(tree.links(), leader, &robot::Link::joint);
      leader = next == tree.links().end() ? "" : next->mimics;
    }
    return "";
  }

  /// Of a joint beside the chain: given, or by the joint that it mimics.
  static std::optional<double> stays_at(const robot::Link& link,
                                        const std::map<std::string, double>& fixed) {
    if (link.type == robot::JointType::fixed) return 0.0;
    if (const auto given = fixed.find(link.joint); given != fixed.end()) return given->second;
    const auto leader = fixed.find(link.mimics);
    if (leader == fixed.end()) return std::nullopt;
    return link.mimic_factor * leader->second + link.mimic_offset;
  }

  /// Of links in without_geometry only what can be read.
  void read_solids() {
    solids_.emplace();
    if (urdf_.empty()) return;
    const auto read = [this](const std::vector<std::string>& links) {
      solids_->merge(robot::link_solids(urdf_, links, entry_.chain.use_visual, mesh_paths()));
    };
    std::vector<std::string> needed, excused;
    for (const std::string& link : order_)
      (std::ranges::count(entry_.chain.without_geometry, link) > 0 ? excused : needed)
          .push_back(link);
    try {
      read(needed);
    } catch (const ConfigError& e) {
      throw ConfigError(std::string(e.what()) + ", or its name in without_geometry");
    }
    for (const std::string& link : excused) {
      try {
        read({link});
      } catch (const ConfigError&) {
        unread_.insert(link);  // nothing of it is checked, which is said
      }
    }
  }

  /// Empty if the link has no geometry.
  const std::vector<robot::Solid>& solids_of(const std::string& link) {
    if (!solids_) read_solids();
    return (*solids_)[link];
  }

  void add(kin::ArmModel& arm, const std::string& link, const LinkPlace& where, int group,
           bool fitted, std::vector<math::ConvexPart> parts) {
    const bool more = !out_.links.empty() && out_.links.back().link == link &&
                      out_.links.back().group == group && out_.links.back().fitted == fitted;
    if (!more)
      out_.links.push_back({.link = link, .group = group, .frame = where.frame, .fitted = fitted});
    for (math::ConvexPart& part : parts) {
      const bool is_ball = part.points.rows() == 1;
      if (is_ball) {
        arm.balls.push_back(
            {where.frame, group, where.X_FL * part.points.row(0).transpose(), part.radius});
      } else {
        kin::SafetyPart safety{where.frame, group, part, robot::balls_around(part)};
        safety.shape.points =
            ((where.X_FL.linear() * part.points.transpose()).colwise() + where.X_FL.translation())
                .transpose();
        for (math::RoundBound& ball : safety.cover) {
          ball.center = where.X_FL * ball.center;
          arm.balls.push_back({where.frame, group, ball.center, ball.radius, true});
        }
        arm.parts.push_back(std::move(safety));
      }
      out_.links.back().parts.push_back(std::move(part));
    }
  }

  /// Around the parts of each link: those of one frame and group that follow each other.
  static void add_hulls(kin::ArmModel& arm) {
    constexpr double kSlack_m = 0.002;
    for (std::size_t begin = 0, end = 0; begin < arm.parts.size(); begin = end) {
      const kin::SafetyPart& first = arm.parts[begin];
      std::vector<math::ConvexPart> shapes;
      for (; end < arm.parts.size() && arm.parts[end].frame == first.frame &&
             arm.parts[end].group == first.group;
           ++end)
        shapes.push_back(arm.parts[end].shape);
      arm.part_links.push_back(
          {begin, end, shapes.size() == 1 ? shapes.front() : robot::hull_around(shapes, kSlack_m)});
    }
  }

  /// The link that an entry of a list names, or its frame.
  template <class Entry>
  std::pair<std::string, LinkPlace> place_of(const kin::ArmModel& arm, const std::string& key,
                                             const Entry& entry) const {
    if (entry.frame > arm.dof()) fail(key, "frame is above the number of joints");
    if (entry.link.empty() && links_.empty())
      return {"frame " + std::to_string(entry.frame), {.frame = entry.frame}};
    const auto found = links_.find(entry.link);
    if (found == links_.end()) fail(key, "no link '" + entry.link + "' in the chain of joints");
    return *found;
  }

  void add_given(kin::ArmModel& arm) {
    for (std::size_t i = 0; i < entry_.balls.size(); ++i) {
      const BallEntry& ball = entry_.balls[i];
      const std::string key = "balls[" + std::to_string(i) + "]";
      const auto [link, where] = place_of(arm, key, ball);
      add(arm, link, where, group_index(arm, key, ball.group), false,
          {{Eigen::RowVector3d::Map(ball.center_m.data()), ball.radius_m}});
    }
    for (std::size_t i = 0; i < entry_.parts.size(); ++i) {
      const PartEntry& part = entry_.parts[i];
      const std::string key = "parts[" + std::to_string(i) + "]";
      const auto [link, where] = place_of(arm, key, part);
      const int group = group_index(arm, key, part.group);
      if (part.fitted_m == 0.0) {
        const auto numbers = std::ssize(part.points_m);
        if (numbers == 0 || numbers % 3 != 0)
          fail(key, std::to_string(numbers) + " numbers in points_m, expected x y z of each point");
        using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
        add(arm, link, where, group, false,
            {{Rows::Map(part.points_m.data(), numbers / 3, 3), part.radius_m}});
        continue;
      }
      const auto& solids = solids_of(link);
      if (solids.empty())
        fail(key, "link '" + link + "' has no collision geometry that parts could be fitted to");
      if (part.fitted_m < kLeastFit_m) fail(key, "fitted_m, expected 0.001 .. 1");
      add(arm, link, where, group, true,
          robot::convex_parts(solids, {part.fitted_m, entry_.chain.fit.most_parts}));
    }
  }

  /// Nothing is given: every link with geometry gets its own parts, and is a group.
  void fit_all(kin::ArmModel& arm) {
    if (!arm.groups.empty())
      fail("groups", "without balls or parts each link is a group of its name, expected no groups");
    for (const std::string& link : order_) {
      const auto& solids = solids_of(link);
      if (solids.empty()) continue;
      arm.groups.push_back(link);
      add(arm, link, links_.at(link), static_cast<int>(arm.groups.size()) - 1, true,
          robot::convex_parts(solids, entry_.chain.fit));
    }
    if (arm.balls.empty())
      fail("parts", "there is none, and no link of the chain has collision geometry");
  }

  /// Checks of fitted links: all that move against obstacles, and all pairs that no single joint
  /// joins, but those that touch in every posture.
  void add_default_checks(kin::ArmModel& arm) {
    const std::vector<CoveredLink>& links = out_.links;
    for (const CoveredLink& link : links)
      if (entry_.obstacle_groups.empty() && link.frame > 0) arm.env_groups.push_back(link.group);
    if (!entry_.self_pairs.empty()) return;
    const Eigen::MatrixXd postures = sampled_postures(arm);
    std::vector<std::pair<int, int>> always = touching_groups(arm, arm.home);
    for (Eigen::Index p = 0; p < postures.cols() && !always.empty(); ++p) {
      const auto now = touching_groups(arm, postures.col(p));
      std::erase_if(always, [&](const auto& pair) { return std::ranges::count(now, pair) == 0; });
    }
    for (const CoveredLink& a : links) {
      for (const CoveredLink& b : links) {
        if (&a >= &b || std::abs(a.frame - b.frame) < 2) continue;
        const std::pair pair(a.group, b.group);
        if (std::ranges::count(always, pair) > 0) {
          out_.always_touching.emplace_back(a.link, b.link);
        } else {
          arm.self_pairs.push_back(pair);
        }
      }
    }
  }

  /// What moves and is checked against nothing would be proven by silence. Arms without any balls
  /// are for drives: load_checked_arm refuses them.
  void require_checks(kin::ArmModel& arm) {
    if (arm.balls.empty()) return;
    if (arm.env_groups.empty())
      fail("obstacle_groups", "there is none: no part is checked against obstacles, expected some");
    const auto ends = std::ranges::minmax(arm.balls, {}, &kin::SafetyBall::frame);
    if (arm.self_pairs.empty() && out_.always_touching.empty() &&
        ends.max.frame - ends.min.frame > 1)
      fail("self_pairs", "there is none: no part is checked against another, expected some");
    if (!urdf_.empty()) require_shapes(arm);
  }

  void require_shapes(kin::ArmModel& arm) {
    const std::vector<std::string>& excused = entry_.chain.without_geometry;
    for (const std::string& name : excused) {
      if (!links_.contains(name) && !loose_.contains(name))
        fail("chain.without_geometry", "no link '" + name + "' that the chain moves");
    }
    const robot::RobotTree tree = robot::read_urdf(urdf_);
    const auto parts = robot::link_parts(urdf_);
    const auto require = [&](const std::string& link, const std::string& joint) {
      const robot::LinkParts& has = parts.at(link);
      const bool massive = tree.link(tree.require_link(link)).inertia.mass_kg > 0.0;
      if (!has.collision && !has.visual && !massive) return;  // a frame
      if (std::ranges::count(excused, link) > 0) return arm.unchecked.push_back(link);
      const std::string name = "link '" + link + "' ";
      const std::string excuse = "its name in without_geometry";
      const auto mover = std::ranges::find(tree.links(), joint, &robot::Link::joint);
      const std::string leader = joint.empty() ? "" : leader_of(tree, *mover);
      if (!leader.empty())
        fail("chain", name + "moves with '" + leader + "' of the chain, by joint '" + joint +
                          "': expected " + excuse);
      if (!joint.empty())
        fail("chain", name + "moves on joint '" + joint + "' beside the chain, expected {joint: " +
                          joint + ", at: ...} in fixed, or " + excuse);
      if (has.collision)
        fail("parts", "none is on " + name + "though it has geometry, expected some, or " + excuse);
      fail("chain", name + "moves, and has " +
                        (has.visual ? "visual, but no collision geometry: expected use_visual: "
                                      "true, parts on it, or "
                                    : "mass, but no geometry: expected parts on it, or ") +
                        excuse);
    };
    for (const std::string& link : order_) {
      const bool covered = std::ranges::count(out_.links, link, &CoveredLink::link) > 0;
      if ((links_.at(link).frame > 0 || unread_.contains(link)) && !covered) require(link, "");
    }
    for (const auto& [link, joint] : loose_) require(link, joint);
  }

  using Solids = std::map<std::string, std::vector<robot::Solid>>;

  const std::string& file_;
  const ArmFile& entry_;
  CoveredArm out_;
  std::string urdf_;                          // of the chain
  std::set<std::string> joints_;              // of the chain, that move
  std::map<std::string, LinkPlace> links_;    // that the frames carry
  std::vector<std::string> order_;            // of them: from base to tip, then the branches
  std::map<std::string, std::string> loose_;  // links that a joint beside the chain moves; which
  std::optional<Solids> solids_;              // once asked for
  std::set<std::string> unread_;              // of without_geometry
};

/// `use`: what is done with the builder and what it has built.
template <class Use>
CoveredArm build_arm(const std::string& file, const Use& use) {
  if (is_biped(file))
    throw ConfigError(file + ": is a biped's, expected an arm's file, did you mean 'lwr4.yaml'?");
  ArmFile entry;
  runtime::load_params(file, [&](ParamVisitor& v) { entry.visit(v); });
  Builder builder(file, entry);
  CoveredArm covered = builder.build();
  use(builder, covered);
  return covered;
}

}  // namespace

Eigen::MatrixXd sampled_postures(const kin::ArmModel& arm) {
  Eigen::MatrixXd q(arm.dof(), 256);
  std::mt19937 draw(1);
  for (Eigen::Index p = 0; p < q.cols(); ++p) {
    for (Eigen::Index j = 0; j < q.rows(); ++j)
      q(j, p) =
          arm.q_min[j] + (arm.q_max[j] - arm.q_min[j]) * static_cast<double>(draw()) / 4294967296.0;
  }
  return q;
}

std::vector<std::pair<int, int>> touching_groups(const kin::ArmModel& arm,
                                                 const Eigen::VectorXd& q) {
  constexpr double kNear_m = 0.003;
  const std::vector<kin::SafetyPart> parts = kin::deciding_parts(arm);
  std::vector<Eigen::Isometry3d> X;
  kin::forward(arm, q, X);
  std::set<std::pair<int, int>> touching;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    for (std::size_t k = i + 1; k < parts.size(); ++k) {
      const kin::SafetyPart &a = parts[i], &b = parts[k];
      if (std::abs(a.frame - b.frame) < 2 || a.group == b.group) continue;
      const Eigen::Isometry3d X_AB =
          X[static_cast<std::size_t>(a.frame)].inverse() * X[static_cast<std::size_t>(b.frame)];
      const math::RoundBound &round_a = a.cover.front(), &round_b = b.cover.front();
      if (a.cover.size() == 1 && b.cover.size() == 1 &&
          (round_a.center - X_AB * round_b.center).norm() - round_a.radius - round_b.radius >=
              kNear_m)
        continue;
      if (math::gap_between(a.shape, b.shape, X_AB, kNear_m, kNear_m).at_least < kNear_m)
        touching.insert(std::minmax(a.group, b.group));
    }
  }
  return {touching.begin(), touching.end()};
}

kin::ArmModel load_arm(const std::string& file) {
  return build_arm(file, [](Builder&, CoveredArm&) {}).arm;
}

CoveredArm load_covered_arm(const std::string& file, bool compare) {
  return build_arm(file, [compare](Builder& builder, CoveredArm& arm) {
    if (compare) builder.compare(arm);
  });
}

CoveredArm load_checked_arm(const std::string& file) {
  CoveredArm covered = load_covered_arm(file, false);
  if (covered.arm.balls.empty())
    throw ConfigError(file +
                      ": balls: there is none, nor parts, expected some on every link that moves");
  return covered;
}

}  // namespace mimesis::model
