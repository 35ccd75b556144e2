#include "nodes/vision/verb/foreign_calibration.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <numbers>
#include <optional>

#include "common/error.h"
#include "common/model/rig_file.h"
#include "common/runtime/value_text.h"
#include "nodes/vision/verb/foreign_values.h"

namespace mimesis::tool {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using foreign::fail;
using foreign::find;
using foreign::Keys;
using foreign::need;
using foreign::number;
using foreign::numbers;
using foreign::Numbers;
using foreign::Place;
using foreign::pose;
using foreign::read_text;
using foreign::rotation;
using foreign::Value;
using foreign::Yaml;
using model::Foreign;

constexpr double kMost_px = 0.25;                        // a fitted lens may be off by
constexpr double kNearest_m = 0.001, kFarthest_m = 2.0;  // baselines

// Cameras.

enum class Bend { plumb_bob, rational, equidistant, omni };

/// One camera as its file has it.
struct Entry {
  Place place;
  std::string name;
  double width = 0.0, height = 0.0, fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;
  double xi = 0.0;    ///< of omni: how far the pinhole is behind the sphere's centre
  std::string model;  ///< as the file says; empty if it does not
  Bend bend = Bend::plumb_bob;
  Numbers d;                              ///< of `bend`
  Isometry3d X = Isometry3d::Identity();  ///< from the first camera to this one, metres
  std::optional<Matrix3d> R;              ///< of ROS: rectification
  Numbers P;                              ///< of ROS: projection matrix, 3x4
  Place P_place;
};

class Reader {
 public:
  explicit Reader(const ImportOptions& options) : options_(options) {}

  Imported read(std::span<const ForeignFile> files) {
    std::vector<Yaml> documents;
    std::vector<std::string> names;
    for (const ForeignFile& file : files) {
      const Foreign kind = model::foreign_kind(file.text);
      names.push_back(printable(file.name));
      if (kind == Foreign::none) {
        throw ConfigError(file.name +
                          ": expected a calibration of ROS (camera_info), OpenCV, Kalibr "
                          "(camchain), camodocal or ORB-SLAM");
      }
      if (!documents.empty() && kind != kind_) {
        throw ConfigError(fmt::format("{}: is {}, {} is {}: expected two of one kind", file.name,
                                      described(kind), files[0].name, described(kind_)));
      }
      kind_ = kind;
      documents.push_back(read_text(file));
      if (documents.back().kind != Yaml::Kind::map) fail(documents.back().place, "expected keys");
    }
    const bool pair = kind_ == Foreign::camera_info || kind_ == Foreign::opencv;
    if (documents.size() > 1 && !pair) {
      throw ConfigError(fmt::format(
          "{}: is {} as the other file: neither says where the other one's camera is, import each "
          "alone",
          files[1].name, described(kind_)));
    }
    for (const Yaml& document : documents) cameras_of(document, documents);
    if (documents.size() == 2 && kind_ == Foreign::camera_info) pair_by_projection();
    return rig(names);
  }

 private:
  void say(const std::string& what) { said_.push_back(what); }

  void cameras_of(const Yaml& document, std::vector<Yaml>& all) {
    switch (kind_) {
      case Foreign::kalibr:
        return chain(document);
      case Foreign::camodocal:
        return camodocal(document);
      case Foreign::orb_slam:
        return orb_slam(document);
      case Foreign::camera_info:
      case Foreign::opencv:
      case Foreign::none:
        break;
    }
    if (kind_ == Foreign::opencv && &document == &all[0] && opencv_pair(all)) return;
    if (!paired_) cameras_.push_back(matrices(document, kMatrix, kDistortion));
  }

  static inline const Keys kMatrix{
      "camera_matrix", "cameraMatrix",  "Camera_Matrix",    "CameraMatrix", "K", "k", "M",
      "mtx",           "camera_Matrix", "intrinsic_matrix", "Intrinsics"};
  static inline const Keys kDistortion{"distortion_coefficients",
                                       "Distortion_Coefficients",
                                       "distCoeffs",
                                       "dist_coeffs",
                                       "distCoefs",
                                       "dist_coefs",
                                       "DistCoeffs",
                                       "D",
                                       "d",
                                       "dist",
                                       "distortion",
                                       "distCoef",
                                       "dist_coeff",
                                       "camera_distortion",
                                       "distortion_coeffs"};
  static Keys numbered(const char* number) {
    Keys out;
    for (const char* key : {"M", "K", "cameraMatrix", "camera_matrix", "CameraMatrix", "mtx"}) {
      out.push_back(std::string(key) + number);
      out.push_back(std::string(key) + "_" + number);
    }
    out.emplace_back(number[0] == '1' ? "left_camera_matrix" : "right_camera_matrix");
    return out;
  }
  static Keys numbered_bend(const char* number) {
    Keys out;
    for (const char* key : {"D", "distCoeffs", "dist_coeffs", "distortion_coefficients", "dist"}) {
      out.push_back(std::string(key) + number);
      out.push_back(std::string(key) + "_" + number);
    }
    out.emplace_back(number[0] == '1' ? "left_distortion_coefficients"
                                      : "right_distortion_coefficients");
    return out;
  }

  void size_of(const Yaml& map, Entry& out) const {
    const Value width = find(map, {"image_width", "image_Width", "width", "imageWidth"}),
                height = find(map, {"image_height", "image_Height", "height", "imageHeight"}),
                both = find(map, {"image_size", "imageSize", "Image_size", "resolution", "size"});
    if (width && height) {
      out.width = number(*width.yaml, width.key);
      out.height = number(*height.yaml, height.key);
    } else if (both) {
      const Numbers n = numbers(both, 2);
      out.width = n[0];
      out.height = n[1];
    }
    fill_size(out);
  }
  void fill_size(Entry& out) const {
    if (out.width == 0.0 && out.height == 0.0) {
      if (options_.width_px == 0)
        fail(out.place, "does not say how large its pictures are: --size WIDTHxHEIGHT");
      out.width = options_.width_px;
      out.height = options_.height_px;
    }
    if (options_.width_px != 0 &&
        (out.width != options_.width_px || out.height != options_.height_px)) {
      fail(out.place,
           fmt::format("is of pictures of {}x{}, --size says {}x{}: a calibration is not "
                       "carried to another size",
                       out.width, out.height, options_.width_px, options_.height_px));
    }
  }

  /// A camera of ROS or OpenCV: matrices.
  Entry matrices(const Yaml& map, const Keys& matrix, const Keys& distortion) {
    Entry out;
    out.place = map.place;
    const Value K = need(map, matrix);
    const Numbers k = numbers(K, 9);
    out.place = K.yaml->place;
    if (k[1] != 0.0) fail(out.place, K.key + ": has a skew, which no lens of a rig has");
    if (k[3] != 0.0 || k[6] != 0.0 || k[7] != 0.0 || (k[8] != 1.0 && k[0] != 0.0))
      fail(out.place, K.key + ": expected fx 0 cx, 0 fy cy, 0 0 1 in its rows");
    std::tie(out.fx, out.cx, out.fy, out.cy) = std::tie(k[0], k[2], k[4], k[5]);
    size_of(map, out);
    window_of(map, "binning_x", "binning_y");
    const Value D = need(map, distortion);
    out.d = numbers(*D.yaml, D.key);
    if (const Value model = find(map, {"distortion_model", "camera_model"}))
      out.model = model.yaml->text;
    const Value fisheye = find(map, {"fisheye_model", "Use_FishEyeModel", "bFishEye"});
    if (fisheye && fisheye.yaml->text != "0" && out.model.empty()) out.model = "fisheye";
    if (kind_ == Foreign::opencv) return out;  // OpenCV's R and P have several meanings
    if (const Value R = find(map, {"rectification_matrix", "R", "r"})) out.R = rotation(R);
    if (const Value P = find(map, {"projection_matrix", "P", "p"})) {
      out.P = numbers(P, 12);
      out.P_place = P.yaml->place;
      if (!(out.P[0] > 0.0) || !(out.P[5] > 0.0))
        fail(out.P_place, P.key + ": a focal length of 0");
    }
    return out;
  }

  /// A message may be of a part of the picture.
  static void window_of(const Yaml& map, const std::string& x, const std::string& y) {
    for (const std::string& key : {x, y}) {
      const Yaml* value = map.find(key);
      if (value != nullptr && number(*value, key) > 1.0)
        fail(value->place, key + ": the pictures are binned, expected a calibration of whole ones");
    }
    const Yaml* roi = map.find("roi");
    if (roi == nullptr) return;
    for (const char* key : {"x_offset", "y_offset", "width", "height"}) {
      const Yaml* value = roi->find(key);
      if (value != nullptr && number(*value, key) != 0.0)
        fail(value->place, std::string("roi.") + key +
                               ": the pictures are cut out, expected a calibration of whole ones");
    }
  }

  /// M1 D1 M2 D2 and R, T, in one file or two, as OpenCV's sample writes them.
  bool opencv_pair(const std::vector<Yaml>& all) {
    Yaml merged = all[0];
    for (std::size_t i = 1; i < all.size(); ++i) {
      for (const Yaml::Entry& each : all[i].entries) {
        if (merged.find(each.key) == nullptr) merged.entries.push_back(each);
      }
    }
    const Value first = find(merged, numbered("1")), second = find(merged, numbered("2"));
    if (!first && !second) {
      if (all.size() == 2)
        fail(all[1].place,
             "neither file says where the second camera is: expected R and T, in a "
             "file with M1 D1 M2 D2 or beside it");
      return false;
    }
    cameras_ = {matrices(merged, numbered("1"), numbered_bend("1")),
                matrices(merged, numbered("2"), numbered_bend("2"))};
    const Value R = need(merged, {"R", "Rotation"}), T = need(merged, {"T", "t", "Translation"});
    const Numbers t = numbers(T, 3);
    if (options_.unit_m == 0.0) {
      fail(T.yaml->place,
           fmt::format("{}: is {:.6g} long in the unit of its author's squares: --unit-m 1 if that "
                       "is metres, --unit-m 0.001 if millimetres",
                       T.key, Vector3d::Map(t.data()).norm()));
    }
    cameras_[1].X.linear() = rotation(R);
    cameras_[1].X.translation() = options_.unit_m * Vector3d::Map(t.data());
    paired_ = true;
    return true;
  }

  /// Left and right camera_info. With R the rectification and P = (f 0 c f·b; ..) a point is at
  /// Rr p_r = Rl p_l + (P03/P00, P13/P11, 0).
  void pair_by_projection() {
    const auto shift = [](const Entry& e) {
      return e.P.empty() ? Vector3d(Vector3d::Zero())
                         : Vector3d(e.P[3] / e.P[0], e.P[7] / e.P[5], 0.0);
    };
    Entry &left = cameras_[0], &right = cameras_[1];
    if (shift(left).norm() > 0.0) {
      fail(left.P_place,
           "projection_matrix: has a baseline, as the second camera's has; expected the other file "
           "first");
    }
    if (!(shift(right).norm() > 0.0)) {
      fail(right.place,
           "its projection_matrix has no baseline, so that it does not say where the second camera "
           "is; import each alone, or calibrate them: mimesis calibrate stereo");
    }
    const Matrix3d Rl = left.R.value_or(Matrix3d::Identity()),
                   Rr = right.R.value_or(Matrix3d::Identity());
    right.X.linear() = Rr.transpose() * Rl;
    right.X.translation() = unit() * (Rr.transpose() * shift(right));
    if (options_.unit_m == 0.0)
      say("the baseline is taken for metres, as " + described(kind_) + " has it");
  }
  double unit() const { return options_.unit_m == 0.0 ? 1.0 : options_.unit_m; }

  void chain(const Yaml& document) {
    std::optional<Isometry3d> X_first_imu;  // of cam0, from the IMU
    for (int i = 0;; ++i) {
      const std::string name = fmt::format("cam{}", i);
      const Yaml* map = document.find(name);
      if (map == nullptr && i == 0) fail(document.place, "no cam0 in it");
      if (map == nullptr) break;
      Entry out;
      out.place = map->place;
      out.name = name;
      const std::string projection = need(*map, {"camera_model"}).yaml->text;
      const Value model = need(*map, {"distortion_model"}), f = need(*map, {"intrinsics"});
      if (projection != "pinhole" && projection != "omni") {
        fail(
            need(*map, {"camera_model"}).yaml->place,
            fmt::format("camera_model {}: no lens of a rig, expected pinhole or omni", projection));
      }
      const std::size_t more = projection == "omni" ? 1 : 0;
      const Numbers n = numbers(f, 4 + more);
      if (more == 1) out.xi = n[0];
      std::tie(out.fx, out.fy, out.cx, out.cy) =
          std::tie(n[more], n[1 + more], n[2 + more], n[3 + more]);
      out.model = model.yaml->text;
      if (more == 1) {
        if (out.model != "radtan" && out.model != "none")
          fail(model.yaml->place, "omni-" + out.model + ": expected omni-radtan or omni-none");
        out.bend = Bend::omni;
      }
      if (const Value d = find(*map, {"distortion_coeffs"})) out.d = numbers(*d.yaml, d.key);
      size_of(*map, out);
      const Value before = find(*map, {"T_cn_cnm1"}), to = find(*map, {"T_cam_imu"}),
                  from = find(*map, {"T_imu_cam"});
      std::optional<Isometry3d> X_imu;
      if (to) X_imu = pose(to);
      if (from && !to) X_imu = pose(from).inverse();
      if (i == 0) X_first_imu = X_imu;
      if (i > 0 && before) {
        out.X = pose(before) * cameras_.back().X;
        if (X_imu && X_first_imu) demand_same(out.X, *X_imu * X_first_imu->inverse(), before);
      } else if (i > 0 && X_imu && X_first_imu) {
        out.X = *X_imu * X_first_imu->inverse();
      } else if (i > 0) {
        fail(out.place, name + ": does not say where it is: expected T_cn_cnm1");
      }
      cameras_.push_back(std::move(out));
    }
    for (Entry& each : cameras_) each.X.translation() *= unit();
  }
  static void demand_same(const Isometry3d& a, const Isometry3d& b, const Value& at) {
    constexpr double kApart_m = 0.001, kApart_rad = 0.002;
    const double m = (a.translation() - b.translation()).norm(),
                 rad = Eigen::AngleAxisd(a.linear() * b.linear().transpose()).angle();
    if (m > kApart_m || rad > kApart_rad) {
      fail(at.yaml->place,
           fmt::format("T_cn_cnm1 and T_cam_imu place the camera {:.4g} m and {:.4g} "
                       "rad apart, expected one place",
                       m, rad));
    }
  }

  void camodocal(const Yaml& document) {
    Entry out;
    const Value type = need(document, {"model_type"});
    out.place = type.yaml->place;
    const Value p = need(document, {"projection_parameters"});
    const auto at = [](const Value& map, const char* key) {
      return number(*need(*map.yaml, {key}).yaml, key);
    };
    size_of(document, out);
    if (type.yaml->text == "PINHOLE") {
      const Value d = need(document, {"distortion_parameters"});
      std::tie(out.fx, out.fy, out.cx, out.cy) =
          std::tuple(at(p, "fx"), at(p, "fy"), at(p, "cx"), at(p, "cy"));
      out.model = "plumb_bob";
      out.d = {at(d, "k1"), at(d, "k2"), at(d, "p1"), at(d, "p2")};
    } else if (type.yaml->text == "KANNALA_BRANDT") {
      std::tie(out.fx, out.fy, out.cx, out.cy) =
          std::tuple(at(p, "mu"), at(p, "mv"), at(p, "u0"), at(p, "v0"));
      out.model = "equidistant";
      out.d = {at(p, "k2"), at(p, "k3"), at(p, "k4"), at(p, "k5")};
    } else if (type.yaml->text == "MEI") {
      const Value d = need(document, {"distortion_parameters"});
      std::tie(out.fx, out.fy, out.cx, out.cy) =
          std::tuple(at(p, "gamma1"), at(p, "gamma2"), at(p, "u0"), at(p, "v0"));
      out.xi = at(need(document, {"mirror_parameters"}), "xi");
      out.model = "radtan";
      out.bend = Bend::omni;
      out.d = {at(d, "k1"), at(d, "k2"), at(d, "p1"), at(d, "p2")};
    } else {
      fail(out.place, "model_type " + type.yaml->text +
                          ": no lens of a rig, expected PINHOLE, KANNALA_BRANDT or MEI");
    }
    cameras_.push_back(std::move(out));
  }

  void orb_slam(const Yaml& document) {
    const auto at = [&](const std::string& key) {
      return number(*need(document, {key}).yaml, key);
    };
    const Value type = find(document, {"Camera.type"});
    const std::string model = type ? type.yaml->text : "PinHole";
    if (model != "PinHole" && model != "KannalaBrandt8") {
      fail(type.yaml->place, "Camera.type " + model +
                                 ": is of pictures that ORB-SLAM rectifies, expected PinHole or "
                                 "KannalaBrandt8");
    }
    if (document.find("LEFT.K") != nullptr) {  // Camera.fx .. are of the rectified pictures then
      for (const std::string side : {"LEFT.", "RIGHT."}) {
        Yaml own = document;
        std::erase_if(own.entries, [&](const auto& each) { return !each.key.starts_with(side); });
        for (Yaml::Entry& each : own.entries) each.key.erase(0, side.size());
        cameras_.push_back(matrices(own, {"K"}, {"D"}));
      }
      return pair_by_projection();
    }
    const Value second = find(document, {"Camera2.fx"}), T = find(document, {"Stereo.T_c1_c2"}),
                bf = find(document, {"Camera.bf", "Stereo.b"});
    for (const std::string& camera : {std::string("Camera1"), std::string("Camera2")}) {
      if (camera == "Camera2" && !second) break;
      const std::string key = document.find(camera + ".fx") != nullptr ? camera + "." : "Camera.";
      Entry out;
      out.place = need(document, {key + "fx"}).yaml->place;
      std::tie(out.fx, out.fy, out.cx, out.cy) =
          std::tuple(at(key + "fx"), at(key + "fy"), at(key + "cx"), at(key + "cy"));
      out.model = model == "PinHole" ? "plumb_bob" : "equidistant";
      const bool plane = model == "PinHole";
      for (const char* k : {"k1", "k2", plane ? "p1" : "k3", plane ? "p2" : "k4"})
        out.d.push_back(document.find(key + k) != nullptr || !plane ? at(key + k) : 0.0);
      if (plane && document.find(key + "k3") != nullptr) out.d.push_back(at(key + "k3"));
      if (document.find("Camera.width") != nullptr) {
        out.width = at("Camera.width");
        out.height = at("Camera.height");
      }
      fill_size(out);
      cameras_.push_back(std::move(out));
    }
    if (second) {
      cameras_[1].X = pose(T ? T : need(document, {"Stereo.T_c1_c2"})).inverse();
      cameras_[1].X.translation() *= unit();
    } else if (bf) {
      say(bf.key + ": left out, a depth camera has it as well as a pair");
    }
  }

  /// The lens's family by its name, or by how many numbers it has.
  void decide_bend(Entry& e) {
    const bool zero = std::ranges::all_of(e.d, [](double k) { return k == 0.0; });
    std::string model = e.model;
    if (model.empty() && e.d.size() == 4 && !zero) {
      if (options_.lens.empty()) {
        fail(e.place,
             "four coefficients and no lens model: --lens plumb_bob (k1 k2 p1 p2) or --lens "
             "equidistant (k1 k2 k3 k4, cv::fisheye)");
      }
      model = options_.lens;
    }
    if (e.bend == Bend::omni && e.xi != 0.0) return demand_count(e, "omni", {0, 4});
    if (model == "equidistant" || model == "fisheye" || model == "equi" ||
        model == "kannala_brandt") {
      e.bend = Bend::equidistant;
      return demand_count(e, model, {4});
    }
    if (model == "none" || model == "None" || (zero && model.empty())) {
      if (!zero) fail(e.place, "distortion_model none, but distortion coefficients");
      e.d.clear();
    } else if (model == "plumb_bob" || model == "radtan") {
      demand_count(e, model, {0, 4, 5});
    } else if (model == "rational_polynomial" || model.empty()) {
      demand_count(e, model.empty() ? "no lens model" : model, {5, 8, 12, 14});
      if (model.empty())
        say(fmt::format("{}: names no lens model, {} coefficients are those of OpenCV's {}",
                        to_string(e.place), e.d.size(),
                        e.d.size() == 5 ? "plumb_bob" : "rational_polynomial"));
    } else {
      fail(e.place, fmt::format("lens model '{}': no lens of a rig, expected plumb_bob, radtan, "
                                "rational_polynomial or equidistant",
                                model));
    }
    if (e.d.size() == 14 && (e.d[12] != 0.0 || e.d[13] != 0.0))
      fail(e.place, "a tilted sensor (τx, τy), which no lens of a rig has");
    e.bend = e.d.size() > 5 ? Bend::rational : Bend::plumb_bob;
  }
  static void demand_count(const Entry& e, const std::string& model,
                           std::vector<std::size_t> some) {
    if (std::ranges::find(some, e.d.size()) == some.end())
      fail(e.place, fmt::format("{}: expected {} coefficients, found {}", model,
                                fmt::join(some, " or "), e.d.size()));
  }

  /// What a rig does not have is no camera, or none that has been calibrated.
  void demand_plausible(const Entry& e) {
    if (e.fx == 0.0 || e.fy == 0.0)
      fail(e.place, "a focal length of 0: a placeholder, no calibration");
    if (!(e.width >= 8.0 && e.height >= 8.0 && e.width <= 16384.0 && e.height <= 16384.0) ||
        e.width != std::floor(e.width) || e.height != std::floor(e.height)) {
      fail(e.place,
           fmt::format("pictures of {}x{}: a placeholder, no calibration", e.width, e.height));
    }
    if (!(e.fx >= 10.0 && e.fy >= 10.0 && e.fx < 1e6 && e.fy < 1e6))
      fail(e.place, fmt::format("focal lengths {:.6g} and {:.6g} are not in pixels", e.fx, e.fy));
    if (!(e.cx >= 0.0 && e.cy >= 0.0 && e.cx <= e.width && e.cy <= e.height)) {
      fail(e.place, fmt::format("centre ({:.6g}, {:.6g}) outside of pictures of {}x{}: is it of "
                                "another resolution?",
                                e.cx, e.cy, e.width, e.height));
    }
    if (std::abs(e.cx / e.width - 0.5) > 0.2 || std::abs(e.cy / e.height - 0.5) > 0.2) {
      say(
          fmt::format("{}: centre ({:.1f}, {:.1f}) is far from the middle of {}x{}: is it of that "
                      "resolution?",
                      to_string(e.place), e.cx, e.cy, e.width, e.height));
    }
    const bool straight = std::ranges::all_of(e.d, [](double k) { return k == 0.0; });
    if (straight && e.bend == Bend::plumb_bob) {
      const Numbers expected{e.fx, 0.0, e.cx, 0.0, e.fy, e.cy};
      const bool turned = e.R && (*e.R - Matrix3d::Identity()).norm() > 1e-6;
      if (!e.P.empty() && !turned &&
          std::abs(e.P[0] - e.fx) + std::abs(e.P[2] - e.cx) + std::abs(e.P[5] - e.fy) +
                  std::abs(e.P[6] - e.cy) >
              1e-3) {
        fail(e.P_place,
             "no distortion, but projection_matrix is not camera_matrix: of rectified "
             "pictures alone; expected the raw pictures' distortion, or both equal");
      }
      say(to_string(e.place) + ": no distortion, so that its pictures must be without already");
    }
  }

  /// Bent (x, y) at depth 1 of a direction: angle off the axis, angle about it.
  static Vector2d bent(const Entry& e, double off, double about) {
    const Vector2d way(std::cos(about), std::sin(about));
    const auto k = [&e](std::size_t i) { return i < e.d.size() ? e.d[i] : 0.0; };
    if (e.bend == Bend::equidistant) {
      const double s = off * off;
      return off * (1.0 + s * (k(0) + s * (k(1) + s * (k(2) + s * k(3))))) * way;
    }
    const double r = e.bend == Bend::omni ? std::sin(off) / (std::cos(off) + e.xi) : std::tan(off);
    const double x = r * way.x(), y = r * way.y(), s = r * r;
    const double c =
        (1.0 + s * (k(0) + s * (k(1) + s * k(4)))) / (1.0 + s * (k(5) + s * (k(6) + s * k(7))));
    return {x * c + 2.0 * k(2) * x * y + k(3) * (s + 2.0 * x * x) + s * (k(8) + s * k(9)),
            y * c + k(2) * (s + 2.0 * y * y) + 2.0 * k(3) * x * y + s * (k(10) + s * k(11))};
  }

  image::Lens lens_of(const Entry& e) {
    image::Lens lens{
        static_cast<int>(e.width), static_cast<int>(e.height), e.fx, e.fy, e.cx, e.cy, {}};
    const bool plane = e.bend == Bend::plumb_bob || e.bend == Bend::rational;
    if (plane && std::all_of(e.d.begin() + static_cast<long>(std::min<std::size_t>(5, e.d.size())),
                             e.d.end(), [](double k) { return k == 0.0; })) {
      std::copy_n(e.d.begin(), std::min<std::size_t>(5, e.d.size()), lens.distortion.begin());
    } else {
      fit(e, lens);
    }
    if (std::ranges::any_of(lens.distortion, [](double k) { return !(std::abs(k) <= 1000.0); }) ||
        lens.fx_px < 10.0 || lens.fy_px < 10.0 || lens.fx_px > 1e6 || lens.fy_px > 1e6) {
      fail(e.place, "its focal lengths or distortion are of no lens");
    }
    if (lens.folds()) {
      fail(e.place, "its distortion folds the picture over, so that it describes no lens");
    }
    return lens;
  }

  /// The distortion of `lens` nearest to a lens of another family, over the picture: it is linear.
  void fit(const Entry& e, image::Lens& lens) {
    constexpr int kWays = 48;
    constexpr double kStep = 0.5 * std::numbers::pi / 180.0, kFar = 160 * kStep;
    const std::string model = e.bend == Bend::omni          ? "omni"
                              : e.bend == Bend::equidistant ? "equidistant"
                                                            : "rational";
    if (e.bend == Bend::omni) {
      if (!(e.xi > -1.0)) fail(e.place, "omni: expected xi above -1");
      lens.fx_px /= 1.0 + e.xi;
      lens.fy_px /= 1.0 + e.xi;
    }
    std::vector<std::pair<Vector2d, Vector2d>> seen;  // direction at depth 1, pixel
    for (int i = 0; i < kWays; ++i) {
      const double about = 2.0 * std::numbers::pi * i / kWays;
      bool inside = true;
      for (double off = 0.0; inside; off += kStep) {  // one step beyond the border, too
        const Vector2d b = bent(e, off, about);
        const Vector2d pixel(e.cx + e.fx * b.x(), e.cy + e.fy * b.y());
        inside = pixel.x() > -0.5 && pixel.y() > -0.5 && pixel.x() < e.width - 0.5 &&
                 pixel.y() < e.height - 0.5;
        if (inside && off > kFar) {
          fail(e.place,
               fmt::format("{}: sees more than 80° off its axis, which no lens of a rig does",
                           model));
        }
        seen.emplace_back(
            Vector2d(std::tan(off) * std::cos(about), std::tan(off) * std::sin(about)), pixel);
      }
    }
    Eigen::MatrixXd a(2 * static_cast<long>(seen.size()), 5);
    Eigen::VectorXd b(a.rows());
    const Vector2d f(lens.fx_px, lens.fy_px), c(lens.cx_px, lens.cy_px);
    for (long i = 0; i < a.rows() / 2; ++i) {
      const auto& [p, pixel] = seen[static_cast<std::size_t>(i)];
      const double x = p.x(), y = p.y(), s = p.squaredNorm();
      a.row(2 * i) << x * s, x * s * s, 2.0 * x * y, s + 2.0 * x * x, x * s * s * s;
      a.row(2 * i + 1) << y * s, y * s * s, s + 2.0 * y * y, 2.0 * x * y, y * s * s * s;
      a.row(2 * i) *= f.x();
      a.row(2 * i + 1) *= f.y();
      b.segment<2>(2 * i) = pixel - c - f.cwiseProduct(p);
    }
    Eigen::Matrix<double, 5, 1>::Map(lens.distortion.data()) = a.colPivHouseholderQr().solve(b);
    double off_px = 0.0;
    for (const auto& [p, pixel] : seen)
      off_px = std::max(off_px, (lens.project(p.homogeneous()) - pixel).norm());
    if (!(off_px < kMost_px)) {
      fail(e.place, fmt::format("{} lens: the nearest k1 k2 p1 p2 k3 is off by up to {:.3g} px, "
                                "expected at most {}",
                                model, off_px, kMost_px));
    }
    say(fmt::format("{}: {} lens, approximated by k1 k2 p1 p2 k3 to {:.2g} px", to_string(e.place),
                    model, off_px));
  }

  Imported rig(const std::vector<std::string>& names) {
    Imported out;
    out.kind = described(kind_);
    out.rig.date = options_.date;
    out.rig.board = fmt::format("none: imported from {} ({})", out.kind, fmt::join(names, ", "));
    out.rig.pictures = 0;  // how many there were is not known
    if (!options_.names.empty() && options_.names.size() != cameras_.size()) {
      throw ConfigError(fmt::format("--name: expected {} names, one per camera, found {}",
                                    cameras_.size(), options_.names.size()));
    }
    if (cameras_.size() == 1 && !cameras_[0].P.empty() && cameras_[0].P[3] != 0.0)
      say("its projection_matrix has a baseline, as a right camera's: taken as a camera alone");
    if (cameras_.size() > 1 && options_.unit_m == 0.0 && kind_ == Foreign::kalibr)
      say("translations are taken for metres, as " + out.kind + " has them");
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      Entry& e = cameras_[i];
      decide_bend(e);
      demand_plausible(e);
      std::string name = e.name;
      if (name.empty()) name = cameras_.size() == 1 ? "camera" : i == 0 ? "left" : "right";
      if (!options_.names.empty()) name = options_.names[i];
      if (name.empty()) throw ConfigError("--name: expected a word");
      if (out.rig.find(name) != nullptr) throw ConfigError("--name: '" + name + "' is there twice");
      const double far_m = e.X.translation().norm();
      if (i > 0 && !(far_m >= kNearest_m && far_m <= kFarthest_m)) {
        fail(e.place,
             fmt::format("the camera is {:.4g} m from the first one, expected {} to {} m: say "
                         "what 1 of the file is, --unit-m 0.001 if millimetres",
                         far_m, kNearest_m, kFarthest_m));
      }
      const Matrix3d R = e.X.linear();
      out.rig.cameras.push_back(
          {name,
           image::Camera(lens_of(e), R,
                         Vector3d(R.transpose() * (Vector3d::Zero() - e.X.translation()))),
           0.0});
    }
    out.said = said_;
    return out;
  }

  const ImportOptions& options_;
  Foreign kind_ = Foreign::none;
  std::vector<Entry> cameras_;
  bool paired_ = false;
  std::vector<std::string> said_;
};

}  // namespace

Imported import_calibration(std::span<const ForeignFile> files, const ImportOptions& options) {
  return Reader(options).read(files);
}

}  // namespace mimesis::tool
