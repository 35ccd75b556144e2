#pragma once
#include <string>
#include <vector>

namespace mimesis::launch {

/// Options of `mimesis launch`.
struct Options {
  std::string file;
  std::vector<std::string> args;  ///< NAME=VALUE
  std::vector<std::string> sets;  ///< NODE.KEY=VALUE
  std::string graph;              ///< empty: the environment's
  std::string name;               ///< of the run; empty: made from the time
  bool check = false, dry_run = false, json = false;
  bool keep_running = false;  ///< the result does not end the run
};

/// Checks, shows or runs a launch file. Returns the exit code. @throws ConfigError
int launch(const Options& options);

}  // namespace mimesis::launch
