#include "hw/sim/cia402/dictionary.h"

namespace mimesis::hw::sim {

void Dictionary::add(arm::Object object, int bytes, Access access, std::uint32_t value) {
  entries_[key(object)] = {bytes, access, value};
}

std::uint32_t Dictionary::get(arm::Object object) const { return entries_.at(key(object)).value; }

std::int32_t Dictionary::get_signed(arm::Object object) const {
  const Entry& e = entries_.at(key(object));
  const int unused = 32 - 8 * e.bytes;
  return static_cast<std::int32_t>(e.value << unused) >> unused;
}

void Dictionary::set(arm::Object object, std::uint32_t value) {
  entries_.at(key(object)).value = value;
}

std::uint32_t Dictionary::refuse_upload(arm::Object object) const {
  if (contains(object)) return 0;
  const auto next = entries_.lower_bound(key({object.index, 0}));
  const bool index_exists = next != entries_.end() && next->first >> 8 == object.index;
  return index_exists ? 0x06090011 : 0x06020000;
}

std::uint32_t Dictionary::refuse_download(arm::Object object, int bytes) const {
  if (const std::uint32_t code = refuse_upload(object)) return code;
  const Entry& e = entries_.at(key(object));
  if (e.access == Access::read_only) return 0x06010002;
  return bytes == e.bytes ? 0 : 0x06070010;
}

}  // namespace mimesis::hw::sim
