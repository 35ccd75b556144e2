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
  Built(const Crowd& start, int threads)
      : simulator_(static_cast<float>(kStep_s), static_cast<float>(kReach_m), kNeighbours,
                   static_cast<float>(kHorizon_s), static_cast<float>(kHorizon_s), 0.3F,
                   static_cast<float>(kMost_m_s)),
        threads_(threads) {
    for (int group = 0; group < start.groups(); ++group) add(start, group);
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
std::unique_ptr<Rvo2> Rvo2::make(const Crowd& start, int threads) {
  return std::make_unique<Built>(start, threads);
}

}  // namespace mimesis::crowd
