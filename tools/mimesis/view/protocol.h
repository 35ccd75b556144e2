#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <variant>
#include <vector>

// The Foxglove WebSocket protocol as a server speaks it: texts are JSON with "op", binary messages
// an opcode and little-endian numbers. Pure: bytes in, bytes out.
namespace mimesis::view {

/// Subprotocols, the preferred one first: the second is the older name of the same.
inline constexpr std::array<std::string_view, 2> kSubprotocols{"foxglove.sdk.v1",
                                                               "foxglove.websocket.v1"};

struct Channel {
  std::uint32_t id = 0;  ///< stands for the same topic and type as long as the server runs
  std::string topic, type;
  std::string descriptors;  ///< serialised FileDescriptorSet
  bool latched = false;     ///< its last message goes to whoever comes later
  bool operator==(const Channel&) const = default;
};

/// A request or response of a service.
struct Half {
  std::string type, descriptors;
  bool operator==(const Half&) const = default;
};
struct Service {
  std::uint32_t id = 0;
  std::string name;
  Half request, response;
  bool operator==(const Service&) const = default;
};

/// Who publishes, listens and serves: node names by topic or service.
struct Connections {
  std::map<std::string, std::set<std::string>> published, subscribed, services;
  bool operator==(const Connections&) const = default;
};

struct Parameter {
  std::string name;      ///< NODE.KEY
  nlohmann::json value;  ///< null: there is none of this name
};

enum class Level { info, warning, error };

// Messages of the server.
std::string server_info(std::string_view name, std::string_view session,
                        const std::map<std::string, std::string>& metadata, bool may_change);
std::string advertise(std::span<const Channel> channels);
std::string unadvertise(std::span<const std::uint32_t> channels);
std::string advertise_services(std::span<const Service> services);
std::string unadvertise_services(std::span<const std::uint32_t> services);
/// All of `now`, and what of `before` is no more.
std::string connection_graph(const Connections& now, const Connections& before);
std::string parameter_values(std::span<const Parameter> parameters, const std::string& request);
std::string status(Level level, std::string_view message, std::string_view id = {});
std::string service_failure(std::uint32_t service, std::uint32_t call, std::string_view why);
std::string service_answer(std::uint32_t service, std::uint32_t call, std::string_view payload);
std::string time(std::uint64_t ns);
/// Header before the payload of a message.
using MessageHeader = std::array<char, 13>;
MessageHeader message_header(std::uint32_t subscription, std::uint64_t ns);

// Messages of a client.
struct Subscribe {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> subscriptions;  ///< id, channel
};
struct Unsubscribe {
  std::vector<std::uint32_t> subscriptions;
};
struct GetParameters {
  std::vector<std::string> names;  ///< empty: all
  std::string request;             ///< repeated in the answer
};
struct SetParameters {
  std::vector<Parameter> parameters;
  std::string request;
};
struct WatchParameters {
  std::vector<std::string> names;
  bool on = true;
};
struct WatchConnections {
  bool on = true;
};
struct CallService {
  std::uint32_t service = 0, call = 0;
  std::string payload;
};
using Request = std::variant<Subscribe, Unsubscribe, GetParameters, SetParameters, WatchParameters,
                             WatchConnections, CallService>;

/// Or why it is none that this server answers: a line for the client.
tl::expected<Request, std::string> parse_text(std::string_view text);
tl::expected<Request, std::string> parse_binary(std::string_view bytes);

}  // namespace mimesis::view
