#include "tools/mimesis/hw/bus_watch.h"

#include <fmt/format.h>

#include <utility>

#include "hw/can/bus.h"
#include "hw/cia402/cia402.h"

namespace mimesis::tool {

namespace can = hw::can;
namespace cia402 = hw::cia402;

std::string candump_line(const can::Frame& frame, hw::Time stamp, const std::string& bus) {
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(stamp).count();
  const bool wide = (frame.id & (can::kExtendedFlag | can::kErrorFlag)) != 0;
  const std::uint32_t id = frame.id & (wide ? 0x3FFFFFFFu & ~can::kRemoteFlag : 0x7FFu);
  std::string line =
      fmt::format("({}.{:06}) {} {:0{}X}#", us / 1'000'000, us % 1'000'000, bus, id, wide ? 8 : 3);
  if ((frame.id & can::kRemoteFlag) != 0) return line + "R";
  const bool fd = frame.length > 8 || (frame.flags & can::kFd) != 0;
  if (fd) line += fmt::format("#{:X}", frame.flags & 0xFu);
  for (std::size_t i = 0; i < frame.length; ++i) line += fmt::format("{:02X}", frame.data[i]);
  return line;
}

void BusWatch::observe(const can::Frame& frame) {
  if ((frame.id & can::kErrorFlag) != 0) {
    ++error_frames_;
    bus_off_ = bus_off_ || (frame.id & can::kBusOff) != 0;
    return;
  }
  ++frames_;
  bits_ += static_cast<std::uint64_t>(can::worst_bits(std::min<int>(frame.length, 8)));
  using Kind = cia402::Identity::Kind;
  const cia402::Identity id = cia402::identify(frame);
  if (id.kind == Kind::sync) ++syncs_;
  // Requests and set-points are the master's; they alone make no node.
  const bool from_node = id.kind == Kind::heartbeat || id.kind == Kind::tpdo ||
                         id.kind == Kind::emergency || id.kind == Kind::sdo_response;
  if (id.kind == Kind::rpdo && id.n == 1) {
    const auto found = nodes_.find(id.node);
    if (found != nodes_.end()) found->second.node.target = cia402::signed_at(frame, 2, 4);
  }
  if (!from_node) return;
  Node& node = nodes_[id.node].node;
  node.id = id.node;
  ++node.frames;
  if (id.kind == Kind::heartbeat && frame.length == 1) node.nmt = frame.data[0];
  if (id.kind == Kind::emergency) {
    const auto code = static_cast<std::uint16_t>(cia402::unsigned_at(frame, 0, 2).value_or(0));
    node.emergency = code == 0 ? "" : cia402::emergency_text(code);
  }
  if (id.kind == Kind::tpdo && id.n == 1) {
    const auto status = cia402::unsigned_at(frame, 0, 2);
    if (status) node.statusword = static_cast<std::uint16_t>(*status);
    if (status) node.state = cia402::decode_statusword(node.statusword);
    if (const auto position = cia402::signed_at(frame, 2, 4)) node.position = position;
    node.torque = cia402::signed_at(frame, 6, 2).value_or(0);
  }
  if (id.kind == Kind::sdo_response && temperature_) {
    const cia402::Sdo answer = cia402::parse_sdo_response(frame);
    if (answer.kind == cia402::Sdo::Kind::uploaded && answer.object == *temperature_)
      node.temperature = cia402::signed_at(frame, 4, answer.bytes);
  }
  if (id.kind == Kind::tpdo && id.n == 2) node.velocity = cia402::signed_at(frame, 0, 4);
}

void BusWatch::close_interval(double seconds) {
  const auto rate = [&](std::uint64_t& count) {
    return static_cast<double>(std::exchange(count, 0)) / seconds;
  };
  frames_s_ = rate(frames_);
  syncs_s_ = rate(syncs_);
  bits_s_ = rate(bits_);
  for (auto& [id, seen] : nodes_) {
    seen.node.frames_s = static_cast<double>(seen.node.frames - seen.before) / seconds;
    seen.before = seen.node.frames;
  }
}

std::vector<BusWatch::Node> BusWatch::nodes() const {
  std::vector<Node> all;
  for (const auto& [id, seen] : nodes_) all.push_back(seen.node);
  return all;
}

}  // namespace mimesis::tool
