#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/runtime/param_source.h"
#include "common/runtime/run_node.h"
#include "common/runtime/zmq_bus.h"

namespace mimesis::runtime {

/// Options that every node understands on its command line.
struct NodeOptions {
  BusOptions bus;
  std::string params;  ///< FILE or FILE#PATH
  std::vector<std::string> args,
      sets;  ///< NAME=VALUE of the file's arguments; KEY=VALUE of parameters
  bool lock_memory = false;
  bool check = false;     ///< make the node without sockets and devices, and stop
  bool describe = false;  ///< print what it is, and stop
  int replay_fd = -1;     ///< >= 0: driven step by step over this socket (replay.h)
};

/// Fills `options`, or returns the exit code with which the program ends now (0 after --help, 2
/// after a mistake, which has been reported). `visit`, `create`: parameters and ports, for --help.
std::optional<int> parse_command_line(int argc, char** argv, const NodeAbout& about,
                                      const std::function<void(ParamVisitor&)>& visit,
                                      const std::function<void(Bus&)>& create,
                                      NodeOptions& options);

/// --check and --describe. `defaults`: the parameters before reading `source`. Returns the exit
/// code.
int show_node(const NodeOptions& options, const NodeAbout& about,
              const std::function<void(Bus&)>& create,
              const std::function<void(ParamVisitor&)>& visit,
              const std::vector<ParamInfo>& defaults, const ParamSource& source);

}  // namespace mimesis::runtime
