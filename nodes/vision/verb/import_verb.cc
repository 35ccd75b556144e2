// `mimesis calibrate import`.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/error.h"
#include "common/json_text.h"
#include "common/model/rig_file.h"
#include "common/runtime/value_text.h"
#include "nodes/vision/verb/calibrate_tools.h"
#include "nodes/vision/verb/foreign_calibration.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

struct ImportArguments : ImportOptions {
  std::vector<std::string> files;
  std::string size, out;
  bool json = false;
};

ForeignFile foreign_file(const std::string& name) {
  constexpr std::streamsize kMost = 4 << 20;
  std::ifstream in(name, std::ios::binary);
  std::string text(kMost + 1, '\0');
  in.read(text.data(), kMost + 1);
  if (in.bad() || in.gcount() == 0) throw ConfigError(name + ": cannot be read, or is empty");
  if (in.gcount() > kMost) throw ConfigError(name + ": more than 4 MiB, no calibration");
  text.resize(static_cast<std::size_t>(in.gcount()));
  return {name, std::move(text)};
}

void read_size(ImportArguments& arguments) {
  if (arguments.size.empty()) return;
  const std::size_t x = arguments.size.find('x');
  const auto width = runtime::to_int(arguments.size.substr(0, x));
  const auto height =
      x == std::string::npos ? std::nullopt : runtime::to_int(arguments.size.substr(x + 1));
  if (!width || !height || *width < 8 || *height < 8)
    throw ConfigError("--size: expected WIDTHxHEIGHT, as 640x480, found '" + arguments.size + "'");
  arguments.width_px = *width;
  arguments.height_px = *height;
}

int import(ImportArguments& arguments) {
  if (!model::day_number(arguments.date))
    throw ConfigError("--date: expected YYYY-MM-DD, found '" + arguments.date + "'");
  read_size(arguments);
  std::vector<ForeignFile> files;
  for (const std::string& name : arguments.files) files.push_back(foreign_file(name));
  const Imported imported = import_calibration(files, arguments);
  write_rig(arguments.out, imported.rig);
  nlohmann::ordered_json report{{"kind", imported.kind}, {"cameras", nlohmann::json::array()}};
  for (const image::RigCamera& c : imported.rig.cameras) {
    const Eigen::Vector3d& eye = c.camera.eye();
    nlohmann::ordered_json camera = lens_report(c.name, c.camera.lens());
    camera["position_m"] = {eye.x(), eye.y(), eye.z()};
    report["cameras"].push_back(std::move(camera));
  }
  report["said"] = imported.said;
  report["file"] = arguments.out;
  if (arguments.json) {
    std::cout << json_text(report) << '\n';
    return 0;
  }
  for (const image::RigCamera& c : imported.rig.cameras) {
    const image::Lens& lens = c.camera.lens();
    const Eigen::Vector3d& eye = c.camera.eye();
    std::cout << fmt::format(
        "{}: {}x{}, fx {:.2f} px, fy {:.2f} px, centre ({:.2f}, {:.2f}) px, k1 k2 p1 p2 k3 "
        "({:.5g})\n",
        printable(c.name), lens.width_px, lens.height_px, lens.fx_px, lens.fy_px, lens.cx_px,
        lens.cy_px, fmt::join(lens.distortion, ", "));
    if (&c == &imported.rig.cameras.front()) continue;
    std::cout << fmt::format(
        "  from the first one: {:.4f} m right, {:.4f} m down, {:.4f} m forward\n", eye.x(), eye.y(),
        eye.z());
  }
  for (const std::string& line : imported.said) std::cout << "assumed: " << printable(line) << '\n';
  std::cout << "written: " << arguments.out << " from " << imported.kind << '\n';
  return 0;
}

}  // namespace

void add_import(CLI::App* calibrate, int& exit_code) {
  auto arguments = std::make_shared<ImportArguments>();
  CLI::App* verb = calibrate->add_subcommand(
      "import", "Makes a rig of a calibration by ROS, OpenCV, Kalibr, camodocal or ORB-SLAM");
  verb->add_option(
          "FILE", arguments->files,
          "camera_info (left and right of a pair), OpenCV's YAML or XML (one with R and T, "
          "or two), camchain, settings")
      ->required()
      ->expected(1, 2);
  verb->add_option("-o,--out", arguments->out, "Write the rig to this file")
      ->required()
      ->type_name("RIG");
  verb->add_option("--date", arguments->date,
                   "Day of the calibration: nodes with rig_days refuse images long after it")
      ->required()
      ->type_name("YYYY-MM-DD");
  verb->add_option("--size", arguments->size, "Size of the pictures, where a file does not say it")
      ->type_name("WIDTHxHEIGHT");
  verb->add_option("--unit-m", arguments->unit_m,
                   "Metres that 1 of a translation is: 0.001 of millimetres, the squares' edge of "
                   "squares of 1 [ROS, Kalibr, ORB-SLAM: 1]")
      ->check(number_above_zero)
      ->type_name("M");
  verb->add_option("--lens", arguments->lens, "Of four coefficients, where a file does not say it")
      ->check(CLI::IsMember({"plumb_bob", "equidistant"}));
  verb->add_option("--name", arguments->names,
                   "Names of the cameras in the rig [the file's, or "
                   "camera; left right]")
      ->type_name("NAME");
  verb->add_flag("--json", arguments->json, "One object with all that is printed");
  verb->footer(
      "Exit codes: 0 done, 2 no calibration, one that no rig holds, or usage.\n"
      "Examples:\n"
      "  mimesis calibrate import camera_info.yaml --date 2026-03-14 -o camera.yaml\n"
      "  mimesis calibrate import left.yaml right.yaml --date 2026-03-14 -o rig.yaml\n"
      "  mimesis calibrate import intrinsics.yml extrinsics.yml --size 640x480 --unit-m 0.025 "
      "--date "
      "2026-03-14 -o rig.yaml");
  verb->callback([arguments, &exit_code] { exit_code = import(*arguments); });
}

}  // namespace mimesis::tool
