#pragma once
#include <vector>

#include "experiments/harness/figure.h"

namespace mimesis::walk {

/// What the biped does in the physics, to be looked at: a walk with moving arms, the drawer task, a
/// push while it walks. In a build without DART they are listed and say so when they are asked for.
std::vector<reproduce::Figure> films();

}  // namespace mimesis::walk
