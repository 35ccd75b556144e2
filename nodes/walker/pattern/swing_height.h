#pragma once

namespace mimesis::walker {

/// Height of a sole in the air and its rates by the share of its swing that is over.
struct SwingHeight {
  double z = 0.0, dz = 0.0, ddz = 0.0;
};

/// A swing of height 1, u ∈ [0, 1]: up from rest, down, then a slow glide to rest. The ground may
/// be higher than planned, and what drives press until the foot is felt there goes as its speed:
/// against 64 (u (1 − u))³ the glide has 0.6 of it below a tenth of the height. Speeds are
/// continuous; the acceleration ends with the glide.
SwingHeight swing_height(double u);

}  // namespace mimesis::walker
