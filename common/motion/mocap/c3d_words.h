#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace mimesis::mocap {

/// The processors whose numbers a C3D file may hold, by the byte that says so.
enum class C3dProcessor { intel = 84, dec = 85, mips = 86 };

/// Numbers of a C3D file at byte offsets. Who reads has seen to it that they are inside.
struct C3dWords {
  std::span<const std::byte> bytes;
  C3dProcessor processor = C3dProcessor::intel;
  std::string file;

  unsigned u8(std::size_t at) const { return std::to_integer<unsigned>(bytes[at]); }
  int i8(std::size_t at) const { return static_cast<std::int8_t>(u8(at)); }
  unsigned u16(std::size_t at) const {
    return processor == C3dProcessor::mips ? u8(at) << 8 | u8(at + 1) : u8(at + 1) << 8 | u8(at);
  }
  int i16(std::size_t at) const { return static_cast<std::int16_t>(u16(at)); }
  double f32(std::size_t at) const;

  /// @throws ConfigError "file: byte N: what" always
  [[noreturn]] void fail(std::size_t at, const std::string& what) const;
  /// "file: what"
  [[noreturn]] void fail(const std::string& what) const;
};

}  // namespace mimesis::mocap
