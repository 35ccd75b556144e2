// `mimesis hw scan|sdo`: requests to the nodes of a bus.
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "common/json_text.h"
#include "common/runtime/raw.h"
#include "common/runtime/value_text.h"
#include "hw/cia402/cia402.h"
#include "tools/mimesis/hw/hw_tools.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

namespace can = hw::can;
namespace cia402 = hw::cia402;
using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;

/// Calls `take(frame)` for what arrives, until it returns true or `until` has passed.
template <class Take>
bool listen(can::Bus& bus, Clock::time_point until, const Take& take) {
  std::array<can::Frame, 64> frames;
  for (;;) {
    const std::size_t count = bus.receive(frames);
    for (const can::Frame& frame : std::span(frames).first(count)) {
      if (take(frame)) return true;
    }
    if (Clock::now() >= until) return false;
    if (count == 0) poll(nullptr, 0, 1);
  }
}

std::string text_of(const std::vector<std::uint8_t>& data) {
  return printable(std::string(data.begin(), data.end()));
}

std::uint32_t number_of(const std::vector<std::uint8_t>& data) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(4, data.size()); ++i)
    value |= std::uint32_t{data[i]} << 8 * i;
  return value;
}

const char* nmt_name(int state) {
  switch (state) {
    case 0:
      return "boot-up";
    case 4:
      return "stopped";
    case 5:
      return "operational";
    case 127:
      return "pre-operational";
    default:
      return "unknown";
  }
}

/// Bytes and sign of a type; 0 bytes: text.
struct TypeOf {
  int bytes;
  bool is_signed;
};
TypeOf type_of(const std::string& name) {
  static const std::map<std::string, TypeOf> kTypes{
      {"u8", {1, false}}, {"u16", {2, false}}, {"u32", {4, false}}, {"i8", {1, true}},
      {"i16", {2, true}}, {"i32", {4, true}},  {"text", {0, false}}};
  return kTypes.at(name);
}

std::vector<std::uint8_t> bytes_of(const HwOptions& options) {
  if (options.type.empty()) throw ConfigError("--type: expected the object's type to write it");
  const TypeOf type = type_of(options.type);
  if (type.bytes == 0) return {options.value.begin(), options.value.end()};
  char* end = nullptr;
  const long long value = std::strtoll(options.value.c_str(), &end, 0);
  const long long most = (1LL << (8 * type.bytes - (type.is_signed ? 1 : 0))) - 1;
  const long long least = type.is_signed ? -most - 1 : 0;
  if (options.value.empty() || *end != '\0' || value < least || value > most) {
    throw ConfigError(
        fmt::format("VALUE '{}': expected {}, {} to {}", options.value, options.type, least, most));
  }
  std::vector<std::uint8_t> data;
  for (int i = 0; i < type.bytes; ++i) data.push_back(static_cast<std::uint8_t>(value >> 8 * i));
  return data;
}

/// Objects of a node that is there; nothing if it lacks one.
std::optional<std::vector<std::uint8_t>> read(can::Bus& bus, int node, cia402::Object object,
                                              const HwOptions& options) {
  const auto done =
      transfer(bus, cia402::SdoTransfer::upload(node, object), milliseconds(options.timeout_s));
  if (!done.failure().empty()) return std::nullopt;
  return done.data();
}

}  // namespace

cia402::Object object_of(const std::string& text) {
  unsigned index = 0, sub = 0;
  int end = 0;
  const bool whole = (std::sscanf(text.c_str(), "%4x%n", &index, &end) == 1 &&
                      static_cast<std::size_t>(end) == text.size()) ||
                     (std::sscanf(text.c_str(), "%4x:%2x%n", &index, &sub, &end) == 2 &&
                      static_cast<std::size_t>(end) == text.size());
  if (!whole) throw ConfigError("OBJECT '" + text + "': expected hexadecimal 6041 or 607D:02");
  return {static_cast<std::uint16_t>(index), static_cast<std::uint8_t>(sub)};
}

std::unique_ptr<can::Bus> open_bus(const std::string& address, const GraphOptions& options) {
  can::check_address(address);
  return can::open(address, runtime::graph_directory(chosen_graph(options)));
}

cia402::SdoTransfer transfer(can::Bus& bus, cia402::SdoTransfer transfer,
                             std::chrono::milliseconds timeout) {
  bus.send(std::array{transfer.first()});
  const bool ended = listen(bus, Clock::now() + timeout, [&](const can::Frame& frame) {
    if (const auto next = transfer.handle(frame)) bus.send(std::array{*next});
    return transfer.done();
  });
  if (ended) return transfer;
  throw VerbFailure{
      fmt::format("node {} did not answer within {} s", cia402::identify(transfer.first()).node,
                  1e-3 * static_cast<double>(timeout.count())),
      kNotFound};
}

int hw_scan(const HwOptions& options) {
  const auto bus = open_bus(options.bus, options);
  struct Found {
    std::uint32_t type = 0;
    std::optional<int> nmt{};
  };
  std::map<int, Found> found;
  std::map<int, int> heartbeats;
  const auto take = [&](const can::Frame& frame) {
    const cia402::Identity id = cia402::identify(frame);
    if (id.kind == cia402::Identity::Kind::heartbeat && frame.length == 1)
      heartbeats[id.node] = frame.data[0];
    if (id.kind != cia402::Identity::Kind::sdo_response) return false;
    const cia402::Sdo answer = cia402::parse_sdo_response(frame);
    const bool of_type = answer.object == cia402::object::kDeviceType;
    if (of_type)
      found[id.node].type = answer.kind == cia402::Sdo::Kind::uploaded ? answer.value : 0;
    return false;
  };
  constexpr int kAtOnce = 8;  // requests, so that a loaded bus goes on
  for (int node = 1; node <= cia402::kLastNode; ++node) {
    bus->send(std::array{cia402::sdo_upload(node, cia402::object::kDeviceType)});
    if (node % kAtOnce == 0) listen(*bus, Clock::now() + std::chrono::milliseconds(2), take);
  }
  listen(*bus, Clock::now() + milliseconds(options.timeout_s), take);
  Json list = Json::array();
  TextTable table({"NODE", "DEVICE", "NAME", "DRIVE", "NETWORK"});
  for (auto& [node, f] : found) {
    const bool drive = (f.type & 0xFFFF) == 402;
    const auto name = read(*bus, node, {0x1008, 0}, options);
    std::string state = "-";
    if (drive) {
      const auto word = read(*bus, node, cia402::object::kStatusword, options);
      if (word)
        state = hw::name(cia402::decode_statusword(static_cast<std::uint16_t>(number_of(*word))));
    }
    const std::string device = drive ? "CiA 402 drive" : fmt::format("profile {}", f.type & 0xFFFF);
    const std::string called = name ? text_of(*name) : "-";
    const std::string network =
        heartbeats.contains(node) ? nmt_name(heartbeats[node]) : "no heartbeat";
    list.push_back({{"node", node},
                    {"device_type", f.type},
                    {"name", called},
                    {"state", state},
                    {"network", network}});
    table.row({std::to_string(node), device, called, state, network});
  }
  if (options.json) {
    std::cout << json_text(list) << '\n';
  } else if (!found.empty()) {
    table.print(std::cout, use_colour(STDOUT_FILENO));
  }
  if (!found.empty()) return 0;
  std::cerr << fmt::format("nobody answers on {} within {:.3g} s\n", options.bus,
                           options.timeout_s);
  return kNotFound;
}

namespace {

/// Objects that stop a drive whose master is lost, or that does not follow. The bridge writes them
/// before it enables the drive, and counts on them.
bool protects(const cia402::Object& object) {
  constexpr std::array<std::uint16_t, 10> kProtection{0x100C, 0x100D, 0x1016, 0x1017, 0x1029,
                                                      0x6007, 0x605A, 0x605E, 0x6065, 0x6066};
  return std::ranges::count(kProtection, object.index) > 0 ||
         (object.index == 0x1400 && object.sub == 5);
}

/// Beside a bridge that runs, a write changes what it has set. @throws ConfigError
void respect_protection(const HwOptions& options, const cia402::Object& object) {
  const std::string graph = options.graph.empty() ? runtime::graph_name() : options.graph;
  std::string bridge;
  for (const v1::NodeInfo& node : runtime::GraphView(graph).nodes()) {
    for (const v1::ServiceInfo& service : node.services()) {
      if (service.service() == node.name() + "/enable") bridge = node.name();
    }
  }
  if (bridge.empty()) return;
  if (protects(object) && !options.force) {
    throw ConfigError(fmt::format(
        "hw sdo: {} protects the drive when its master is lost or it does not follow, and node {} "
        "counts on it: --force writes it all the same",
        cia402::text(object), bridge));
  }
  std::cerr << fmt::format("hw sdo: node {} of graph {} may be moving this drive\n", bridge, graph);
}

}  // namespace

int hw_sdo(const HwOptions& options) {
  const cia402::Object object = object_of(options.object);
  const bool writes = !options.value.empty();
  if (writes) respect_protection(options, object);
  const auto bus = open_bus(options.bus, options);
  const auto done =
      transfer(*bus,
               writes ? cia402::SdoTransfer::download(options.node, object, bytes_of(options))
                      : cia402::SdoTransfer::upload(options.node, object),
               milliseconds(options.timeout_s));
  if (!done.failure().empty()) {
    throw VerbFailure{
        fmt::format("node {}: {}: {}", options.node, cia402::text(object), done.failure()), 1};
  }
  const std::vector<std::uint8_t>& data = done.data();
  const bool number = options.type.empty() ? data.size() <= 4 : options.type != "text";
  const bool is_signed = !options.type.empty() && type_of(options.type).is_signed;
  const int unused =
      32 - 8 * static_cast<int>(std::min<std::size_t>(4, std::max<std::size_t>(1, data.size())));
  const std::uint32_t bits = number_of(data);
  const std::int64_t value =
      is_signed ? std::int64_t{static_cast<std::int32_t>(bits << unused) >> unused} : bits;
  if (options.json) {
    Json out{{"node", options.node}, {"object", cia402::text(object)}, {"bytes", data.size()}};
    if (number)
      out["value"] = value;
    else
      out["value"] = text_of(data);
    std::cout << json_text(out) << '\n';
  } else if (!writes) {
    std::cout << (number ? fmt::format("{} (0x{:0{}X})", value, bits, 2 * data.size())
                         : text_of(data))
              << '\n';
  }
  return 0;
}

}  // namespace mimesis::tool
