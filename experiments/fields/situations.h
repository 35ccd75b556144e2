#pragma once
#include <array>
#include <string>
#include <vector>

#include "nodes/cognition/network_file.h"
#include "nodes/cognition/trial.h"

namespace mimesis::cognition {

/// What the robot did before a trial.
enum class Practice {
  none,
  familiar,    ///< both preferred sequences rehearsed
  both_means,  ///< familiar, and a weaker link from the high goal to FG-BT [M18 2.4.1]
  colors,      ///< both sequences rehearsed with the colour of the object
  lesioned     ///< familiar, then PFC->PF cut
};

/// Site of each layer's single peak: STSg STSt PF F5g F5t PFC COL. -1: no peak; -2: several.
using Sites = std::array<int, kLayers>;

/// One trial of a figure and how it must end.
struct Situation {
  std::string figure, what;
  Practice practice;
  Trial trial;
  Sites expected;
};

/// The shipped network, and fig. 2.19's link to the strategy that is not preferred.
struct Constants {
  NetworkSpec network = load_network();
  double weak = 0.1;  ///< relative to a link that was learned completely [1]

  /// All but those of the fields themselves; gains of one kind vary together.
  std::vector<std::vector<double*>> gains();
};

template <class Real>
FieldNetwork<Real> practised(const Constants& constants, Practice practice);

Sites sites_of(const TrialResult& result);

/// Fig. 2.22: the grasp with full grip is seen and no means are preferred; then the planner reports
/// a test plan with this grip, or not; last the object is placed at the high goal.
inline constexpr double kPlanned_s = 0.3, kPlaced_s = 0.8;
Trial dialogue(const Demonstration& planned);

/// All decisions of M18 figs. 2.17 to 2.24, and the controls that must stay silent.
std::vector<Situation> situations();

/// Figures of `all` that hold for these constants, each once, with "all" if all do.
template <class Real>
std::vector<std::string> figures_that_hold(const Constants& constants);

/// Constants with every gain multiplied by 1 + spread * (normal deviate).
Constants jittered(Constants constants, unsigned seed, double spread);

extern template FieldNetwork<float> practised(const Constants&, Practice);
extern template FieldNetwork<double> practised(const Constants&, Practice);
extern template std::vector<std::string> figures_that_hold<float>(const Constants&);
extern template std::vector<std::string> figures_that_hold<double>(const Constants&);

}  // namespace mimesis::cognition
