#pragma once
#include <array>
#include <cstddef>
#include <string>
#include <string_view>

#include "common/error.h"

namespace mimesis::task {

// The vocabulary of the bridge paradigm [M18 2.1.1]: what is seen, decided and done. The numbers
// are those of proto/task.proto.

/// How the object is grasped: with the finger tips from above, or with the whole hand from the
/// side.
enum class Grip { unknown, precision, full };
/// How the object passes the bar.
enum class Transport { unknown, above, below };
/// Where the object is placed.
enum class Goal { unknown, high, low };
/// Colour cue of the object [M18 2.4.4].
enum class Color { unknown, light, dark };

/// Words of the values, first the one for "not known".
template <class Symbol>
inline constexpr std::array<std::string_view, 3> kWords{};
template <>
inline constexpr std::array<std::string_view, 3> kWords<Grip>{"unknown", "precision", "full"};
template <>
inline constexpr std::array<std::string_view, 3> kWords<Transport>{"unknown", "above", "below"};
template <>
inline constexpr std::array<std::string_view, 3> kWords<Goal>{"unknown", "high", "low"};
template <>
inline constexpr std::array<std::string_view, 3> kWords<Color>{"unknown", "light", "dark"};
/// The word of a value.
template <class Symbol>
constexpr std::string_view word(Symbol symbol) {
  return kWords<Symbol>.at(static_cast<std::size_t>(symbol));
}

/// @param where  key or option that holds the word; empty: none
/// @throws ConfigError that names the word and the two that are expected
template <class Symbol>
Symbol parse_symbol(std::string_view word, const std::string& where = {}) {
  for (const std::size_t i : {1U, 2U}) {
    if (word == kWords<Symbol>[i]) return static_cast<Symbol>(i);
  }
  throw ConfigError(where + (where.empty() ? "'" : ": '") + std::string(word) + "' is neither '" +
                    std::string(kWords<Symbol>[1]) + "' nor '" + std::string(kWords<Symbol>[2]) +
                    "'");
}

/// An action with the object, shown or seen. An unknown symbol was not seen.
struct Demonstration {
  Grip grip = Grip::unknown;
  Transport transport = Transport::unknown;
  Goal goal = Goal::unknown;
  Color color = Color::unknown;
  /// 0..1 [1]
  double grip_confidence = 1.0, transport_confidence = 1.0, goal_confidence = 1.0,
         color_confidence = 1.0;

  /// Somebody acts: the colour of an object that only stands there is no demonstration.
  bool action() const {
    return grip != Grip::unknown || transport != Transport::unknown || goal != Goal::unknown;
  }
};

/// Reads "precision,above,high" (grip, transport, goal), and a colour behind it if there is one.
/// @throws ConfigError that names what is not understood and what is expected
Demonstration parse_demonstration(std::string_view text, const std::string& where = {});

}  // namespace mimesis::task
