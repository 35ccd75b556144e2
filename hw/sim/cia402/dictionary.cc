#include "hw/sim/cia402/dictionary.h"

#include <algorithm>

namespace mimesis::hw::sim {

int bytes_of(Type type) {
  switch (type) {
    case Type::i8:
    case Type::u8:
      return 1;
    case Type::i16:
    case Type::u16:
      return 2;
    case Type::text:
      return 0;
    default:
      return 4;
  }
}

std::int64_t decode(Type type, std::span<const std::uint8_t> data) {
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < data.size(); ++i) bits |= std::uint32_t{data[i]} << 8 * i;
  switch (type) {
    case Type::i8:
      return static_cast<std::int8_t>(bits);
    case Type::i16:
      return static_cast<std::int16_t>(bits);
    case Type::i32:
      return static_cast<std::int32_t>(bits);
    default:
      return bits;
  }
}

void encode(std::int64_t value, int bytes, std::vector<std::uint8_t>& data) {
  for (int i = 0; i < bytes; ++i) data.push_back(static_cast<std::uint8_t>(value >> 8 * i));
}

void Dictionary::add(Entry entry) {
  entry.power_on = entry.value;
  const auto at = std::ranges::lower_bound(entries_, entry.address, {}, &Entry::address);
  if (at != entries_.end() && at->address == entry.address) {
    *at = std::move(entry);
  } else {
    entries_.insert(at, std::move(entry));
  }
}

void Dictionary::remove(Address address) {
  std::erase_if(entries_, [&](const Entry& e) { return e.address == address; });
}

const Entry* Dictionary::find(Address address) const {
  const auto at = std::ranges::lower_bound(entries_, address, {}, &Entry::address);
  return at != entries_.end() && at->address == address ? &*at : nullptr;
}

Entry* Dictionary::entry(Address address) { return const_cast<Entry*>(find(address)); }

std::int64_t Dictionary::value(Address address) const {
  const Entry* e = find(address);
  return e == nullptr ? 0 : e->value;
}

void Dictionary::set(Address address, std::int64_t value) {
  if (Entry* e = entry(address)) e->value = value;
}

void Dictionary::reset(Address first, Address last) {
  for (Entry& e : entries_) {
    if (e.address >= first && e.address <= last) e.value = e.power_on;
  }
}

std::uint32_t Dictionary::read(Address address, std::vector<std::uint8_t>& data) const {
  const Entry* e = find(address);
  if (e == nullptr) {
    const auto next = std::ranges::lower_bound(entries_, address & ~0xFFu, {}, &Entry::address);
    const bool index_exists = next != entries_.end() && next->address >> 8 == address >> 8;
    return index_exists ? abort_code::kNoSub : abort_code::kNoObject;
  }
  if (e->access == Access::wo) return abort_code::kWriteOnly;
  data.clear();
  if (e->type == Type::text) {
    data.assign(e->text.begin(), e->text.end());
  } else {
    encode(e->value, bytes_of(e->type), data);
  }
  return 0;
}

std::uint32_t Dictionary::refuse_write(Address address, std::span<const std::uint8_t> data,
                                       std::int64_t& value) const {
  const Entry* e = find(address);
  std::vector<std::uint8_t> ignored;
  if (e == nullptr) return read(address, ignored);
  if (e->access == Access::ro) return abort_code::kReadOnly;
  if (e->type == Type::text) return 0;
  if (data.size() != static_cast<std::size_t>(bytes_of(e->type))) return abort_code::kLength;
  value = decode(e->type, data);
  if (value > e->high) return abort_code::kTooHigh;
  if (value < e->low) return abort_code::kTooLow;
  const bool chosen = e->choices.empty() || std::ranges::count(e->choices, value) > 0;
  return chosen ? 0 : abort_code::kRange;
}

void Dictionary::write(Address address, std::span<const std::uint8_t> data, std::int64_t value) {
  Entry* e = entry(address);
  if (e->type == Type::text) {
    e->text.assign(data.begin(), data.end());
  } else {
    e->value = value;
  }
}

}  // namespace mimesis::hw::sim
