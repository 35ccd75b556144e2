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

/// Number of allocations on this thread so far; 0 under sanitizers.
std::uint64_t allocations();

}  // namespace mimesis::testing
