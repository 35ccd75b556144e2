#pragma once
#include <functional>
#include <string>
#include <vector>

#include "common/runtime/bus.h"
#include "common/runtime/param_source.h"
#include "common/runtime/run_node.h"

namespace google::protobuf {
class Descriptor;
}

namespace mimesis::runtime {

using CreateNode = std::function<void(Bus&)>;

/// What a node says to its bus while it is constructed: the only list of its ports.
struct Declared {
  struct Port {
    std::string name;
    const google::protobuf::Descriptor* type = nullptr;
    bool input = false;
    InOptions in{};
    OutOptions out{};
  };
  struct Service {
    std::string name;
    const google::protobuf::Descriptor *request = nullptr, *response = nullptr;
  };

  std::vector<Port> ports;
  std::vector<Service> services;
  std::vector<Opening> opened;  ///< buses and devices
  bool complete = false;        ///< all ports are there
};

/// Constructs a node on a bus without sockets, devices and other nodes; what it declared is in
/// `declared`, though it throws.
/// @param whole  all of the node, so that it finds what is wrong with its parameters; else as far
///               as its PortsEnd
/// @throws ConfigError as the node
void declare(const CreateNode& create, const std::string& name, bool lockstep, bool whole,
             Declared& declared);

/// One JSON object: common/runtime/README.md.
/// @param defaults, present  the parameters before and after reading `source`
/// @param flat  the present ones as flat_params() writes them
std::string description(const NodeAbout& about, const Declared& declared,
                        const std::vector<ParamInfo>& defaults,
                        const std::vector<ParamInfo>& present, const std::vector<std::string>& flat,
                        const ParamSource& source);

/// Lines for --help: ports and services; parameters with their meaning.
std::string ports_text(const Declared& declared);
std::string params_text(const std::vector<ParamInfo>& infos);

/// Meaning of a parameter, empty if none is known, and its unit.
std::string param_meaning(const std::string& key);
std::string param_unit(const std::string& key);

/// `line` of a ConfigError, with the place of the parameter that it is about in front: it begins
/// with "KEY: " or "OWNER.KEY: ", or with the file that a parameter names, or quotes its value.
std::string placed(const std::string& line, const std::string& owner,
                   const std::vector<ParamInfo>& defaults, const VisitParams& visit,
                   const ParamSource& source);

/// Meaning of parameters, "KEY\tTEXT\n" for each last part of a key: called before main() by a file
/// that cmake/param_help.py makes of the comments at the declarations.
bool explain(const char* lines);

/// Offers service NODE/params (proto/params.proto): shows the parameters, and changes those that
/// their `visit` declares as changeable, and the level of the log. As every service it is answered
/// between two steps, recorded with the next one and answered again in a replay, at the same place:
/// a replay follows the change. `bus` and `node` outlive it; call before the node is created.
void serve_params(Bus& bus, AnyNode& node);

}  // namespace mimesis::runtime
