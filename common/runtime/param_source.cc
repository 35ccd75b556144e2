#include "common/runtime/param_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

#include "common/error.h"
#include "common/runtime/value_text.h"

// The values of a struct of parameters as text: for the log (YAML) and for --help (one line each).

namespace mimesis::runtime {
namespace {

constexpr const char* kSet = "--set";

Yaml scalar_at(const std::string& text, const Place& place) {
  Yaml y;
  y.kind = Yaml::Kind::scalar;
  y.text = text;
  y.place = place;
  return y;
}

std::vector<Yaml> split_at_commas(const std::string& text, const Place& place) {
  std::vector<Yaml> items;
  std::size_t begin = 0;
  while (begin <= text.size() && !text.empty()) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    items.push_back(scalar_at(text.substr(begin, end - begin), place));
    begin = end + 1;
  }
  return items;
}

namespace fs = std::filesystem;

/// Value at "nodes.camera.params"; null if only its last key is absent. Keys may hold dots.
/// @param names  gets the names that a `for` on the way binds
const Yaml* section_of(const Yaml& document, const std::string& path,
                       std::set<std::string, std::less<>>& names) {
  const Yaml* at = &document;
  for (std::size_t begin = 0; begin < path.size();) {
    std::size_t end = path.size();
    const Yaml* next = at->find(path.substr(begin));
    while (next == nullptr && (end = path.rfind('.', end - 1)) != std::string::npos && end > begin)
      next = at->find(path.substr(begin, end - begin));
    if (next == nullptr) {
      end = std::min(path.find('.', begin), path.size());
      if (end == path.size()) return nullptr;
      const std::string key = path.substr(begin, end - begin);
      throw ConfigError(to_string(at->place) + ": has no '" + key + "' on the way to " + path +
                        did_you_mean(key, at->keys()));
    }
    at = next;
    begin = end + 1;
    if (const Yaml* repeated = at->find("for")) {
      for (const std::string& name : repeated->keys()) names.insert(name);
    }
  }
  return at;
}

std::array<fs::path, 2> project_folders(const std::string& folder) {
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  return {fs::path(MIMESIS_SOURCE_DIR) / folder,
          program.parent_path().parent_path() / "share/mimesis" / folder};
}

/// Names of the files in models/ that end like this: candidates for one that is not there.
std::vector<std::string> model_files(const fs::path& extension) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const fs::path& folder : project_folders("models")) {
    for (const auto& entry : fs::directory_iterator(folder, ignored)) {
      if (entry.path().extension() == extension) names.push_back(entry.path().filename());
    }
  }
  return names;
}

std::string quoted_text(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '\n') {
      out += "\\n";
      continue;
    }
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

std::string flow(const std::vector<double>& values) {
  return fmt::format("[{}]", fmt::join(values, ", "));
}

std::string flow(const std::vector<std::string>& values) {
  std::string out;
  for (const std::string& value : values) out += (out.empty() ? "" : ", ") + quoted_text(value);
  return "[" + out + "]";
}

/// Base of the two writers: each value with all that the visit says about it.
class Writer : public ParamVisitor {
 public:
  void operator()(std::string_view key, double& value, double lo, double hi) override {
    put({std::string(key), "number", fmt::format("{}", value), fmt::format("[{}, {}]", lo, hi),
         std::pair(lo, hi)});
  }
  void operator()(std::string_view key, int& value, int lo, int hi) override {
    put({std::string(key), "integer", fmt::format("{}", value),
         fmt::format("[{}, {}] whole", lo, hi), std::pair<double, double>(lo, hi)});
  }
  void operator()(std::string_view key, bool& value) override {
    put({std::string(key), "bool", fmt::format("{}", value), "true or false"});
  }
  void operator()(std::string_view key, std::string& value) override {
    put({std::string(key), "text", quoted_text(value), "text"});
  }
  void operator()(std::string_view key, std::string& value,
                  std::initializer_list<std::string_view> choices) override {
    put({.key = std::string(key),
         .type = "text",
         .value = quoted_text(value),
         .allowed = fmt::format("one of {}", fmt::join(choices, ", ")),
         .choices = {choices.begin(), choices.end()}});
  }
  void file(std::string_view key, std::string& value, std::string_view kind, bool) override {
    put({.key = std::string(key),
         .type = "text",
         .value = quoted_text(value),
         .allowed = fmt::format("file: {}", kind),
         .file_of = std::string(kind)});
  }
  void operator()(std::string_view key, std::vector<double>& value, double lo, double hi,
                  std::size_t size) override {
    const std::string count = size != 0 ? fmt::format("{} numbers", size) : "numbers";
    put({.key = std::string(key),
         .type = "numbers",
         .value = flow(value),
         .allowed = fmt::format("{} in [{}, {}]", count, lo, hi),
         .range = std::pair(lo, hi),
         .size = size});
  }
  void operator()(std::string_view key, std::vector<std::string>& value) override {
    put({std::string(key), "texts", flow(value), "list of text"});
  }

 private:
  void put(ParamInfo info) {
    info.changeable = changeable_;
    leaf(std::move(info));
  }
  virtual void leaf(ParamInfo info) = 0;
};

class YamlWriter final : public Writer {
 public:
  std::string out;

  void group(std::string_view key, const VisitParams& visit) override {
    line(fmt::format("{}:", key));
    indent_ += 2;
    visit(*this);
    indent_ -= 2;
  }
  void elements(std::string_view key, std::size_t size, const std::function<void(std::size_t)>&,
                const std::function<void(ParamVisitor&, std::size_t)>& visit) override {
    line(fmt::format("{}:{}", key, size == 0 ? " []" : ""));
    indent_ += 4;
    for (std::size_t i = 0; i < size; ++i) {
      dash_ = true;
      visit(*this, i);
    }
    indent_ -= 4;
  }

 private:
  void leaf(ParamInfo info) override { line(fmt::format("{}: {}", info.key, info.value)); }
  void line(const std::string& text) {
    const std::size_t spaces = dash_ ? indent_ - 2 : indent_;
    out += std::string(spaces, ' ') + (dash_ ? "- " : "") + text + "\n";
    dash_ = false;
  }

  std::size_t indent_ = 0;
  bool dash_ = false;  // the next line starts an element of a list
};

/// One entry per value: "view.focal_px", "axes.0.node".
class FlatWriter final : public Writer {
 public:
  /// `lists`: their elements have entries; else the list has one, and its elements "axes.N.node".
  FlatWriter(const VisitParams& visit, bool lists) : lists_(lists) { visit(*this); }

  void group(std::string_view key, const VisitParams& visit) override {
    const std::string outer = std::exchange(prefix_, prefix_ + std::string(key) + ".");
    visit(*this);
    prefix_ = outer;
  }
  void elements(std::string_view key, std::size_t size,
                const std::function<void(std::size_t)>& resize,
                const std::function<void(ParamVisitor&, std::size_t)>& visit) override {
    if (!lists_) {
      leaf({std::string(key), "list", fmt::format("({})", size), "list"});
      if (size == 0) resize(1);
      group(fmt::format("{}.N", key), [&](ParamVisitor& v) { visit(v, 0); });
      if (size == 0) resize(0);
    }
    for (std::size_t i = 0; lists_ && i < size; ++i) {
      group(fmt::format("{}.{}", key, i), [&](ParamVisitor& v) { visit(v, i); });
    }
  }

  std::vector<ParamInfo> entries;

 private:
  void leaf(ParamInfo info) override {
    info.key.insert(0, prefix_);
    entries.push_back(std::move(info));
  }

  bool lists_;
  std::string prefix_;
};

}  // namespace

ParamReader::ParamReader(std::string_view owner, const Yaml* section, const Variables& variables,
                         const std::vector<std::pair<std::string, std::string>>& sets)
    : owner_(owner.empty() ? "" : std::string(owner) + "."), variables_(variables), map_(section) {
  here_ = section != nullptr ? section->place : Place{"parameters"};
  for (const auto& [path, text] : sets) sets_[path] = scalar_at(text, {kSet});
}

std::string ParamReader::path_of(std::string_view key) const {
  return prefix_.empty() ? std::string(key) : prefix_ + "." + std::string(key);
}

void ParamReader::mistake(const Place& place, const std::string& path, const std::string& what) {
  mistakes_.push_back({place, fmt::format("{}: {}{}: {}", to_string(place), owner_, path, what)});
}

void ParamReader::demand(const Found& found, bool has_default, const std::string& expected) {
  if (found.yaml == nullptr && !has_default) {
    mistake(here_, found.path, "is missing, expected " + expected);
  }
}

ParamReader::Found ParamReader::look_up(std::string_view key) {
  Found found{.path = path_of(key)};
  keys_.emplace_back(key);
  paths_.push_back(found.path);
  if (map_ != nullptr) found.yaml = map_->find(key);
  if (const auto it = sets_.find(found.path); it != sets_.end()) {
    used_sets_.insert(found.path);
    found.yaml = &it->second;
  }
  return found;
}

std::optional<std::string> ParamReader::scalar(const Found& found, std::string_view expected) {
  if (found.yaml == nullptr) return std::nullopt;
  if (found.yaml->kind != Yaml::Kind::scalar) {
    mistake(found.yaml->place, found.path,
            fmt::format("expected {}, found {}", expected, found.yaml->described()));
    return std::nullopt;
  }
  try {
    return variables_.expand(*found.yaml);
  } catch (const ConfigError& e) {
    mistakes_.push_back({found.yaml->place, e.what()});
    return std::nullopt;
  }
}

template <class T>
std::optional<T> ParamReader::number(const Found& found, T lo, T hi) {
  constexpr bool kWhole = std::is_integral_v<T>;
  const std::string_view expected = kWhole ? "a whole number" : "a number";
  const auto text = scalar(found, expected);
  if (!text) return std::nullopt;
  std::optional<T> value;
  if constexpr (kWhole) {
    value = to_int(*text);
  } else {
    value = to_double(*text);
  }
  if (!value) {
    mistake(found.yaml->place, found.path, fmt::format("expected {}, found '{}'", expected, *text));
  } else if (*value < lo || *value > hi) {
    mistake(found.yaml->place, found.path, fmt::format("{} is outside [{}, {}]", *text, lo, hi));
    value.reset();
  }
  return value;
}

void ParamReader::operator()(std::string_view key, double& value, double lo, double hi) {
  const Found found = look_up(key);
  demand(found, lo <= value && value <= hi, fmt::format("a number in [{}, {}]", lo, hi));
  value = number(found, lo, hi).value_or(value);
}

void ParamReader::operator()(std::string_view key, int& value, int lo, int hi) {
  const Found found = look_up(key);
  demand(found, lo <= value && value <= hi, fmt::format("a whole number in [{}, {}]", lo, hi));
  value = number(found, lo, hi).value_or(value);
}

void ParamReader::operator()(std::string_view key, bool& value) {
  const Found found = look_up(key);
  const auto text = scalar(found, "true or false");
  if (!text) return;
  if (const auto flag = to_bool(*text)) {
    value = *flag;
  } else {
    mistake(found.yaml->place, found.path,
            fmt::format("expected true or false, found '{}'", *text));
  }
}

void ParamReader::operator()(std::string_view key, std::string& value) {
  value = scalar(look_up(key), "text").value_or(value);
}

void ParamReader::operator()(std::string_view key, std::string& value,
                             std::initializer_list<std::string_view> choices) {
  const Found found = look_up(key);
  const std::vector<std::string> known(choices.begin(), choices.end());
  const std::string expected = fmt::format("one of {}", fmt::join(known, ", "));
  demand(found, std::ranges::find(known, value) != known.end(), expected);
  const auto text = scalar(found, expected);
  if (!text) return;
  if (std::ranges::find(known, *text) == known.end()) {
    mistake(found.yaml->place, found.path,
            fmt::format("expected {}, found '{}'{}", expected, *text, did_you_mean(*text, known)));
  } else {
    value = *text;
  }
}

void ParamReader::file(std::string_view key, std::string& value, std::string_view kind,
                       bool in_models) {
  const Found found = look_up(key);
  value = scalar(found, fmt::format("the file of: {}", kind)).value_or(value);
  if (found.yaml == nullptr || value.empty() || !in_models) return;
  const std::string& named_in = found.yaml->place.file;
  const std::string& written = found.yaml->text;  // not what an argument of the launch says
  if (named_in != kSet && (written.starts_with("./") || written.starts_with("../")))
    value = (fs::path(named_in).parent_path() / value).lexically_normal().string();
  try {
    find_model_file(value);
  } catch (const ConfigError& e) {
    mistake(found.yaml->place, found.path,
            e.what() + fmt::format(", expected the file of: {}", kind) +
                did_you_mean(value, model_files(fs::path(value).extension())));
  }
}

std::optional<std::vector<Yaml>> ParamReader::sequence(const Found& found) {
  if (found.yaml == nullptr) return std::nullopt;
  if (found.yaml->kind == Yaml::Kind::sequence) return found.yaml->items;
  // A list can come as text only from outside the file: --set, or a variable that is the whole
  // value.
  const bool variable =
      found.yaml->kind == Yaml::Kind::scalar && found.yaml->text.starts_with("${");
  if (found.yaml->place.file != kSet && !variable) {
    mistake(found.yaml->place, found.path,
            fmt::format("expected a list, found {}", found.yaml->described()));
    return std::nullopt;
  }
  const auto text = scalar(found, "a list");
  if (!text) return std::nullopt;
  if (!text->starts_with('[')) return split_at_commas(*text, found.yaml->place);
  try {
    return parse_yaml(*text, kSet).items;
  } catch (const ConfigError& e) {
    mistake(found.yaml->place, found.path, e.what());
    return std::nullopt;
  }
}

/// `read`: nothing, with a mistake noted, if an element is wrong; then the list stays as it is.
template <class T, class Read>
void ParamReader::read_list(std::string_view key, std::vector<T>& value, std::size_t size,
                            const Read& read) {
  const Found found = look_up(key);
  demand(found, size == 0 || value.size() == size, fmt::format("{} numbers", size));
  const auto items = sequence(found);
  if (!items) return;
  if (size != 0 && items->size() != size) {
    return mistake(found.yaml->place, found.path,
                   fmt::format("expected {} numbers, found {}", size, items->size()));
  }
  std::vector<T> read_items;
  for (std::size_t i = 0; i < items->size(); ++i) {
    auto item = read(Found{&(*items)[i], fmt::format("{}.{}", found.path, i)});
    if (item) read_items.push_back(*std::move(item));
  }
  if (read_items.size() == items->size()) value = std::move(read_items);
}

void ParamReader::operator()(std::string_view key, std::vector<double>& value, double lo, double hi,
                             std::size_t size) {
  read_list(key, value, size, [&](const Found& item) { return number(item, lo, hi); });
}

void ParamReader::operator()(std::string_view key, std::vector<std::string>& value) {
  read_list(key, value, 0, [&](const Found& item) { return scalar(item, "text"); });
}

void ParamReader::report_unknown_keys() {
  if (map_ == nullptr) return;
  for (const Yaml::Entry& entry : map_->entries) {
    if (std::ranges::find(keys_, entry.key) != keys_.end()) continue;
    if (unknown_ != nullptr) {
      unknown_->push_back(path_of(entry.key));
    } else {
      mistake(entry.place, path_of(entry.key),
              "unknown parameter" + did_you_mean(entry.key, keys_));
    }
  }
}

void ParamReader::enter(const std::string& path, const Yaml* map, const VisitParams& visit) {
  const Yaml* outer_map = std::exchange(map_, map);
  const Place outer_here = here_;
  if (map != nullptr) here_ = map->place;
  const std::string outer_prefix = std::exchange(prefix_, path);
  std::vector<std::string> outer_keys = std::exchange(keys_, {});
  visit(*this);
  report_unknown_keys();
  map_ = outer_map;
  here_ = outer_here;
  prefix_ = outer_prefix;
  keys_ = std::move(outer_keys);
}

void ParamReader::group(std::string_view key, const VisitParams& visit) {
  const Found found = look_up(key);
  const Yaml* map = found.yaml;
  if (map != nullptr && map->kind != Yaml::Kind::map) {
    if (map->kind != Yaml::Kind::empty) {
      mistake(map->place, found.path,
              fmt::format("expected a map of parameters, found {}", map->described()));
    }
    map = nullptr;
  }
  enter(found.path, map, visit);
}

void ParamReader::elements(std::string_view key, std::size_t size,
                           const std::function<void(std::size_t)>& resize,
                           const std::function<void(ParamVisitor&, std::size_t)>& visit) {
  const Found found = look_up(key);
  const auto items = sequence(found);
  if (items) resize(items->size());
  for (std::size_t i = 0; i < (items ? items->size() : size); ++i) {
    const std::string path = fmt::format("{}.{}", found.path, i);
    const Yaml* item = items ? &(*items)[i] : nullptr;
    if (item != nullptr && item->kind != Yaml::Kind::map) {
      mistake(item->place, path,
              fmt::format("expected a map of parameters, found {}", item->described()));
      item = nullptr;
    }
    enter(path, item, [&](ParamVisitor& v) { visit(v, i); });
  }
}

void ParamReader::finish() {
  report_unknown_keys();
  for (const auto& [path, value] : sets_) {
    if (!used_sets_.contains(path)) {
      mistake(value.place, path, "unknown parameter" + did_you_mean(path, paths_));
    }
  }
  if (mistakes_.empty()) return;
  std::ranges::stable_sort(
      mistakes_, {}, [](const Mistake& m) { return std::pair(m.place.line, m.place.column); });
  std::string lines;
  for (const Mistake& m : mistakes_) lines += (lines.empty() ? "" : "\n") + m.line;
  throw ConfigError(lines);
}

ParamSource::ParamSource(const std::string& reference, const std::vector<std::string>& args,
                         const std::vector<std::string>& sets)
    : args_(args) {
  for (const std::string& set : sets) sets_.push_back(split_assignment(set, "--set"));
  if (reference.empty()) {
    if (!args.empty()) throw ConfigError("--arg: there is no file that declares arguments");
    return;
  }
  const std::size_t hash = reference.find('#');
  document_ = read_yaml(reference.substr(0, hash));
  section_ = hash == std::string::npos ? &document_
                                       : section_of(document_, reference.substr(hash + 1), bound_);
  const bool empty = section_ == nullptr || section_->kind == Yaml::Kind::empty;
  if (empty && hash != std::string::npos) {
    section_ = nullptr;
  } else if (!empty && section_->kind != Yaml::Kind::map) {
    throw ConfigError(to_string(section_->place) + ": expected a map of parameters, found " +
                      section_->described());
  }
}

void ParamSource::read(std::string_view owner, const VisitParams& visit,
                       std::vector<std::string>* unknown) const {
  Variables variables(document_);
  for (const std::string& arg : args_) {
    const auto [name, value] = split_assignment(arg, "--arg");
    bound_.contains(name) ? variables.bind(name, value) : variables.set_arg(arg);
  }
  ParamReader reader(owner, section_, variables, sets_);
  reader.leave_unknown(unknown);
  visit(reader);
  reader.finish();
}

bool ParamSource::gives(std::string_view key) const {
  return std::ranges::any_of(sets_, [&](const auto& set) { return set.first == key; }) ||
         (section_ != nullptr && section_->find(key) != nullptr);
}

Place ParamSource::place_of(std::string_view path) const {
  for (const auto& [key, text] : sets_) {
    if (key == path || path.starts_with(key + ".")) return {"--set"};
  }
  const Yaml* at = section_ != nullptr ? section_ : &document_;
  for (std::size_t begin = 0; begin < path.size();) {
    const std::size_t end = std::min(path.find('.', begin), path.size());
    const std::string key(path.substr(begin, end - begin));
    const Yaml* next = at->find(key);
    if (at->kind == Yaml::Kind::sequence) {
      const auto index = to_int(key);
      const bool there =
          index && *index >= 0 && static_cast<std::size_t>(*index) < at->items.size();
      if (there) next = &at->items[static_cast<std::size_t>(*index)];
    }
    if (next == nullptr) break;
    at = next;
    begin = end + 1;
  }
  return at->place;
}

std::string find_project_file(const std::string& folder, const std::string& file) {
  std::error_code ignored;
  if (fs::exists(file, ignored)) return file;
  const fs::path name(file);
  std::string searched = fs::current_path(ignored).string();
  if (name.is_relative()) {
    for (const fs::path& place : project_folders(folder)) {
      if (fs::exists(place / name, ignored)) return (place / name).string();
      searched += ", " + place.string();
    }
  }
  throw ConfigError(file + ": no such file" + (name.is_relative() ? " in " + searched : ""));
}

std::string find_model_file(const std::string& file) { return find_project_file("models", file); }

void load_params(const std::string& file, const VisitParams& visit) {
  ParamSource(find_model_file(file), {}, {}).read("", visit);
}

std::string dump_params(const VisitParams& visit) {
  YamlWriter writer;
  visit(writer);
  return writer.out;
}

std::vector<std::string> flat_params(const VisitParams& visit) {
  std::vector<std::string> lines;
  for (const ParamInfo& info : FlatWriter(visit, true).entries) {
    const std::string& value = info.value;
    const bool bare = value.starts_with('"') && value.find_first_of(" \\") == std::string::npos;
    lines.push_back(info.key + "=" + (bare ? value.substr(1, value.size() - 2) : value));
  }
  return lines;
}

std::vector<ParamInfo> param_infos(const VisitParams& visit) {
  return FlatWriter(visit, false).entries;
}

std::vector<ParamInfo> param_values(const VisitParams& visit) {
  return FlatWriter(visit, true).entries;
}

}  // namespace mimesis::runtime
