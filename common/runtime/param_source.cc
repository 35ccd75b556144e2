#include "common/runtime/param_source.h"

#include <filesystem>

#include "common/error.h"
#include "common/runtime/param_reader.h"
#include "common/runtime/suggest.h"
#include "common/runtime/value_text.h"

namespace mimesis::runtime {
namespace {

namespace fs = std::filesystem;

/// Value at "nodes.camera.params"; null if only its last key is absent.
const Yaml* section_of(const Yaml& document, const std::string& path) {
  const Yaml* at = &document;
  for (std::size_t begin = 0; begin < path.size();) {
    const std::size_t end = std::min(path.find('.', begin), path.size());
    const std::string key = path.substr(begin, end - begin);
    const Yaml* next = at->find(key);
    if (next == nullptr && end == path.size()) return nullptr;
    if (next == nullptr) {
      throw ConfigError(to_string(at->place) + ": has no '" + key + "' on the way to " + path +
                        did_you_mean(key, at->keys()));
    }
    at = next;
    begin = end + 1;
  }
  return at;
}

}  // namespace

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
  section_ =
      hash == std::string::npos ? &document_ : section_of(document_, reference.substr(hash + 1));
  if (section_ == nullptr || section_->kind == Yaml::Kind::empty) {
    section_ = nullptr;
  } else if (section_->kind != Yaml::Kind::map) {
    throw ConfigError(to_string(section_->place) + ": expected a map of parameters, found " +
                      section_->described());
  }
}

void ParamSource::read(std::string_view owner, const VisitParams& visit) const {
  Variables variables(document_);
  for (const std::string& arg : args_) variables.set_arg(arg);
  ParamReader reader(owner, section_, variables, sets_);
  visit(reader);
  reader.finish();
}

Place ParamSource::place_of(std::string_view path) const {
  for (const auto& [key, text] : sets_) {
    if (key == path) return {"--set"};
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
    const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
    for (const fs::path& place : {fs::path(MIMESIS_SOURCE_DIR) / folder,
                                  program.parent_path().parent_path() / "share/mimesis" / folder}) {
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

}  // namespace mimesis::runtime
