#pragma once
#include <cstdint>

namespace mimesis::testing {

/// While one lives, an allocation on this thread aborts with a message; deallocation is free to
/// happen. Inactive under sanitizers, which replace malloc themselves.
class NoMalloc {
 public:
  NoMalloc();
  ~NoMalloc();
  NoMalloc(const NoMalloc&) = delete;
  NoMalloc& operator=(const NoMalloc&) = delete;
};

}  // namespace mimesis::testing
