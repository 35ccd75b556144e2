#pragma once
#include <array>
#include <string_view>

namespace mimesis::tool {

struct KnownVerb {
  std::string_view name, about;
};

/// The verbs of this project, for the help of `mimesis` and of each verb.
constexpr std::array kKnownVerbs{
    KnownVerb{"launch", "Starts the nodes of a launch file and watches them"},
    KnownVerb{"host", "The launcher's hand on another host; called through ssh"},
    KnownVerb{"key", "Keys of this host, and of hosts that it trusts"},
    KnownVerb{"topic", "Shows topics and their messages"},
    KnownVerb{"node", "Shows the nodes of a graph"},
    KnownVerb{"param", "Shows and changes parameters of nodes that run"},
    KnownVerb{"service", "Shows services and calls them"},
    KnownVerb{"graph", "Shows the graphs that run"},
    KnownVerb{"log", "Records, plays, replays, checks, changes and shows message logs (MCAP)"},
    KnownVerb{"view", "Shows a running graph or a log on a page, and to Foxglove and Lichtblick"},
    KnownVerb{"top", "Shows the nodes of a graph with load and health, once a second"},
    KnownVerb{"doctor", "Looks at this computer: what keeps a graph from running well"},
    KnownVerb{"completion", "Prints the completion of bash, zsh or fish"},
    KnownVerb{"plan", "Plans a motion or a task of an arm, and proves written plans again"},
    KnownVerb{"crowd", "Shows the guarantees of theory for a crowd scenario"},
    KnownVerb{"cognition", "Says why the neural fields decided as they did"},
    KnownVerb{"calibrate", "Calibrates cameras from pictures of a chessboard"},
    KnownVerb{"vision", "Teaches vision colours, checks its camera"},
    KnownVerb{"hw", "Drives on their buses: finds, watches, checks, moves, asks, breaks"},
    KnownVerb{"demix", "Learns motion primitives: sources, weights and delays"},
    KnownVerb{"reproduce", "Recomputes a published figure and compares it with its reference"},
    KnownVerb{"walk-trials", "Walks of the biped in the physics world, many at once"}};

/// First word of a call that asks for completions: `mimesis __complete VERB WORD ...`.
inline constexpr std::string_view kComplete = "__complete";

}  // namespace mimesis::tool
