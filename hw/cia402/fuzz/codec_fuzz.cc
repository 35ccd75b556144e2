// Any bytes as frames, to everything that reads frames: the bridge's side of a drive, an SDO
// client, a simulated drive, PowerCube's answers and modules; as registers of a hand, as datagrams
// of python-can, as lines of a serial adapter, as the text of an EDS. The first byte chooses, or
// MIMESIS_CODEC=NAME. `MIMESIS_CODEC=slcan hw_codec_fuzz CORPUS -max_total_time=600`. corpus.txt
// holds what was found:
//   while read reader hex; do
//     mkdir -p $reader; echo $hex | xxd -r -p > $reader/${hex:0:60}; done < corpus.txt
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string_view>
#include <utility>

#include "common/error.h"
#include "hw/can/bus.h"
#include "hw/cia402/axis_master.h"
#include "hw/cia402/canopen.h"
#include "hw/cia402/eds.h"
#include "hw/modbus/hand_profile.h"
#include "hw/powercube/protocol.h"
#include "hw/sim/cia402/drive.h"
#include "hw/sim/powercube/module.h"

namespace mimesis::hw {
namespace {

using namespace std::chrono_literals;

void demand(bool good) {
  if (!good) std::abort();
}

/// Ten bytes a frame: two of the identifier, one of the length, up to eight of data, of which the
/// last may be missing.
class Frames {
 public:
  explicit Frames(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  bool next(can::Frame& frame) {
    if (bytes_.size() < 4) return false;
    frame = {};
    frame.id = static_cast<std::uint32_t>(bytes_[0] | (bytes_[1] & 0x7) << 8);
    if ((bytes_[1] & 0x80) != 0) frame.id |= can::kErrorFlag;
    frame.length = bytes_[2] % 9;
    bytes_ = bytes_.subspan(3);
    const std::size_t count = std::min<std::size_t>(frame.length, bytes_.size());
    std::copy_n(bytes_.begin(), count, frame.data.begin());
    bytes_ = bytes_.subspan(count);
    return true;
  }

 private:
  std::span<const std::uint8_t> bytes_;
};

void master(std::span<const std::uint8_t> bytes) {
  Frames frames(bytes);
  const cia402::Axis axis{.node_id = 5, .stop_bit = 3};
  cia402::AxisMaster master(
      "A1", axis,
      cia402::setup_steps(axis, {.q_min = -1, .q_max = 1, .v_max = 1, .a_max = 1}, {5, -3}));
  Time now = 1s;
  std::vector<can::Frame> out;
  for (can::Frame frame; frames.next(frame); now += 5ms) {
    const cia402::Identity id = cia402::identify(frame);
    if (id.node == 5) master.handle(id, frame, now);
    out.clear();
    master.advance(now, out);
    demand(out.size() <= 1);
    demand(master.command().length <= 8);
    demand(std::isfinite(master.reading().position_rad) &&
           std::isfinite(master.reading().velocity_rad_s));
    if (!master.failure().empty()) master.restart();
  }
  (void)master.complaint(DriveState::operation_enabled);
}

/// A drive that answers each access to an object: done, aborted or with a value, as five bytes say.
void setup(std::span<const std::uint8_t> bytes) {
  const cia402::Axis axis{.node_id = 5, .stop_bit = 3};
  cia402::AxisMaster master(
      "A1", axis,
      cia402::setup_steps(axis, {.q_min = -1, .q_max = 1, .v_max = 1, .a_max = 1}, {5, -3}));
  Time now = 1s;
  std::vector<can::Frame> requests;
  for (; bytes.size() >= 5 && !master.configured(); now += 200ms) {
    requests.clear();
    master.advance(now, requests);
    if (!master.failure().empty()) {  // too many answers that were none
      master.restart();
      continue;
    }
    demand(requests.size() == 1);
    constexpr std::array<std::uint8_t, 3> kKinds{0x60, 0x80, 0x43};
    can::Frame answer = requests.front();
    answer.id = 0x585;
    answer.data[0] = kKinds.at(bytes[0] % kKinds.size());
    std::copy_n(bytes.begin() + 1, 4, answer.data.begin() + 4);
    bytes = bytes.subspan(5);
    master.handle(cia402::identify(answer), answer, now);
    demand(master.command().length <= 8);
    if (!master.failure().empty()) master.restart();
  }
}

void client(std::span<const std::uint8_t> bytes) {
  Frames frames(bytes);
  auto transfer = cia402::SdoTransfer::upload(5, {0x1008, 0});
  auto sends = cia402::SdoTransfer::download(5, {0x2000, 0}, std::vector<std::uint8_t>(20, 7));
  for (can::Frame frame; frames.next(frame);) {
    for (auto* t : {&transfer, &sends}) {
      if (const auto next = t->handle(frame)) demand(next->length == 8 && next->id == 0x605);
    }
  }
  demand(transfer.data().size() <= (1u << 16) + 7);
}

void drive(std::span<const std::uint8_t> bytes) {
  Frames frames(bytes);
  sim::Drive drive({.axis = {.node_id = 5}});
  Time now = 1s;
  std::vector<can::Frame> out;
  for (can::Frame frame; frames.next(frame); now += 1ms) {
    out.clear();
    drive.advance(now, out);
    drive.handle(frame, out);
    for (const can::Frame& f : out) demand(f.length <= 8 && (f.id & ~0x7FFu) == 0);
    demand(std::isfinite(drive.position_rad()) && std::isfinite(drive.velocity_rad_s()));
  }
}

void hand(std::span<const std::uint8_t> bytes) {
  static const modbus::HandProfile profile = modbus::load_hand_profile("hands/robotiq_3f.yaml");
  modbus::HandRegisters registers;
  for (std::size_t i = 0; i + 1 < bytes.size() && i < 16; i += 2)
    registers[2000 + static_cast<int>(i / 2)] =
        static_cast<std::uint16_t>(bytes[i] << 8 | bytes[i + 1]);
  const modbus::HandReading reading =
      modbus::to_reading(profile, registers, modbus::HandMode::basic);
  demand(reading.closure >= 0.0 && reading.closure <= 1.0);
  demand(!reading.active || reading.fault.empty());
  (void)modbus::contradiction(profile, registers);
  const auto written = modbus::to_registers(profile, {.move = true, .closure = 1.0}, registers);
  demand(written.size() == 8 &&
         (written.at(1000) >> 11 & 1) == (is_ready(profile, registers) ? 1 : 0));
}

void powercube_answers(std::span<const std::uint8_t> bytes) {
  Frames frames(bytes);
  for (can::Frame frame; frames.next(frame);) {
    const auto answer = powercube::parse_answer(frame);
    if (answer) demand(answer->module >= 1 && answer->module <= powercube::kLastModule);
  }
}

void powercube_module(std::span<const std::uint8_t> bytes) {
  Frames frames(bytes);
  sim::Module module({.module = 5});
  Time now = 1s;
  std::vector<can::Frame> out;
  for (can::Frame frame; frames.next(frame); now += 1ms) {
    out.clear();
    module.advance(now);
    module.handle(frame, out);
    for (const can::Frame& f : out) demand(f.length <= 8 && (f.id & ~0x7FFu) == 0);
    demand(std::isfinite(module.position_rad()) && std::isfinite(module.velocity_rad_s()));
  }
}

/// Whatever can be read can be written, and then reads the same.
void slcan(std::span<const std::uint8_t> bytes) {
  const auto frame = can::from_line({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  if (!frame) return;
  (void)can::trouble(*frame);
  std::string out;
  if (!can::to_line(*frame, out)) return demand((frame->id & can::kErrorFlag) != 0);
  out.pop_back();
  demand(can::from_line(out) == frame);
}

/// A description that is taken can be asked for all that a drive needs, or refuses by its line.
void eds(std::span<const std::uint8_t> bytes) {
  static const auto steps = cia402::setup_steps(
      {.node_id = 5, .stop_bit = 3}, {.q_min = -1, .q_max = 1, .v_max = 1, .a_max = 1}, {5, -3});
  try {
    const cia402::Eds described({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, "eds",
                                5);
    for (const int sub : {1, 2, 3}) (void)described.identity(sub);
    for (const cia402::EdsFinding& each : cia402::lacks_of(described, steps))
      demand(!each.text.empty() &&
             (each.kind == cia402::EdsFinding::Kind::accept) != each.word.empty());
  } catch (const ConfigError& refused) {
    demand(std::string_view(refused.what()).starts_with("eds:"));
  }
}

using Codec = void (*)(std::span<const std::uint8_t>);
constexpr std::array<std::pair<std::string_view, Codec>, 9> kCodecs{
    {{"master", master},
     {"client", client},
     {"drive", drive},
     {"hand", hand},
     {"powercube", powercube_answers},
     {"module", powercube_module},
     {"slcan", slcan},
     {"setup", setup},
     {"eds", eds}}};

Codec chosen() {
  const char* name = std::getenv("MIMESIS_CODEC");
  if (name == nullptr) return nullptr;
  for (const auto& [known, codec] : kCodecs) {
    if (known == name) return codec;
  }
  std::fprintf(stderr, "MIMESIS_CODEC=%s is not known\n", name);
  std::exit(2);
}

}  // namespace
}  // namespace mimesis::hw

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace mimesis::hw;
  static const Codec only = chosen();
  if (size == 0) return 0;
  const std::span bytes(data, size);
  only != nullptr ? only(bytes) : kCodecs[data[0] % kCodecs.size()].second(bytes.subspan(1));
  return 0;
}
