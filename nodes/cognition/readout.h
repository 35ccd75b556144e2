#pragma once
#include <span>

#include "nodes/cognition/ladder.h"
#include "nodes/cognition/symbols.h"

namespace mimesis::cognition {

/// Suprathreshold activity of one field. A peak is a run of neighbours with u > 0 = u_TH
/// [M18 2.2.2].
struct Peaks {
  int count = 0;
  int site = -1;       ///< nearest to the most active neuron; -1 without a peak
  double max_u = 0.0;  ///< of the whole field [1]
};

template <class Real>
Peaks read_peaks(const Ladder<Real>& ladder, Layer layer);

/// What the ladder has decided: means from F5, goal from PFC, colour from COL.
struct Decision {
  Grip grip = Grip::unknown;
  Transport transport = Transport::unknown;
  Goal goal = Goal::unknown;
  Color color = Color::unknown;
  /// Exactly one peak in each of F5g, F5t and PFC, and all fields at rest: |u̇| < 1 per second.
  bool settled = false;

  bool operator==(const Decision&) const = default;
};

/// A layer without exactly one peak reads `unknown`. O(7 N), does not allocate.
template <class Real>
Decision read_decision(const Ladder<Real>& ladder);

extern template Peaks read_peaks(const Ladder<float>&, Layer);
extern template Peaks read_peaks(const Ladder<double>&, Layer);
extern template Decision read_decision(const Ladder<float>&);
extern template Decision read_decision(const Ladder<double>&);

}  // namespace mimesis::cognition
