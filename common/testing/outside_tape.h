#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "common/runtime/bus.h"

namespace mimesis::testing {

/// Keeps the data that a node exchanges with the outside; after `rewind` gives it to a second
/// instance of the node.
class OutsideTape final : public runtime::Outside {
 public:
  struct Entry {
    std::string name, bytes;
    bool written;
    friend bool operator==(const Entry&, const Entry&) = default;
  };

  void rewind() {
    replaying_ = true;
    next_ = 0;
    problem_.clear();
  }
  std::vector<Entry>& entries() { return entries_; }
  bool at_end() const { return next_ == entries_.size(); }
  /// The first difference between record and replay; empty: there was none.
  const std::string& problem() const { return problem_; }

  bool replaying() const override { return replaying_; }
  void record(std::string_view name, std::string_view bytes) override {
    entries_.push_back({std::string(name), std::string(bytes), false});
  }
  std::string replay(std::string_view name) override;
  void written(std::string_view name, std::string_view bytes) override;

 private:
  /// The next entry, if it is the expected one; else notes the problem.
  const Entry* expect(std::string_view name, bool written);

  bool replaying_ = false;
  std::vector<Entry> entries_;
  std::size_t next_ = 0;
  std::string problem_;
};

}  // namespace mimesis::testing
