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
    KnownVerb{"log", "Records, plays, replays, checks, changes and shows message logs (MCAP)"},
    KnownVerb{"crowd", "Shows the guarantees of theory for a crowd scenario"},
    KnownVerb{"demix", "Learns motion primitives: sources, weights and delays"},
    KnownVerb{"drawer-trials", "Writes generated trials of the drawer task as files"},
    KnownVerb{"reproduce", "Recomputes a published figure and compares it with its reference"},
    KnownVerb{"walk-trials", "Walks of the biped in the physics world, many at once"}};

}  // namespace mimesis::tool
