#pragma once
#include <cstdint>
#include <optional>

namespace mimesis::tool {

/// Follows the sequence numbers of one publisher on one topic: they count without gaps, modulo
/// 2^32.
class Sequence {
 public:
  struct Step {
    std::uint32_t missing = 0;  ///< between the one before and this one
    bool repeated = false;      ///< the same number again
    bool back = false;          ///< a lower one
  };
  Step next(std::uint32_t number) {
    const std::uint32_t ahead = number - last_.value_or(number - 1);
    last_ = number;
    if (ahead == 0) return {.repeated = true};
    if (ahead >= 1u << 31) return {.back = true};
    return {.missing = ahead - 1};
  }
  std::optional<std::uint32_t> last() const { return last_; }

 private:
  std::optional<std::uint32_t> last_;
};

}  // namespace mimesis::tool
