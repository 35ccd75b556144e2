#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <vector>

#include "common/error.h"
#include "common/json_text.h"
#include "common/runtime/param_source.h"
#include "common/runtime/raw.h"
#include "tools/mimesis/graph_tools.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;
namespace pb = google::protobuf;

/// A message or an enum as its file has it, with the comment before it.
struct Type {
  std::string package, file, text;
};

/// The types of a .proto file: blocks at its left edge.
void read_types(const std::string& file, const std::string& content,
                std::map<std::string, Type>& types) {
  static const std::regex package_line(R"(package\s+([\w.]+)\s*;.*)"),
      begin_line(R"((message|enum)\s+(\w+)\s*\{.*)");
  std::string package, name, block;
  std::istringstream in(content);
  for (std::string line; std::getline(in, line);) {
    std::smatch found;
    if (std::regex_match(line, found, package_line)) package = found[1].str() + '.';
    if (name.empty() && std::regex_match(line, found, begin_line)) name = found[2];
    if (name.empty() && !line.starts_with("//")) {
      block.clear();
      continue;
    }
    block += line + '\n';
    const bool one_line =
        line.find('}') != std::string::npos && line.find('{') != std::string::npos;
    if (!name.empty() && (line.starts_with("}") || (one_line && !line.starts_with(" ")))) {
      types[package + name] = {package, file, block};
      name.clear();
      block.clear();
    }
  }
}

/// All types of this installation's .proto files, and of the nodes that run.
std::map<std::string, Type> all_types(const GraphOptions& options) {
  std::map<std::string, Type> types;
  const fs::path folder =
      fs::path(runtime::find_project_file("proto", "header.proto")).parent_path();
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".proto") continue;
    std::ifstream in(entry.path(), std::ios::binary);
    const std::string content{std::istreambuf_iterator<char>(in), {}};
    read_types("proto/" + fs::relative(entry.path(), folder).string(), content, types);
  }
  if (options.graph.empty() && running_graphs().empty()) return types;
  for (const v1::NodeInfo& node : runtime::GraphView(chosen_graph(options)).nodes()) {
    for (const auto& [name, set] : node.descriptors()) {
      pb::FileDescriptorSet files;
      if (types.contains(name) || !files.ParseFromString(set)) continue;
      pb::DescriptorPool pool;
      for (const pb::FileDescriptorProto& file : files.file()) pool.BuildFile(file);
      const pb::Descriptor* type = pool.FindMessageTypeByName(name);
      if (type == nullptr) continue;
      types[name] = {type->file()->package() + '.', "of node " + node.name(), type->DebugString()};
    }
  }
  return types;
}

using Found = std::pair<const std::string, Type>;

/// By its full name, or by the last part of it: ours goes before others'.
/// @throws ConfigError with a suggestion, or with those that fit
const Found& find_type(const std::map<std::string, Type>& types, const std::string& name) {
  if (const auto exact = types.find(name); exact != types.end()) return *exact;
  if (const auto ours = types.find("mimesis.v1." + name); ours != types.end()) return *ours;
  std::vector<std::string> fitting, known;
  for (const auto& [full, type] : types) {
    if (full.ends_with("." + name)) fitting.push_back(full);
    known.push_back(full);
    known.push_back(full.substr(full.rfind('.') + 1));
  }
  if (fitting.size() == 1) return *types.find(fitting[0]);
  if (fitting.empty()) {
    throw ConfigError("no type '" + name + "'" + runtime::did_you_mean(name, known) +
                      "; `mimesis interface list` shows all");
  }
  throw ConfigError(fmt::format("'{}' is {}: say which", name, fmt::join(fitting, " or ")));
}

struct Field {
  std::string label, type, name, number, comment;
};

std::vector<Field> fields_of(const Type& type) {
  static const std::regex field(
      R"(\s+(repeated |optional )?(map<[^>]*>|[\w.]+) (\w+) = (\d+)[^;]*;\s*(?://\s*(.*))?)");
  std::vector<Field> fields;
  std::istringstream in(type.text);
  for (std::string line; std::getline(in, line);) {
    std::smatch m;
    if (std::regex_match(line, m, field)) fields.push_back({m[1], m[2], m[3], m[4], m[5]});
  }
  return fields;
}

/// The type and what its fields need, each once.
void print(const std::map<std::string, Type>& types, const Found& found,
           std::set<std::string>& printed) {
  if (!printed.insert(found.first).second) return;
  std::cout << fmt::format("// {}  ({})\n{}\n", found.first, found.second.file, found.second.text);
  for (const Field& field : fields_of(found.second)) {
    for (const std::string& name : {found.second.package + field.type, field.type}) {
      if (const auto used = types.find(name); used != types.end()) print(types, *used, printed);
    }
  }
}

int show(const GraphOptions& options, const std::string& name) {
  const std::map<std::string, Type> types = all_types(options);
  const Found& found = find_type(types, name);
  if (!options.json) {
    std::set<std::string> printed;
    print(types, found, printed);
    return 0;
  }
  nlohmann::ordered_json fields = nlohmann::ordered_json::array();
  for (const Field& f : fields_of(found.second)) {
    fields.push_back({{"name", f.name},
                      {"number", std::stoi(f.number)},
                      {"type", f.type},
                      {"repeated", f.label == "repeated "},
                      {"comment", f.comment}});
  }
  std::cout << json_text(nlohmann::ordered_json{
                   {"type", found.first}, {"file", found.second.file}, {"fields", fields}})
            << '\n';
  return 0;
}

int list(const GraphOptions& options) {
  nlohmann::ordered_json names = nlohmann::ordered_json::array();
  for (const auto& [name, type] : all_types(options)) {
    names.push_back(name);
    if (!options.json) std::cout << name << '\n';
  }
  if (options.json) std::cout << json_text(names) << '\n';
  return 0;
}

}  // namespace

void add_interface(CLI::App& program, int& exit_code) {
  auto options = std::make_shared<GraphOptions>();
  auto type = std::make_shared<std::string>();
  CLI::App* verb = program.add_subcommand("interface", "Types of messages");
  verb->require_subcommand(1);
  CLI::App* sub = verb->add_subcommand("show", "Fields of a type, with units and frames");
  sub->add_option("TYPE", *type, "Such as mimesis.v1.JointState, or JointState")->required();
  add_graph_options(*sub, *options);
  sub->footer(
      "Types of this installation, and those that nodes of the running graph brought along.\n"
      "Exit codes: 0 done, 2 no such type.\nExamples:\n  mimesis interface show JointState");
  sub->callback([options, type, &exit_code] { exit_code = show(*options, *type); });
  CLI::App* all = verb->add_subcommand("list", "All types");
  add_graph_options(*all, *options);
  all->footer("Examples:\n  mimesis interface list");
  all->callback([options, &exit_code] { exit_code = list(*options); });
}

}  // namespace mimesis::tool
