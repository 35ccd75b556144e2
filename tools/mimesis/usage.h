#pragma once

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace mimesis::tool {

/// Prints help (standard output) or what is wrong with the command line, with a suggestion
/// (standard error). Returns the exit code: 0 for help, 2 for a mistake.
int report_usage(const CLI::App& program, const CLI::ParseError& error);

}  // namespace mimesis::tool
