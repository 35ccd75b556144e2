#pragma once
#include <Eigen/Core>
#include <functional>
#include <vector>

namespace mimesis::planner {

struct RefinementSettings {
  double window_rad =
      1.3;  ///< half side of the testing window, about the range of the obstacles [rad]
  double inhibited_share = 0.02;  ///< stop below this share of inhibited nodes [1]
  int max_iterations = 30;        ///< [1]
};

using FreePosture = std::function<bool(const Eigen::VectorXd&)>;

/// Off-line refinement [M18 2.3.2, fig. 2.9, 2.10]: inhibited nodes move out of the obstacles and
/// gather at their borders. Each inhibited node moves by v₁ = v₂ + v₃, with v₂ from the mean of the
/// other inhibited nodes to the node and v₃ from the node to the mean of the active nodes (0 if
/// there are none), over a testing window. The thesis slides the window over the whole space; here
/// every inhibited node has the window centred at it, which is the same mean without the grid of
/// positions. All nodes move at once; those that are still inhibited at the end are dropped. Nodes
/// stay within [lo, hi].
/// @returns the share of inhibited nodes before each iteration and at the end, before the drop [1]
std::vector<double> refine_offline(Eigen::MatrixXd& nodes, const Eigen::VectorXd& lo,
                                   const Eigen::VectorXd& hi, const FreePosture& free,
                                   const RefinementSettings& settings);

}  // namespace mimesis::planner
