#pragma once
#include "common/motion/mocap/trials.h"

namespace mimesis::synthesizer {

/// A recorded gait cycle does not end where it began; played again and again it jumps at phase 0,
/// and so does every model that is good enough to learn the jump. Takes from each row the straight
/// line that closes it, d(t/T − ½) with
///   d = x(T−1) + ½[x(T−1) − x(T−2) + x(1) − x(0)] − x(0);
/// means stay (but for d/2T). For periodic motion only. Returns the rms of d over all rows [rad].
/// @throws ConfigError with fewer than 4 samples a cycle
double close_cycles(mocap::Trials& trials);

}  // namespace mimesis::synthesizer
