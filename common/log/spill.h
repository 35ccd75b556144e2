#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "common/log/io.h"

namespace mimesis::log {

/// Bytes appended now and read back once at the end: in memory up to `limit`, beyond it in a file
/// without a name, so that what grows with a recording takes no memory.
class Spill {
 public:
  /// @param folder  on the disk to use; empty: memory only
  explicit Spill(std::string folder, std::size_t limit = 1024 * 1024);
  ~Spill();
  Spill(const Spill&) = delete;
  Spill& operator=(const Spill&) = delete;

  /// Never fails: data that the disk does not take stays in memory.
  void append(std::string_view bytes);
  std::uint64_t size() const { return on_disk_ + memory_.size(); }
  std::size_t in_memory() const { return memory_.size(); }
  /// Everything in its order, piece by piece, until one is not taken.
  [[nodiscard]] Result read(const std::function<Result(std::string_view)>& take) const;

 private:
  void move_to_disk();

  std::string folder_;
  std::size_t limit_;
  int fd_ = -1;
  std::uint64_t on_disk_ = 0;
  std::string memory_;  ///< data that follows the part on the disk
};

}  // namespace mimesis::log
