#include "common/model/rig_file.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <vector>

#include "common/error.h"
#include "common/runtime/param_source.h"
#include "common/runtime/value_text.h"

namespace mimesis::model {
namespace {

using runtime::ParamVisitor;

constexpr std::string_view kFormat = "mimesis-rig-1";
constexpr std::array kFrames{"camera", "table", "flange", "base"};  // of image::Rig::Frame

struct CameraEntry {
  std::string name;
  int width_px = 0, height_px = 0;
  double fx_px = 0.0, fy_px = 0.0, cx_px = -1.0, cy_px = -1.0;
  std::vector<double> distortion, position_m, orientation;
  double held_out_px = -1.0;

  void visit(ParamVisitor& v) {
    v("name", name);
    v("width_px", width_px, 8, 16384);
    v("height_px", height_px, 8, 16384);
    v("fx_px", fx_px, 10.0, 1e6);
    v("fy_px", fy_px, 10.0, 1e6);
    v("cx_px", cx_px, 0.0, 16384.0);
    v("cy_px", cy_px, 0.0, 16384.0);
    v("distortion", distortion, -1000.0, 1000.0, 5);
    v("position_m", position_m, -1000.0, 1000.0, 3);
    v("orientation", orientation, -1.0, 1.0, 4);
    v("held_out_px", held_out_px, 0.0, 100.0);
  }
};

struct RigFile {
  std::string format, frame;
  image::Rig rig;
  std::vector<double> position_2sigma_m, rotation_2sigma_rad;
  std::vector<CameraEntry> cameras;

  void visit(ParamVisitor& v) {
    v("format", format, {kFormat});
    v("date", rig.date);
    v("board", rig.board);
    v("frame", frame, {kFrames[0], kFrames[1], kFrames[2], kFrames[3]});
    if (frame == "flange" || frame == "base") {
      v("position_2sigma_m", position_2sigma_m, 0.0, 100.0, 3);
      v("rotation_2sigma_rad", rotation_2sigma_rad, 0.0, 10.0, 3);
    }
    v("pictures", rig.pictures, 0, 1000000);
    v("epipolar_px", rig.epipolar_px, 0.0, 100.0);
    list(v, "cameras", cameras);
  }
};

/// Checks between keys, beyond the range of each.
void check(const RigFile& file, const runtime::ParamSource& source) {
  const auto fail = [&source](const std::string& key, const std::string& what) {
    throw ConfigError(
        fmt::format("{}: {}: {}", runtime::to_string(source.place_of(key)), key, what));
  };
  if (!day_number(file.rig.date))
    fail("date", "expected YYYY-MM-DD, found '" + file.rig.date + "'");
  if (file.cameras.empty()) fail("cameras", "there is none");
  for (std::size_t i = 0; i < file.cameras.size(); ++i) {
    const CameraEntry& c = file.cameras[i];
    const std::string at = fmt::format("cameras.{}.", i);
    if (c.name.empty()) fail(at + "name", "is missing, expected a word");
    for (std::size_t k = 0; k < i; ++k) {
      if (file.cameras[k].name == c.name) fail(at + "name", "'" + c.name + "' is there twice");
    }
    if (c.cx_px > c.width_px) fail(at + "cx_px", "is beyond the picture's width_px");
    if (c.cy_px > c.height_px) fail(at + "cy_px", "is beyond the picture's height_px");
    if (std::abs(Eigen::Vector4d::Map(c.orientation.data()).norm() - 1.0) > 1e-3) {
      fail(at + "orientation", "expected a unit quaternion w x y z");
    }
  }
}

image::Lens lens_of(const CameraEntry& c) {
  image::Lens lens{c.width_px, c.height_px, c.fx_px, c.fy_px, c.cx_px, c.cy_px, {}};
  std::ranges::copy(c.distortion, lens.distortion.begin());
  return lens;
}

image::Rig read_rig(const runtime::ParamSource& source) {
  RigFile read;
  read.rig.pictures = -1;  // must be there
  read.rig.epipolar_px = -1.0;
  source.read("", [&read](ParamVisitor& v) { read.visit(v); });
  check(read, source);
  image::Rig rig = read.rig;
  const auto frame = std::ranges::find(kFrames, read.frame) - kFrames.begin();
  rig.frame = static_cast<image::Rig::Frame>(frame);
  if (!read.position_2sigma_m.empty()) {
    rig.position_2sigma_m = Eigen::Vector3d::Map(read.position_2sigma_m.data());
    rig.rotation_2sigma_rad = Eigen::Vector3d::Map(read.rotation_2sigma_rad.data());
  }
  for (std::size_t i = 0; i < read.cameras.size(); ++i) {
    const CameraEntry& c = read.cameras[i];
    const Eigen::Vector4d q = Eigen::Vector4d::Map(c.orientation.data()).normalized();
    const image::Lens lens = lens_of(c);
    if (lens.folds()) {
      throw ConfigError(fmt::format(
          "{}: cameras.{}.distortion: folds the picture over, so that it describes no lens",
          runtime::to_string(source.place_of(fmt::format("cameras.{}.distortion", i))), i));
    }
    rig.cameras.push_back(
        {c.name,
         image::Camera(lens,
                       Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix().transpose(),
                       Eigen::Vector3d::Map(c.position_m.data())),
         c.held_out_px});
  }
  return rig;
}

/// Whether YAML, JSON or XML has this key anywhere.
bool has_key(const std::string& text, std::string_view key) {
  for (std::size_t at = text.find(key); at != std::string::npos; at = text.find(key, at + 1)) {
    const std::size_t end = at + key.size();
    const bool begins =
        at == 0 || std::string_view(" \t\n{,<\"'").find(text[at - 1]) != std::string_view::npos;
    if (begins && end < text.size() &&
        std::string_view(" \t:>\"'").find(text[end]) != std::string_view::npos)
      return true;
  }
  return false;
}

/// A file of others where a rig belongs is told what it is, not which key of a rig it lacks.
void demand_no_foreign(const std::string& text, const std::string& name) {
  if (const Foreign kind = foreign_kind(text); kind != Foreign::none) {
    throw ConfigError(fmt::format(
        "{0}: is {1}, expected a rig: mimesis calibrate import {0} --date YYYY-MM-DD -o rig.yaml",
        name, described(kind)));
  }
}

}  // namespace

Foreign foreign_kind(const std::string& text) {
  const auto has = [&text](auto... keys) { return (has_key(text, keys) || ...); };
  const auto all = [&text](auto... keys) { return (has_key(text, keys) && ...); };
  if (has("format") && text.find("mimesis-rig") != std::string::npos) return Foreign::none;
  if (has("T_cn_cnm1") || all("camera_model", "intrinsics")) return Foreign::kalibr;
  if (has("Camera.fx", "Camera1.fx")) return Foreign::orb_slam;
  if (has("projection_parameters", "mirror_parameters")) return Foreign::camodocal;
  if (has("camera_matrix", "distortion_model") &&
      has("projection_matrix", "rectification_matrix", "distortion_model"))
    return Foreign::camera_info;
  if (text.starts_with("%YAML:") || text.find("opencv_storage") != std::string::npos ||
      text.find("opencv-matrix") != std::string::npos ||
      has("camera_matrix", "cameraMatrix", "dist_coeffs", "distortion_coefficients"))
    return Foreign::opencv;
  return Foreign::none;
}

std::string described(Foreign kind) {
  constexpr std::array kWords{"no calibration",
                              "a ROS camera_info",
                              "an OpenCV file",
                              "a Kalibr camchain",
                              "a camodocal (VINS) calibration",
                              "an ORB-SLAM setting"};
  return kWords.at(static_cast<std::size_t>(kind));
}

std::optional<int> day_number(const std::string& date) {
  int y = 0;
  unsigned m = 0, d = 0;
  char more = 0;
  if (date.size() != 10 || std::sscanf(date.c_str(), "%4d-%2u-%2u%c", &y, &m, &d, &more) != 3)
    return std::nullopt;
  const std::chrono::year_month_day day{std::chrono::year(y), std::chrono::month(m),
                                        std::chrono::day(d)};
  if (!day.ok()) return std::nullopt;
  return static_cast<int>(std::chrono::sys_days(day).time_since_epoch().count());
}

image::Rig load_rig(const std::string& file) {
  std::stringstream text;  // empty for a section of a file, FILE#KEY
  text << std::ifstream(runtime::find_model_file(file)).rdbuf();
  demand_no_foreign(text.str(), file);
  return read_rig(runtime::ParamSource(runtime::find_model_file(file), {}, {}));
}

image::Rig parse_rig(const std::string& text, const std::string& name) {
  demand_no_foreign(text, name);
  return read_rig(runtime::ParamSource(runtime::parse_yaml(text, name)));
}

std::string rig_text(const image::Rig& rig) {
  RigFile file;
  file.format = kFormat;
  file.frame = kFrames.at(static_cast<std::size_t>(rig.frame));
  file.rig = rig;
  const auto of = [](const Eigen::Vector3d& x) { return std::vector{x.x(), x.y(), x.z()}; };
  file.position_2sigma_m = of(rig.position_2sigma_m);
  file.rotation_2sigma_rad = of(rig.rotation_2sigma_rad);
  for (const image::RigCamera& c : rig.cameras) {
    const image::Lens& lens = c.camera.lens();
    const Eigen::Vector3d& p = c.camera.eye();
    const Eigen::Quaterniond q(Eigen::Matrix3d(c.camera.R_CT().transpose()));
    file.cameras.push_back({c.name,
                            lens.width_px,
                            lens.height_px,
                            lens.fx_px,
                            lens.fy_px,
                            lens.cx_px,
                            lens.cy_px,
                            {lens.distortion.begin(), lens.distortion.end()},
                            {p.x(), p.y(), p.z()},
                            {q.w(), q.x(), q.y(), q.z()},
                            c.held_out_px});
  }
  return "# Written by `mimesis calibrate`; units and frames: nodes/vision/README.md\n" +
         runtime::dump_params([&file](ParamVisitor& v) { file.visit(v); });
}

image::Camera camera_on_table(const image::Rig& rig, const std::string& file,
                              const std::string& name) {
  std::vector<std::string> names;
  for (const image::RigCamera& c : rig.cameras) names.push_back(c.name);
  const image::RigCamera* found = name.empty() ? &rig.cameras.front() : rig.find(name);
  if (found == nullptr) {
    throw ConfigError(fmt::format("{}: no camera '{}'{}; there are: {}", file, name,
                                  runtime::did_you_mean(name, names), fmt::join(names, ", ")));
  }
  if (rig.frame != image::Rig::Frame::table) {
    throw ConfigError(file +
                      ": the rig does not know the table yet, expected frame: table; run "
                      "`mimesis calibrate table`");
  }
  return found->camera;
}

}  // namespace mimesis::model
