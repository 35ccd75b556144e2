#include "experiments/crowd/quality.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mimesis::crowd {
namespace {

/// Goes straight to its goals, through everybody.
class Blind : public Movers {
 public:
  explicit Blind(const Crowd& crowd) {
    for (int i = 0; i < crowd.size(); ++i) {
      at_.push_back(crowd.agent(i).state.position_W_m);
      goal_.push_back(crowd.agent(i).traits.goal_W_m);
    }
  }
  void step() override {
    time_s_ += 0.1;
    for (std::size_t i = 0; i < at_.size(); ++i) {
      at_[i] += 0.1 * 6.0 * 0.22 * (goal_[i] - at_[i]).normalized();
    }
  }
  double time_s() const override { return time_s_; }
  int size() const override { return static_cast<int>(at_.size()); }
  Eigen::Vector2d position_W_m(int agent) const override {
    return at_[static_cast<std::size_t>(agent)];
  }
  void set_goal(int agent, const Eigen::Vector2d& goal_W_m) override {
    goal_[static_cast<std::size_t>(agent)] = goal_W_m;
  }

 private:
  std::vector<Eigen::Vector2d> at_, goal_;
  double time_s_ = 0.0;
};

TEST(Quality, OfTheBlindIsInTheirOverlaps) {
  const Quality blind = quality([](World w) { return std::make_unique<Blind>(w.crowd); }, 1.0, {});
  EXPECT_NEAR(blind.delay_s, 0.0, 1e-3);
  EXPECT_GT(blind.overlaps, 0.1);
  const Quality ours =
      quality([](World w) { return move_by_engine(std::move(w.crowd), 1); }, 1.0, {.dt_s = 0.1});
  EXPECT_EQ(ours.overlaps, 0.0);
  EXPECT_GT(ours.delay_s, 0.1);
  EXPECT_GT(ours.flow_1_s, 1.0);
  EXPECT_LT(ours.flow_1_s, blind.flow_1_s);
  EXPECT_GT(ours.flow_error_1_s, 0.0);
  EXPECT_FALSE(blind.admissible(blind));
  EXPECT_TRUE(ours.admissible(ours));
  const auto worse = [&](double Quality::*what, double by) {
    Quality q = ours;
    q.*what += by;
    return q.admissible(ours);
  };
  EXPECT_FALSE(worse(&Quality::overlaps, 2e-3));
  EXPECT_FALSE(worse(&Quality::delay_s, 0.06 * ours.delay_s + 0.02));
  EXPECT_TRUE(worse(&Quality::delay_s, -0.1));
  EXPECT_FALSE(worse(&Quality::flow_1_s,
                     -0.06 * ours.flow_1_s - 2.0 * std::sqrt(2.0) * ours.flow_error_1_s));
  EXPECT_TRUE(worse(&Quality::flow_1_s, 0.1));
}

}  // namespace
}  // namespace mimesis::crowd
