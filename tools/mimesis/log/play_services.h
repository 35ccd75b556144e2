#pragma once
#include "common/runtime/bus.h"
#include "tools/mimesis/log/play_paced.h"

namespace mimesis::tool {

/// Offers PLAYER/pause, resume, step, seek, rate and status (proto/player.proto). Each answers with
/// the status after it. Before `ready`.
void serve_player(runtime::Bus& bus, PacedPlayer& player);

}  // namespace mimesis::tool
