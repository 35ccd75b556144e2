#pragma once

namespace CLI {
class App;
}

namespace mimesis::tool {

/// Each adds one sub-verb to `mimesis log` (NAME_verb.cc); exit codes as in verbs.h.
void add_record(CLI::App& log, int& exit_code);
void add_play(CLI::App& log, int& exit_code);
void add_replay(CLI::App& log, int& exit_code);
void add_info(CLI::App& log, int& exit_code);
void add_cat(CLI::App& log, int& exit_code);
void add_check(CLI::App& log, int& exit_code);
void add_recover(CLI::App& log, int& exit_code);
void add_filter(CLI::App& log, int& exit_code);
void add_merge(CLI::App& log, int& exit_code);
void add_sort(CLI::App& log, int& exit_code);
void add_diff(CLI::App& log, int& exit_code);
void add_export(CLI::App& log, int& exit_code);
void add_convert(CLI::App& log, int& exit_code);
void add_plot(CLI::App& log, int& exit_code);
void add_view(CLI::App& log, int& exit_code);

}  // namespace mimesis::tool
