#include "nodes/cognition/readout.h"

#include <algorithm>

namespace mimesis::cognition {

template <class Real>
Peaks read_peaks(const Ladder<Real>& ladder, Layer layer) {
  const auto u = ladder.field(layer).activity();
  Peaks peaks;
  bool inside = false;
  std::size_t top = 0;
  for (std::size_t i = 0; i < u.size(); ++i) {
    if (u[i] > 0 && !inside) ++peaks.count;
    inside = u[i] > 0;
    if (u[i] > u[top]) top = i;
  }
  peaks.max_u = static_cast<double>(u[top]);
  if (peaks.count > 0) {
    peaks.site = std::min(static_cast<int>(top * static_cast<std::size_t>(sites(layer)) / u.size()),
                          sites(layer) - 1);
  }
  return peaks;
}

template <class Real>
Decision read_decision(const Ladder<Real>& ladder) {
  constexpr double kAtRest_1_s = 1.0;
  const auto symbol = [&](Layer layer) {
    const Peaks peaks = read_peaks(ladder, layer);
    return peaks.count == 1 ? peaks.site + 1 : 0;
  };
  Decision d{static_cast<Grip>(symbol(Layer::f5_grip)),
             static_cast<Transport>(symbol(Layer::f5_transport)),
             static_cast<Goal>(symbol(Layer::pfc)), static_cast<Color>(symbol(Layer::color))};
  d.settled =
      d.grip != Grip::unknown && d.transport != Transport::unknown && d.goal != Goal::unknown;
  for (const Layer layer : kAllLayers) {
    d.settled = d.settled && ladder.field(layer).speed_1_s() < kAtRest_1_s;
  }
  return d;
}

template Peaks read_peaks(const Ladder<float>&, Layer);
template Peaks read_peaks(const Ladder<double>&, Layer);
template Decision read_decision(const Ladder<float>&);
template Decision read_decision(const Ladder<double>&);

}  // namespace mimesis::cognition
