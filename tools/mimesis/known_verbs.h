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
    KnownVerb{"topic", "Shows topics and what is published on them"},
    KnownVerb{"node", "Shows the nodes of a graph"},
    KnownVerb{"log", "Records, plays, replays, checks, changes and shows message logs (MCAP)"},
    KnownVerb{"crowd", "Says what theory guarantees for a crowd scenario"},
    KnownVerb{"demix", "Learns motion primitives: sources, weights and delays"},
    KnownVerb{"reproduce", "Computes a published figure anew and compares it with its reference"},
    KnownVerb{"walk-trials", "Walks of the biped in the physics, many at once"}};

}  // namespace mimesis::tool
