#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "common/json_text.h"
#include "common/runtime/value_text.h"
#include "tools/mimesis/field_text.h"
#include "tools/mimesis/graph_tools.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

struct Options : GraphOptions {
  std::string service, request;
  bool from_stdin = false;
};

int list_services(const Options& options) {
  const auto nodes = runtime::GraphView(options.graph).nodes();
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  TextTable table({"SERVICE", "REQUEST", "RESPONSE"});
  for (const v1::NodeInfo& node : nodes) {
    for (const v1::ServiceInfo& s : node.services()) {
      list.push_back({{"service", s.service()},
                      {"node", node.name()},
                      {"request", s.request_type()},
                      {"response", s.response_type()}});
      table.row({s.service(), s.request_type(), s.response_type()});
    }
  }
  if (options.json) {
    std::cout << json_text(list) << '\n';
  } else if (list.empty()) {
    std::cerr << "graph '" << options.graph << "' has no services\n";
  } else {
    table.print(std::cout, use_colour(STDOUT_FILENO));
  }
  return 0;
}

/// A new message of a type that a node has announced.
std::unique_ptr<google::protobuf::Message> make(runtime::TypePool& types, const v1::NodeInfo& node,
                                                const std::string& type) {
  const auto set = node.descriptors().find(type);
  auto message = set == node.descriptors().end() ? nullptr : types.make(type, set->second);
  if (message == nullptr) {
    throw ConfigError(fmt::format("node '{}' has not announced the type {}", node.name(), type));
  }
  return message;
}

int call(const Options& options) {
  const auto nodes = runtime::GraphView(options.graph).nodes();
  for (const v1::NodeInfo& node : nodes) {
    for (const v1::ServiceInfo& s : node.services()) {
      if (s.service() != options.service) continue;
      runtime::TypePool types;
      const auto request = make(types, node, s.request_type());
      const std::string json = options.from_stdin
                                   ? std::string(std::istreambuf_iterator<char>(std::cin), {})
                                   : options.request;
      from_json(json.empty() ? "{}" : json, s.service(), *request);
      const auto answer = call_service(nodes, s.service(), request->SerializeAsString(),
                                       milliseconds(options.timeout_s));
      if (!answer) {
        std::cerr << s.service() << ": " << printable(answer.error().reason) << '\n';
        return answer.error().reason.find("did not answer within") != std::string::npos ? kNotFound
                                                                                        : 1;
      }
      const auto response = make(types, node, s.response_type());
      if (!response->ParseFromString(*answer)) {
        std::cerr << s.service() << ": the answer is no " << s.response_type() << '\n';
        return 1;
      }
      std::cout << to_json(*response).dump(options.json ? -1 : 2) << '\n';
      return 0;
    }
  }
  std::cerr << "no service '" << options.service << "' in graph '" << options.graph << "'"
            << runtime::did_you_mean(options.service, service_names(nodes)) << '\n';
  return kNotFound;
}

}  // namespace

void add_service(CLI::App& program, int& exit_code) {
  CLI::App* service = program.add_subcommand("service");
  service->require_subcommand(1);
  auto o = std::make_shared<Options>();
  const auto on = [o, &exit_code](CLI::App* verb, int (*run)(const Options&)) {
    verb->callback([=, &exit_code] {
      o->graph = chosen_graph(*o);
      exit_code = run(*o);
    });
  };
  CLI::App* list = service->add_subcommand("list", "Services with their types");
  add_graph_options(*list, *o);
  list->footer("Examples:\n  mimesis service list\n  mimesis service list --json");
  on(list, list_services);

  CLI::App* call_verb = service->add_subcommand("call", "Calls a service, prints its answer");
  call_verb->add_option("service", o->service, "NODE/NAME")->required();
  call_verb->add_option("request", o->request, "Request as JSON (default: {})");
  call_verb->add_flag("--stdin", o->from_stdin, "Read the request from standard input");
  add_graph_options(*call_verb, *o, "the answer");
  call_verb->footer(
      "Exit code 1 if the node refuses, 3 if it does not answer.\n"
      "Examples:\n  mimesis service call player/seek '{\"position_s\": 12.5}'\n"
      "  mimesis service call player/status --json");
  on(call_verb, call);
}

}  // namespace mimesis::tool
