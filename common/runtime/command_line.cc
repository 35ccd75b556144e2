#include "common/runtime/command_line.h"

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <iostream>
#include <map>

#include "common/error.h"
#include "common/runtime/param_source.h"
#include "common/runtime/suggest.h"

namespace mimesis::runtime {
namespace {

/// PORT=TOPIC.
void wire(const std::vector<std::string>& pairs, const char* option,
          std::map<std::string, std::string, std::less<>>& wiring) {
  for (const std::string& pair : pairs) {
    const std::size_t equals = pair.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == pair.size()) {
      throw ConfigError(std::string(option) + " '" + pair + "': expected PORT=TOPIC");
    }
    if (!wiring.emplace(pair.substr(0, equals), pair.substr(equals + 1)).second) {
      throw ConfigError(std::string(option) + " " + pair.substr(0, equals) + " is given twice");
    }
  }
}

int report(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) return app.exit(error);
  std::string line = error.what();
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr && !app.remaining().empty()) {
    const std::string word = app.remaining().front();
    std::vector<std::string> known;
    for (const CLI::Option* option : app.get_options()) {
      for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
    }
    line = word.starts_with('-') ? "unknown option '" + word + "'" +
                                       did_you_mean(word.substr(0, word.find('=')), known)
                                 : "unexpected argument '" + word + "'";
  }
  std::cerr << app.get_name() << ": " << line << "; see --help\n";
  return 2;
}

}  // namespace

std::optional<int> parse_command_line(int argc, char** argv, const NodeAbout& about,
                                      const std::function<void(ParamVisitor&)>& visit,
                                      NodeOptions& options) {
  const std::string program = "mimesis_" + std::string(about.name);
  CLI::App app(std::string(about.about), program);
  options.bus.name = about.name;
  std::vector<std::string> in, out;
  const std::map<std::string, ClockKind> clocks{
      {"wall", ClockKind::wall}, {"sim", ClockKind::sim}, {"lockstep", ClockKind::lockstep}};
  std::string clock = "wall";
  const auto repeated = [&app](const char* name, std::vector<std::string>& values, const char* help,
                               const char* metavar) {
    app.add_option(name, values, help)->type_name(metavar)->allow_extra_args(false);
  };
  app.add_option("--name", options.bus.name, "Name of the node in its graph")
      ->capture_default_str();
  app.add_option("--graph", options.bus.graph,
                 "Graph to join (default: $MIMESIS_GRAPH, or 'default')");
  app.add_option("--clock", clock, "wall, sim (topic clock/time) or lockstep (node clock conducts)")
      ->capture_default_str();
  app.add_option("--params", options.params, "Parameters: a YAML file, or a section of one")
      ->type_name("FILE[#PATH]");
  repeated("--set", options.sets, "Sets one parameter; wins over the file", "KEY=VALUE");
  repeated("--arg", options.args, "Replaces the default of an argument that the file declares",
           "NAME=VALUE");
  repeated("--in", in, "Wires an input to a topic; unwired inputs receive nothing", "PORT=TOPIC");
  repeated("--out", out, "Wires an output to a topic (default: NAME/PORT)", "PORT=TOPIC");
  app.add_option(
         "--bind", options.bus.bind,
         "Reachable from other hosts: services on PORT, data on PORT+1, reliable data on PORT+2")
      ->type_name("tcp://ADDRESS:PORT");
  repeated("--peer", options.bus.peers, "A node on another host: its --bind address",
           "tcp://HOST:PORT");
  app.add_flag("--check", options.check, "Reads the parameters and stops: exit code 0 or 2");
  app.add_option("--replay", options.replay_fd,
                 "Runs recorded steps that `mimesis log replay` sends over this socket")
      ->type_name("FD");
  app.footer([&] {
    return "Parameters (key, default, range):\n" + describe_params(visit) + "\nExamples:\n  " +
           program + " --params launch/imitation.yaml#nodes." + std::string(about.name) +
           ".params\n  " + program +
           " --name other --graph trial --set rate_hz=50 --in PORT=node/topic\n";
  });
  try {
    app.parse(argc, argv);
    const auto chosen = clocks.find(clock);
    if (chosen == clocks.end()) {
      throw ConfigError("--clock '" + clock + "': expected wall, sim or lockstep" +
                        did_you_mean(clock, {"wall", "sim", "lockstep"}));
    }
    options.bus.clock = chosen->second;
    wire(in, "--in", options.bus.in);
    wire(out, "--out", options.bus.out);
  } catch (const CLI::ParseError& e) {
    return report(app, e);
  } catch (const ConfigError& e) {
    std::cerr << program << ": " << e.what() << '\n';
    return 2;
  }
  return std::nullopt;
}

}  // namespace mimesis::runtime
