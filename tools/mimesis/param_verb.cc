#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/json_text.h"
#include "common/runtime/value_text.h"
#include "common/runtime/yaml_document.h"
#include "proto/params.pb.h"
#include "tools/mimesis/graph_tools.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using Json = nlohmann::ordered_json;
using Values = std::vector<std::pair<std::string, std::string>>;

struct Options : GraphOptions {
  std::string node, key, file;
  std::vector<std::string> words;  ///< KEY=VALUE ... or KEY VALUE
};

/// Values are written as YAML, which for them is JSON, too.
Json value_of(const v1::Param& param) {
  Json value = Json::parse(param.value(), nullptr, /*allow_exceptions=*/false);
  return value.is_discarded() ? Json(param.value()) : value;
}

Json param_json(const std::string& node, const v1::Param& param) {
  return {{"node", node},
          {"key", param.key()},
          {"value", value_of(param)},
          {"type", param.type()},
          {"unit", param.unit()},
          {"allowed", param.allowed()},
          {"changeable", param.changeable()},
          {"meaning", param.meaning()}};
}

/// The node's parameters once it has taken `values`. @throws VerbFailure
v1::ParamSet ask(const Options& options, const std::string& node, const Values& values = {}) {
  std::vector<v1::NodeInfo> nodes;
  if (find_node(options, node, nodes) == nullptr) throw VerbFailure{"", kNotFound};
  const std::string service = node + "/params";
  if (!std::ranges::count(service_names(nodes), service))
    throw VerbFailure{"node '" + node + "' has no service params: it is no node of ours", 1};
  v1::ParamRequest request;
  request.set_described(true);
  for (const auto& [key, value] : values) {
    v1::ParamValue& set = *request.add_set();
    set.set_key(key);
    set.set_value(value);
  }
  const auto answer =
      call_service(nodes, service, request.SerializeAsString(), milliseconds(options.timeout_s));
  if (!answer) {
    const std::string& why = answer.error().reason;
    throw VerbFailure{why, why.find("did not answer within") != std::string::npos ? kNotFound : 2};
  }
  v1::ParamSet params;
  if (!params.ParseFromString(*answer)) throw VerbFailure{service + ": not an answer", 1};
  return params;
}

int list_params(const Options& options) {
  std::vector<std::string> nodes;
  if (!options.node.empty()) {
    nodes.push_back(options.node);
  } else {
    for (const v1::NodeInfo& node : runtime::GraphView(options.graph).nodes()) {
      for (const v1::ServiceInfo& s : node.services()) {
        if (s.service() == node.name() + "/params") nodes.push_back(node.name());
      }
    }
  }
  if (nodes.empty()) std::cerr << "graph '" << options.graph << "' has no nodes with parameters\n";
  Json list = Json::array();
  TextTable table({"PARAMETER", "VALUE", "UNIT", "ALLOWED", "CHANGE"});
  for (const std::string& node : nodes) {
    const v1::ParamSet params = ask(options, node);
    for (const v1::Param& p : params.params()) {
      list.push_back(param_json(node, p));
      table.row({node + "." + p.key(), p.value(), p.unit(), p.allowed(),
                 p.changeable() ? "at run time" : "-"});
    }
  }
  if (options.json) {
    std::cout << json_text(list) << '\n';
  } else if (!list.empty()) {
    table.print(std::cout, use_colour(STDOUT_FILENO));
  }
  return 0;
}

/// @throws VerbFailure
const v1::Param& param_named(const v1::ParamSet& params, const Options& options) {
  const auto found = std::ranges::find(params.params(), options.key, &v1::Param::key);
  if (found != params.params().end()) return *found;
  std::vector<std::string> keys;
  for (const v1::Param& p : params.params()) keys.push_back(p.key());
  throw VerbFailure{fmt::format("node '{}' has no parameter '{}'{}", options.node, options.key,
                                runtime::did_you_mean(options.key, keys)),
                    kNotFound};
}

int get_param(const Options& options) {
  const v1::ParamSet params = ask(options, options.node);
  const v1::Param& param = param_named(params, options);
  if (options.json) {
    std::cout << json_text(param_json(options.node, param)) << '\n';
  } else {
    const Json value = value_of(param);
    std::cout << (value.is_string() ? value.get<std::string>() : param.value()) << '\n';
    if (isatty(STDOUT_FILENO) == 1) {
      std::cerr << fmt::format("{}: {} {}\n", param.meaning(), param.allowed(), param.unit());
    }
  }
  return 0;
}

/// Prints what is different now.
int set_values(const Options& options, const Values& values) {
  const v1::ParamSet before = ask(options, options.node);
  const v1::ParamSet after = ask(options, options.node, values);
  Json list = Json::array();
  for (int i = 0; i < std::min(before.params_size(), after.params_size()); ++i) {
    const v1::Param &old = before.params(i), &now = after.params(i);
    if (old.value() == now.value()) continue;
    Json entry = param_json(options.node, now);
    entry["before"] = value_of(old);
    list.push_back(std::move(entry));
    if (options.json) continue;
    std::cerr << fmt::format("{}.{}: {} instead of {}{}{}\n", options.node, now.key(), now.value(),
                             old.value(), now.unit().empty() ? "" : " ", now.unit());
  }
  if (options.json) std::cout << json_text(list) << '\n';
  if (!options.json && list.empty()) std::cerr << options.node << ": nothing has changed\n";
  return 0;
}

int set_params(const Options& options) {
  Values values;
  const auto& words = options.words;
  if (words.size() == 2 && words[0].find('=') == std::string::npos) {
    values.emplace_back(words[0], words[1]);
  } else {
    for (const std::string& word : words) {
      const std::size_t equals = word.find('=');
      if (equals == std::string::npos || equals == 0)
        throw ConfigError("param set: '" + word + "' is not KEY=VALUE");
      values.emplace_back(word.substr(0, equals), word.substr(equals + 1));
    }
  }
  return set_values(options, values);
}

/// "axes.0.node" into {"axes": [{"node": ...}]}.
Json nested(const v1::ParamSet& params) {
  Json root = Json::object();
  for (const v1::Param& param : params.params()) {
    Json* at = &root;
    std::string key = param.key();
    for (std::size_t dot; (dot = key.find('.')) != std::string::npos; key.erase(0, dot + 1)) {
      const auto index = runtime::to_int(key.substr(0, dot));
      at = index ? &(*at)[static_cast<std::size_t>(*index)] : &(*at)[key.substr(0, dot)];
    }
    (*at)[key] = value_of(param);
  }
  return root;
}

/// Block style, as launch files and --params read it.
void write_yaml(std::ostream& out, const Json& map, const std::string& indent) {
  for (const auto& [key, value] : map.items()) {
    const bool list = value.is_array() && !value.empty() && value.front().is_object();
    out << indent << key << ':';
    if (value.is_object()) {
      out << '\n';
      write_yaml(out, value, indent + "  ");
    } else if (list) {
      out << '\n';
      for (const Json& item : value) out << indent << "  - " << item.dump() << '\n';
    } else {
      out << ' ' << value.dump() << '\n';
    }
  }
}

int dump_params_of(const Options& options) {
  const Json map = nested(ask(options, options.node));
  if (options.json) {
    std::cout << json_text(map) << '\n';
    return 0;
  }
  if (options.file.empty()) {
    write_yaml(std::cout, map, "");
    return 0;
  }
  std::ofstream out(options.file);
  write_yaml(out, map, "");
  if (!out.flush()) throw VerbFailure{"cannot write '" + options.file + "'", 1};
  return 0;
}

void flatten(const runtime::Yaml& yaml, const std::string& path, Values& values) {
  using Kind = runtime::Yaml::Kind;
  const auto below = [&](const std::string& key) { return path.empty() ? key : path + "." + key; };
  if (yaml.kind == Kind::scalar) values.emplace_back(path, yaml.text);
  for (const auto& entry : yaml.entries) flatten(entry.value, below(entry.key), values);
  if (yaml.kind != Kind::sequence) return;
  std::string list;
  for (std::size_t i = 0; i < yaml.items.size(); ++i) {
    const runtime::Yaml& item = yaml.items[i];
    if (item.kind != Kind::scalar) {
      flatten(item, below(std::to_string(i)), values);
    } else {
      list += (list.empty() ? "" : ", ") + (item.quoted ? Json(item.text).dump() : item.text);
    }
  }
  if (!list.empty() || yaml.items.empty()) values.emplace_back(path, "[" + list + "]");
}

/// Sets what differs from the file: all of it, or nothing.
int load_params_of(const Options& options) {
  Values all, different;
  flatten(runtime::read_yaml(options.file), "", all);
  const v1::ParamSet present = ask(options, options.node);
  for (const auto& [key, text] : all) {
    const auto param = std::ranges::find(present.params(), key, &v1::Param::key);
    const auto same = [&, &text = text] {
      const Json value = value_of(*param);
      if (value.is_number()) return runtime::to_double(text) == value.get<double>();
      return text == (value.is_string() ? value.get<std::string>() : param->value());
    };
    if (param == present.params().end() || !same()) different.emplace_back(key, text);
  }
  if (different.empty()) {
    if (options.json) std::cout << "[]\n";
    std::cerr << options.node << ": all values of " << options.file << " are in force\n";
    return 0;
  }
  return set_values(options, different);
}

}  // namespace

void add_param(CLI::App& program, int& exit_code) {
  CLI::App* param = program.add_subcommand("param");
  param->require_subcommand(1);
  auto o = std::make_shared<Options>();
  const auto verb = [&](const char* name, const char* about, const char* examples,
                        int (*run)(const Options&)) {
    CLI::App* sub = param->add_subcommand(name, about);
    sub->footer(examples);
    sub->callback([=, &exit_code] {
      o->graph = chosen_graph(*o);
      try {
        exit_code = run(*o);
      } catch (const VerbFailure& failure) {
        if (!failure.line.empty()) std::cerr << printable(failure.line, "\n") << '\n';
        exit_code = failure.exit_code;
      }
    });
    return sub;
  };
  const auto finish = [&](CLI::App* sub) {
    add_graph_options(*sub, *o, "the node and its answer");
  };

  CLI::App* list =
      verb("list", "Parameters of a node, or of all",
           "Examples:\n  mimesis param list camera\n  mimesis param list --json", list_params);
  list->add_option("node", o->node, "Name of a node");
  finish(list);
  CLI::App* get = verb("get", "Value of a parameter",
                       "Examples:\n  mimesis param get camera noise\n"
                       "  mimesis param get camera view.focal_px --json",
                       get_param);
  get->add_option("node", o->node, "Name of a node")->required();
  get->add_option("key", o->key, "Name of a parameter")->required();
  finish(get);
  CLI::App* set = verb("set", "Changes parameters while the node runs: all that are given, or none",
                       "Which may change, `param list` shows; a log holds the change and a replay\n"
                       "follows it. Exit code 2 if a value is refused.\n"
                       "Examples:\n  mimesis param set camera noise 12\n"
                       "  mimesis param set camera gain=0.8 warmth=1.2",
                       set_params);
  set->add_option("node", o->node, "Name of a node")->required();
  set->add_option("values", o->words, "KEY VALUE, or KEY=VALUE ...")->required();
  finish(set);
  CLI::App* dump = verb("dump", "All parameters of a node as YAML, as --params reads them",
                        "Examples:\n  mimesis param dump camera -o camera.yaml\n"
                        "  mimesis_camera --params camera.yaml",
                        dump_params_of);
  dump->add_option("node", o->node, "Name of a node")->required();
  dump->add_option("-o,--output", o->file, "File to write (default: standard output)");
  finish(dump);
  CLI::App* load = verb("load", "Sets the values of a YAML file that differ from the present ones",
                        "Examples:\n  mimesis param load camera camera.yaml", load_params_of);
  load->add_option("node", o->node, "Name of a node")->required();
  load->add_option("file", o->file, "YAML, as `param dump` writes it")->required();
  finish(load);
}

}  // namespace mimesis::tool
