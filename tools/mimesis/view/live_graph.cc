#include "tools/mimesis/view/live_graph.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/json_text.h"
#include "common/time.h"
#include "proto/params.pb.h"
#include "tools/mimesis/graph_tools.h"
#include "tools/mimesis/json_depth.h"

namespace mimesis::view {
namespace {
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
constexpr auto kTurn = 5ms, kLook = 100ms, kAnswer = 2000ms;
constexpr std::int64_t kTimePeriod_ns = 20'000'000;

/// Values of parameters are YAML, which for them is JSON, too.
nlohmann::json value_of(const v1::Param& param) {
  constexpr int kDeepest = 16;
  if (tool::nested_deeper(param.value(), kDeepest)) return param.value();
  auto value = nlohmann::json::parse(param.value(), nullptr, /*allow_exceptions=*/false);
  return value.is_discarded() ? nlohmann::json(param.value()) : value;
}

Half half(const v1::NodeInfo& node, const std::string& type) {
  const auto set = node.descriptors().find(type);
  return {type, set == node.descriptors().end() ? std::string() : set->second};
}

/// The node and the key in NODE.KEY.
std::pair<std::string, std::string> split(const std::string& name) {
  const std::size_t dot = name.find('.');
  return {name.substr(0, dot), dot == name.npos ? std::string() : name.substr(dot + 1)};
}

tl::expected<v1::ParamSet, Status> ask(const std::vector<v1::NodeInfo>& nodes,
                                       const std::string& node, const v1::ParamRequest& request) {
  const auto answer =
      tool::call_service(nodes, node + "/params", request.SerializeAsString(), kAnswer);
  if (!answer) return tl::unexpected(answer.error());
  v1::ParamSet set;
  if (!set.ParseFromString(*answer)) return tl::unexpected(Status{node + "/params: no answer"});
  return set;
}

}  // namespace

LiveGraph::LiveGraph(Server& server, std::string graph, tool::TopicFilter topics,
                     runtime::Policy policy)
    : server_(server),
      graph_(std::move(graph)),
      topics_(std::move(topics)),
      view_(graph_),
      tap_(
          graph_, [](const std::string&) { return false; }, policy),
      clerk_([this] { serve(); }) {}

LiveGraph::~LiveGraph() {
  end_ = true;
  clerk_.join();
}

void LiveGraph::step() {
  look();
  const auto deadline = Clock::now() + kTurn;
  for (auto left = kTurn; left > 0ms;
       left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now())) {
    auto tapped = tap_.next(left);
    if (!tapped) break;
    const auto channel = channels_.find({tapped->topic, tapped->type_hash});
    if (channel == channels_.end()) continue;
    const std::int64_t stamp_ns = tapped->message.stamp.count();
    server_.send(channel->second.id, std::move(tapped->message.payload),
                 static_cast<std::uint64_t>(stamp_ns));
    const bool simulated = tapped->publisher != nullptr && tapped->publisher->clock() != "wall";
    if (simulated && (stamp_ns >= told_ns_ + kTimePeriod_ns || stamp_ns < told_ns_)) {
      told_ns_ = stamp_ns;
      server_.send_time(static_cast<std::uint64_t>(stamp_ns));
    }
  }
}

/// Subscribes to the topics that somebody looks at, and to no others.
void LiveGraph::choose() {
  std::set<std::uint32_t> wanted = server_.wanted();
  if (wanted == wanted_) return;
  wanted_ = std::move(wanted);
  std::set<std::string> topics;
  for (const auto& [key, channel] : channels_) {
    if (wanted_.contains(channel.id)) topics.insert(channel.topic);
  }
  tap_.choose([topics](const std::string& topic) { return topics.contains(topic); });
}

void LiveGraph::look() {
  if (Clock::now() >= next_look_) {
    next_look_ = Clock::now() + kLook;
    infos_ = view_.nodes();
    announce();
  }
  choose();
}

void LiveGraph::announce() {
  std::vector<Channel> channels;
  std::vector<Service> services;
  Connections connections;
  for (const v1::NodeInfo& node : infos_) {
    for (const v1::TopicInfo& out : node.outputs()) {
      if (!topics_(out.topic())) continue;
      connections.published[out.topic()].insert(node.name());
      const auto [known, fresh] = channels_.try_emplace({out.topic(), out.type_hash()});
      if (fresh)
        known->second = {next_id_++, out.topic(), out.type(), half(node, out.type()).descriptors,
                         out.latched()};
      if (std::ranges::find(channels, known->second.id, &Channel::id) == channels.end())
        channels.push_back(known->second);
    }
    for (const v1::TopicInfo& in : node.inputs()) {
      if (!topics_(in.topic())) continue;
      if (!in.topic().empty() && in.topic() != "*")
        connections.subscribed[in.topic()].insert(node.name());
    }
    for (const v1::ServiceInfo& s : node.services()) {
      connections.services[s.service()].insert(node.name());
      const std::lock_guard lock(mutex_);
      const auto id = services_.try_emplace(s.service(), services_.size() + 1).first->second;
      services.push_back(
          {id, s.service(), half(node, s.request_type()), half(node, s.response_type())});
    }
  }
  server_.announce(std::move(channels));
  server_.announce(std::move(services));
  server_.announce(std::move(connections));
}

void LiveGraph::serve() {
  while (!end_) {
    if (const auto asked = server_.asked(50ms)) handle(*asked);
  }
}

void LiveGraph::handle(const Server::Asked& asked) {
  std::visit(
      [&](const auto& request) {
        if constexpr (requires { answer(asked.client, request); }) answer(asked.client, request);
      },
      asked.request);
}

std::vector<Parameter> LiveGraph::parameters(const std::vector<v1::NodeInfo>& nodes,
                                             const std::vector<std::string>& names) const {
  std::vector<Parameter> all;
  for (const v1::NodeInfo& node : nodes) {
    const bool asked = names.empty() || std::ranges::any_of(names, [&](const std::string& name) {
                         return split(name).first == node.name();
                       });
    if (!asked) continue;
    const auto set = ask(nodes, node.name(), {});
    if (!set) continue;  // a program that is no node of ours has none
    for (const v1::Param& param : set->params()) {
      const std::string name = node.name() + "." + param.key();
      if (names.empty() || std::ranges::find(names, name) != names.end())
        all.push_back({name, value_of(param)});
    }
  }
  return all;
}

void LiveGraph::answer(std::uint64_t client, const GetParameters& get) {
  server_.answer(client, parameter_values(parameters(runtime::GraphView(graph_).nodes(), get.names),
                                          get.request));
}

void LiveGraph::answer(std::uint64_t client, const SetParameters& set) {
  std::map<std::string, v1::ParamRequest> requests;  // by node
  std::vector<std::string> names;
  for (const Parameter& p : set.parameters) {
    const auto [node, key] = split(p.name);
    v1::ParamValue& value = *requests[node].add_set();
    value.set_key(key);
    value.set_value(p.value.is_string() ? p.value.get<std::string>() : json_text(p.value));
    names.push_back(p.name);
  }
  const auto nodes = runtime::GraphView(graph_).nodes();
  for (const auto& [node, request] : requests) {
    if (const auto answer = ask(nodes, node, request); !answer)
      server_.answer(client, status(Level::error, answer.error().reason));
  }
  const auto now = parameters(nodes, names);
  server_.answer(client, parameter_values(now, set.request));
  server_.tell(now);
}

void LiveGraph::answer(std::uint64_t client, const CallService& call) {
  std::string name;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [service, id] : services_) {
      if (id == call.service) name = service;
    }
  }
  const auto answer =
      tool::call_service(runtime::GraphView(graph_).nodes(), name, call.payload, kAnswer);
  if (answer) {
    server_.answer_binary(client, service_answer(call.service, call.call, *answer));
  } else {
    server_.answer(client, service_failure(call.service, call.call, answer.error().reason));
  }
}

}  // namespace mimesis::view
