#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/runtime/params.h"
#include "common/runtime/run_node.h"
#include "common/runtime/zmq_bus.h"

namespace mimesis::runtime {

/// Options that every node understands on its command line.
struct NodeOptions {
  BusOptions bus;
  std::string params;  ///< FILE or FILE#PATH
  std::vector<std::string> args,
      sets;            ///< NAME=VALUE of the file's arguments; KEY=VALUE of parameters
  bool check = false;  ///< read the parameters and stop
  int replay_fd = -1;  ///< >= 0: driven step by step over this socket (replay.h)
};

/// Fills `options`, or returns the exit code with which the program ends now (0 after --help, 2
/// after a mistake, which has been reported). `visit`: the parameters, for --help.
std::optional<int> parse_command_line(int argc, char** argv, const NodeAbout& about,
                                      const std::function<void(ParamVisitor&)>& visit,
                                      NodeOptions& options);

}  // namespace mimesis::runtime
