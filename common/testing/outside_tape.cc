#include "common/testing/outside_tape.h"

namespace mimesis::testing {

const OutsideTape::Entry* OutsideTape::expect(std::string_view name, bool written) {
  if (!problem_.empty()) return nullptr;
  const auto describe = [](std::string_view what, bool goes_out) {
    return (goes_out ? "written '" : "read '") + std::string(what) + "'";
  };
  const Entry* entry = next_ < entries_.size() ? &entries_[next_] : nullptr;
  if (entry == nullptr || entry->name != name || entry->written != written) {
    problem_ = "entry " + std::to_string(next_) + ": the node has " + describe(name, written) +
               ", the record " + (entry ? describe(entry->name, entry->written) : "its end");
    return nullptr;
  }
  ++next_;
  return entry;
}

std::string OutsideTape::replay(std::string_view name) {
  const Entry* entry = expect(name, false);
  return entry == nullptr ? std::string() : entry->bytes;
}

void OutsideTape::written(std::string_view name, std::string_view bytes) {
  if (!replaying_) {
    entries_.push_back({std::string(name), std::string(bytes), true});
    return;
  }
  const Entry* entry = expect(name, true);
  if (entry != nullptr && entry->bytes != bytes) {
    problem_ =
        "entry " + std::to_string(next_ - 1) + ": other bytes written to '" + entry->name + "'";
  }
}

}  // namespace mimesis::testing
