// The object anywhere within 40 mm of its usual place: in how many scenes is there a plan? Where
// there is none, another search looks for one with much more effort: every hold that many starts of
// the inverse kinematics find, shorter straight ways, trees between all of them.
// MIMESIS_SCENES: number of scenes; MIMESIS_SCENES_SEED: other ones.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "common/model/files.h"
#include "nodes/planner/path_search.h"
#include "nodes/planner/task_plan.h"

namespace mimesis::planner {
namespace {

int number_of(const char* variable, int otherwise) {
  const char* asked = std::getenv(variable);
  return asked != nullptr ? std::atoi(asked) : otherwise;
}

using Way = std::vector<Eigen::VectorXd>;

struct Ends {
  Way away, up;  // where the straight ways from the holds end
  Way held;      // the holds
};

/// Any motions that do the task, however they were found.
class Search {
 public:
  Search(const kin::ArmModel& arm, const kin::Table& table, const Task& task)
      : arm_(arm), table_(table), task_(task) {}

  bool finds() {
    const auto goal = std::ranges::find(table_.goals, task_.goal, &kin::GoalPlace::name);
    const Ends grasps = ends_at(table_.object);
    if (grasps.held.empty()) return false;
    const Ends places = ends_at(goal->position);
    Obstacles with_object = empty();
    for (const auto& ball :
         cylinder_balls(table_.object, table_.object_radius, table_.object_height))
      with_object.balls.push_back(ball);
    CollisionChecker carrying(arm_, carried(false), kMargin), reaching(arm_, with_object, kMargin);
    for (std::size_t i = 0; i < std::min<std::size_t>(grasps.held.size(), 60); ++i) {
      Way goals;
      for (std::size_t k = 0; k < places.held.size(); ++k) {
        if (up_in_hand(places.held[k]).dot(up_in_hand(grasps.held[i])) > 0.9)
          goals.push_back(places.up[k]);
      }
      const TreeSettings effort{.max_branches = 100'000, .seed = 77 + i};
      if (!goals.empty() && join_by_trees(carrying, grasps.up[i], goals, effort) &&
          join_by_trees(reaching, arm_.home, std::span(&grasps.away[i], 1), effort))
        return true;
    }
    return false;
  }

 private:
  static constexpr double kMargin = 0.002, kStep = 0.01;

  Eigen::Vector3d up_in_hand(const Eigen::VectorXd& q) const {
    return kin::end_effector(arm_, q).linear().row(2);
  }
  Obstacles empty() const { return {table_.balls, table_.boxes, {}, {}}; }
  Obstacles carried(bool on_its_support) const {
    Obstacles o{table_.balls, closed_passages(table_, task_.transport), held_, {}};
    auto& boxes = on_its_support ? o.supports : o.boxes;
    boxes.insert(boxes.end(), table_.boxes.begin(), table_.boxes.end());
    return o;
  }
  /// The last posture of the longest free part of the straight way, at least `least_m` long.
  std::optional<Eigen::VectorXd> straight(const Eigen::VectorXd& q, const Eigen::Vector3d& unit,
                                          double most_m, double least_m,
                                          CollisionChecker& checker) const {
    for (double length = most_m; length > least_m - 1e-9; length -= 0.01) {
      kin::IkGoal goal = moved_hand(arm_, q, length * unit);
      for (const bool turns : {false, true}) {  // about the vertical, as the object looks the same
        if (turns && unit.z() < 0.9) break;
        if (turns) goal.axes = {{up_in_hand(q), Eigen::Vector3d::UnitZ()}};
        const auto way = straight_way(arm_, q, goal, kStep);
        bool free = way.has_value();
        for (std::size_t i = 1; free && i < way->size(); ++i)
          free = checker.certify((*way)[i - 1], (*way)[i]);
        if (free) return way->back();
      }
    }
    return std::nullopt;
  }
  Ends ends_at(const Eigen::Vector3d& center) {
    Ends ends;
    CollisionChecker alone(arm_, empty(), kMargin);
    for (const auto& goal : grasp_goals(task_.grip, center, table_.object_height, 0.02)) {
      for (const auto& q : kin::solve_ik_anywhere(arm_, goal, 400, 99)) {
        if (!alone.free(q)) continue;
        if (held_.empty()) {
          const Eigen::Isometry3d X_EW = kin::end_effector(arm_, q).inverse();
          held_ = cylinder_balls(center, table_.object_radius, table_.object_height);
          for (auto& ball : held_) ball.center = X_EW * ball.center;
        }
        CollisionChecker holding(arm_, carried(true), kMargin);
        const Eigen::Vector3d back = -kin::end_effector(arm_, q).linear().col(2);
        const auto away = straight(q, back, 0.09, 0.03, alone);
        const auto up = straight(q, Eigen::Vector3d::UnitZ(), 0.05, 0.02, holding);
        if (!away || !up) continue;
        ends.held.push_back(q);
        ends.away.push_back(*away);
        ends.up.push_back(*up);
      }
    }
    return ends;
  }

  const kin::ArmModel& arm_;
  const kin::Table& table_;
  const Task& task_;
  std::vector<kin::Ball> held_;
};

TEST(WholeTable, IsPlannedWhereThereIsAMotion) {
  const int scenes = number_of("MIMESIS_SCENES", 24);
  const kin::ArmModel arm = model::load_arm("lwr4.yaml");
  const kin::Table usual = model::load_table("bar_table.yaml");
  const TaskSettings settings;
  auto roadmap = std::make_shared<const Roadmap>(prepare_roadmap(arm, usual, settings));
  std::mt19937_64 random(static_cast<unsigned>(number_of("MIMESIS_SCENES_SEED", 1)));
  const auto aside = [&] {
    return 0.04 * (2.0 * static_cast<double>(random() >> 11) * 0x1.0p-53 - 1.0);
  };
  int planned = 0, possible = 0;
  double longest_s = 0.0, sum_s = 0.0;
  for (int i = 0; i < scenes; ++i) {
    kin::Table table = usual;
    const Eigen::Vector3d by(aside(), aside(), 0.0);
    table.object += by;
    for (kin::Box& box : table.boxes) box.center += (box.name == "plinth" ? 1.0 : 0.0) * by;
    const Task task = i % 2 == 0 ? Task{Grip::precision, Transport::above, "high"}
                                 : Task{Grip::full, Transport::below, "low"};
    const auto begin = std::clock();
    roadmap = refreshed_roadmap(roadmap, arm, table, settings);
    const auto plan = plan_task(arm, table, *roadmap, arm.home, task, settings);
    const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    longest_s = std::max(longest_s, seconds);
    sum_s += seconds;
    planned += plan.has_value();
    if (plan) {
      ++possible;
      continue;
    }
    std::printf("scene %d, %s, object at (%.0f, %.0f) mm, %.2f s: %s\n", i,
                i % 2 == 0 ? "above" : "below", 1e3 * table.object.x(), 1e3 * table.object.y(),
                seconds, plan.error().reason.c_str());
    const bool exists = Search(arm, table, task).finds();
    std::printf("  %s\n", exists ? "there is a motion" : "no motion found");
    possible += exists;
  }
  std::printf("%d of %d planned, of %d that have a motion; mean %.3f s, longest %.3f s\n", planned,
              scenes, possible, sum_s / scenes, longest_s);
  EXPECT_GE(planned, 0.98 * possible);
}

}  // namespace
}  // namespace mimesis::planner
