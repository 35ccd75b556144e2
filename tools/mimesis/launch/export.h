#pragma once
#include <string>
#include <vector>

#include "tools/mimesis/launch/command.h"

namespace mimesis::launch {

/// Units of systemd with which a host boots its part of a graph, without the launcher.
struct Units4Boot;

}  // namespace mimesis::launch
