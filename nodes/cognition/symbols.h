#pragma once
#include <array>
#include <cstddef>
#include <string_view>

#include "common/task/symbols.h"

namespace mimesis::cognition {

using task::Color, task::Demonstration, task::Goal, task::Grip, task::Transport;

inline constexpr std::array<std::string_view, 4> kSymbolNames = {"grip", "transport", "goal",
                                                                 "color"};
/// Grip, transport, goal, colour; 0: unknown.
inline constexpr std::size_t kSymbols = 4;
constexpr void forget(Demonstration& d, std::size_t symbol) {
  if (symbol == 0) d.grip = Grip::unknown;
  if (symbol == 1) d.transport = Transport::unknown;
  if (symbol == 2) d.goal = Goal::unknown;
  if (symbol == 3) d.color = Color::unknown;
}
constexpr std::array<int, kSymbols> symbols(const Demonstration& d) {
  return {static_cast<int>(d.grip), static_cast<int>(d.transport), static_cast<int>(d.goal),
          static_cast<int>(d.color)};
}

/// Share of the file's task input [1]: what is expected of a familiar task [M18 2.2.2].
struct TaskInput {
  double means = 1.0;                         ///< of the input to PF
  double goal = 1.0;                          ///< of the input to PFC
  std::array<double, 2> each_goal{1.0, 1.0};  ///< of that, high and low (expected_goals)
};
inline constexpr TaskInput kNoTask{.means = 0.0, .goal = 0.0};

/// The fields with which the network of a robot that imitates begins [M18 fig. 2.2, 2.4.4]: action
/// observation, primitives combined for a goal, motor primitives, goals, colour cues. Others may
/// follow them in a network.
enum class Layer { sts_grip, sts_transport, pf, f5_grip, f5_transport, pfc, color };
inline constexpr std::size_t kLayers = 7;
inline constexpr std::array<Layer, kLayers> kAllLayers = {
    Layer::sts_grip,     Layer::sts_transport, Layer::pf,   Layer::f5_grip,
    Layer::f5_transport, Layer::pfc,           Layer::color};

/// Sites of PF: combinations of primitives. All other layers have two sites: the first and the
/// second symbol of their enum (0: precision, above, high, light; 1: full, below, low, dark).
enum PfSite { kPgAt, kFgBt, kFgAt, kPgBt };

constexpr std::size_t index(Layer layer) { return static_cast<std::size_t>(layer); }
constexpr int sites(Layer layer) { return layer == Layer::pf ? 4 : 2; }

/// Name as in the dissertation, in specs and on the wire.
constexpr std::string_view layer_name(Layer layer) {
  constexpr std::array<std::string_view, kLayers> kNames = {"STSg", "STSt", "PF", "F5g",
                                                            "F5t",  "PFC",  "COL"};
  return kNames[index(layer)];
}

/// Name of a site as in the dissertation's figures and in specs.
constexpr std::string_view site_label(Layer layer, int site) {
  constexpr std::array<std::string_view, 4> kPf = {"PG-AT", "FG-BT", "FG-AT", "PG-BT"};
  constexpr std::array<std::array<std::string_view, 2>, kLayers> kTwo = {{{"PG", "FG"},
                                                                          {"AT", "BT"},
                                                                          {"", ""},
                                                                          {"PG", "FG"},
                                                                          {"AT", "BT"},
                                                                          {"high", "low"},
                                                                          {"light", "dark"}}};
  const auto i = static_cast<std::size_t>(site);
  return layer == Layer::pf ? kPf[i] : kTwo[index(layer)][i];
}

}  // namespace mimesis::cognition
