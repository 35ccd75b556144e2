#include "tools/mimesis/log/play.h"

#include <iostream>

#include "tools/mimesis/log/lockstep_player.h"
#include "tools/mimesis/log/play_paced.h"

namespace mimesis::tool {

int log_play(const PlayOptions& options) {
  auto logs = open_logs(options.files);
  if (!logs) {
    std::cerr << logs.error().line << '\n';
    return logs.error().exit_code;
  }
  Playback playback(*std::move(logs), options.playback);
  for (const std::string& line : playback.notes()) std::cerr << line << '\n';
  return options.lockstep ? play_in_lockstep(options, playback)
                          : PacedPlayer(options, playback).run();
}

}  // namespace mimesis::tool
