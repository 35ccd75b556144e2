#include "common/testing/no_malloc.h"

#include <unistd.h>

#include <cstdlib>
#include <new>

namespace {
thread_local int guards = 0;
thread_local std::uint64_t allocated = 0;

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
extern "C" void* __libc_malloc(std::size_t);
extern "C" void* __libc_calloc(std::size_t, std::size_t);
extern "C" void* __libc_realloc(void*, std::size_t);

void count() {
  ++allocated;
  if (guards == 0) return;
  guards = 0;  // the abort itself may allocate
  static constexpr char kLine[] = "NoMalloc: an allocation where none is allowed\n";
  [[maybe_unused]] const auto written = write(STDERR_FILENO, kLine, sizeof kLine - 1);
  std::abort();
}
#endif
}  // namespace

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// Operator new ends in malloc, Eigen calls it directly: this covers both.
extern "C" void* malloc(std::size_t size) {
  count();
  return __libc_malloc(size);
}
extern "C" void* calloc(std::size_t n, std::size_t size) {
  count();
  return __libc_calloc(n, size);
}
extern "C" void* realloc(void* p, std::size_t size) {
  count();
  return __libc_realloc(p, size);
}
#endif

namespace mimesis::testing {
NoMalloc::NoMalloc() { ++guards; }
NoMalloc::~NoMalloc() {
  if (guards > 0) --guards;
}
std::uint64_t allocations() { return allocated; }
}  // namespace mimesis::testing
