// `mimesis plan` and `mimesis plan verify`: the real programs; and the verifier on plans that are
// shifted into obstacles, which are placed by the arm's own kinematics (common/kin), not its.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "common/error.h"
#include "common/model/files.h"
#include "common/shared_data.h"
#include "common/testing/process.h"
#include "common/testing/temporary_folder.h"
#include "nodes/planner/verb/hulls_apart.h"
#include "nodes/planner/verb/plan_file.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
using Eigen::Vector3d;
using Eigen::VectorXd;
using nlohmann::json;
namespace fs = std::filesystem;

constexpr double kInto_m = 0.001;

const testing::TemporaryFolder& folder() {
  static const testing::TemporaryFolder one;
  return one;
}

struct Ran {
  int code = -1;
  std::string output, errors;
};

Ran run(std::vector<std::string> words) {
  words.insert(words.begin(), "plan");
  testing::Process p("mimesis", words);
  const int code = p.wait(100s).value_or(-1);
  return {code, p.output(), p.errors()};
}

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

fs::path written(const std::string& name, const std::string& text) {
  std::ofstream(folder() / name, std::ios::binary) << text;
  return folder() / name;
}

const std::vector<std::string> kPlanar{"planar16.yaml", "--robot", "planar2.yaml",
                                       "--start=-0.3,-0.2", "--goal=0.92,1.42"};

/// The demo's task, above the bar.
const PlanFile& task_plan() {
  static const PlanFile plan = [] {
    const std::string file = folder() / "task.yaml";
    const Ran made = run({"bar_table.yaml", "--task", "precision", "above", "high", "-o", file});
    EXPECT_EQ(made.code, 0) << made.errors;
    return load_plan(file);
  }();
  return plan;
}

const kin::ArmModel& lwr() {
  static const kin::ArmModel arm = model::load_arm("lwr4.yaml");
  return arm;
}

VectorXd vector(const std::vector<double>& v) { return VectorXd::Map(v.data(), std::ssize(v)); }

/// Balls of the arm and of what it holds.
std::vector<kin::Ball> balls_at(const PlanMotion& motion, const VectorXd& q) {
  std::vector<Eigen::Isometry3d> X;
  kin::forward(lwr(), q, X);
  std::vector<kin::Ball> balls;
  for (const kin::SafetyBall& b : lwr().balls) {
    if (std::ranges::count(lwr().env_groups, b.group) > 0)
      balls.push_back({X[static_cast<std::size_t>(b.frame)] * b.center, b.radius});
  }
  for (std::size_t i = 0; i < motion.held_m.size(); i += 4)
    balls.push_back(
        {X.back() * lwr().X_LE * Vector3d::Map(&motion.held_m[i]), motion.held_m[i + 3]});
  return balls;
}

double gap(const std::vector<kin::Ball>& balls, const kin::Ball& obstacle) {
  double least = 1e9;
  for (const auto& b : balls)
    least = std::min(least, (b.center - obstacle.center).norm() - b.radius - obstacle.radius);
  return least;
}

/// A place in a motion, and the findings about an obstacle ball that is put there.
class Shifted {
 public:
  explicit Shifted(unsigned seed) : random_(seed) {}

  void draw() {
    const auto& motions = task_plan().motions;
    motion = &motions[draw_below(motions.size())];
    k = 2 + draw_below(motion->instants.size() - 4);
  }
  /// Overlaps a ball of the arm at q by 1 mm, from anywhere or from the side that is turned away
  /// from where the ball is at instant k.
  kin::Ball obstacle_into(const VectorXd& q, bool from_behind) {
    const auto balls = balls_at(*motion, q);
    const std::size_t i = draw_below(balls.size());
    const double radius = 0.002 + 0.02 * unit();
    Vector3d n = Vector3d(normal(), normal(), normal()).normalized();
    if (from_behind) n = (balls[i].center - path()[k][i].center + 0.01 * n).normalized();
    return {balls[i].center + (balls[i].radius + radius - kInto_m) * n, radius};
  }
  /// The balls at all instants of the motion.
  const std::vector<std::vector<kin::Ball>>& path() {
    auto& balls = paths_[motion];
    if (balls.empty()) {
      for (const PlanInstant& i : motion->instants)
        balls.push_back(balls_at(*motion, vector(i.position_rad)));
    }
    return balls;
  }
  /// Findings of the instants near k.
  std::vector<std::string> findings(const kin::Ball& obstacle, std::size_t around,
                                    double stop_alone_s = task_plan().stop_alone_s) const {
    PlanFile plan = task_plan();
    plan.stop_alone_s = stop_alone_s;
    PlanMotion some = *motion;
    const std::size_t first = k - std::min(k, around),
                      last = std::min(motion->instants.size(), k + around + 1);
    some.instants.assign(motion->instants.begin() + static_cast<std::ptrdiff_t>(first),
                         motion->instants.begin() + static_cast<std::ptrdiff_t>(last));
    const Eigen::Vector3d c = obstacle.center;
    const std::string name =
        as_hull ? "and hull 0:"
                : "and obstacle ball " + std::to_string(some.balls_m.size() / 4) + ":";
    if (as_hull) {
      some.hulls = {{"ball", {c.x(), c.y(), c.z()}, obstacle.radius}};
    } else {
      some.balls_m.insert(some.balls_m.end(), {c.x(), c.y(), c.z(), obstacle.radius});
    }
    for (PlanInstant& instant : some.instants) instant.stop_s.clear();
    plan.motions = {some};
    auto all = verify_plan(plan, lwr()).findings;
    std::erase_if(all, [&](const std::string& f) { return f.find(name) == f.npos; });
    return all;
  }
  double unit() { return std::uniform_real_distribution(0.0, 1.0)(random_); }
  double normal() { return std::normal_distribution()(random_); }
  std::size_t draw_below(std::size_t n) {
    return std::min(n - 1, static_cast<std::size_t>(unit() * static_cast<double>(n)));
  }

  const PlanMotion* motion = nullptr;
  std::size_t k = 0;
  bool as_hull = false;  ///< the obstacle is given as the hull of its centre

 private:
  std::mt19937_64 random_;
  std::map<const PlanMotion*, std::vector<std::vector<kin::Ball>>> paths_;
};

TEST(PlanVerify, ProvesEveryInstantOfTheDemosTask) {
  const PlanVerdict verdict = verify_plan(task_plan(), lwr());
  EXPECT_EQ(verdict.findings, std::vector<std::string>{});
  EXPECT_GT(verdict.instants, 1000u);
  EXPECT_GE(verdict.nearest_m, task_plan().margin_m - 2e-5);
  EXPECT_GE(verdict.nearest_stop_m, task_plan().stop_margin_m - 2e-5);
  const Ran said = run({"verify", folder() / "task.yaml"});
  EXPECT_EQ(said.code, 0) << said.output << said.errors;
  EXPECT_EQ(said.output.rfind("proven: 6 motions", 0), 0u) << said.output;
}

TEST(PlanVerify, FindsPathsOneMillimetreInAnObstacle) {
  Shifted s(401);
  for (int trial = 0; trial < 300; ++trial) {
    s.draw();
    const VectorXd a = vector(s.motion->instants[s.k].position_rad),
                   b = vector(s.motion->instants[s.k + 1].position_rad);
    const kin::Ball obstacle = s.obstacle_into(a + s.unit() * (b - a), false);
    s.as_hull = trial % 3 == 0;
    const auto found = s.findings(obstacle, 1);
    EXPECT_TRUE(std::ranges::any_of(
        found, [](const std::string& f) { return f.find("the stop") == f.npos; }))
        << trial << ": motion " << s.motion->phase << ", instant " << s.k;
  }
}

constexpr int kStops = 50;

TEST(PlanVerify, FindsStopsOneMillimetreInAnObstacleThatThePathPasses) {
  Shifted s(402);
  int trial = 0;
  for (int draws = 0; trial < kStops && draws < 2'000'000; ++draws) {
    s.draw();
    const PlanInstant& instant = s.motion->instants[s.k];
    VectorXd q = vector(instant.position_rad);
    const VectorXd v = vector(instant.velocity_rad_s), a = lwr().a_max;
    if (v.norm() < 0.5) continue;  // such stops stay near the path
    const double tau = task_plan().stop_delay_s * s.unit(), u = 0.1 + 0.3 * s.unit();
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      const double t = std::min(u, std::abs(v[j]) / a[j]);
      q[j] += v[j] * tau + std::copysign(std::abs(v[j]) * t - 0.5 * a[j] * t * t, v[j]);
    }
    const kin::Ball obstacle = s.obstacle_into(q, true);
    const auto& path = s.path();
    const auto clear = [&](std::size_t i) { return gap(path[i], obstacle) > 0.0021; };
    bool passed = true;  // the instants behind k are the most likely to touch
    for (std::size_t i = 0; i < path.size() && passed; ++i) passed = clear((s.k + i) % path.size());
    if (!passed) continue;
    ++trial;
    const auto found = s.findings(obstacle, 1);
    EXPECT_FALSE(found.empty()) << trial << ": motion " << s.motion->phase << ", instant " << s.k;
    for (const std::string& f : found) EXPECT_NE(f.find("the stop by the drives"), f.npos) << f;
  }
  EXPECT_EQ(trial, kStops);
}

TEST(PlanVerify, FindsADriveThatFailsAloneIntoAnObstacleThatAllOtherStopsPass) {
  constexpr std::size_t kAround = 5;  // the drives' four periods, and one
  constexpr int kTrials = 4;
  Shifted s(403);
  const double alone_s = task_plan().stop_alone_s;
  ASSERT_EQ(alone_s, 4 * task_plan().period_s);
  int trial = 0;
  for (int draws = 0; trial < kTrials && draws < 2'000'000; ++draws) {
    s.draw();
    if (s.k < kAround || s.k + kAround >= s.motion->instants.size()) continue;
    const VectorXd v = vector(s.motion->instants[s.k].velocity_rad_s), a = lwr().a_max;
    VectorXd q = vector(s.motion->instants[s.k].position_rad);
    const auto j = static_cast<Eigen::Index>(s.draw_below(static_cast<std::size_t>(q.size())));
    if (std::abs(v[j]) < 0.2) continue;
    // Since up to alone_s, or it goes on for as long: most such stops are near others.
    const bool stands = s.unit() < 0.5;
    const double u = 0.1 * s.unit(), of = 1.0 - 0.3 * s.unit();
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      const double t = std::min(u, std::abs(v[i]) / a[i]);
      if (i != j || !stands) q[i] += std::copysign(std::abs(v[i]) * t - 0.5 * a[i] * t * t, v[i]);
    }
    q[j] += (stands ? -of : of) * alone_s * v[j];
    const kin::Ball obstacle = s.obstacle_into(q, true);
    bool passed = true;
    for (std::size_t i = s.k - kAround; i <= s.k + kAround && passed; ++i)
      passed = gap(s.path()[i], obstacle) > 0.0021;
    if (!passed || !s.findings(obstacle, kAround, 0.0).empty()) continue;
    ++trial;
    const auto found = s.findings(obstacle, kAround);
    const std::string what = "that of joint " + std::to_string(j) + " failing alone";
    EXPECT_TRUE(std::ranges::any_of(found, [&](const auto& f) { return f.find(what) != f.npos; }))
        << trial << ": motion " << s.motion->phase << ", instant " << s.k << ", joint " << j
        << (stands ? " stands" : " is late") << (found.empty() ? "" : "; " + found.front());
  }
  EXPECT_EQ(trial, kTrials);
}

TEST(PlanVerify, FindsWhatIsNoMotionOfTheArm) {
  using Instants = std::vector<PlanInstant>;
  const auto says = [](const std::string& what, const std::function<void(Instants&)>& change) {
    PlanFile plan = task_plan();
    plan.motions.resize(1);
    change(plan.motions[0].instants);
    const auto all = verify_plan(plan, lwr()).findings;
    EXPECT_TRUE(std::ranges::any_of(all, [&](const auto& f) { return f.find(what) != f.npos; }))
        << what << ", found " << (all.empty() ? "nothing" : all.front());
  };
  says("the velocity of joint 3 is not", [](Instants& i) { i[40].position_rad[3] += 0.002; });
  says("is not that of its positions", [](Instants& i) { i.erase(i.begin() + 30); });
  says("is not at rest", [](Instants& i) { i.back().velocity_rad_s[0] = 0.01; });
  says("does not end at rest", [](Instants& i) { i[50].stop_s.resize(i[50].stop_s.size() / 2); });
  says("does not end at rest", [](Instants& i) { i[50].stop_s.clear(); });
  says("goes backwards", [](Instants& i) { i[50].stop_s[1] = 0.0; });
  says("of the arm's accelerations", [](Instants& i) {
    for (double& s : i[50].stop_s) s = i[50].stop_s.front();
  });
  says("joint 1 is at", [](Instants& i) {
    for (PlanInstant& k : i) k.position_rad[1] += 3.0;
  });
  PlanFile torn = task_plan();
  torn.motions.erase(torn.motions.begin() + 1);
  EXPECT_NE(verify_plan(torn, lwr()).findings.front().find("does not begin where"),
            std::string::npos);
}

TEST(PlanVerb, PlansThePlanarArmAndWritesIt) {
  auto words = kPlanar;
  const fs::path plan = folder() / "planar.yaml", log = folder() / "planar.mcap";
  words.insert(words.end(), {"--json", "--out", plan.string(), "--scene", log.string()});
  const Ran made = run(words);
  ASSERT_EQ(made.code, 0) << made.errors;
  const json report = json::parse(made.output);
  EXPECT_TRUE(report["planned"]);
  EXPECT_EQ(report["path_rad"].front(), (std::vector<double>{-0.3, -0.2}));
  EXPECT_EQ(report["path_rad"].back(), (std::vector<double>{0.92, 1.42}));
  EXPECT_GT(report["path_rad"].size(), 2u) << "the obstacles are in the way";
  const Ran proven = run({"verify", plan, "--json"});
  EXPECT_EQ(proven.code, 0) << proven.output << proven.errors;
  EXPECT_TRUE(json::parse(proven.output)["proven"]);
  testing::Process info("mimesis", {"log", "cat", log, "--json"});
  EXPECT_EQ(info.wait(20s).value_or(-1), 0) << info.errors();
  EXPECT_NE(info.output().find("\"frames\""), std::string::npos) << info.output().substr(0, 500);
}

/// An L of two boxes as an STL in millimetres: three corners each of 12 triangles a box.
std::string bracket_stl() {
  std::string text = "solid bracket\n";
  for (const auto& [lo, hi] : {std::pair(Vector3d(0, 0, 0), Vector3d(300, 100, 40)),
                               std::pair(Vector3d(0, 0, 0), Vector3d(40, 100, 400))}) {
    const auto corner = [&lo = lo, &hi = hi](int i) {
      return Vector3d(i & 1 ? hi.x() : lo.x(), i & 2 ? hi.y() : lo.y(), i & 4 ? hi.z() : lo.z());
    };
    for (const auto& [a, b, c, d] :
         {std::array{0, 2, 3, 1}, std::array{4, 5, 7, 6}, std::array{0, 1, 5, 4},
          std::array{2, 6, 7, 3}, std::array{0, 4, 6, 2}, std::array{1, 3, 7, 5}}) {
      for (const auto& t : {std::array{a, b, c}, std::array{a, c, d}}) {
        text += "facet normal 0 0 0\nouter loop\n";
        for (const int i : t)
          text += fmt::format("vertex {} {} {}\n", corner(i).x(), corner(i).y(), corner(i).z());
        text += "endloop\nendfacet\n";
      }
    }
  }
  return text + "endsolid bracket\n";
}

/// A bracket stands before the arm, as a mesh and as the cloud of points on it: what is planned
/// keeps clear of the two boxes that it was made of.
TEST(PlanVerb, KeepsClearOfMeshesAndPointClouds) {
  written("bracket.stl", bracket_stl());
  std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 15000\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n";
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int i = 0; i < 15000; ++i) {
    const Vector3d size = i % 2 ? Vector3d(0.3, 0.1, 0.04) : Vector3d(0.04, 0.1, 0.4);
    Vector3d p(unit(random), unit(random), unit(random));
    p[i / 2 % 3] = i / 6 % 2;
    p = p.cwiseProduct(size);
    ply += fmt::format("{:.5f} {:.5f} {:.5f}\n", p.x(), p.y(), p.z());
  }
  written("bracket.ply", ply);
  const std::string place = "position_m: [0.55, -0.05, 0.3], rpy_rad: [0, 0, 1.5708]";
  const std::map<std::string, std::string> scenes{
      {"mesh", "meshes: [{name: bracket, file: bracket.stl, scale: 0.001, " + place + "}]\n"},
      {"cloud", "clouds: [{file: bracket.ply, " + place + "}]\n"}};
  const Eigen::Isometry3d X_WB =
      Eigen::Translation3d(0.55, -0.05, 0.3) * Eigen::AngleAxisd(1.5708, Vector3d::UnitZ());
  for (const auto& [name, scene] : scenes) {
    const std::string in = written(name + "_scene.yaml", scene), plan = folder() / (name + ".yaml");
    const std::vector<std::string> words{in, "--start=-0.6,-0.9,0,1,0,-0.6,0",
                                         "--goal=0.9,-0.9,0,1,0,-0.6,0", "-o", plan};
    const Ran made = run(words);
    ASSERT_EQ(made.code, 0) << name << ": " << made.errors;
    const Ran proven = run({"verify", plan});
    EXPECT_EQ(proven.code, 0) << name << ": " << proven.output << proven.errors;
    double least = 1e9;
    for (const PlanMotion& motion : load_plan(plan).motions) {
      EXPECT_EQ(motion.hulls.empty(), name == "cloud");
      for (const PlanInstant& instant : motion.instants) {
        for (const kin::Ball& ball : balls_at(motion, vector(instant.position_rad))) {
          const Vector3d p = X_WB.inverse() * ball.center;
          for (const Vector3d& size : {Vector3d(0.3, 0.1, 0.04), Vector3d(0.04, 0.1, 0.4)})
            least =
                std::min(least, ((p - 0.5 * size).cwiseAbs() - 0.5 * size).cwiseMax(0.0).norm() -
                                    ball.radius);
        }
      }
    }
    EXPECT_GE(least, 0.002 - 2e-5) << name;
    // Straight through it.
    const Ran into = run({in, "--start=0.05,-0.9,0,1,0,-0.6,0", "--goal=0.9,-0.9,0,1,0,-0.6,0"});
    EXPECT_EQ(into.code, 1);
    EXPECT_NE(into.errors.find("the start posture is in collision"), std::string::npos)
        << into.errors;
  }
}

TEST(PlanVerb, RefusesMeshesAndCloudsByTheirFault) {
  written("bracket.stl", bracket_stl());
  const auto says = [](const std::string& scene, const std::string& what) {
    const Ran made = run({written("bad_scene.yaml", scene), "--goal=0.9,-0.9,0,1,0,-0.6,0"});
    EXPECT_EQ(made.code, 2);
    EXPECT_NE(made.errors.find("bad_scene.yaml"), std::string::npos) << made.errors;
    EXPECT_NE(made.errors.find(what), std::string::npos) << made.errors << "expected " << what;
  };
  says("meshes: [{file: bracket.stl}]\n", "meshes[0]: size of a mesh");
  says("meshes: [{file: bracket.stl, scale: 0.1}]\n", "is 40 m long, expected at most 20 m");
  says("meshes: [{file: none.stl}]\n", "meshes[0]: mesh 'none.stl' is not there");
  says("meshes: [{name: nothing}]\n", "meshes[0]: file is missing");
  says("clouds: [{file: bracket.stl}]\n", "is no point cloud, expected PCD or PLY");
  written("far.ply",
          "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float "
          "y\nproperty float z\nend_header\n9 0 0\n");
  says("clouds: [{file: far.ply, within_m: 2}]\n", "no point is within 2 m");
  written("sentinel.ply",
          "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
          "property float z\nend_header\n1e30 0 0\n");
  says("clouds: [{file: sentinel.ply}]\n", "a point is 1e+30 m away, expected at most 10000 m");
}

TEST(PlanVerb, TheToolKeepsToItsWay) {
  const std::string plan = folder() / "tool.yaml";
  const std::vector<std::string> words{written("empty.yaml", "balls: []\n"),
                                       "--start=0,-0.9,0,1,0,-0.6,0",
                                       "--straight",
                                       "0.8,0.2,0.3",
                                       "--arc",
                                       "0.75,0.25,0.35,0.7,0.2,0.4",
                                       "--straight",
                                       "0.7,-0.1,0.4"};
  std::vector<std::string> out = words;
  out.insert(out.end(), {"-o", plan});
  const Ran made = run(out);
  ASSERT_EQ(made.code, 0) << made.errors;
  EXPECT_NE(made.output.find("found by line"), std::string::npos) << made.output;
  PlanFile file = load_plan(plan);
  ASSERT_EQ(file.motions.size(), 1u);
  ASSERT_EQ(file.motions[0].tool.size(), 3u);
  EXPECT_EQ(file.motions[0].tool[1].via_m, (std::vector<double>{0.75, 0.25, 0.35}));
  const Ran proven = run({"verify", plan});
  EXPECT_EQ(proven.code, 0) << proven.output << proven.errors;
  // Another way than that which it keeps to; and one that it does not keep to so well.
  file.motions[0].tool[1].via_m[1] += 0.004;
  EXPECT_NE(verify_plan(file, lwr()).findings.front().find("off its way"), std::string::npos);
  file = load_plan(plan);
  file.motions[0].tool_off_m *= 0.3;
  EXPECT_NE(verify_plan(file, lwr()).findings.front().find("off its way"), std::string::npos);
  file = load_plan(plan);
  file.motions[0].tool_off_rad = 0.0;
  EXPECT_NE(verify_plan(file, lwr()).findings.front().find("off its way"), std::string::npos);
  file = load_plan(plan);
  file.motions[0].tool.push_back({{}, {0.7, -0.15, 0.4}});
  EXPECT_NE(verify_plan(file, lwr()).findings.front().find("does not end at the end"),
            std::string::npos);
  file = load_plan(plan);
  file.motions[0].tool[1].via_m = file.motions[0].tool[0].to_m;
  EXPECT_NE(verify_plan(file, lwr()).findings.front().find("are on a line"), std::string::npos);
  const Ran both =
      run({"bar_table.yaml", "--straight", "0.5,0.1,0.5", "--hand", "0.5", "0.1", "0.5"});
  EXPECT_EQ(both.code, 2);
  EXPECT_NE(both.errors.find("expected one of"), std::string::npos) << both.errors;
  const Ran few = run({"bar_table.yaml", "--arc", "0.5,0.1,0.5"});
  EXPECT_EQ(few.code, 2);
  EXPECT_NE(few.errors.find("--arc: expected X,Y,Z,X,Y,Z"), std::string::npos) << few.errors;
}

TEST(PlanVerb, WavesAndTreesAreAskedAlone) {
  for (const std::string by : {"waves", "trees", "both"}) {
    auto words = kPlanar;
    words.insert(words.end(), {"--search", by, "--json"});
    const Ran made = run(words);
    ASSERT_EQ(made.code, 0) << by << made.errors;
    const std::string found = json::parse(made.output)["motions"][0]["found_by"];
    EXPECT_EQ(found, by == "trees" ? "trees" : "waves");
  }
}

/// The right arm of JVRC-1, as its makers published it: shoulder, offset elbow, wrist. The balls
/// are ours.
const std::string kArmOfJvrc = R"(name: jvrc1_right_arm
base_m: [0, 0, 0.4]
tool_m: [0, 0, -0.13]
chain:
  urdf: "shared:data/robots/jvrc1.urdf"
  base: WAIST_R_S
  tip: R_WRIST_Y_S
  a_max_rad_s2: [10, 10, 10, 10, 10, 10, 10]
  home_rad: [0, 0, 0, -1.2, 0, 0, 0]
  fixed: [
    {joint: L_SHOULDER_P, at: 0}, {joint: L_SHOULDER_R, at: 0}, {joint: L_SHOULDER_Y, at: 0},
    {joint: L_ELBOW_P, at: 0}, {joint: L_ELBOW_Y, at: 0}, {joint: L_WRIST_R, at: 0},
    {joint: L_WRIST_Y, at: 0}, {joint: L_UINDEX, at: 0}, {joint: L_LINDEX, at: 0},
    {joint: L_ULITTLE, at: 0}, {joint: L_LLITTLE, at: 0}, {joint: L_UTHUMB, at: 0},
    {joint: NECK_Y, at: 0}, {joint: NECK_R, at: 0}, {joint: NECK_P, at: 0},
    {joint: R_UINDEX, at: 0}, {joint: R_LINDEX, at: 0}, {joint: R_ULITTLE, at: 0},
    {joint: R_LLITTLE, at: 0}, {joint: R_UTHUMB, at: 0}
  ]
  without_geometry: [R_SHOULDER_P_S, R_SHOULDER_R_S, R_UINDEX_S, R_LINDEX_S, R_ULITTLE_S,
    R_LLITTLE_S, R_UTHUMB_S, R_LTHUMB_S]
groups: [trunk, upper, fore, hand]
obstacle_groups: [upper, fore, hand]
self_pairs: [{a: trunk, b: fore}, {a: trunk, b: hand}]
balls:
  - {link: WAIST_R_S, group: trunk, center_m: [0, 0, 0.1], radius_m: 0.13}
  - {link: WAIST_R_S, group: trunk, center_m: [0, 0, 0.25], radius_m: 0.13}
  - {link: R_SHOULDER_Y_S, group: upper, center_m: [0, 0, -0.15], radius_m: 0.08}
  - {link: R_ELBOW_P_S, group: fore, center_m: [0, 0, 0], radius_m: 0.07}
  - {link: R_ELBOW_Y_S, group: fore, center_m: [0, 0, 0.1], radius_m: 0.06}
  - {link: R_WRIST_R_S, group: hand, center_m: [0, 0, 0], radius_m: 0.06}
  - {link: R_WRIST_Y_S, group: hand, center_m: [0, 0, -0.1], radius_m: 0.05}
)";

TEST(PlanVerb, TakesAnArmFromAPublishedUrdf) {
  if (!fs::exists(shared_data("data/robots/jvrc1.urdf"))) GTEST_SKIP() << "not here: no ../shared";
  const std::string shelf =
      "boxes: [{name: shelf, center_m: [0.4, -0.25, 0.5], half_extent_m: [0.15, 0.25, 0.01]}]\n";
  const fs::path plan = folder() / "jvrc.yaml";
  const Ran made = run({written("shelf.yaml", shelf), "--robot", written("arm.yaml", kArmOfJvrc),
                        "--hand", "0.35", "-0.25", "0.65", "-o", plan, "--json"});
  ASSERT_EQ(made.code, 0) << made.errors;
  EXPECT_GT(json::parse(made.output)["path_rad"].size(), 2u) << "the shelf is in the way";
  const Ran judged = run({"verify", plan});
  EXPECT_EQ(judged.code, 1) << judged.output << judged.errors;
  EXPECT_NE(judged.output.find("link R_UTHUMB_S has no known shape: nothing of it is checked"),
            std::string::npos)
      << judged.output;
  const std::string gone = "jvrc_description/meshes/R_ELBOW_P_S.dae is not there";
  EXPECT_NE(judged.output.find("link R_ELBOW_P_S: mesh " + gone), std::string::npos)
      << "nor is geometry held that nobody can read: " << judged.output;
}

/// The planner's distance of hulls and the verifier's share no code.
TEST(PlanVerb, BothDistancesOfHullsAgree) {
  std::mt19937_64 random(5);
  const auto in = [&random](double lo, double hi) {
    return std::uniform_real_distribution(lo, hi)(random);
  };
  for (int i = 0; i < 2000; ++i) {
    Eigen::Matrix3Xd hulls[2];
    for (int h = 0; h < 2; ++h) {
      hulls[h].resize(3, 2 * (2 + static_cast<Eigen::Index>(in(0.0, 20.0))));
      for (Eigen::Index k = 0; k < hulls[h].cols(); ++k)
        hulls[h].col(k) << in(0.0, 0.1) + 0.12 * h, in(-0.1, 0.1), in(-0.1, 0.1);
      if (i % 2 == 0) hulls[h].row(2) = hulls[h].row(2).cwiseSign() * 0.05;  // flat at both ends
    }
    Vector3d normal = Vector3d::Zero();
    const Apart apart = hulls_apart(hulls[0], hulls[1], -1.0, 1.0, normal);
    const math::Gap gap = math::gap_between({hulls[0].transpose()}, {hulls[1].transpose()},
                                            Eigen::Isometry3d::Identity());
    EXPECT_NEAR(apart.at_most, gap.at_most, 3e-6);
    EXPECT_NEAR(apart.at_least, std::max(0.0, gap.at_least), 3e-6);
  }
}

/// Two links on a rail along x, turned into the plane of the planar scene.
const std::string kOnARail = R"(name: rail
base_rpy_rad: [0, 1.5707963267948966, 0]
joints:
  - {type: slides, alpha_rad: -1.5707963267948966, offset_rad: 1.5707963267948966, q_min_m: -0.9, q_max_m: 0.9,
     v_max_m_s: 0.5, a_max_m_s2: 2}
  - {a_m: 0.6, q_min_rad: -3, q_max_rad: 3, v_max_rad_s: 2, a_max_rad_s2: 6}
  - {a_m: 0.5, q_min_rad: -2.8, q_max_rad: 2.8, v_max_rad_s: 2, a_max_rad_s2: 6}
groups: [upper, fore]
obstacle_groups: [upper, fore]
balls:
  - {frame: 2, group: upper, center_m: [-0.4, 0, 0], radius_m: 0.08}
  - {frame: 2, group: upper, center_m: [-0.2, 0, 0], radius_m: 0.08}
  - {frame: 2, group: upper, center_m: [0, 0, 0], radius_m: 0.08}
  - {frame: 3, group: fore, center_m: [-0.25, 0, 0], radius_m: 0.08}
  - {frame: 3, group: fore, center_m: [0, 0, 0], radius_m: 0.08}
)";

TEST(PlanVerb, TakesAnArmOnARail) {
  const std::string posts =
      "balls: [{center_m: [0.1, 0.5, 0], radius_m: 0.1}, {center_m: [0.1, -0.5, 0], radius_m: 0.1},"
      " {center_m: [0.1, 0.5, 0.5], radius_m: 0.1}, {center_m: [0.1, 0, 0.6], radius_m: 0.1},"
      " {center_m: [0.1, 0, -0.6], radius_m: 0.1}]\n";
  const fs::path plan = folder() / "rail.yaml", arm = written("rail_arm.yaml", kOnARail);
  const Ran made = run({written("posts.yaml", posts), "--robot", arm, "--start=-0.8,1.5,0",
                        "--goal=0.8,-1.5,0.2", "-o", plan, "--json"});
  ASSERT_EQ(made.code, 0) << made.errors;
  const Ran proven = run({"verify", plan});
  EXPECT_EQ(proven.code, 0) << proven.output << proven.errors;
  PlanFile stuck = load_plan(plan);
  const kin::ArmModel rail = model::load_arm(arm);
  const PlanInstant& middle = stuck.motions[0].instants[stuck.motions[0].instants.size() / 2];
  const Vector3d hand = kin::end_effector(rail, vector(middle.position_rad)).translation();
  for (const double x : {hand.x(), hand.y(), hand.z() + 0.089, 0.01})
    stuck.motions[0].balls_m.push_back(x);
  EXPECT_FALSE(verify_plan(stuck, rail).findings.empty());
}

TEST(PlanVerb, GoesThroughTheFirstPlacesAndKeepsItsDeadline) {
  const std::string via = "--via=-0.2458,1.9987";
  std::vector<std::string> words = kPlanar;
  words.insert(words.end(), {via, "--json"});
  const Ran r = run(words);
  ASSERT_EQ(r.code, 0) << r.errors;
  const json report = json::parse(r.output);
  ASSERT_EQ(report["motions"].size(), 2U);
  EXPECT_EQ(report["motions"][0]["end_rad"], json({-0.2458, 1.9987}));
  EXPECT_EQ(report["motions"][1]["end_rad"], json({0.92, 1.42}));

  const Ran late =
      run({"bar_table.yaml", "--task", "full", "below", "low", "--deadline-ms", "0.01"});
  EXPECT_EQ(late.code, 1);
  EXPECT_EQ(late.errors, "plan: the deadline of 0.01 ms passed while the roadmap was built\n");
}

TEST(PlanVerb, ShowsPartsAndTheirOverCoverage) {
  const Ran given = run({"arm", "lwr4.yaml", "--json"});
  ASSERT_EQ(given.code, 0) << given.errors;
  EXPECT_EQ(json::parse(given.output)["balls"], 25);
  written("rod.urdf",
          "<robot name='rod'><link name='base'/><link name='rod'><collision><geometry><cylinder "
          "radius='0.05' length='0.4'/></geometry></collision></link><joint name='turn' "
          "type='revolute'><parent link='base'/><child link='rod'/><axis xyz='1 0 0'/><limit "
          "lower='-1' upper='1' velocity='1' effort='1'/></joint></robot>");
  const std::string chain =
      "name: rod\nchain: {urdf: rod.urdf, base: base, tip: rod, a_max_rad_s2: [4]}\n";
  const fs::path rod = written("rod.yaml", chain);
  const Ran fitted = run({"arm", rod, "--json"});
  ASSERT_EQ(fitted.code, 0) << fitted.errors;
  const json link = json::parse(fitted.output)["links"][0];
  EXPECT_NEAR(link["solid_m3"].get<double>(), 0.4 * M_PI * 0.05 * 0.05, 5e-5);
  EXPECT_EQ(link["bare_m3"], 0.0);
  const Ran yaml = run({"arm", rod, "--yaml"});
  const kin::ArmModel by_hand = model::load_arm(written("by_hand.yaml", chain + yaml.output));
  EXPECT_EQ(by_hand.parts.size(), link["parts"]);
  EXPECT_EQ(by_hand.balls.size(), json::parse(fitted.output)["balls"]);
  EXPECT_EQ(by_hand.env_groups, model::load_arm(rod).env_groups);
  EXPECT_EQ(run({"arm", written("none.yaml", "name: none\n")}).code, 2);
}

TEST(PlanVerb, GivesReasonsInOneLine) {
  const auto says = [](std::vector<std::string> words, int code, const std::string& what) {
    const Ran r = run(std::move(words));
    EXPECT_EQ(r.code, code) << r.output << r.errors;
    EXPECT_NE(r.errors.find(what), std::string::npos) << r.errors;
    EXPECT_EQ(std::ranges::count(r.errors, '\n'), 1) << r.errors;
  };
  const auto planar = [](const std::string& start, const std::string& goal) {
    return std::vector<std::string>{"planar16.yaml", "--robot", "planar2.yaml", "--start=" + start,
                                    "--goal=" + goal};
  };
  says(planar("0.5,0", "0.92,1.42"), 1, "the start posture is in collision: ball ");
  says(planar("-0.3,-0.2", "0.5,0"), 1,
       "of the postures at the goal the only one is inhibited: ball ");
  says(planar("-0.3,-0.2", "0.5,2.8"), 2, "--goal: joint 2 at 2.8 rad, expected -2.7053 .. 2.7053");
  says(planar("-0.3,-0.2", "0.5"), 2, "--goal: 1 numbers, expected 2, one for each joint");
  says(planar("nan,0", "0.5,0"), 2, "--start: expected numbers and commas, found 'nan'");
  says({"bar_table.yaml", "--hand", "3", "0", "0"}, 1, "no posture reaches the goal");
  says({"bar_table.yaml"}, 2, "expected one of --goal, --hand, --task, and --straight with --arc");
  says({"bar_table.yaml", "--task", "precision", "round", "high"}, 2,
       "neither 'above' nor 'below'");
  says({"planar16.yaml", "--task", "full", "below", "low"}, 2, "no bar");
  says({"no.yaml", "--hand", "0.5", "0", "0.5"}, 2, "no.yaml");
  std::string lacks = text_of(std::string(MIMESIS_SOURCE_DIR) + "/models/lwr4.yaml");
  lacks.erase(lacks.find("v_max_rad_s: 1.9199,"), 20);
  says({"bar_table.yaml", "--hand", "0.5", "0", "0.5", "--robot", written("lacks.yaml", lacks)}, 2,
       "v_max_rad_s");
}

TEST(PlanVerb, SurvivesDamagedPlans) {
  auto words = kPlanar;
  const fs::path file = folder() / "small.yaml";
  words.insert(words.end(), {"-o", file});
  ASSERT_EQ(run(words).code, 0);
  const kin::ArmModel arm = model::load_arm("planar2.yaml");
  std::string start = text_of(file).substr(0, 6'000);
  start.resize(start.rfind("\n      - position_rad") + 1);  // whole instants
  std::mt19937_64 random(403);
  int refused = 0;
  for (int trial = 0; trial < 150; ++trial) {
    std::string bad = start;
    if (trial % 3 == 0) {
      bad.resize(random() % bad.size());
    } else {
      for (int i = 0; i < 1 + trial % 4; ++i)
        bad[random() % bad.size()] = "0123456789.-[]{},:e\n \x80\"'#&*"[random() % 26];
    }
    const fs::path damaged = written("damaged.yaml", bad);
    try {
      verify_plan(load_plan(damaged), arm);
    } catch (const ConfigError& e) {
      ++refused;
      EXPECT_NE(std::string(e.what()), "");
    }
  }
  EXPECT_GT(refused, 50);
  const Ran r =
      run({"verify", written("robot.yaml", "format: mimesis.plan 3\nrobot: lwr4.yaml\n")});
  EXPECT_EQ(r.code, 2);
  EXPECT_NE(r.errors.find("period_s"), std::string::npos) << r.errors;
  const Ran other = run({"verify", file, "--robot", "lwr4.yaml"});
  EXPECT_EQ(other.code, 2);
  EXPECT_NE(other.errors.find("position_rad has 2 numbers, expected 7 for each posture"),
            std::string::npos)
      << other.errors;
}

}  // namespace
}  // namespace mimesis::tool
