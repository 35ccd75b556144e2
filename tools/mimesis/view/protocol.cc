#include "tools/mimesis/view/protocol.h"

#include <fmt/format.h>
#include <sodium.h>

#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>

#include "common/json_text.h"
#include "tools/mimesis/json_depth.h"

namespace mimesis::view {
namespace {

using Json = nlohmann::json;
static_assert(std::endian::native == std::endian::little, "numbers are copied as they are");

constexpr char kMessage = 1, kTime = 2, kAnswer = 3;  // opcodes of a server
constexpr char kCall = 2;                             // of a client

std::string base64(const std::string& bytes) {
  constexpr int kKind = sodium_base64_VARIANT_ORIGINAL;
  std::string text(sodium_base64_encoded_len(bytes.size(), kKind), '\0');
  sodium_bin2base64(text.data(), text.size(), reinterpret_cast<const unsigned char*>(bytes.data()),
                    bytes.size(), kKind);
  text.pop_back();  // the terminating zero
  return text;
}

template <class T>
void append(std::string& bytes, T number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

Json half(const Half& h) {
  return {{"encoding", "protobuf"},
          {"schemaName", h.type},
          {"schemaEncoding", "protobuf"},
          {"schema", base64(h.descriptors)}};
}

Json named(const std::map<std::string, std::set<std::string>>& all, const char* ids) {
  Json list = Json::array();
  for (const auto& [name, nodes] : all) list.push_back({{"name", name}, {ids, nodes}});
  return list;
}

Json gone(const std::map<std::string, std::set<std::string>>& before,
          const std::map<std::string, std::set<std::string>>& now,
          const std::map<std::string, std::set<std::string>>& now_too) {
  Json list = Json::array();
  for (const auto& [name, nodes] : before) {
    if (!now.contains(name) && !now_too.contains(name)) list.push_back(name);
  }
  return list;
}

/// Numbers and names below `key`. @throws nlohmann::json::exception if there are no such
template <class T>
std::vector<T> list(const Json& json, const char* key) {
  return json.at(key).get<std::vector<T>>();
}

std::string request_id(const Json& json) {
  const auto id = json.find("id");
  return id == json.end() || id->is_null() ? std::string() : id->get<std::string>();
}

std::uint32_t number(const Json& json, const char* key) {
  const Json& value = json.at(key);
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > UINT32_MAX)
    throw std::invalid_argument(
        fmt::format("\"{}\": expected a number in [0, {}]", key, UINT32_MAX));
  return value.get<std::uint32_t>();
}

tl::expected<Request, std::string> parse(const Json& json) {
  const auto op = json.at("op").get<std::string>();
  if (op == "subscribe") {
    Subscribe all;
    for (const Json& s : json.at("subscriptions"))
      all.subscriptions.emplace_back(number(s, "id"), number(s, "channelId"));
    return all;
  }
  if (op == "unsubscribe") return Unsubscribe{list<std::uint32_t>(json, "subscriptionIds")};
  if (op == "getParameters")
    return GetParameters{list<std::string>(json, "parameterNames"), request_id(json)};
  if (op == "setParameters") {
    SetParameters all{{}, request_id(json)};
    for (const Json& p : json.at("parameters"))
      all.parameters.push_back({p.at("name").get<std::string>(), p.at("value")});
    return all;
  }
  const bool off = op == "unsubscribeParameterUpdates";
  if (off || op == "subscribeParameterUpdates")
    return WatchParameters{list<std::string>(json, "parameterNames"), !off};
  if (op == "subscribeConnectionGraph") return WatchConnections{true};
  if (op == "unsubscribeConnectionGraph") return WatchConnections{false};
  return tl::unexpected(fmt::format("this server does not do \"{:.100}\"", op));
}

}  // namespace

std::string server_info(std::string_view name, std::string_view session,
                        const std::map<std::string, std::string>& metadata, bool may_change) {
  Json capabilities{"time", "connectionGraph"};
  if (may_change) {
    for (const char* more : {"parameters", "parametersSubscribe", "services"})
      capabilities.push_back(more);
  }
  return json_text(Json{{"op", "serverInfo"},
                        {"name", name},
                        {"sessionId", session},
                        {"capabilities", capabilities},
                        {"supportedEncodings", {"protobuf"}},
                        {"metadata", metadata}});
}

std::string advertise(std::span<const Channel> channels) {
  Json all = Json::array();
  for (const Channel& c : channels) {
    all.push_back({{"id", c.id},
                   {"topic", c.topic},
                   {"encoding", "protobuf"},
                   {"schemaName", c.type},
                   {"schemaEncoding", "protobuf"},
                   {"schema", base64(c.descriptors)}});
  }
  return json_text(Json{{"op", "advertise"}, {"channels", all}});
}

std::string unadvertise(std::span<const std::uint32_t> channels) {
  return json_text(Json{{"op", "unadvertise"}, {"channelIds", channels}});
}

std::string advertise_services(std::span<const Service> services) {
  Json all = Json::array();
  for (const Service& s : services) {
    all.push_back({{"id", s.id},
                   {"name", s.name},
                   {"type", s.request.type},
                   {"request", half(s.request)},
                   {"response", half(s.response)}});
  }
  return json_text(Json{{"op", "advertiseServices"}, {"services", all}});
}

std::string unadvertise_services(std::span<const std::uint32_t> services) {
  return json_text(Json{{"op", "unadvertiseServices"}, {"serviceIds", services}});
}

std::string connection_graph(const Connections& now, const Connections& before) {
  Json removed = gone(before.published, now.published, now.subscribed);
  for (const Json& topic : gone(before.subscribed, now.published, now.subscribed)) {
    if (!before.published.contains(topic.get<std::string>())) removed.push_back(topic);
  }
  return json_text(Json{{"op", "connectionGraphUpdate"},
                        {"publishedTopics", named(now.published, "publisherIds")},
                        {"subscribedTopics", named(now.subscribed, "subscriberIds")},
                        {"advertisedServices", named(now.services, "providerIds")},
                        {"removedTopics", removed},
                        {"removedServices", gone(before.services, now.services, {})}});
}

std::string parameter_values(std::span<const Parameter> parameters, const std::string& request) {
  Json all = Json::array();
  for (const Parameter& p : parameters) {
    Json one{{"name", p.name}, {"value", p.value}};
    if (p.value.is_number()) one["type"] = "float64";
    all.push_back(std::move(one));
  }
  Json json{{"op", "parameterValues"}, {"parameters", all}};
  if (!request.empty()) json["id"] = request;
  return json_text(json);
}

std::string status(Level level, std::string_view message, std::string_view id) {
  Json json{{"op", "status"}, {"level", static_cast<int>(level)}, {"message", message}};
  if (!id.empty()) json["id"] = id;
  return json_text(json);
}

std::string service_failure(std::uint32_t service, std::uint32_t call, std::string_view why) {
  return json_text(Json{
      {"op", "serviceCallFailure"}, {"serviceId", service}, {"callId", call}, {"message", why}});
}

std::string service_answer(std::uint32_t service, std::uint32_t call, std::string_view payload) {
  constexpr std::string_view kEncoding = "protobuf";
  std::string bytes(1, kAnswer);
  append(bytes, service), append(bytes, call);
  append(bytes, static_cast<std::uint32_t>(kEncoding.size()));
  return bytes.append(kEncoding).append(payload);
}

std::string time(std::uint64_t ns) {
  std::string bytes(1, kTime);
  append(bytes, ns);
  return bytes;
}

MessageHeader message_header(std::uint32_t subscription, std::uint64_t ns) {
  MessageHeader header{kMessage};
  std::memcpy(&header[1], &subscription, sizeof subscription);
  std::memcpy(&header[5], &ns, sizeof ns);
  return header;
}

tl::expected<Request, std::string> parse_text(std::string_view text) {
  constexpr int kDeepest = 16;
  if (tool::nested_deeper(text, kDeepest))
    return tl::unexpected(fmt::format("not understood: nested deeper than {}", kDeepest));
  try {
    return parse(Json::parse(text));         // a callback that watches the depth makes it quadratic
  } catch (const std::exception& e) {        // of the library or ours: all say what was expected
    constexpr std::size_t kMostBytes = 300;  // the library repeats what it has read
    std::string why = e.what();
    if (why.size() > kMostBytes) why = why.substr(0, kMostBytes) + " ...";
    return tl::unexpected("not understood: " + why);
  }
}

tl::expected<Request, std::string> parse_binary(std::string_view bytes) {
  constexpr std::size_t kFixed = 13;  // opcode, service, call, length of the encoding's name
  if (bytes.empty() || bytes[0] != kCall)
    return tl::unexpected(std::string("this server takes binary service requests alone"));
  std::uint32_t length = 0;
  if (bytes.size() >= kFixed) std::memcpy(&length, &bytes[9], sizeof length);
  if (bytes.size() < kFixed || length > bytes.size() - kFixed)
    return tl::unexpected(std::string("a service request that is cut off"));
  if (bytes.substr(kFixed, length) != "protobuf")
    return tl::unexpected(std::string("a service request that is not in protobuf"));
  CallService call;
  std::memcpy(&call.service, &bytes[1], sizeof call.service);
  std::memcpy(&call.call, &bytes[5], sizeof call.call);
  call.payload = bytes.substr(kFixed + length);
  return call;
}

}  // namespace mimesis::view
