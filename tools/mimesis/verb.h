#pragma once
#include <string>
#include <vector>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace mimesis::tool {

/// Each adds one verb with its sub-verbs to the program. When the verb is chosen its callback
/// stores the exit code: 0 done, 1 failed, 2 usage or configuration, 3 not found or timed out, 130
/// interrupted. The verb's description is that of known_verbs.h, if it is there. Every verb is a
/// program of its own, mimesis-VERB (mimesis_verb in cmake/).
void add_launch(CLI::App& program, int& exit_code);
void add_host(CLI::App& program, int& exit_code);
void add_key(CLI::App& program, int& exit_code);
void add_service(CLI::App& program, int& exit_code);
void add_param(CLI::App& program, int& exit_code);
void add_graph(CLI::App& program, int& exit_code);
void add_top(CLI::App& program, int& exit_code);
void add_doctor(CLI::App& program, int& exit_code);
void add_completion(CLI::App& program, int& exit_code);
void add_topic(CLI::App& program, int& exit_code);
void add_node(CLI::App& program, int& exit_code);
void add_log(CLI::App& program, int& exit_code);
void add_crowd(CLI::App& program, int& exit_code);
void add_cognition(CLI::App& program, int& exit_code);
void add_plan(CLI::App& program, int& exit_code);
void add_calibrate(CLI::App& program, int& exit_code);
void add_vision(CLI::App& program, int& exit_code);
void add_view(CLI::App& program, int& exit_code);
void add_hw(CLI::App& program, int& exit_code);
void add_demix(CLI::App& program, int& exit_code);
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

}  // namespace mimesis::tool
