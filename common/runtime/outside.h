#pragma once
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

#include "common/runtime/bus.h"

namespace mimesis::runtime {

/// Bytes that `read()` brings from outside, or what it brought when the log was recorded.
template <class Read>
std::string read_outside(Bus& bus, std::string_view name, Read read) {
  Outside& outside = bus.outside();
  if (outside.replaying()) return outside.replay(name);
  std::string bytes = read();
  outside.record(name, bytes);
  return bytes;
}

/// The same for a plain value: a duration on the wall clock, whether a thread is done. Zero where a
/// replay has nothing that fits.
template <class T, class Read>
requires std::is_trivially_copyable_v<T> T read_outside_value(Bus& bus, std::string_view name,
                                                              Read read) {
  const std::string bytes = read_outside(bus, name, [&read] {
    const T value = read();
    return std::string(reinterpret_cast<const char*>(&value), sizeof value);
  });
  T value{};
  if (bytes.size() == sizeof value) std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

}  // namespace mimesis::runtime
