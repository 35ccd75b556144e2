// `mimesis hw check`: drives beside their descriptions (EDS, DCF).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/runtime/param_source.h"
#include "hw/cia402/cia402.h"
#include "hw/cia402/eds.h"
#include "tools/mimesis/hw/hw_tools.h"

namespace mimesis::tool {
namespace {

namespace cia402 = hw::cia402;
using Json = nlohmann::ordered_json;
using Kind = cia402::EdsFinding::Kind;

cia402::Eds load_eds(const std::string& file, int node) {
  const std::string path = runtime::find_model_file(file);
  std::ifstream in(path, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  if (!in) throw ConfigError(path + ": cannot be read");
  return {text.str(), file, node};
}

std::vector<cia402::SetupStep> steps_of(const hw::Machine& machine, std::size_t joint) {
  const hw::JointLimits& l = machine.joints.limits;
  const auto k = static_cast<Eigen::Index>(joint);
  return cia402::setup_steps(
      machine.axes[joint],
      {.q_min = l.q_min[k],
       .q_max = l.q_max[k],
       .v_max = l.v_max[k],
       .a_max = l.a_max[k],
       .mode = cia402::stream_mode(machine.axes[joint])},
      cia402::period_of(machine.joints.rate_hz),
      machine.joints.walks ? cia402::QuickStop::stays_powered : cia402::QuickStop::disables);
}

/// What a drive answers for an object: its number, or nothing if it says that it has none.
struct Answer {
  std::optional<std::uint32_t> value;
  std::string failure;
};
Answer ask(hw::can::Bus& bus, int node, cia402::Object object, double timeout_s) {
  const auto done = transfer(bus, cia402::SdoTransfer::upload(node, object),
                             std::chrono::milliseconds(std::lround(1e3 * timeout_s)));
  if (!done.failure().empty()) return {std::nullopt, done.failure()};
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(4, done.data().size()); ++i)
    value |= std::uint32_t{done.data()[i]} << 8 * i;
  return {value, ""};
}

/// A drive on its bus against its description: who it is, and which objects it has.
std::vector<cia402::EdsFinding> compare_drive(hw::can::Bus& bus, int node, const cia402::Eds& eds,
                                              const std::vector<cia402::SetupStep>& steps,
                                              double timeout_s) {
  constexpr std::array<const char*, 3> kWho{"vendor", "product", "revision"};
  std::vector<cia402::EdsFinding> out;
  for (int sub = 1; sub <= 3; ++sub) {
    const auto expected = eds.identity(sub);
    if (!expected) continue;
    const Answer is = ask(bus, node, {0x1018, static_cast<std::uint8_t>(sub)}, timeout_s);
    if (is.value == expected) continue;
    out.push_back({sub == 3 ? Kind::warning : Kind::unusable,
                   fmt::format("1018:{:02X} ({}): the drive says {}, its file {:#x}", sub,
                               kWho.at(static_cast<std::size_t>(sub - 1)),
                               is.value ? fmt::format("{:#x}", *is.value) : is.failure, *expected),
                   ""});
  }
  std::map<std::string, cia402::Object> asked;
  for (const cia402::SetupStep& step : steps) asked.emplace(text(step.object), step.object);
  for (const auto& [name, object] : asked) {
    if (!eds.find(object)) continue;
    const Answer is = ask(bus, node, object, timeout_s);
    if (!is.value)
      out.push_back({Kind::warning, name + ": its file has it, the drive says: " + is.failure, ""});
  }
  return out;
}

}  // namespace

DriveCheck check_drives(const hw::Machine& machine, const HwOptions& options) {
  DriveCheck out;
  std::size_t joint = 0;
  for (const hw::BusShare& share : machine.buses) {
    std::unique_ptr<hw::can::Bus> bus;
    for (const std::size_t end = joint + static_cast<std::size_t>(share.joints); joint < end;
         ++joint) {
      const std::string& file = machine.eds[joint];
      if (file.empty()) continue;
      const cia402::Axis& axis = machine.axes[joint];
      const cia402::Eds eds = load_eds(file, axis.node_id);
      const auto steps = steps_of(machine, joint);
      DriveCheck::Drive drive{machine.joints.names[joint], file, eds.device("ProductName"), {}};
      drive.found = cia402::lacks_of(eds, steps);
      if (options.drives) {
        if (!bus) bus = open_bus(share.can, options);
        const auto more = compare_drive(*bus, axis.node_id, eds, steps, options.timeout_s);
        drive.found.insert(drive.found.end(), more.begin(), more.end());
      }
      const bool good = std::ranges::all_of(
          drive.found, [](const auto& each) { return each.kind == Kind::warning; });
      out.usable = out.usable && good;
      out.drives.push_back(std::move(drive));
    }
  }
  return out;
}

Json as_json(const DriveCheck& check) {
  constexpr std::array<const char*, 3> kKinds{"unusable", "accept", "warning"};
  Json out = Json::array();
  for (const DriveCheck::Drive& drive : check.drives) {
    Json found = Json::array();
    for (const cia402::EdsFinding& each : drive.found) {
      found.push_back({{"kind", kKinds.at(static_cast<std::size_t>(each.kind))},
                       {"what", each.text},
                       {"accept", each.word}});
    }
    out.push_back(
        {{"name", drive.name}, {"eds", drive.file}, {"product", drive.product}, {"found", found}});
  }
  return out;
}

void print(const DriveCheck& check) {
  for (const DriveCheck::Drive& drive : check.drives) {
    std::cout << fmt::format("{}: {}{}\n", drive.name, drive.file,
                             drive.product.empty() ? "" : " (" + drive.product + ")");
    std::string words;
    for (const cia402::EdsFinding& each : drive.found) {
      std::cout << (each.kind == Kind::warning ? "  warning: " : "  not enabled: ") << each.text
                << '\n';
      if (!each.word.empty() && words.find(each.word) == words.npos)
        words += (words.empty() ? "" : ", ") + each.word;
    }
    if (!words.empty())
      std::cout << fmt::format("  `accept: [{}]` of its joint uses it without\n", words);
    if (drive.found.empty()) std::cout << "  has all that the bridge sets up\n";
  }
}

}  // namespace mimesis::tool
