#include <gtest/gtest.h>

#include "common/error.h"
#include "common/testing/refusal.h"
#include "nodes/walker/tasks/limits.h"
#include "nodes/walker/tasks/task_rows.h"
#include "nodes/walker/tasks/test/reference.h"

namespace mimesis::walker {
namespace {

class TaskList : public ::testing::Test {
 protected:
  template <typename Change>
  std::string said(Change change) {
    StackSettings settings = walking_stack(biped_);
    change(settings);
    return mimesis::testing::refusal([&] { Stack stack(biped_, settings); });
  }
  robot::Biped biped_ = model::load_biped("biped.yaml");
};

TEST_F(TaskList, SaysWhatIsWrong) {
  using S = StackSettings;
  EXPECT_EQ(said([](S&) {}), "");
  EXPECT_EQ(said([](S& s) { s.tasks.clear(); }), "stack.tasks: none, expected at least one");
  EXPECT_EQ(said([](S& s) { s.tasks[1].name = "left foot"; }),
            "stack.tasks: 'left foot': name twice");
  EXPECT_EQ(said([](S& s) { s.tasks[2].name = ""; }), "stack.tasks: a task without a name");
  EXPECT_EQ(said([](S& s) { s.tasks[0].link = "tail"; }),
            "stack.tasks: 'left foot': robot biped has no link 'tail'");
  EXPECT_EQ(said([](S& s) { s.tasks[0].link = "chest"; }),
            "stack.tasks: 'left foot': link 'chest' is no sole of the robot");
  EXPECT_EQ(said([](S& s) { s.tasks[5].link = "chest"; }),
            "stack.tasks: 'left hand': link 'chest' is no hand of the robot");
  EXPECT_EQ(said([](S& s) { s.tasks[2].link = "chest"; }),
            "stack.tasks: 'com': link 'chest', expected none for its kind");
  EXPECT_EQ(said([](S& s) { s.tasks[7].joints = {"left_wing"}; }),
            "stack.tasks: 'upper body': robot biped has no joint 'left_wing'");
  EXPECT_EQ(said([](S& s) {
              s.tasks[7].joints = {"left_elbow", "left_elbow"};
            }),
            "stack.tasks: 'upper body': joint 'left_elbow' twice");
  EXPECT_EQ(said([](S& s) { s.tasks[0].joints = {"left_elbow"}; }),
            "stack.tasks: 'left foot': joints, expected none for its kind");
  EXPECT_EQ(said([](S& s) { s.tasks[2].axes = {true}; }),
            "stack.tasks: 'com': axes: 1 of them, expected 3");
  EXPECT_EQ(said([](S& s) {
              s.tasks[0].axes = {true, true};
            }),
            "stack.tasks: 'left foot': axes: 2 of them, expected 3 or 6");
  EXPECT_EQ(said([](S& s) {
              s.tasks[2].axes = {false, false, false};
            }),
            "stack.tasks: 'com': axes: none counts, expected at least one");
}

TEST_F(TaskList, AnySetOfTasksMoves) {
  const Reference reference(biped_);
  const StackSettings all = walking_stack(biped_);
  for (std::size_t i = 0; i < all.tasks.size(); ++i) {
    for (const bool alone : {true, false}) {
      StackSettings some = all;
      if (alone) {
        some.tasks = {all.tasks[i]};
      } else {
        some.tasks.erase(some.tasks.begin() + static_cast<std::ptrdiff_t>(i));
        some.tasks.push_back(some.tasks.front());  // an equal wish again, at another priority
        some.tasks.back().name = "again";
        some.tasks.back().priority = 7;
      }
      Stack stack(biped_, some);
      for (int tick = 1; tick <= 100; ++tick) {
        const StackState& state = stack.step(reference.walk(tick * 0.005, 0.2), 0.005);
        ASSERT_EQ(state.reason, "");
        ASSERT_TRUE(state.q.allFinite() && state.X_WB.matrix().allFinite());
      }
    }
  }
}

TEST_F(TaskList, FindsTheStretchedKnee) {
  for (const robot::Biped& biped : robots()) {
    for (const Side side : robot::kSides) {
      const auto& leg = biped.leg[static_cast<std::size_t>(side)];
      robot::Kinematics kinematics(biped.tree);
      const auto length = [&](double knee) {
        Eigen::VectorXd q = biped.half_sitting;
        q[leg.dof[3]] = knee;
        kinematics.update(Eigen::Isometry3d::Identity(), q);
        const auto origin = [&](std::size_t i) {
          return kinematics.X_WL(biped.tree.find_link(biped.tree.moved(leg.dof[i]).name))
              .translation();
        };
        return (origin(2) - origin(4)).norm();
      };
      const double straight = LegRoom(biped).straight_rad(side);
      EXPECT_GT(length(straight), length(straight + 0.01));
      EXPECT_GT(length(straight), length(straight - 0.01));
      EXPECT_GT(length(straight), length(biped.half_sitting[leg.dof[3]]));
    }
  }
}

}  // namespace
}  // namespace mimesis::walker
