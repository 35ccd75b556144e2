#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/image/image.h"
#include "common/json_text.h"
#include "common/runtime/value_text.h"
#include "nodes/vision/files/colors_file.h"
#include "nodes/vision/teach.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using Json = nlohmann::ordered_json;
using vision::Kind;

struct Options {
  std::string image, out, picture, colors;
  std::vector<std::string> images;
  std::vector<std::string> regions;
  bool json = false;
};

/// "hand=120,80,60,40", or "hand=120,80": the 11x11 pixels around a click.
vision::TaughtRegion region_of(const std::string& text) {
  constexpr int kAround = 5;
  const std::size_t equals = text.find('=');
  const std::string where = "--region " + text;
  std::vector<int> numbers;
  for (std::size_t at = equals; at < text.size();) {
    const std::size_t comma = std::min(text.find(',', at + 1), text.size());
    const auto number = runtime::to_int(text.substr(at + 1, comma - at - 1));
    if (!number) numbers.clear();
    if (!number) break;
    numbers.push_back(*number);
    at = comma;
  }
  if (numbers.size() != 2 && numbers.size() != 4)
    throw ConfigError(where + ": expected NAME=X,Y,WIDTH,HEIGHT in pixels, or NAME=X,Y");
  const Kind kind = vision::kind_named(text.substr(0, equals), where);
  if (numbers.size() == 4) return {kind, numbers[0], numbers[1], numbers[2], numbers[3]};
  return {kind, numbers[0] - kAround, numbers[1] - kAround, 2 * kAround + 1, 2 * kAround + 1};
}

/// The picture, dimmed where there is no class.
image::Image labelled(const image::Image& image, const std::vector<std::uint8_t>& labels) {
  constexpr std::array<std::array<std::uint8_t, 3>, vision::kKinds> kPaint{
      {{0, 0, 0}, {90, 140, 255}, {80, 230, 60}, {255, 120, 60}, {40, 230, 255}, {230, 80, 230}}};
  image::Image out = image;
  for (std::size_t i = 0; i < out.bgr.size(); ++i) {
    const auto label = labels[i / 3];
    out.bgr[i] = label == 0 ? static_cast<std::uint8_t>(out.bgr[i] / 3) : kPaint.at(label)[i % 3];
  }
  return out;
}

int teach(const Options& options) {
  const auto image = image::read_image(options.image);
  if (!image) throw ConfigError(image.error().reason);
  std::vector<vision::TaughtRegion> regions;
  for (const std::string& text : options.regions) regions.push_back(region_of(text));
  const auto lesson = vision::teach(*image, regions);
  if (!lesson) throw ConfigError("--region: " + lesson.error().reason);
  std::vector<std::uint8_t> labels;
  vision::ColorTable(lesson->spots).apply(*image, labels);
  Json report{{"classes", Json::array()}, {"warnings", lesson->warnings}};
  for (std::size_t k = 1; k < vision::kKinds; ++k) {
    const auto& spot = lesson->spots.of[k];
    if (!spot) continue;
    const auto count = std::ranges::count(labels, static_cast<std::uint8_t>(k));
    report["classes"].push_back(
        {{"name", vision::name(static_cast<Kind>(k))},
         {"u", spot->mean.x()},
         {"v", spot->mean.y()},
         {"u_deviation", std::sqrt(spot->covariance(0, 0))},
         {"v_deviation", std::sqrt(spot->covariance(1, 1))},
         {"share", static_cast<double>(count) / static_cast<double>(labels.size())}});
  }
  if (!options.out.empty()) {
    std::ofstream file(options.out);
    file << vision::colors_text({lesson->reference_bgr, lesson->spots});
    file.close();
    if (!file) throw std::runtime_error(options.out + ": cannot be written");
    report["file"] = options.out;
  }
  if (!options.picture.empty()) {
    const auto written = image::write_png(options.picture, labelled(*image, labels));
    if (!written) throw std::runtime_error(written.error().reason);
    report["picture"] = options.picture;
  }
  if (options.json) {
    std::cout << json_text(report) << '\n';
    return 0;
  }
  TextTable table({"class", "U", "V", "share of the picture"});
  for (const Json& c : report["classes"]) {
    const auto text = [&c](const char* mean, const char* deviation) {
      return fmt::format("{:.0f} ± {:.1f}", c[mean].get<double>(), c[deviation].get<double>());
    };
    table.row({c["name"], text("u", "u_deviation"), text("v", "v_deviation"),
               fmt::format("{:.2f} %", 100.0 * c["share"].get<double>())});
  }
  table.print(std::cout, use_colour(STDOUT_FILENO));
  for (const std::string& warning : lesson->warnings) std::cerr << "vision: " << warning << '\n';
  if (!options.out.empty()) std::cout << "written: " << options.out << '\n';
  return 0;
}

/// Report on the camera's view of the desk, with advice.
int check(const Options& options) {
  std::vector<image::Image> pictures;
  for (const std::string& file : options.images) {
    auto image = image::read_image(file);
    if (!image) throw ConfigError(image.error().reason);
    pictures.push_back(std::move(*image));
  }
  vision::CameraReport report = vision::check_camera(pictures);
  if (!options.colors.empty()) {
    const vision::TaughtColors taught = vision::load_colors(options.colors);
    for (std::string& line :
         vision::check_colors(pictures.front(), taught.spots, taught.reference_bgr))
      report.advice.push_back(std::move(line));
  }
  if (options.json) {
    const auto known = [](const std::optional<double>& x) { return x ? Json(*x) : Json(); };
    std::cout << json_text(Json{{"blur_px", known(report.blur_px)},
                                {"overexposed", report.overexposed},
                                {"median_luma", report.median_luma},
                                {"flicker", known(report.flicker)},
                                {"advice", report.advice}})
              << '\n';
    return report.advice.empty() ? 0 : 1;
  }
  const auto number = [](const std::optional<double>& x, double scale, const char* unit) {
    return x ? fmt::format("{:.1f} {}", scale * *x, unit) : "?";
  };
  TextTable table({"focus: blur", "at the white end", "median luma", "flicker"});
  table.row({number(report.blur_px, 1.0, "px"), number(report.overexposed, 100.0, "%"),
             fmt::format("{:.0f}", report.median_luma), number(report.flicker, 100.0, "%")});
  table.print(std::cout, use_colour(STDOUT_FILENO));
  for (const std::string& line : report.advice) std::cout << line << '\n';
  return report.advice.empty() ? 0 : 1;
}

}  // namespace

void add_vision(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand(
      "vision", "Teaches vision colours, checks its camera, shows what it saw");
  verb->require_subcommand(1);
  auto options = std::make_shared<Options>();
  CLI::App* sub = verb->add_subcommand("teach", "Learns colours from regions of a picture");
  sub->add_option("IMAGE", options->image, "PNG or JPEG file")->required();
  sub->add_option("--region", options->regions,
                  "NAME=X,Y,WIDTH,HEIGHT: pixels that show hand, object, bar, goal_high or "
                  "goal_low and nothing else; NAME=X,Y: those around a click. May be repeated")
      ->required()
      ->type_name("NAME=X,Y[,W,H]");
  sub->add_option("-o,--out", options->out, "Write the colours, which vision reads, to this file")
      ->type_name("FILE");
  sub->add_option("--picture", options->picture, "Write the picture with its classes (PNG)")
      ->type_name("FILE");
  sub->add_flag("--json", options->json, "One object with all that is printed");
  sub->footer(
      "Exit codes: 0 done, 1 a file cannot be written, 2 usage.\nExamples:\n"
      "  mimesis vision teach desk.png --region hand=120,80,60,40 --region bar=300,150 -o "
      "colors.yaml\n"
      "  mimesis_vision --set colors=colors.yaml");
  sub->callback([options, &exit_code] { exit_code = teach(*options); });

  sub = verb->add_subcommand("check", "Says what to change on the desk for a camera to see well");
  sub->add_option("IMAGE", options->images,
                  "PNG or JPEG files of one camera in their order; three or more tell of flicker")
      ->required();
  sub->add_option("--colors", options->colors,
                  "Colours from `teach`, to be told apart in the first")
      ->type_name("FILE");
  sub->add_flag("--json", options->json, "One object with all that is printed");
  sub->footer(
      "Focus is judged by the sharpest edges, exposure by the shares of bright and dark pixels.\n"
      "Exit codes: 0 nothing to change, 1 something, 2 usage.\nExamples:\n"
      "  mimesis vision check desk1.png desk2.png desk3.png --colors colors.yaml\n"
      "  mimesis log export run.mcap --images camera/image -o desk && mimesis vision check desk/*");
  sub->callback([options, &exit_code] { exit_code = check(*options); });
}

}  // namespace mimesis::tool
