#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "common/json_text.h"
#include "nodes/camera/source/v4l2.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using camera::CameraInfo;
using camera::CameraMode;
using nlohmann::ordered_json;

struct Options {
  std::vector<std::string> devices;
  bool json = false;
};

/// /dev/video0, /dev/video1, .. in the order of their numbers.
std::vector<std::string> all_devices() {
  const auto number = [](const std::string& name) { return std::stoi(name.substr(10)); };
  std::vector<std::string> found;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", ignored)) {
    const std::string name = entry.path().string();
    const std::string digits = name.starts_with("/dev/video") ? name.substr(10) : "";
    if (!digits.empty() && digits.size() < 6 && std::ranges::all_of(digits, ::isdigit)) {
      found.push_back(name);
    }
  }
  std::ranges::sort(found, {}, number);
  return found;
}

std::string size_text(const CameraMode& mode) {
  if (mode.width == 0) return "not listed";
  if (mode.most_width == 0) return fmt::format("{}x{}", mode.width, mode.height);
  return fmt::format("{}x{} to {}x{}", mode.width, mode.height, mode.most_width, mode.most_height);
}

ordered_json json_of(const std::string& device, const CameraInfo& info) {
  ordered_json modes = ordered_json::array(), controls = modes;
  for (const CameraMode& m : info.modes) {
    modes.push_back({{"format", m.fourcc},
                     {"is_read", camera::format_of(m.fourcc).has_value()},
                     {"width_px", m.width},
                     {"height_px", m.height},
                     {"most_width_px", m.most_width},
                     {"most_height_px", m.most_height},
                     {"rate_hz", m.rate_hz}});
  }
  for (const camera::CameraControl& c : info.controls) {
    controls.push_back({{"name", c.name},
                        {"min", c.least},
                        {"max", c.most},
                        {"step", c.step},
                        {"default", c.usual},
                        {"value", c.value}});
  }
  return {{"device", device},
          {"card", info.card},
          {"driver", info.driver},
          {"modes", modes},
          {"controls", controls}};
}

void print(const std::string& device, const CameraInfo& info) {
  const bool colour = use_colour(STDOUT_FILENO);
  std::cout << fmt::format("{}: {} ({})\n", device, printable(info.card), printable(info.driver));
  TextTable modes({"FORMAT", "READ", "SIZE", "MOST HZ"});
  for (const CameraMode& m : info.modes) {
    modes.row({printable(m.fourcc), camera::format_of(m.fourcc) ? "yes" : "no", size_text(m),
               m.rate_hz > 0.0 ? fmt::format("{:g}", m.rate_hz) : "?"});
  }
  modes.print(std::cout, colour);
  if (info.controls.empty()) return;
  TextTable controls({"CONTROL", "VALUE", "MIN", "MAX", "DEFAULT"});
  for (const camera::CameraControl& c : info.controls) {
    controls.row({printable(c.name), std::to_string(c.value), std::to_string(c.least),
                  std::to_string(c.most), std::to_string(c.usual)});
  }
  controls.print(std::cout, colour);
}

int list(const Options& o) {
  constexpr int kNoCamera = 3;
  const bool named = !o.devices.empty();
  const std::vector<std::string> devices = named ? o.devices : all_devices();
  ordered_json all = ordered_json::array();
  int found = 0, refused = 0;
  for (const std::string& device : devices) {
    const auto info = camera::describe_camera(device);
    if (!info) {  // a camera has more devices than one: of a plain list only cameras count
      if (named) std::cerr << printable(device) << ": " << info.error().reason << '\n';
      refused += named ? 1 : 0;
      continue;
    }
    ++found;
    if (o.json) {
      all.push_back(json_of(device, *info));
    } else {
      print(device, *info);
    }
  }
  if (o.json) std::cout << json_text(all) << '\n';
  if (found == 0 && !named) std::cerr << "no camera among /dev/video*\n";
  return found == 0 || refused > 0 ? kNoCamera : 0;
}

}  // namespace

void add_camera(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("camera", "Cameras of this computer");
  verb->require_subcommand(1);
  auto o = std::make_shared<Options>();
  CLI::App* sub = verb->add_subcommand("list", "Formats, sizes, rates and controls of cameras");
  sub->add_option("DEVICE...", o->devices, "Such as /dev/video0; otherwise all");
  sub->add_flag("--json", o->json, "A list with one object for each camera");
  sub->footer(
      "A format that is read can be chosen: mimesis_camera --set format=MJPG (any: the camera "
      "node\n"
      "takes a raw one that reaches rate_hz, else MJPG).\n"
      "Exit codes: 0 done, 2 usage, 3 no camera there.\nExamples:\n"
      "  mimesis camera list\n"
      "  mimesis camera list /dev/video2 --json");
  sub->callback([o, &exit_code] { exit_code = list(*o); });
}

}  // namespace mimesis::tool
