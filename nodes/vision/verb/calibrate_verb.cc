#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/image/image.h"
#include "common/json_text.h"
#include "common/model/rig_file.h"
#include "nodes/vision/verb/calibrate_tools.h"
#include "nodes/vision/verb/calibration_pictures.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using vision::Board;

constexpr int kDone = 0, kFailed = 1;

struct Options : BoardOptions {
  std::vector<std::string> from;  ///< mono, stereo: pictures per camera; table: pictures
  std::string rig, out, report_dir, side;
  double thickness_m = 0.0;
  std::vector<double> middle_m{0.0, 0.0};
  std::vector<std::string> names;
};

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  return fmt::format("{:04}-{:02}-{:02}", local.tm_year + 1900, local.tm_mon + 1, local.tm_mday);
}

/// Advice for the next pictures.
std::vector<std::string> advice(const vision::Calibrated& c,
                                const std::vector<std::string>& names) {
  constexpr std::size_t kEnough = 12;
  constexpr double kTilted_deg = 25.0, kDepth = 1.25, kWellKnown = 0.005;
  std::vector<std::string> out;
  if (c.shots.size() < kEnough) {
    out.push_back(fmt::format("take {} positions of the board or more, these are {}", kEnough,
                              c.shots.size()));
  }
  for (std::size_t i = 0; i < c.cameras.size(); ++i) {
    const vision::Coverage& seen = c.coverage[i];
    if (!seen.missing.empty()) {
      out.push_back(fmt::format("show the board in the {} of {}'s picture",
                                fmt::join(seen.missing, ", "), names[i]));
    }
    const double two = 2.0 * c.sigma[i].fx_px / c.cameras[i].lens().fx_px;
    if (two > kWellKnown) {
      out.push_back(fmt::format("{}'s focal length is known to {:.1f} %: most helps a view of {}",
                                names[i], 100.0 * two, c.sigma[i].helps));
    }
    if (seen.tilt_deg < kTilted_deg) {
      out.push_back(fmt::format("tilt the board more, by 30 to 45°: {} has seen {:.0f}° at most",
                                names[i], seen.tilt_deg));
    }
  }
  if (c.coverage[0].farthest_m < kDepth * c.coverage[0].nearest_m) {
    out.emplace_back("show the board at more distances");
  }
  return out;
}

Json report_of(const Board& board, const vision::Calibrated& c,
               const std::vector<std::string>& names,
               const std::vector<vision::Rejected>& rejected) {
  const vision::HeldOutSummary held = vision::summary(c.held_out);
  Json out{{"board", board.described()}, {"used", c.shots.size()}, {"rms_px", c.rms_px}};
  out["cameras"] = Json::array();
  for (std::size_t i = 0; i < c.cameras.size(); ++i) {
    const image::Lens& lens = c.cameras[i].lens();
    const vision::Coverage& seen = c.coverage[i];
    Json camera = lens_report(names[i], lens);
    camera.update(Json{{"fx_2sigma_px", 2.0 * c.sigma[i].fx_px},
                       {"fy_2sigma_px", 2.0 * c.sigma[i].fy_px},
                       {"cx_2sigma_px", 2.0 * c.sigma[i].cx_px},
                       {"cy_2sigma_px", 2.0 * c.sigma[i].cy_px},
                       {"mono_rms_px", c.mono_rms_px[i]},
                       {"covered", seen.cells},
                       {"tilt_deg", seen.tilt_deg},
                       {"nearest_m", seen.nearest_m},
                       {"farthest_m", seen.farthest_m}});
    out["cameras"].push_back(std::move(camera));
  }
  out["held_out"] = {{"reprojection_px", held.reprojection_px}, {"worst", held.worst}};
  if (c.cameras.size() > 1) {
    out["baseline_m"] = c.baseline_m();
    out["held_out"]["epipolar_px"] = held.epipolar_px;
    out["held_out"]["worst_epipolar_px"] = held.worst_epipolar_px;
    out["held_out"]["baseline_spread"] = held.baseline_spread;
  }
  out["rejected"] = Json::array();
  for (const vision::Rejected& r : rejected)
    out["rejected"].push_back({{"name", r.name}, {"reason", r.reason}});
  out["advice"] = advice(c, names);
  return out;
}

void print(const Json& report) {
  std::cout << fmt::format("{} positions of a board of {}\n", report["used"].dump(),
                           report["board"].get<std::string>());
  TextTable table({"camera", "fx [px]", "fy [px]", "cx [px]", "cy [px]", "k1 k2 p1 p2 k3",
                   "alone, rms [px]", "covered", "tilt up to", "distance [m]"});
  for (const Json& c : report["cameras"]) {
    const auto number = [&c](const char* key) { return c[key].get<double>(); };
    const auto known = [&](const std::string& key) {  // to 2 sigma
      return fmt::format("{:.2f} ± {:.2g}", number((key + "_px").c_str()),
                         number((key + "_2sigma_px").c_str()));
    };
    table.row({c["name"], known("fx"), known("fy"), known("cx"), known("cy"),
               fmt::format("{:.4f}", fmt::join(c["distortion"].get<std::vector<double>>(), " ")),
               fmt::format("{:.3f}", number("mono_rms_px")),
               fmt::format("{:.0f} %", 100.0 * number("covered")),
               fmt::format("{:.0f}°", number("tilt_deg")),
               fmt::format("{:.3g} .. {:.3g}", number("nearest_m"), number("farthest_m"))});
  }
  table.print(std::cout, use_colour(STDOUT_FILENO));
  const Json& held = report["held_out"];
  std::cout << fmt::format(
      "corners: {:.3f} px rms, {:.3f} px in positions that were left out (worst: {})\n",
      report["rms_px"].get<double>(), held["reprojection_px"].get<double>(),
      held["worst"].get<std::string>());
  if (report.contains("baseline_m")) {
    std::cout << fmt::format(
        "baseline: {:.5g} m, {:.2f} % between calibrations that leave one out\n"
        "epipolar lines, left out: {:.3f} px mean per side, worst position {:.3f} px\n",
        report["baseline_m"].get<double>(), 100.0 * held["baseline_spread"].get<double>(),
        held["epipolar_px"].get<double>(), held["worst_epipolar_px"].get<double>());
  }
  for (const Json& r : report["rejected"]) {
    std::cout << fmt::format("rejected {}: {}\n", r["name"].get<std::string>(),
                             r["reason"].get<std::string>());
  }
  for (const Json& line : report["advice"])
    std::cout << "advice: " << line.get<std::string>() << '\n';
}

void write_picture(const fs::path& file, const image::Image& picture, Json& report) {
  const auto written = image::write_png(file, picture);
  if (!written) throw std::runtime_error(written.error().reason);
  report["pictures"].push_back(file.string());
}

int lenses(const Options& options) {
  const Board board = vision::parse_board(options.board, options.square_m);
  if (options.names.size() != options.from.size()) {
    throw ConfigError(fmt::format("--name: expected {} names, one per camera, found {}",
                                  options.from.size(), options.names.size()));
  }
  if (options.names.front() == options.names.back() && options.names.size() > 1)
    throw ConfigError("--name: expected two different names");
  CalibrationPictures pictures = read_calibration_pictures(board, options.from);
  const auto calibrated = vision::calibrate(board, pictures.sizes, pictures.shots);
  if (!calibrated) {
    for (const vision::Rejected& r : pictures.rejected)
      std::cerr << "calibrate: " << r.name << ": " << r.reason << '\n';
    std::cerr << "calibrate: " << calibrated.error().reason << '\n';
    return kFailed;
  }
  std::vector<vision::Rejected> rejected = pictures.rejected;
  rejected.insert(rejected.end(), calibrated->rejected.begin(), calibrated->rejected.end());
  Json report = report_of(board, *calibrated, options.names, rejected);
  if (!options.report_dir.empty()) {
    const fs::path dir = options.report_dir;
    fs::create_directories(dir);
    write_picture(dir / "corners.png", corner_sheet(board, pictures), report);
    if (calibrated->cameras.size() > 1) {
      const auto a = image::read_image(pictures.files[0][0]),
                 b = image::read_image(pictures.files[0][1]);
      if (a && b)
        write_picture(dir / "rectified.png",
                      rectified_pair(calibrated->cameras[0], calibrated->cameras[1], *a, *b),
                      report);
    }
    plot_calibration(dir / "residuals.png", board, *calibrated);
    report["pictures"].push_back((dir / "residuals.png").string());
  }
  if (!options.out.empty()) {
    const vision::HeldOutSummary held = vision::summary(calibrated->held_out);
    image::Rig rig{today(),
                   board.described(),
                   image::Rig::Frame::camera,
                   static_cast<int>(calibrated->shots.size()),
                   held.epipolar_px,
                   {}};
    for (std::size_t i = 0; i < calibrated->cameras.size(); ++i) {
      rig.cameras.push_back({options.names[i], calibrated->cameras[i], held.reprojection_px});
    }
    write_rig(options.out, rig);
    report["file"] = options.out;
  }
  options.json ? void(std::cout << json_text(report) << '\n') : print(report);
  if (!options.json && !options.out.empty()) std::cout << "written: " << options.out << '\n';
  return kDone;
}

int table(const Options& options) {
  constexpr double kTimes = 5.0, kLeast_px = 0.5;  // times the held-out error that a rig may be off
  const Board board = vision::parse_board(options.board, options.square_m);
  image::Rig rig = model::load_rig(options.rig);
  if (options.from.size() > rig.cameras.size()) {
    throw ConfigError(fmt::format(
        "{} pictures for a rig of {} cameras, expected one per camera or of the first alone",
        options.from.size(), rig.cameras.size()));
  }
  std::vector<image::Camera> cameras;
  std::vector<vision::Corners> seen;
  for (std::size_t i = 0; i < options.from.size(); ++i) {
    const image::RigCamera& c = rig.cameras[i];
    const auto picture = image::read_image(options.from[i]);
    if (!picture) throw ConfigError(picture.error().reason);
    if (picture->width != c.camera.width() || picture->height != c.camera.height()) {
      throw ConfigError(fmt::format("{}: {}x{} pixels, camera '{}' of {} has {}x{}",
                                    options.from[i], picture->width, picture->height, c.name,
                                    options.rig, c.camera.width(), c.camera.height()));
    }
    auto found = vision::find_board(*picture, board);
    if (!found) {
      const auto shown = vision::board_size_in(*picture);
      std::cerr << fmt::format(
          "calibrate: no whole board of {}x{} inner corners in {}{}\n", board.columns, board.rows,
          options.from[i],
          shown ? fmt::format(", but one of {}x{}", shown->first, shown->second) : "");
      return kFailed;
    }
    cameras.push_back(c.camera);
    seen.push_back(std::move(found->corners));
  }
  const double most_px = std::max(kLeast_px, kTimes * rig.cameras.front().held_out_px);
  const auto placed = vision::place_on_table(
      board, cameras, seen, options.side == "far" ? vision::Side::far : vision::Side::near,
      options.thickness_m, {options.middle_m[0], options.middle_m[1]}, most_px);
  if (!placed) {
    std::cerr << "calibrate: " << placed.error().reason << '\n';
    return kFailed;
  }
  // The same turn and shift for cameras that took no picture.
  const Eigen::Matrix3d R_TF = placed->cameras[0].R_CT().transpose() * cameras[0].R_CT();
  Json report{{"rms_px", placed->rms_px}, {"cameras", Json::array()}};
  for (image::RigCamera& c : rig.cameras) {
    const Eigen::Vector3d eye =
        placed->cameras[0].eye() + R_TF * (c.camera.eye() - cameras[0].eye());
    c.camera = image::Camera(c.camera.lens(), c.camera.R_CT() * R_TF.transpose(), eye);
    report["cameras"].push_back({{"name", c.name}, {"position_m", {eye.x(), eye.y(), eye.z()}}});
  }
  rig.frame = image::Rig::Frame::table;
  const std::string out = options.out.empty() ? options.rig : options.out;
  write_rig(out, rig);
  report["file"] = out;
  if (options.json) {
    std::cout << json_text(report) << '\n';
    return kDone;
  }
  std::cout << fmt::format("board on the table: corners {:.3f} px rms\n", placed->rms_px);
  for (const image::RigCamera& c : rig.cameras) {
    const Eigen::Vector3d& p = c.camera.eye();
    std::cout << fmt::format(
        "{}: {:.4f} m to the right, {:.4f} m above the table, {:.4f} m towards the teacher's "
        "side\n",
        c.name, p.x(), p.y(), p.z());
  }
  std::cout << "written: " << out << '\n';
  return kDone;
}

void add_lenses(CLI::App* verb, const std::shared_ptr<Options>& options, int& exit_code) {
  add_board(verb, *options);
  verb->add_option("-o,--out", options->out, "Write the rig, which nodes read, to this file")
      ->type_name("FILE");
  verb->add_option(
          "--report", options->report_dir,
          "Write corners, rectified pair and residuals as PNG into this folder (needs gnuplot)")
      ->type_name("DIR");
  verb->add_option("--name", options->names, "Names of the cameras in the rig")->type_name("NAME");
  verb->callback([options, &exit_code] { exit_code = lenses(*options); });
}

}  // namespace

void write_rig(const std::string& file, const image::Rig& rig) {
  const fs::path fresh = file + ".new";  // a reader sees the old file or the new one
  std::ofstream out(fresh);
  out << model::rig_text(rig);
  out.close();
  std::error_code error;
  if (out) fs::rename(fresh, file, error);
  if (!out || error) throw std::runtime_error(file + ": cannot be written");
}

Json lens_report(const std::string& name, const image::Lens& lens) {
  return {{"name", name},        {"width_px", lens.width_px},    {"height_px", lens.height_px},
          {"fx_px", lens.fx_px}, {"fy_px", lens.fy_px},          {"cx_px", lens.cx_px},
          {"cy_px", lens.cy_px}, {"distortion", lens.distortion}};
}

void add_board(CLI::App* verb, BoardOptions& options) {
  verb->add_option("--board", options.board, "Inner corners, COLUMNSxROWS [9x6]")->type_name("CxR");
  verb->add_option("--square-m", options.square_m, "Edge of a square in metres")
      ->required()
      ->check(number_above_zero)
      ->type_name("M");
  verb->add_flag("--json", options.json, "One object with all that is printed");
}

void add_calibrate(CLI::App& program, int& exit_code) {
  CLI::App* verb =
      program.add_subcommand("calibrate", "Calibrates cameras from pictures of a chessboard");
  verb->require_subcommand(1);
  verb->footer(
      "Exit codes: 0 done, 1 the pictures give no calibration, 2 usage.\n"
      "PICTURES: a folder, or the beginning of the paths of PNG and JPEG files. Pictures of a pair "
      "are told by\n"
      "what follows, or by names that differ in the side alone: left07.jpg and right07.jpg, left_7 "
      "and Right007,\n"
      "7_l and 7_r, cam0_7 and cam1_7.\n"
      "Examples:\n"
      "  mimesis calibrate stereo boards/left boards/right --square-m 0.025 -o rig.yaml --report "
      "report\n"
      "  mimesis calibrate mono boards/ --board 8x5 --square-m 0.03 -o camera.yaml\n"
      "  mimesis calibrate table rig.yaml left.png right.png --square-m 0.025\n"
      "  mimesis calibrate hand-eye camera.yaml poses.csv --on-arm camera --square-m 0.03 -o "
      "hand.yaml\n"
      "  mimesis_vision --set rig=rig.yaml");

  auto mono = std::make_shared<Options>();
  mono->names = {"camera"};
  CLI::App* one = verb->add_subcommand("mono", "One camera: lens");
  one->add_option("PICTURES", mono->from, "Pictures of a board in 12 or more positions")
      ->required()
      ->expected(1);
  add_lenses(one, mono, exit_code);

  auto stereo = std::make_shared<Options>();
  stereo->names = {"left", "right"};
  CLI::App* two =
      verb->add_subcommand("stereo", "Two cameras: lenses, and where the right one stands");
  two->add_option("LEFT RIGHT", stereo->from,
                  "Pictures of each camera, a board in 12 or more positions")
      ->required()
      ->expected(2);
  add_lenses(two, stereo, exit_code);

  auto on = std::make_shared<Options>();
  CLI::App* table_verb = verb->add_subcommand(
      "table", "Places a rig on the table: frame T, x right, y up, z towards the camera");
  table_verb->add_option("RIG", on->rig, "File that mono or stereo wrote")->required();
  table_verb
      ->add_option("PICTURE", on->from,
                   "The board on the table, one picture per camera or of the first alone")
      ->required()
      ->expected(1, 2);
  add_board(table_verb, *on);
  table_verb->add_option("-o,--out", on->out, "Write the rig to this file [RIG]")
      ->type_name("FILE");
  table_verb
      ->add_option(
          "--side", on->side,
          "near: z of the table points towards the camera; far: the camera stands opposite [near]")
      ->check(CLI::IsMember({"near", "far"}));
  table_verb
      ->add_option("--thickness-m", on->thickness_m, "Height of the print above the table [0]")
      ->check(number_not_below_zero);
  table_verb
      ->add_option("--middle-m", on->middle_m, "x and z of the board's middle on the table [0 0]")
      ->expected(2);
  table_verb->callback([on, &exit_code] { exit_code = table(*on); });
  add_hand_eye(verb, exit_code);
  add_import(verb, exit_code);
}

}  // namespace mimesis::tool
