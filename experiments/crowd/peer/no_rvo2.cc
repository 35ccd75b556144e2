// Where RVO2 was not fetched.
#include "experiments/crowd/rvo2.h"

namespace mimesis::crowd {

bool Rvo2::built() { return false; }
std::unique_ptr<Rvo2> Rvo2::make(const Crowd&, const Rvo2Settings&, std::span<const Wall>) {
  return nullptr;
}

}  // namespace mimesis::crowd
