#include "common/cdr/definition.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "common/error.h"

namespace mimesis::cdr {
namespace {

constexpr std::uint32_t kMostElements = 1U << 28;

std::string_view trimmed(std::string_view s) {
  const auto first = s.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return s.substr(first, s.find_last_not_of(" \t\r") - first + 1);
}

std::uint32_t number(std::string_view text, int line) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value == 0 ||
      value > kMostElements) {
    throw ConfigError(fmt::format("line {}: '{}': expected a number of elements", line, text));
  }
  return value;
}

bool is_name(std::string_view s) {
  return !s.empty() && !std::isdigit(static_cast<unsigned char>(s[0])) &&
         std::ranges::all_of(s, [](char c) {
           return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
         });
}

void add(std::vector<Member>& members, Member member, int line) {
  if (std::ranges::find(members, member.name, &Member::name) != members.end()) {
    throw ConfigError(fmt::format("line {}: field '{}' is there twice", line, member.name));
  }
  members.push_back(std::move(member));
}

// --- ros2msg

std::optional<Kind> msg_kind(std::string_view type) {
  static const std::map<std::string_view, Kind> kKinds = {
      {"bool", Kind::boolean},    {"byte", Kind::uint8},    {"char", Kind::uint8},
      {"uint8", Kind::uint8},     {"int8", Kind::int8},     {"int16", Kind::int16},
      {"uint16", Kind::uint16},   {"int32", Kind::int32},   {"uint32", Kind::uint32},
      {"int64", Kind::int64},     {"uint64", Kind::uint64}, {"float32", Kind::float32},
      {"float64", Kind::float64}, {"string", Kind::string}, {"wstring", Kind::wstring}};
  const auto found = kKinds.find(type);
  return found == kKinds.end() ? std::nullopt : std::optional(found->second);
}

/// "float64[36]", "string<=5[<=3]", "geometry_msgs/Pose[]"; a name without package is of `package`.
Member msg_member(std::string_view type, std::string_view name, const std::string& package,
                  int line) {
  Member m{.name = std::string(name)};
  std::string_view base = type;
  if (const auto bracket = type.find('['); bracket != std::string_view::npos) {
    base = type.substr(0, bracket);
    std::string_view size = type.substr(bracket + 1);
    if (!size.ends_with(']'))
      throw ConfigError(fmt::format("line {}: '{}': expected ]", line, type));
    size.remove_suffix(1);
    m.sequence = size.empty() || size.starts_with("<=");
    if (size.starts_with("<=")) size.remove_prefix(2);
    if (!size.empty()) m.count = number(size, line);
  }
  if (const auto bound = base.find("<="); bound != std::string_view::npos) {
    (void)number(base.substr(bound + 2), line);
    base = base.substr(0, bound);
  }
  if (!is_name(name)) {
    throw ConfigError(
        fmt::format("line {}: '{} {}': expected the name of a field", line, type, name));
  }
  if (const auto kind = msg_kind(base)) {
    m.kind = *kind;
    return m;
  }
  m.type = base == "time" || base == "duration"
               ? fmt::format("builtin_interfaces/{}", base == "time" ? "Time" : "Duration")
           : base == "Header"                         ? "std_msgs/Header"
           : base.find('/') == std::string_view::npos ? fmt::format("{}/{}", package, base)
                                                      : short_name(base);
  if (!is_name(m.type.substr(m.type.find('/') + 1))) {
    throw ConfigError(fmt::format("line {}: '{}': expected a type", line, type));
  }
  return m;
}

}  // namespace

std::string short_name(std::string_view name) {
  const auto first = name.find('/'), last = name.rfind('/');
  if (first == std::string_view::npos) return std::string(name);
  return fmt::format("{}{}", name.substr(0, first), name.substr(last));
}

Definitions parse_msg(const std::string& name, std::string_view text) {
  Definitions found;
  const std::string event = "_Event",
                    stem = name.substr(0, name.size() - std::min(name.size(), event.size()));
  std::string current = name;
  bool service = false;
  found[current];
  int line = 0;
  while (!text.empty()) {
    const auto end = std::min(text.find('\n'), text.size());
    std::string_view s = trimmed(text.substr(0, end));
    text.remove_prefix(std::min(text.size(), end + 1));
    ++line;
    if (s.starts_with("====") || s.starts_with("SRV:")) continue;  // the service is the first part
    if (s.starts_with("MSG:")) {
      current = short_name(trimmed(s.substr(4)));
      found[current].clear();
      continue;
    }
    if (s == "---" && current == name && name.ends_with(event)) {
      service = true;
      found[stem + "_Request"] = std::move(found[name]);
      found.erase(name);
      current = stem + "_Response";
      found[current];
      continue;
    }
    s = trimmed(s.substr(0, s.find('#')));  // a default value with '#' is left out all the same
    if (s.empty()) continue;
    const auto gap = s.find_first_of(" \t");
    if (gap == std::string_view::npos) {
      throw ConfigError(fmt::format("line {}: '{}': expected a type and a name", line, s));
    }
    const std::string_view type = s.substr(0, gap), rest = trimmed(s.substr(gap));
    const std::string_view field = rest.substr(0, rest.find_first_of(" \t="));
    const std::string_view behind = trimmed(rest.substr(field.size()));
    if (behind.starts_with('=')) continue;  // a constant
    add(found[current], msg_member(type, field, current.substr(0, current.find('/')), line), line);
  }
  if (service) {
    found[name] = {{.name = "info", .type = "service_msgs/ServiceEventInfo"},
                   {.name = "request", .type = stem + "_Request", .sequence = true, .count = 1},
                   {.name = "response", .type = stem + "_Response", .sequence = true, .count = 1}};
  }
  return found;
}

namespace {

// --- ros2idl

/// Words, and signs one by one; without comments, annotations and directives.
class IdlWords {
 public:
  explicit IdlWords(std::string_view text) : text_(text) { next(); }

  const std::string& word() const { return word_; }  ///< empty: the end
  int line() const { return line_; }
  bool is(std::string_view w) const { return word_ == w; }
  std::string take() {
    std::string taken = word_;
    next();
    return taken;
  }
  void expect(std::string_view w) {
    if (!is(w)) fail(fmt::format("'{}'", w));
    next();
  }
  [[noreturn]] void fail(const std::string& expected) const {
    throw ConfigError(fmt::format("line {}: {}: expected {}", line_,
                                  word_.empty() ? "the end" : "'" + word_ + "'", expected));
  }

 private:
  char at(std::size_t ahead = 0) const {
    return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\0';
  }
  void skip_to_end_of_line() {
    while (at_ < text_.size() && text_[at_] != '\n') ++at_;
  }
  void skip_string() {
    for (++at_; at_ < text_.size() && text_[at_] != '"'; ++at_) {
      if (text_[at_] == '\\') ++at_;
      if (at() == '\n') ++line_;
    }
    ++at_;
  }
  /// @name and (…), which may hold strings with brackets.
  void skip_annotation() {
    for (++at_; std::isalnum(static_cast<unsigned char>(at())) != 0 || at() == '_' || at() == ':';)
      ++at_;
    std::size_t ahead = 0;
    while (at(ahead) == ' ') ++ahead;
    if (at(ahead) != '(') return;
    at_ += ahead;
    int depth = 0;
    do {
      const char c = at();
      if (c == '"') {
        skip_string();
        continue;
      }
      if (c == '\n') ++line_;
      depth += c == '(' ? 1 : c == ')' ? -1 : 0;
      ++at_;
    } while (depth > 0 && at_ < text_.size());
  }
  void next() {
    word_.clear();
    while (at_ < text_.size()) {
      const char c = at();
      if (c == '\n') ++line_;
      if (std::isspace(static_cast<unsigned char>(c)) != 0) {
        ++at_;
      } else if (c == '@') {
        skip_annotation();
      } else if (c == '#' || (c == '/' && at(1) == '/') || text_.substr(at_).starts_with("====") ||
                 text_.substr(at_).starts_with("IDL:")) {
        skip_to_end_of_line();
      } else if (c == '/' && at(1) == '*') {
        while (at_ < text_.size() && !(at() == '*' && at(1) == '/')) line_ += text_[at_++] == '\n';
        at_ += 2;
      } else if (c == '"') {
        skip_string();
        word_ = "\"\"";
        return;
      } else {
        break;
      }
    }
    const auto part = [](char c) {
      return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
    };
    while (at_ < text_.size() && (part(at()) || (at() == ':' && at(1) == ':'))) {
      const std::size_t n = part(at()) ? 1 : 2;
      word_ += text_.substr(at_, n);
      at_ += n;
    }
    if (word_.empty() && at_ < text_.size()) word_ = text_[at_++];
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int line_ = 1;
  std::string word_;
};

class IdlParser {
 public:
  explicit IdlParser(std::string_view text) : words_(text) {}

  Definitions run() {
    while (!words_.word().empty()) definition();
    return std::move(found_);
  }

 private:
  static constexpr int kDeepest = 16;

  std::string package() const { return modules_.empty() ? "" : modules_.front(); }
  void definition() {
    if (words_.is("module")) return module();
    if (words_.is("struct")) return structure();
    if (words_.is("typedef")) return type_name();
    if (words_.is("enum")) return enumeration();
    if (!words_.is("const")) words_.fail("module, struct, typedef, enum or const");
    while (!words_.word().empty() && !words_.is(";")) words_.take();
    words_.expect(";");
  }
  void module() {
    words_.take();
    modules_.push_back(words_.take());
    if (modules_.size() > kDeepest) words_.fail("fewer modules in each other");
    words_.expect("{");
    while (!words_.is("}")) {
      if (words_.word().empty()) words_.fail("'}'");
      definition();
    }
    words_.take();
    if (words_.is(";")) words_.take();
    modules_.pop_back();
  }
  void structure() {
    words_.take();
    const std::string name = package() + "/" + words_.take();
    std::vector<Member>& members = found_[name];
    members.clear();
    words_.expect("{");
    while (!words_.is("}")) {
      if (words_.word().empty()) words_.fail("'}'");
      const int line = words_.line();
      for (Member& m : declared()) {
        // rosidl gives an empty structure a member that no message has
        if (m.name != "structure_needs_at_least_one_member") add(members, std::move(m), line);
      }
    }
    words_.take();
    words_.expect(";");
  }
  void enumeration() {
    words_.take();
    aliases_[words_.take()] = {.name = "", .kind = Kind::uint32};
    while (!words_.word().empty() && !words_.is(";")) words_.take();
    words_.expect(";");
  }
  void type_name() {
    words_.take();
    for (Member& m : declared()) aliases_[m.name] = m;
  }
  /// TYPE NAME[N], NAME ... ;
  std::vector<Member> declared() {
    const Member type = this->type();
    std::vector<Member> all;
    do {
      Member m = type;
      m.name = words_.take();
      if (!is_name(m.name)) words_.fail("the name of a field");
      if (words_.is("[")) {
        words_.take();
        if (m.list()) words_.fail("no array of lists");
        m.count = number(words_.take(), words_.line());
        words_.expect("]");
      }
      all.push_back(m);
    } while (words_.is(",") && !words_.take().empty());
    words_.expect(";");
    return all;
  }
  Member type() {
    static const std::map<std::string, Kind> kKinds = {
        {"boolean", Kind::boolean}, {"octet", Kind::uint8},    {"char", Kind::uint8},
        {"uint8", Kind::uint8},     {"int8", Kind::int8},      {"short", Kind::int16},
        {"int16", Kind::int16},     {"uint16", Kind::uint16},  {"int32", Kind::int32},
        {"uint32", Kind::uint32},   {"int64", Kind::int64},    {"uint64", Kind::uint64},
        {"float", Kind::float32},   {"double", Kind::float64}, {"string", Kind::string},
        {"wstring", Kind::wstring}};
    std::string word = words_.take();
    if (word == "sequence") {
      words_.expect("<");
      Member m = type();
      if (m.list()) words_.fail("no sequence of lists");
      m.sequence = true;
      if (words_.is(",")) {
        words_.take();
        m.count = number(words_.take(), words_.line());
      }
      words_.expect(">");
      return m;
    }
    const bool positive = word == "unsigned";
    if (positive) word = words_.take();
    if (positive && word == "short") return {.name = "", .kind = Kind::uint16};
    if (word == "long") {
      const bool twice = words_.is("long");
      if (twice) words_.take();
      if (!twice && words_.is("double")) words_.fail("no long double, which ROS does not have");
      return {.name = "",
              .kind = twice ? (positive ? Kind::uint64 : Kind::int64)
                            : (positive ? Kind::uint32 : Kind::int32)};
    }
    if (const auto kind = kKinds.find(word); kind != kKinds.end()) {
      if (words_.is("<")) {
        words_.take();
        (void)number(words_.take(), words_.line());
        words_.expect(">");
      }
      return {.name = "", .kind = kind->second};
    }
    const std::string last =
        word.substr(word.rfind(':') == std::string::npos ? 0 : word.rfind(':') + 1);
    if (const auto alias = aliases_.find(last); alias != aliases_.end()) return alias->second;
    if (!is_name(last)) words_.fail("a type");
    const auto scope = word.find("::");
    return {.name = "",
            .type = (scope == std::string::npos ? package() : word.substr(0, scope)) + "/" + last};
  }

  IdlWords words_;
  std::vector<std::string> modules_;
  std::map<std::string, Member> aliases_;
  Definitions found_;
};

}  // namespace

Definitions parse_idl(std::string_view text) { return IdlParser(text).run(); }

}  // namespace mimesis::cdr
