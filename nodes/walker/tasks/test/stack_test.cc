#include "nodes/walker/tasks/stack.h"

#include <gtest/gtest.h>

#include "common/testing/no_malloc.h"
#include "nodes/walker/tasks/test/reference.h"

namespace mimesis::walker {
namespace {

constexpr double kDt = 0.005;

TEST(Stack, FollowsAWalk) {
  for (const robot::Biped& biped : robots()) {
    for (const double speed : {0.0, 0.2, 0.3}) {
      const Reference reference(biped);
      Stack stack(biped, walking_stack(biped));
      double com = 0.0, foot = 0.0, fastest = 0.0;
      int limited = 0;
      for (int tick = 1; tick <= 1600; ++tick) {
        const StackState& state = stack.step(reference.walk(tick * kDt, speed), kDt);
        ASSERT_EQ(state.reason, "");
        com = std::max(com, state.com_error_m);
        foot = std::max(foot, state.foot_error_m);
        fastest = std::max(fastest, state.dq.cwiseAbs().maxCoeff());
        limited += state.limited;
      }
      EXPECT_LT(com, 1e-6) << biped.tree.name() << " " << speed;
      EXPECT_LT(foot, 1e-6) << biped.tree.name() << " " << speed;
    }
  }
}

}  // namespace
}  // namespace mimesis::walker
