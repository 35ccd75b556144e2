// Plans of arms whose safety balls were fitted to a URDF, judged from outside: the URDF's own
// solids, placed by the kinematics of its tree, against the obstacles and each other, by FCL.
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "common/model/files.h"
#include "common/robot/cover_balls.h"
#include "common/robot/kinematics.h"
#include "common/shared_data.h"
#include "common/testing/temporary_folder.h"
#include "nodes/planner/move_plan.h"

namespace mimesis::planner {
namespace {

namespace fs = std::filesystem;
using Eigen::Isometry3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Shape = std::shared_ptr<fcl::CollisionGeometryd>;

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  double in(double a, double b) { return std::uniform_real_distribution(a, b)(random_); }
  int below(int n) { return std::uniform_int_distribution(0, n - 1)(random_); }
  VectorXd posture(const kin::ArmModel& arm) {
    VectorXd q(arm.dof());
    for (Eigen::Index j = 0; j < q.size(); ++j) q[j] = in(arm.q_min[j], arm.q_max[j]);
    return q;
  }

 private:
  std::mt19937_64 random_;
};

Shape shape_of(const robot::Solid& solid) {
  using Kind = robot::Solid::Kind;
  const Vector3d edges = 2.0 * solid.half_m;
  if (solid.kind == Kind::box) return std::make_shared<fcl::Boxd>(edges);
  if (solid.kind == Kind::ball) return std::make_shared<fcl::Sphered>(solid.half_m.x());
  if (solid.kind == Kind::cylinder)
    return std::make_shared<fcl::Cylinderd>(solid.half_m.x(), edges.z());
  auto mesh = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  mesh->beginModel();
  for (const auto& t : solid.mesh->triangles()) mesh->addTriangle(t[0], t[1], t[2]);
  mesh->endModel();
  return mesh;
}

class Judge {
 public:
  Judge(const std::string& urdf, const model::CoveredArm& covered)
      : tree_(robot::read_urdf(urdf)), kinematics_(tree_), covered_(covered) {
    std::vector<std::string> names;
    for (const auto& link : covered.links) names.push_back(link.link);
    for (const auto& [name, solids] : robot::link_solids(urdf, names)) {
      for (const robot::Solid& solid : solids)
        parts_.push_back({group_of(name), tree_.find_link(name), solid.X_LS, shape_of(solid)});
    }
  }

  void set_obstacles(const kin::Table& table) {
    obstacles_.clear();
    for (const kin::Ball& b : table.balls)
      obstacles_.push_back({std::make_shared<fcl::Sphered>(b.radius), b.center});
    for (const kin::Box& b : table.boxes)
      obstacles_.push_back({std::make_shared<fcl::Boxd>(Vector3d(2.0 * b.half_extent)), b.center});
  }

  bool touches(const VectorXd& q) {
    kinematics_.update(Isometry3d::Identity(), q);  // the root, which is the chain's base, is W
    const auto meet = [](const Shape& a, const Isometry3d& X_WA, const Shape& b,
                         const Isometry3d& X_WB) {
      fcl::CollisionResultd result;
      return fcl::collide(a.get(), X_WA, b.get(), X_WB, fcl::CollisionRequestd(), result) > 0;
    };
    const auto& arm = covered_.arm;
    for (const Part& part : parts_) {
      const Isometry3d X_WS = kinematics_.X_WL(part.link) * part.X_LS;
      if (std::ranges::count(arm.env_groups, part.group) > 0) {
        for (const auto& [shape, center] : obstacles_)
          if (meet(part.shape, X_WS, shape, Isometry3d(Eigen::Translation3d(center)))) return true;
      }
      for (const Part& other : parts_) {
        if (std::ranges::count(arm.self_pairs, std::pair(part.group, other.group)) > 0 &&
            meet(part.shape, X_WS, other.shape, kinematics_.X_WL(other.link) * other.X_LS))
          return true;
      }
    }
    return false;
  }

 private:
  struct Part {
    int group, link;
    Isometry3d X_LS;
    Shape shape;
  };
  int group_of(const std::string& link) const {
    return std::ranges::find(covered_.links, link, &model::LinkBalls::link)->group;
  }

  robot::RobotTree tree_;
  robot::Kinematics kinematics_;
  const model::CoveredArm& covered_;
  std::vector<Part> parts_;
  std::vector<std::pair<Shape, Vector3d>> obstacles_;
};

class FittedArm : public ::testing::Test {
 protected:
  /// One link, along its z axis: a cylinder, a box, a capsule of three solids, or a mesh, a
  /// pyramid's stump of n sides.
  std::string solid(Draw& draw, int link, double length, double radius) {
    std::ostringstream out;
    const auto collision = [&](double z, const std::string& geometry) {
      out << "<collision><origin xyz='0 0 " << z << "'/><geometry>" << geometry
          << "</geometry></collision>";
    };
    const std::string r = std::to_string(radius), l = std::to_string(length);
    const std::string rod = "<cylinder radius='" + r + "' length='" + l + "'/>";
    const std::string ball = "<sphere radius='" + r + "'/>";
    switch (draw.below(4)) {
      case 0:
        collision(0.5 * length, rod);
        break;
      case 1: {
        const std::string edge = std::to_string(1.6 * radius);
        collision(0.5 * length, "<box size='" + edge + " " + edge + " " + l + "'/>");
        break;
      }
      case 2:
        collision(0.5 * length, rod);
        collision(0.0, ball);
        collision(length, ball);
        break;
      default: {
        const std::string file = "link" + std::to_string(link) + ".obj";
        write_stump(folder_ / file, 5 + draw.below(8), radius, draw.in(0.4, 1.0) * radius, length);
        collision(0.0, "<mesh filename='" + file + "'/>");
      }
    }
    return out.str();
  }

  static void write_stump(const fs::path& file, int n, double bottom, double top, double height) {
    std::ofstream out(file);
    out << "v 0 0 0\nv 0 0 " << height << '\n';
    for (int i = 0; i < n; ++i) {
      const double turn = 2.0 * M_PI * i / n;
      out << "v " << bottom * std::cos(turn) << ' ' << bottom * std::sin(turn) << " 0\n"
          << "v " << top * std::cos(turn) << ' ' << top * std::sin(turn) << ' ' << height << '\n';
    }
    for (int i = 0; i < n; ++i) {
      const int a = 3 + 2 * i, b = 3 + 2 * ((i + 1) % n);
      out << "f 1 " << b << ' ' << a << "\nf 2 " << a + 1 << ' ' << b + 1 << "\nf " << a << ' ' << b
          << ' ' << b + 1 << ' ' << a + 1 << '\n';
    }
  }

  std::string write_arm(const std::string& links, const std::string& joints, int n,
                        const std::string& more = "") {
    std::ofstream(folder_ / "arm.urdf") << "<robot name='arm'>" << links << joints << "</robot>";
    std::ofstream out(folder_ / "arm.yaml");
    out << "name: arm\nrate_hz: 200\nchain: {urdf: arm.urdf, base: l0, tip: l" << n << ", " << more
        << "a_max_rad_s2: [";
    for (int i = 0; i < n; ++i) out << (i > 0 ? ", 6" : "6");
    out << "]}\n";
    return folder_ / "arm.yaml";
  }

  static std::string joint(int i, const std::string& xyz, const std::string& rpy,
                           const std::string& axis, double most) {
    const std::string n = std::to_string(i), before = std::to_string(i - 1);
    return "<joint name='j" + n + "' type='revolute'><parent link='l" + before +
           "'/><child link='l" + n + "'/><origin xyz='" + xyz + "' rpy='" + rpy + "'/><axis xyz='" +
           axis + "'/><limit lower='-" + std::to_string(most) + "' upper='" + std::to_string(most) +
           "' velocity='2' effort='1'/></joint>";
  }

  /// 4 to 7 joints, every one across the one before or along it, links of random shape.
  std::string random_arm(Draw& draw) {
    const int n = 4 + draw.below(4);
    std::string links, joints;
    double length = 0.2;
    for (int i = 0; i <= n; ++i) {
      if (i > 0) {
        const std::string axis = i % 2 == 1 ? "0 0 1" : draw.below(2) == 0 ? "0 1 0" : "1 0 0";
        std::ostringstream rpy;
        rpy << draw.in(-0.4, 0.4) << ' ' << draw.in(-0.4, 0.4) << ' ' << draw.in(-3.0, 3.0);
        joints +=
            joint(i, "0 0 " + std::to_string(length), rpy.str(), axis, i % 2 == 1 ? 2.9 : 2.0);
        length = draw.in(0.12, 0.3);
      }
      links += "<link name='l" + std::to_string(i) + "'>" +
               solid(draw, i, length, draw.in(0.035, 0.065)) + "</link>";
    }
    return write_arm(links, joints, n);
  }

  /// The LWR4+'s joints; cylinders where models/lwr4.yaml has balls.
  std::string lwr_like() {
    const auto rod = [](const std::string& xyz, const std::string& rpy, double r, double l) {
      return "<collision><origin xyz='" + xyz + "' rpy='" + rpy +
             "'/><geometry><cylinder radius='" + std::to_string(r) + "' length='" +
             std::to_string(l) + "'/></geometry></collision>";
    };
    const std::string across = "1.5707963267948966 0 0";
    const std::vector<std::string> solids{
        rod("0 0 0.1", "0 0 0", 0.08, 0.2),  rod("0 0 0.1", "0 0 0", 0.07, 0.22),
        rod("0 0 0.1", "0 0 0", 0.065, 0.2), rod("0 0 0.1", "0 0 0", 0.065, 0.2),
        rod("0 0 0.1", "0 0 0", 0.06, 0.2),  rod("0 0 0.1", "0 0 0", 0.055, 0.2),
        rod("0 0 0", across, 0.06, 0.1),     rod("0 0 0.06", "0 0 0", 0.04, 0.08)};
    const std::vector<std::string> at{"0 0 0.11", "0 0 0.2",  "0 0 0.2",  "0 0 0.2",
                                      "0 0 0.2",  "0 0 0.19", "0 0 0.078"};
    std::string links, joints;
    for (std::size_t i = 0; i < solids.size(); ++i) {
      links += "<link name='l" + std::to_string(i) + "'>" + solids[i] + "</link>";
      if (i > 0) {
        joints += joint(static_cast<int>(i), at[i - 1], "0 0 0", i % 2 == 1 ? "0 0 1" : "0 1 0",
                        i % 2 == 1 ? 2.967 : 2.094);
      }
    }
    return write_arm(links, joints, 7, "home_rad: [0, 0.5, 0, 1.2, 0, 0.8, 0], ");
  }

  struct Tally {
    int asked = 0, planned = 0, no_way = 0, inhibited = 0, instants = 0, contacts = 0;
  };

  /// Random obstacles, starts and goals that the balls allow; what is planned is judged at every
  /// instant, with eight more between two of them.
  Tally judged_queries(Draw& draw, const std::string& arm_file, const std::string& urdf, int scenes,
                       int queries) {
    const model::CoveredArm covered = model::load_covered_arm(arm_file);
    const kin::ArmModel& arm = covered.arm;
    Judge judge(urdf, covered);
    Tally tally;
    TaskSettings settings;
    for (int scene = 0; scene < scenes; ++scene) {
      kin::Table table;
      for (int i = 2 + draw.below(6); i-- > 0;) {
        const double away = draw.in(0.35, 0.8), turn = draw.in(-M_PI, M_PI);
        const Vector3d at(away * std::cos(turn), away * std::sin(turn), draw.in(0.1, 1.0));
        if (draw.below(2) == 0) {
          table.balls.push_back({at, draw.in(0.03, 0.12)});
        } else {
          table.boxes.push_back(
              {at, {draw.in(0.02, 0.12), draw.in(0.02, 0.12), draw.in(0.02, 0.12)}, "box"});
        }
      }
      judge.set_obstacles(table);
      CollisionChecker checker(arm, {table.balls, table.boxes, {}, {}}, settings.margin_m);
      const auto free_posture = [&]() -> VectorXd {
        for (int i = 0; i < 2000; ++i) {
          const VectorXd q = draw.posture(arm);
          const bool free = checker.free(q), touches = judge.touches(q);
          EXPECT_FALSE(free && touches) << "the balls do not cover the arm";
          tally.inhibited += !free && !touches;
          if (free) return q;
        }
        return {};
      };
      for (int query = 0; query < queries; ++query) {
        const VectorXd start = free_posture(), goal = free_posture();
        if (start.size() == 0 || goal.size() == 0) continue;
        ++tally.asked;
        const auto plan = plan_move(arm, {}, {table, start, Move{{}, {{goal}}}}, settings);
        if (!plan) {
          tally.no_way += !any_way(arm, checker, start, goal);
          std::cout << arm.name << ": " << plan.error().reason << '\n';
          continue;
        }
        ++tally.planned;
        for (const PlannedMotion& motion : plan->motions) {
          const auto& q = motion.trajectory.position;
          for (Eigen::Index k = 0; k + 1 < q.cols(); ++k) {
            for (int part = 0; part < 8; ++part, ++tally.instants) {
              const VectorXd between = q.col(k) + part / 8.0 * (q.col(k + 1) - q.col(k));
              tally.contacts += judge.touches(between);
            }
          }
        }
      }
    }
    std::cout << arm.balls.size() << " balls, " << tally.planned << " of " << tally.asked
              << " planned, " << tally.no_way << " of the others have no way, " << tally.instants
              << " instants, " << tally.contacts << " contacts, " << tally.inhibited
              << " drawn postures were free but for the balls\n";
    return tally;
  }

  /// Searches with ten times the effort and other seeds.
  static bool any_way(const kin::ArmModel& arm, CollisionChecker& checker, const VectorXd& start,
                      const VectorXd& goal) {
    (void)arm;
    SearchSettings search;
    search.max_branches *= 10;
    for (search.seed = 100; search.seed < 103; ++search.seed)
      if (find_path({}, checker, start, std::vector{goal}, {}, search)) return true;
    return false;
  }

  testing::TemporaryFolder folder_;
};

void expect_sound(const auto& tally) {
  EXPECT_EQ(tally.contacts, 0);
  EXPECT_EQ(tally.planned + tally.no_way, tally.asked) << "a longer search finds a way";
  EXPECT_GT(tally.planned, 0);
}

TEST_F(FittedArm, LikeTheLwrTouchesNothing) {
  Draw draw(41);
  const std::string file = lwr_like();
  expect_sound(judged_queries(draw, file, folder_ / "arm.urdf", 6, 5));
}

TEST_F(FittedArm, OfRandomGeometryTouchesNothing) {
  Draw draw(1);
  expect_sound(judged_queries(draw, random_arm(draw), folder_ / "arm.urdf", 3, 5));
}

TEST_F(FittedArm, DISABLED_SlowOfMoreRandomGeometryTouchesNothing) {
  for (unsigned seed = 2; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    Draw draw(seed);
    const std::string file = random_arm(draw);
    expect_sound(judged_queries(draw, file, folder_ / "arm.urdf", 3, 5));
  }
}

TEST_F(FittedArm, ThatNobodyHereWroteTouchesNothing) {
  const fs::path urdf = shared_data("data/robots/iiwa_description/urdf/iiwa14.urdf");
  if (!fs::exists(urdf)) GTEST_SKIP() << "not here: " << urdf << " is absent";
  std::ofstream(folder_ / "iiwa.yaml")
      << "name: iiwa14\nchain: {urdf: 'shared:data/robots/iiwa_description/urdf/iiwa14.urdf',\n"
         "  base: base, tip: iiwa_link_ee, a_max_rad_s2: [8.57, 8.57, 8.74, 11.36, 12.23, 15.72, "
         "15.72],\n  home_rad: [0, 0.6, 0, -1.2, 0, 1, 0]}\n";
  Draw draw(14);
  expect_sound(judged_queries(draw, folder_ / "iiwa.yaml", urdf, 6, 5));
}

}  // namespace
}  // namespace mimesis::planner
