#include "nodes/crowd/rules/hopf_network.h"

namespace mimesis::crowd {

void hopf_network_rate(const CouplingGraph& graph, const dmp::AndronovHopf& oscillator,
                       double k_1_s, const HopfLeader& leader, const HopfStates& x,
                       Eigen::Ref<Eigen::Matrix2Xd> rate) {
  const auto n = static_cast<double>(x.cols());
  const Eigen::Vector2d sum = x.rowwise().sum();
  for (int i = 0; i < x.cols(); ++i) {
    const Eigen::Vector2d own = x.col(i);
    Eigen::Vector2d pull = Eigen::Vector2d::Zero();
    if (graph.complete()) pull = sum - n * own;
    for (const auto& other : graph.neighbours(i)) {
      pull += other.weight * dmp::AndronovHopf::pull(own, x.col(other.index));
    }
    rate.col(i) = oscillator.rate(own) + k_1_s * pull +
                  leader.gain_1_s * dmp::AndronovHopf::pull(own, leader.x);
  }
}

}  // namespace mimesis::crowd
