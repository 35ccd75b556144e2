#pragma once
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "common/error.h"

namespace mimesis {

/// Ends a long computation early: a deadline, a cancellation. The computation asks between parts of
/// its work of some microseconds. After the first yes all answers are yes, and what it computes
/// from then on is thrown away: it only has to end soon. The default never interrupts.
///
/// Copies are one and the same. Used by one thread. Pure libraries take it as an argument: the
/// clock is in `yes`, and with the same answers they compute the same bits.
class Interrupt {
 public:
  static constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();

  Interrupt() = default;
  /// @param why    the reason begins so: "the deadline of 0.5 s passed"
  /// @param yes    the answer
  /// @param every  it is called at each `every`-th question, as clocks are slow [1]
  Interrupt(std::string why, std::function<bool()> yes, std::uint64_t every = 1);

  /// Asks.
  bool now() const { return state_ && ask(); }
  /// An answer was yes. Does not ask.
  bool told() const { return told_at() != kNever; }
  /// Number of the first question, from 1 on, that was answered by yes; kNever if none was.
  std::uint64_t told_at() const;
  std::uint64_t asked() const;  ///< questions so far
  /// The work that begins, as in "while `part`".
  void enter(std::string_view part) const;
  /// Once told, what is thrown away may be kept as long as any copy lives: freeing much takes time.
  template <class T>
  void keep(T&& garbage) const {
    if (told()) keep_pointer(std::make_shared<std::decay_t<T>>(std::forward<T>(garbage)));
  }
  /// "the deadline of 0.5 s passed while links were certified".
  Status reason() const;

 private:
  struct State;
  bool ask() const;
  void keep_pointer(std::shared_ptr<void> garbage) const;

  std::shared_ptr<State> state_;
};

}  // namespace mimesis
