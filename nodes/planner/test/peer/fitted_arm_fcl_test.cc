// Plans of arms whose convex parts were fitted to a URDF, judged from outside: the URDF's own
// solids, placed by the kinematics of its tree, against the obstacles and each other, by FCL.
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/robot/arm_chain.h"
#include "common/shared_data.h"
#include "common/testing/temporary_folder.h"
#include "nodes/planner/move_plan.h"
#include "nodes/planner/test/peer/fcl_judge.h"
#ifdef MIMESIS_OMPL
#include "nodes/planner/bench/peer/rrt_connect.h"
#endif

namespace mimesis::planner {
namespace {

namespace fs = std::filesystem;
using Eigen::VectorXd;
using peer::Draw;

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

  /// Random obstacles, starts and goals that the parts allow; what is planned is judged at every
  /// instant, with eight more between two of them.
  Tally judged_queries(Draw& draw, const std::string& arm_file, const std::string& urdf, int scenes,
                       int queries) {
    const model::CoveredArm covered = model::load_covered_arm(arm_file);
    const kin::ArmModel& arm = covered.arm;
    peer::FclJudge judge(urdf, covered);
    Tally tally;
    TaskSettings settings;
    for (int scene = 0; scene < scenes; ++scene) {
      const kin::Table table = draw.table();
      judge.set_obstacles(table);
      CollisionChecker checker(arm, {table.balls, table.boxes, {}, {}}, settings.margin_m);
      const auto free_posture = [&]() -> VectorXd {
        for (int i = 0; i < 2000; ++i) {
          const VectorXd q = draw.posture(arm);
          const bool free = checker.free(q), touches = judge.touches(q);
          EXPECT_FALSE(free && touches) << "the parts do not hold the arm";
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
          tally.no_way += !any_way(checker, start, goal);
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
    std::cout << arm.parts.size() << " parts, " << tally.planned << " of " << tally.asked
              << " planned, " << tally.no_way << " of the others have no way, " << tally.instants
              << " instants, " << tally.contacts << " contacts, " << tally.inhibited
              << " drawn postures were free but for the parts\n";
    return tally;
  }

  /// Searches with ten times the effort and other seeds.
  static bool any_way(CollisionChecker& checker, const VectorXd& start, const VectorXd& goal) {
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

/// An arm of a public URDF: parts of it, between random postures that keep 5 mm on the meshes.
struct PublicArm {
  std::string urdf, base, tip;  // from data/robots/public/example-robot-data/robots on
  std::string without{};        // links that have no geometry
};
void PrintTo(const PublicArm& arm, std::ostream* out) { *out << arm.urdf; }

class PublicArms : public FittedArm, public ::testing::WithParamInterface<PublicArm> {
 protected:
  /// The file that `mimesis robot new` writes, as far as shapes and joints go.
  std::string written(const std::string& urdf, robot::ArmChain& chain) {
    const robot::RobotTree tree = robot::read_urdf(urdf);
    chain = robot::find_arm_chain(tree, GetParam().base, GetParam().tip);
    std::ofstream out(folder_ / "public.yaml");
    out << "name: public\nchain:\n  urdf: '" << urdf << "'\n  base: " << chain.base
        << "\n  tip: " << chain.tip << "\n  use_visual: true\n  without_geometry: ["
        << GetParam().without << "]\n  a_max_rad_s2: [";
    std::ostringstream home;
    home.precision(17);
    for (std::size_t j = 0; j < chain.joints.size(); ++j) {
      const robot::Link& link = tree.link(chain.joints[j]);
      out << (j > 0 ? ", " : "") << 2.0 * link.max_speed;
      home << (j > 0 ? ", " : "") << std::clamp(0.0, link.lower, link.upper);
    }
    out << "]\n  home_rad: [" << home.str() << "]\n  fixed:\n";
    for (const auto& [joint, at] : chain.fixed)
      out << "    - {joint: " << joint << ", at: " << at << "}\n";
    if (chain.fixed.empty()) out << "    []\n";
    return folder_ / "public.yaml";
  }
};

TEST_P(PublicArms, DISABLED_SlowPlanWhatOmplPlansOnTheMeshes) {
  using std::chrono::steady_clock;
  const fs::path urdf =
      shared_data("data/robots/public/example-robot-data/robots") / GetParam().urdf;
  if (!fs::exists(urdf)) GTEST_SKIP() << "not here: " << urdf << " is absent";
  robot::ArmChain chain;
  const std::string file = written(urdf, chain);
  const auto began = steady_clock::now();
  const model::CoveredArm covered = model::load_covered_arm(file);
  const std::chrono::duration<double> fitted = steady_clock::now() - began;
  const kin::ArmModel& arm = covered.arm;
  peer::FclJudge judge(urdf, covered, chain.base, chain.tip, chain.fixed);
  Draw draw(1);
  TaskSettings settings;
  int asked = 0, planned = 0, contacts = 0, instants = 0, ompl = 0, both = 0, missed = 0;
  std::vector<double> seconds;
  for (int scene = 0; scene < 6; ++scene) {
    const kin::Table table = scene < 3 ? kin::Table{} : draw.table();
    judge.set_obstacles(table);
    const auto valid = [&] {
      for (int i = 0; i < 2000; ++i) {
        const VectorXd q = draw.posture(arm);
        if (!judge.nearer(q, 0.005)) return q;
      }
      return VectorXd();
    };
    for (int query = 0; query < 5; ++query, ++asked) {
      const VectorXd start = valid(), goal = valid();
      if (goal.size() == 0) {
        std::cout << "no valid posture in scene " << scene << '\n';
        break;
      }
      bool solved = false;
#ifdef MIMESIS_OMPL
      solved = peer::rrt_connect_solves(
          arm, [&](const VectorXd& q) { return !judge.touches(q); }, start, goal, 5.0);
      ompl += solved;
#endif
      const auto then = steady_clock::now();
      const auto plan = plan_move(arm, {}, {table, start, Move{{}, {{goal}}}}, settings);
      seconds.push_back(std::chrono::duration<double>(steady_clock::now() - then).count());
      planned += plan.has_value();
      both += plan.has_value() && solved;
      if (!plan) {
#ifdef MIMESIS_OMPL
        // Also at the margin that ours keeps?
        const double apart_m = settings.margin_m;
        if (solved && peer::rrt_connect_solves(
                          arm, [&](const VectorXd& q) { return !judge.nearer(q, apart_m); }, start,
                          goal, 5.0)) {
          ++missed;
          std::cout << "OMPL alone: " << plan.error().reason << '\n';
        }
#endif
        continue;
      }
      for (const PlannedMotion& motion : plan->motions) {
        const auto& q = motion.trajectory.position;
        for (Eigen::Index k = 0; k + 1 < q.cols(); ++k) {
          for (int part = 0; part < 2; ++part, ++instants)
            contacts += judge.touches(q.col(k) + part / 2.0 * (q.col(k + 1) - q.col(k)));
        }
      }
    }
  }
  ASSERT_GT(asked, 0);
  std::ranges::sort(seconds);
  std::cout << GetParam().urdf << ": " << arm.parts.size() << " parts, fitted in " << fitted.count()
            << " s; planned " << planned << " of " << asked << ", OMPL " << ompl << ", both "
            << both << ", OMPL alone at the same margin " << missed << "; p50 "
            << 1e3 * seconds[seconds.size() / 2] << " ms, p95 "
            << 1e3 * seconds[seconds.size() * 95 / 100] << " ms; " << contacts << " contacts in "
            << instants << " instants\n";
  EXPECT_GT(planned, 0);
  EXPECT_EQ(contacts, 0);
  EXPECT_GE(both, 0.95 * ompl);
}

/// Those of ../shared, or of the file MIMESIS_PUBLIC_ARMS: "URDF BASE TIP [LINKS WITHOUT GEOMETRY]"
/// a line, ~ for what is to be found.
std::vector<PublicArm> public_arms() {
  const char* file = std::getenv("MIMESIS_PUBLIC_ARMS");
  if (file == nullptr) {
    return {{"ur_description/urdf/ur10_robot.urdf", "", ""},
            {"ur_description/urdf/ur5_gripper.urdf", "", ""},
            {"panda_description/urdf/panda.urdf", "", ""},
            {"tiago_description/robots/tiago_no_hand.urdf", "torso_lift_link", "", "arm_7_link"},
            {"talos_data/robots/talos_reduced.urdf", "torso_2_link", "gripper_right_base_link"}};
  }
  std::vector<PublicArm> arms;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    PublicArm arm;
    std::istringstream words(line);
    words >> arm.urdf >> arm.base >> arm.tip >> std::ws;
    std::getline(words, arm.without);
    for (std::string* link : {&arm.base, &arm.tip})
      if (*link == "~") link->clear();
    arms.push_back(arm);
  }
  return arms;
}

INSTANTIATE_TEST_SUITE_P(Robots, PublicArms, ::testing::ValuesIn(public_arms()));

}  // namespace
}  // namespace mimesis::planner
