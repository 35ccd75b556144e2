#pragma once
#include <cstdint>
#include <map>

#include "hw/arm/canopen.h"

namespace mimesis::hw::sim {

enum class Access : std::uint8_t { read_only, read_write };

/// Object dictionary of a simulated CANopen node: numbers of 1, 2 or 4 bytes. Answers as CiA 301
/// asks for: 0, or the SDO abort code.
class Dictionary {
 public:
  void add(arm::Object object, int bytes, Access access, std::uint32_t value);

  std::uint32_t get(arm::Object object) const;  ///< precondition: exists
  std::int32_t get_signed(arm::Object object) const;
  void set(arm::Object object, std::uint32_t value);  ///< from inside the node, whatever the access
  bool contains(arm::Object object) const { return entries_.contains(key(object)); }
  int bytes(arm::Object object) const { return entries_.at(key(object)).bytes; }

  /// Abort code of reading or of writing `bytes` bytes; 0 if it is allowed.
  std::uint32_t refuse_upload(arm::Object object) const;
  std::uint32_t refuse_download(arm::Object object, int bytes) const;

 private:
  struct Entry {
    int bytes;
    Access access;
    std::uint32_t value;
  };
  static std::uint32_t key(arm::Object o) { return std::uint32_t{o.index} << 8 | o.sub; }

  std::map<std::uint32_t, Entry> entries_;
};

}  // namespace mimesis::hw::sim
