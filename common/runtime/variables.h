#pragma once
#include <map>
#include <string>

#include "common/runtime/yaml_document.h"

namespace mimesis::runtime {

/// What `${arg:NAME}`, `${env:NAME}` and `${run:NAME}` stand for in the values of one document.
/// `$${` is a literal `${`. No expressions, on purpose.
class Variables {
 public:
  /// @param document its section `args:` declares the arguments and their defaults; must outlive
  /// this.
  explicit Variables(const Yaml& document) : declared_(document.find("args")) {}

  /// Value of an argument from outside, "NAME=VALUE". @throws ConfigError if it is not declared.
  void set_arg(const std::string& assignment);
  /// A fact of the run: `${run:NAME}`; the default is the environment's MIMESIS_RUN_NAME.
  void set_run(const std::string& name, const std::string& value) { run_[name] = value; }

  /// Text of `scalar` with every variable replaced.
  /// @throws ConfigError with the position of the variable that has no value.
  std::string expand(const Yaml& scalar) const { return expand(scalar, 0); }
  /// Values given with set_arg.
  const std::map<std::string, std::string>& args() const { return args_; }

 private:
  std::string expand(const Yaml& scalar, int depth) const;
  std::string value(const std::string& variable, const Place& place, int depth) const;

  const Yaml* declared_;
  std::map<std::string, std::string> args_;
  std::map<std::string, std::string> run_;
};

/// Splits "NAME=VALUE". @throws ConfigError that starts with `option` if there is no '=' or no
/// name.
std::pair<std::string, std::string> split_assignment(const std::string& assignment,
                                                     const std::string& option);

}  // namespace mimesis::runtime
