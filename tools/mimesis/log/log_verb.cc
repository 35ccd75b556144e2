#include <CLI/CLI.hpp>

#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {

void add_log(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand(
      "log", "Records, plays, replays, checks, changes and shows message logs (MCAP)");
  verb->require_subcommand(1);
  for (const auto add :
       {add_record, add_play, add_replay, add_info, add_cat, add_check, add_recover, add_filter,
        add_diff, add_export, add_convert, add_plot, add_restore, add_clean}) {
    add(*verb, exit_code);
  }
}

}  // namespace mimesis::tool
