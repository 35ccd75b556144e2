#pragma once
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace mimesis::runtime {

/// Where something was written; line and column count from 1. Line 0: not in a file ("--set").
struct Place {
  std::string file;
  int line = 0;
  int column = 0;

  bool operator==(const Place&) const = default;
};

/// "file:line:col", or the file alone if the line is 0.
std::string to_string(const Place& place);

/// One value of a YAML file with its position. Scalars stay text until they are read with an
/// expected type: so `no` can be a word, and `010` never becomes 8.
struct Yaml {
  enum class Kind { empty, scalar, sequence, map };
  struct Entry;

  Kind kind = Kind::empty;
  Place place;
  std::string text;            ///< text of a scalar
  bool quoted = false;         ///< scalar in quotes, or a block of text
  std::vector<Yaml> items;     ///< items of a sequence
  std::vector<Entry> entries;  ///< entries of a map, in the order of the file

  /// Value of `key` in a map; null if absent or if this is no map.
  const Yaml* find(std::string_view key) const;
  /// Keys of a map.
  std::vector<std::string> keys() const;
  /// "a list", "a map", "nothing", "'text'": for messages.
  std::string described() const;
};

struct Yaml::Entry {
  std::string key;
  Place place;  ///< position of the key
  Yaml value;
};

/// Reads a file with one YAML document. @throws ConfigError "file:line:col: ..." if it is absent,
/// not YAML, or has a duplicate key, a key that is no text, a merge key (<<) or a second document.
Yaml read_yaml(const std::string& file);

/// Reads a document from text; `name` stands for the file in positions.
Yaml parse_yaml(const std::string& text, const std::string& name);

/// Values of `${arg:NAME}`, `${env:NAME}`, `${host:NAME}` and `${run:NAME}` in the values of one
/// document. `$${` is a literal `${`. No expressions, on purpose.
class Variables {
 public:
  /// @param document its section `args:` declares the arguments and their defaults, `hosts:` the
  /// addresses; must outlive this.
  explicit Variables(const Yaml& document)
      : declared_(document.find("args")), hosts_(document.find("hosts")) {}

  /// Value of an argument from outside, "NAME=VALUE". @throws ConfigError if it is not declared.
  void set_arg(const std::string& assignment);
  /// Value of a name that a `for` of the document binds.
  void bind(const std::string& name, const std::string& value) { args_[name] = value; }
  /// A fact of the run: `${run:NAME}`; the default is the environment's MIMESIS_RUN_NAME.
  void set_run(const std::string& name, const std::string& value) { run_[name] = value; }

  /// Text of `scalar` with every variable replaced.
  /// @throws ConfigError with the position of the variable that has no value.
  std::string expand(const Yaml& scalar) const { return expand(scalar, 0); }
  bool declares(const std::string& arg) const {
    return declared_ != nullptr && declared_->find(arg) != nullptr;
  }
  /// Values given with set_arg and bind.
  const std::map<std::string, std::string>& args() const { return args_; }
  /// Default of a declared argument: the one in `implies:` of an argument that is true, else its
  /// own; null if there is none.
  const Yaml* default_of(const std::string& name) const { return default_of(name, 0); }

 private:
  std::string expand(const Yaml& scalar, int depth) const;
  std::string value(const std::string& variable, const Place& place, int depth) const;
  const Yaml* default_of(const std::string& name, int depth) const;
  std::string address(const std::string& host, const Place& place, int depth) const;

  const Yaml* declared_;
  const Yaml* hosts_;
  std::map<std::string, std::string> args_;
  std::map<std::string, std::string> run_;
};

/// Splits "NAME=VALUE". @throws ConfigError that starts with `option` if there is no '=' or no
/// name.
std::pair<std::string, std::string> split_assignment(const std::string& assignment,
                                                     const std::string& option);

}  // namespace mimesis::runtime
