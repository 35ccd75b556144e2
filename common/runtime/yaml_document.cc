#include "common/runtime/yaml_document.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/error.h"
#include "common/runtime/value_text.h"

namespace mimesis::runtime {
namespace {

// Aliases can repeat each other: a small file must not become a tree that fills the memory.
constexpr int kMaxNodes = 200'000;
constexpr int kMaxNesting = 100;

class Converter {
 public:
  Converter(const std::string& text, const std::string& file) : text_(text), file_(file) {}

  Yaml convert(const YAML::Node& from, int depth) {
    Yaml to;
    to.place = place(from.Mark());
    if (++nodes_ > kMaxNodes || depth > kMaxNesting) {
      throw ConfigError(to_string(to.place) + ": nested too deeply, or an alias contains itself");
    }
    switch (from.Type()) {
      case YAML::NodeType::Scalar:
        to.kind = Yaml::Kind::scalar;
        to.text = text(from, to.place);
        to.quoted = from.Tag() == "!";
        if (to.quoted) demand_closed(static_cast<std::size_t>(from.Mark().pos), to.place);
        break;
      case YAML::NodeType::Sequence:
        to.kind = Yaml::Kind::sequence;
        for (const YAML::Node& item : from) to.items.push_back(convert(item, depth + 1));
        break;
      case YAML::NodeType::Map:
        to.kind = Yaml::Kind::map;
        for (const auto& pair : from) add_entry(to, pair.first, pair.second, depth);
        break;
      case YAML::NodeType::Null:
      case YAML::NodeType::Undefined:
        break;
    }
    return to;
  }

  Place place(const YAML::Mark& mark) const {
    return mark.is_null() ? Place{file_, 1, 1} : Place{file_, mark.line + 1, mark.column + 1};
  }

 private:
  /// Names from files reach terminals, logs and other files.
  static const std::string& text(const YAML::Node& scalar, const Place& at) {
    const std::string& all = scalar.Scalar();
    if (printable(all, "\t\r\n") != all) {
      throw ConfigError(to_string(at) + ": '" + printable(all) +
                        "' has control characters or is no UTF-8");
    }
    return all;
  }
  void add_entry(Yaml& map, const YAML::Node& key, const YAML::Node& value, int depth) {
    const Place at = place(key.Mark());
    if (!key.IsScalar()) throw ConfigError(to_string(at) + ": a key must be text");
    if (text(key, at) == "<<") {
      throw ConfigError(to_string(at) + ": merge keys (<<) are not supported");
    }
    if (const Yaml* first = map.find(key.Scalar())) {
      throw ConfigError(to_string(at) + ": key '" + key.Scalar() +
                        "' appears twice (first on line " + std::to_string(first->place.line) +
                        ")");
    }
    Yaml converted = convert(value, depth + 1);
    if (converted.kind == Yaml::Kind::empty) converted.place = at;
    map.entries.push_back({key.Scalar(), at, std::move(converted)});
  }

  /// yaml-cpp 0.7 takes the end of the file for the closing quote.
  void demand_closed(std::size_t at, const Place& begin) const {
    if (at >= text_.size()) return;
    const char quote = text_[at];
    if (quote != '"' && quote != '\'') return;  // a block of text
    for (++at; at < text_.size(); ++at) {
      const bool doubled = quote == '\'' && text_.compare(at, 2, "''") == 0;
      if (doubled || (quote == '"' && text_[at] == '\\')) {
        ++at;
      } else if (text_[at] == quote) {
        return;
      }
    }
    throw ConfigError(to_string(begin) + ": this quote is never closed");
  }

  const std::string& text_;
  const std::string& file_;
  int nodes_ = 0;
};

/// Walks through a text before it becomes a tree: yaml-cpp 0.7 makes documents without end of some
/// texts, of a comma outside of brackets for instance, and keeps them all.
class OneDocument : public YAML::EventHandler {
 public:
  OneDocument(const std::string& text, const Converter& places) : text_(text), places_(places) {}

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ == 1) return;
    // Marks count decoded characters: bytes that are no UTF-8 make more of them.
    const std::size_t at = std::min(static_cast<std::size_t>(std::max(mark.pos, 0)), text_.size());
    throw ConfigError(to_string(places_.place(mark)) +
                      (text_.compare(at, 1, ",") == 0 ? ": a comma outside of brackets"
                                                      : ": a second document (---) is not read"));
  }
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override { count(mark); }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override { count(mark); }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                const std::string&) override {
    count(mark);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    count(mark);
  }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    count(mark);
  }
  void OnDocumentEnd() override {}
  void OnSequenceEnd() override {}
  void OnMapEnd() override {}

 private:
  void count(const YAML::Mark& mark) {
    if (++nodes_ > kMaxNodes) {
      throw ConfigError(to_string(places_.place(mark)) + ": more than " +
                        std::to_string(kMaxNodes) + " values");
    }
  }
  const std::string& text_;
  const Converter& places_;
  int documents_ = 0, nodes_ = 0;
};

/// The lines of a text that the parser refused, and what in them is the likely reason: where the
/// parser gives up is often far behind it.
class Advice {
 public:
  Advice(const std::string& text, const std::string& file, const Place& refused,
         const std::string& reason)
      : file_(file), refused_(refused), reason_(reason) {
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines_.push_back(line);
  }

  /// "file:line:col: what, expected what"
  std::string text() {
    if (!tab() && !bracket() && !space()) say(refused_.line, refused_.column, general());
    return found_;
  }

 private:
  void say(int line, int column, const std::string& what) {
    found_ = to_string({file_, line, column}) + ": " + what;
  }
  bool tab() {
    for (int i = 0; i < std::min<int>(refused_.line, static_cast<int>(lines_.size())); ++i) {
      const std::string& line = lines_[static_cast<std::size_t>(i)];
      const std::size_t begin = std::min(line.find_first_not_of(" \t"), line.size());
      if (begin == line.size() || line.find('\t') >= begin) continue;
      say(i + 1, static_cast<int>(line.find('\t')) + 1,
          "a tab in the indentation, expected spaces: put two for each level in its place");
      return true;
    }
    return false;
  }
  /// The first bracket without its other half.
  bool bracket() {
    struct Open {
      char what;
      int line, column;
    };
    std::vector<Open> open;
    char quote = 0;
    Open quoted{};
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      char before = ':';  // last character that is no space: brackets open at the begin of a value
      for (std::size_t k = 0; k < lines_[i].size(); ++k) {
        const char c = lines_[i][k];
        const int line = static_cast<int>(i) + 1, column = static_cast<int>(k) + 1;
        const bool begins = std::string_view(":,[{-").find(before) != std::string_view::npos;
        if (quote != 0) {
          before = c;
          if (c == '\\' && quote == '"') ++k;
          if (c != quote) continue;
          quote = 0;
          if (quoted.line == line || line != refused_.line) continue;
          say(quoted.line, quoted.column,
              "this quote is not closed on its line, expected it to be");
          return true;
        }
        if ((c == '"' || c == '\'') && begins) {
          quote = c;
          quoted = {c, line, column};
        } else if (c == '#' && (k == 0 || lines_[i][k - 1] == ' ')) {
          break;
        } else if (lines_[i].compare(k, 2, "${") == 0) {
          if (!open.empty()) {
            say(line, column, "a variable within brackets, expected it in quotes: \"${...}\"");
            return true;
          }
          k = std::min(lines_[i].find('}', k), lines_[i].size());
        } else if ((c == '{' || c == '[') && begins) {
          open.push_back({c, line, column});
        } else if ((c == '}' || c == ']') && open.empty() && k + 1 == lines_[i].size()) {
          say(line, column, std::string("a ") + c + " too much: nothing is open here");
          return true;
        } else if ((c == '}' || c == ']') && !open.empty()) {
          if ((c == '}') != (open.back().what == '{')) {
            say(line, column,
                std::string("found ") + c + ", expected the other half of the " + open.back().what +
                    " on line " + std::to_string(open.back().line));
            return true;
          }
          open.pop_back();
        }
        if (c != ' ') before = c;
      }
    }
    if (open.empty()) return false;
    say(open.back().line, open.back().column,
        std::string("this ") + open.back().what + " is never closed, expected a " +
            (open.back().what == '{' ? '}' : ']'));
    return true;
  }
  /// "exec:mimesis_camera" above the line that was refused.
  bool space() {
    for (int i = refused_.line; i > std::max(0, refused_.line - 2); --i) {
      if (i > static_cast<int>(lines_.size())) continue;
      const std::string& line = lines_[static_cast<std::size_t>(i - 1)];
      const std::size_t begin = std::min(line.find_first_not_of(" -"), line.size());
      const std::size_t colon = line.find(':', begin);
      if (colon == std::string::npos || colon + 1 >= line.size() || line[colon + 1] == ' ')
        continue;
      if (line.find_first_not_of("abcdefghijklmnopqrstuvwxyz_0123456789", begin) != colon) continue;
      say(i, static_cast<int>(colon) + 1,
          "no space behind the colon, expected '" + line.substr(begin, colon - begin) + ": " +
              line.substr(colon + 1) + "'");
      return true;
    }
    return false;
  }
  std::string general() const {
    if (reason_.find("flow not found") != std::string::npos)
      return "a comma is missing before this, or quotes around a text with ':', expected , or a "
             "closing bracket";
    if (reason_.find("illegal map value") != std::string::npos)
      return "a second value on this line, or a line deeper than the one above, expected quotes "
             "around a text with ':', or the column of the keys around";
    if (reason_.find("end of map") != std::string::npos ||
        reason_.find("end of sequence") != std::string::npos)
      return "this line begins in a column of its own, expected that of a line above";
    if (reason_.find("anchor") != std::string::npos)
      return "no value above has this name, expected an alias (*NAME) of an anchor (&NAME)";
    return reason_;
  }

  const std::string& file_;
  const Place& refused_;
  const std::string& reason_;
  std::vector<std::string> lines_;
  std::string found_;
};

constexpr int kMaxDepth = 16;  // defaults may name other arguments, but not in a circle

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

std::string from_environment(const std::string& name, const std::string& variable,
                             const Place& place) {
  const char* found = std::getenv(name.c_str());
  if (found == nullptr) {
    throw ConfigError(to_string(place) + ": ${" + variable + "}: the environment has no " + name);
  }
  return found;
}

}  // namespace

std::string to_string(const Place& place) {
  if (place.line == 0) return place.file;
  return place.file + ":" + std::to_string(place.line) + ":" + std::to_string(place.column);
}

const Yaml* Yaml::find(std::string_view key) const {
  for (const Entry& entry : entries) {
    if (entry.key == key) return &entry.value;
  }
  return nullptr;
}

std::vector<std::string> Yaml::keys() const {
  std::vector<std::string> all;
  for (const Entry& entry : entries) all.push_back(entry.key);
  return all;
}

std::string Yaml::described() const {
  switch (kind) {
    case Kind::empty:
      return "nothing";
    case Kind::scalar: {
      std::size_t end = std::min<std::size_t>(text.size(), 60);  // not within a character of UTF-8
      while (end < text.size() && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
      return "'" + text.substr(0, end) + (end < text.size() ? "...'" : "'");
    }
    case Kind::sequence:
      return "a list";
    case Kind::map:
      return "a map";
  }
  return {};
}

Yaml parse_yaml(const std::string& text, const std::string& name) {
  const std::size_t first = text.find_first_not_of("\xEF\xBB\xBF \t\r\n");
  if (first != std::string::npos && text[first] == '<') {
    const char* way = "; `mimesis robot new` makes it from an arm's URDF, `robot check` a biped's";
    const bool is_urdf = text.find("<robot") != std::string::npos;
    throw ConfigError(name + ": is XML, expected YAML" + (is_urdf ? way : ""));
  }
  if (text.find('\0') != std::string::npos)
    throw ConfigError(name + ": is a binary file, expected YAML");
  Converter converter(text, name);
  try {
    std::istringstream in(text);
    YAML::Parser parser(in);
    OneDocument one(text, converter);
    while (parser.HandleNextDocument(one)) {
    }
    return converter.convert(YAML::Load(text), 0);
  } catch (const YAML::Exception& e) {
    throw ConfigError(Advice(text, name, converter.place(e.mark), e.msg).text());
  }
}

Yaml read_yaml(const std::string& file) {
  // ifstream opens folders happily and fails only on reading.
  if (std::error_code ignored; std::filesystem::is_directory(file, ignored)) {
    throw ConfigError(file + ": is a folder");
  }
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  if (in) text << in.rdbuf();
  if (!in || in.bad()) throw ConfigError(file + ": " + std::strerror(errno != 0 ? errno : EIO));
  const std::string bytes = text.str();
  return parse_yaml(bytes.starts_with("\xEF\xBB\xBF") ? bytes.substr(3) : bytes, file);
}

std::pair<std::string, std::string> split_assignment(const std::string& assignment,
                                                     const std::string& option) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw ConfigError(option + ": '" + assignment + "' is not NAME=VALUE");
  }
  return {assignment.substr(0, equals), assignment.substr(equals + 1)};
}

void Variables::set_arg(const std::string& assignment) {
  auto [name, value] = split_assignment(assignment, "--arg");
  if (declared_ == nullptr || declared_->find(name) == nullptr) {
    const auto known = declared_ != nullptr ? declared_->keys() : std::vector<std::string>{};
    throw ConfigError("--arg: the file declares no argument '" + name + "'" +
                      did_you_mean(name, known));
  }
  args_[name] = std::move(value);
}

std::string Variables::expand(const Yaml& scalar, int depth) const {
  const std::string& text = scalar.text;
  std::string out;
  std::size_t at = 0;
  while (true) {
    const std::size_t begin = text.find("${", at);
    out.append(text, at, begin == std::string::npos ? std::string::npos : begin - at);
    if (begin == std::string::npos) return out;
    if (begin > at && text[begin - 1] == '$') {  // "$${": one of the two is already in `out`
      out += '{';
      at = begin + 2;
      continue;
    }
    Place place = scalar.place;
    if (place.line > 0) place.column += static_cast<int>(begin) + (scalar.quoted ? 1 : 0);
    const std::size_t end = text.find('}', begin);
    if (end == std::string::npos) throw ConfigError(to_string(place) + ": ${ without }");
    if (depth > kMaxDepth)
      throw ConfigError(to_string(place) + ": an argument's default names itself");
    out += value(text.substr(begin + 2, end - begin - 2), place, depth);
    at = end + 1;
  }
}

std::string Variables::value(const std::string& variable, const Place& place, int depth) const {
  const std::size_t colon = variable.find(':');
  const std::string kind = variable.substr(0, colon);
  const std::string name = colon == std::string::npos ? "" : variable.substr(colon + 1);
  if (kind == "env" && !name.empty()) return from_environment(name, variable, place);
  if (kind == "run" && !name.empty()) {
    const auto it = run_.find(name);
    return it != run_.end() ? it->second
                            : from_environment("MIMESIS_RUN_" + upper(name), variable, place);
  }
  if (kind == "host" && !name.empty()) return address(name, place, depth);
  if (kind != "arg" || name.empty()) {
    throw ConfigError(to_string(place) + ": ${" + variable +
                      "}: expected ${arg:NAME}, ${env:NAME}, ${host:NAME} or ${run:NAME}");
  }
  if (const auto it = args_.find(name); it != args_.end()) return it->second;
  const Yaml* declaration = declared_ != nullptr ? declared_->find(name) : nullptr;
  if (declaration == nullptr) {
    const auto known = declared_ != nullptr ? declared_->keys() : std::vector<std::string>{};
    throw ConfigError(to_string(place) + ": no argument '" + name + "' is declared" +
                      did_you_mean(name, known));
  }
  const Yaml* fallback = default_of(name, depth);
  if (fallback == nullptr || fallback->kind != Yaml::Kind::scalar) {
    throw ConfigError(to_string(place) + ": argument '" + name + "' has no default: give --arg " +
                      name + "=VALUE");
  }
  return expand(*fallback, depth + 1);
}

const Yaml* Variables::default_of(const std::string& name, int depth) const {
  for (const Yaml::Entry& flag : declared_->entries) {
    const Yaml* implies = flag.value.find("implies");
    const Yaml* implied = implies != nullptr ? implies->find(name) : nullptr;
    if (implied == nullptr || flag.key == name) continue;
    Yaml reference;
    reference.text = "${arg:" + flag.key + "}";
    reference.place = flag.place;
    if (to_bool(expand(reference, depth + 1)) == true) return implied;
  }
  const Yaml* declaration = declared_->find(name);
  return declaration != nullptr ? declaration->find("default") : nullptr;
}

std::string Variables::address(const std::string& host, const Place& place, int depth) const {
  const Yaml* map = hosts_ != nullptr ? hosts_->find(host) : nullptr;
  const Yaml* address = map != nullptr ? map->find("address") : nullptr;
  if (address == nullptr) {
    const auto known = hosts_ != nullptr ? hosts_->keys() : std::vector<std::string>{};
    throw ConfigError(to_string(place) + ": there is no host '" + host + "'" +
                      did_you_mean(host, known));
  }
  const Yaml* condition = map->find("if");
  if (condition != nullptr && to_condition(expand(*condition, depth + 1)) == false)
    return "127.0.0.1";  // its nodes run on the machine that launches
  return expand(*address, depth + 1);
}

}  // namespace mimesis::runtime
