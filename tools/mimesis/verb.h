#pragma once
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "common/runtime/value_text.h"

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace mimesis::tool {

struct KnownVerb {
  std::string_view name, about;
};

/// The verbs of this project, for the help of `mimesis` and of each verb.
inline constexpr std::array kKnownVerbs{
    KnownVerb{"launch", "Starts the nodes of a launch file and watches them"},
    KnownVerb{"host", "The launcher's hand on another host; called through ssh"},
    KnownVerb{"key", "Keys of this host, and of hosts that it trusts"},
    KnownVerb{"topic", "Shows topics and their messages"},
    KnownVerb{"node", "Shows the nodes of a graph"},
    KnownVerb{"param", "Shows and changes parameters of nodes that run"},
    KnownVerb{"service", "Shows services and calls them"},
    KnownVerb{"interface", "Shows types of messages with their fields, units and comments"},
    KnownVerb{"tf", "Shows frames of a graph or a log: their tree, poses, rates"},
    KnownVerb{"run", "Starts one node"},
    KnownVerb{"graph", "Shows the graphs that run"},
    KnownVerb{"log", "Records, plays, replays, checks, changes and shows message logs (MCAP)"},
    KnownVerb{"view", "Shows a running graph or a log on a page, and to Foxglove and Lichtblick"},
    KnownVerb{"top", "Shows the nodes of a graph with load and health, once a second"},
    KnownVerb{"doctor", "Looks at this computer: what keeps a graph from running well"},
    KnownVerb{"completion", "Prints the completion of bash, zsh or fish"},
    KnownVerb{"plan", "Plans a motion or a task of an arm, and proves written plans again"},
    KnownVerb{"robot", "Makes the files of a robot of your own"},
    KnownVerb{"crowd", "Shows the guarantees of theory for a crowd scenario"},
    KnownVerb{"cognition", "Says why the neural fields decided as they did"},
    KnownVerb{"calibrate", "Calibrates cameras from pictures of a chessboard"},
    KnownVerb{"camera", "Cameras of this computer: formats, sizes, rates, controls"},
    KnownVerb{"vision", "Teaches vision colours, checks its camera"},
    KnownVerb{"hw", "Drives on their buses: finds, watches, checks, moves, asks, breaks"},
    KnownVerb{"demix", "Learns motion primitives: sources, weights and delays"},
    KnownVerb{"motion", "Motion as files: joints of recordings, BVH and glTF, beside its model"},
    KnownVerb{"reproduce", "Recomputes a published figure and compares it with its reference"},
    KnownVerb{"walk-trials", "Walks of the biped in the physics world, many at once"}};

/// First word of a call that asks for completions: `mimesis __complete VERB WORD ...`.
inline constexpr std::string_view kComplete = "__complete";

/// Each adds one verb with its sub-verbs to the program. When the verb is chosen its callback
/// stores the exit code: 0 done, 1 failed, 2 usage or configuration, 3 not found or timed out, 130
/// interrupted. The verb's description is that of kKnownVerbs, if it is there. Every verb is a
/// program of its own, mimesis-VERB (mimesis_verb in cmake/).
void add_launch(CLI::App& program, int& exit_code);
void add_host(CLI::App& program, int& exit_code);
void add_key(CLI::App& program, int& exit_code);
void add_service(CLI::App& program, int& exit_code);
void add_param(CLI::App& program, int& exit_code);
void add_graph(CLI::App& program, int& exit_code);
void add_interface(CLI::App& program, int& exit_code);
void add_tf(CLI::App& program, int& exit_code);
void add_run(CLI::App& program, int& exit_code);
void add_top(CLI::App& program, int& exit_code);
void add_doctor(CLI::App& program, int& exit_code);
void add_completion(CLI::App& program, int& exit_code);
void add_topic(CLI::App& program, int& exit_code);
void add_pub(CLI::App& topic, int& exit_code);  ///< `topic pub`
void add_node(CLI::App& program, int& exit_code);
void add_log(CLI::App& program, int& exit_code);
void add_crowd(CLI::App& program, int& exit_code);
void add_cognition(CLI::App& program, int& exit_code);
void add_plan(CLI::App& program, int& exit_code);
void add_robot(CLI::App& program, int& exit_code);
void add_camera(CLI::App& program, int& exit_code);
void add_calibrate(CLI::App& program, int& exit_code);
void add_vision(CLI::App& program, int& exit_code);
void add_view(CLI::App& program, int& exit_code);
void add_hw(CLI::App& program, int& exit_code);
void add_demix(CLI::App& program, int& exit_code);
void add_motion(CLI::App& program, int& exit_code);
void add_reproduce(CLI::App& program, int& exit_code);
void add_walk_trials(CLI::App& program, int& exit_code);  ///< only where DART is found

/// The main function of mimesis-VERB: parses `mimesis VERB ARGUMENTS ...`, runs the verb, turns
/// exceptions into one line on standard error. Returns the exit code.
int run_verb(const std::string& verb, int argc, char** argv, void (*add)(CLI::App&, int&));

/// Words that may stand where the last of `words` stands (behind the verb; it may be empty or
/// begun): sub-verbs, options behind "-", and names of the running graph by the name of the
/// argument
/// ("topic", "node", "service", "graph", "key").
std::vector<std::string> completions(const CLI::App& verb, const std::vector<std::string>& words);

/// Gives live names; set by programs that know graphs (graph_tools.h). `what`: as above; `before`:
/// the arguments in front of it.
using LiveNames = std::vector<std::string> (*)(const std::string& what, const std::string& graph,
                                               const std::vector<std::string>& before);
extern LiveNames live_names;

/// Prints help (standard output) or the error of the command line, with a suggestion (standard
/// error). Returns the exit code: 0 for help, 2 for a mistake.
int report_usage(const CLI::App& program, const CLI::ParseError& error);

/// For CLI::Option::check: the error, or empty. CLI11's own PositiveNumber answers "abc" with the
/// 309 digits of the largest double.
inline std::string number_above_zero(const std::string& text) {
  const auto number = runtime::to_double(text);
  return number && *number > 0.0 ? "" : "expected a number above 0, found '" + text + "'";
}

inline std::string number_not_below_zero(const std::string& text) {
  const auto number = runtime::to_double(text);
  return number && *number >= 0.0 ? "" : "expected 0 or more, found '" + text + "'";
}

/// `text` as a YAML scalar: in quotes unless it is a plain name.
std::string yaml_word(const std::string& text);

}  // namespace mimesis::tool
