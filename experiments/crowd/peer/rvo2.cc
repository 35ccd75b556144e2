#include "experiments/crowd/rvo2.h"

#include <RVO.h>
#include <omp.h>

#include <cmath>
#include <vector>

namespace mimesis::crowd {
namespace {

RVO::Vector2 to_rvo(const Eigen::Vector2d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y())};
}

class Built : public Rvo2 {
 public:
  Built(const Crowd& start, const Rvo2Settings& s, std::span<const Wall> walls)
      : simulator_(static_cast<float>(s.step_s), static_cast<float>(s.reach_m),
                   static_cast<std::size_t>(s.neighbours), static_cast<float>(s.horizon_s),
                   static_cast<float>(s.wall_horizon_s), 0.3F, static_cast<float>(s.most_m_s)),
        threads_(s.threads) {
    for (int group = 0; group < start.groups(); ++group) add(start, group);
    for (const Wall& w : walls) simulator_.addObstacle({to_rvo(w.from_W_m), to_rvo(w.to_W_m)});
    simulator_.processObstacles();
  }

  void step() override {
    omp_set_num_threads(threads_);
    for (std::size_t i = 0; i < wishes_.size(); ++i) {
      const Wish& w = wishes_[i];
      RVO::Vector2 v = w.speed * w.to;
      if (w.is_goal) {  // preferred velocity as in RVO2's example of a circle
        const RVO::Vector2 way = w.to - simulator_.getAgentPosition(i);
        v = RVO::absSq(way) > 1.0F ? w.speed * RVO::normalize(way) : w.speed * way;
      }
      simulator_.setAgentPrefVelocity(i, v);
    }
    simulator_.doStep();
  }
  double time_s() const override { return static_cast<double>(simulator_.getGlobalTime()); }
  int size() const override { return static_cast<int>(wishes_.size()); }
  Eigen::Vector2d position_W_m(int agent) const override {
    const RVO::Vector2& p = simulator_.getAgentPosition(static_cast<std::size_t>(agent));
    return {static_cast<double>(p.x()), static_cast<double>(p.y())};
  }
  void set_goal(int agent, const Eigen::Vector2d& goal_W_m) override {
    Wish& wish = wishes_[static_cast<std::size_t>(agent)];
    wish.to = to_rvo(goal_W_m);
    wish.is_goal = true;
  }

 private:
  struct Wish {
    RVO::Vector2 to;  // a goal, or a direction
    float speed;
    bool is_goal;
  };

  void add(const Crowd& start, int group) {
    const GroupSettings& settings = start.group(group);
    const double direction = settings.path.direction_rad;
    const bool to_goals = settings.rules.heading.kind == HeadingKind::goal;
    const auto [first, count] = start.rows(group);
    for (int row = first; row < first + count; ++row) {
      const Agent a = start.agent(row);
      const std::size_t i = simulator_.addAgent(to_rvo(a.state.position_W_m));
      simulator_.setAgentVelocity(i, to_rvo(a.state.velocity_W_m_s));
      simulator_.setAgentRadius(i, static_cast<float>(a.traits.radius_m));
      const Eigen::Vector2d ahead(std::cos(direction), std::sin(direction));
      const double speed = a.traits.stride * a.traits.omega_rad_s * settings.gait.mean();
      wishes_.push_back(
          {to_rvo(to_goals ? a.traits.goal_W_m : ahead), static_cast<float>(speed), to_goals});
    }
  }

  RVO::RVOSimulator simulator_;
  int threads_;
  std::vector<Wish> wishes_;
};

}  // namespace

bool Rvo2::built() { return true; }
std::unique_ptr<Rvo2> Rvo2::make(const Crowd& start, const Rvo2Settings& settings,
                                 std::span<const Wall> walls) {
  return std::make_unique<Built>(start, settings, walls);
}

}  // namespace mimesis::crowd
