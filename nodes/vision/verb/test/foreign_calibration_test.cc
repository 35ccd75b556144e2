// Calibrations of others, judged by the formulas that their makers document.
#include "nodes/vision/verb/foreign_calibration.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "common/error.h"
#include "common/model/rig_file.h"
#include "common/testing/refusal.h"

namespace mimesis::tool {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const std::vector<Vector3d> kPoints{{0.1, -0.2, 1.0}, {-0.35, 0.2, 1.3}, {0.02, 0.3, 0.9}};

ImportOptions dated() { return {.date = "2026-03-14"}; }

Imported read(const std::vector<std::string>& texts, const ImportOptions& options = dated()) {
  std::vector<ForeignFile> files;
  for (const std::string& text : texts)
    files.push_back({"f" + std::to_string(files.size()) + ".yaml", text});
  return import_calibration(files, options);
}
std::string refused(const std::vector<std::string>& texts, const ImportOptions& options = dated()) {
  return testing::refusal([&] { read(texts, options); }, "accepted");
}
std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

/// Written out anew: OpenCV's "Camera Calibration and 3D Reconstruction", without prisms.
Vector2d opencv_pixel(const Vector3d& p, const std::vector<double>& k, double fx, double fy,
                      double cx, double cy) {
  const double x = p.x() / p.z(), y = p.y() / p.z(), r2 = x * x + y * y;
  const double k3 = k.size() > 4 ? k[4] : 0.0;
  const double radial = 1.0 + k[0] * r2 + k[1] * r2 * r2 + k3 * std::pow(r2, 3);
  const double xd = x * radial + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x);
  const double yd = y * radial + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y;
  return {fx * xd + cx, fy * yd + cy};
}
double furthest(const image::Camera& camera, const std::vector<double>& k, double fx, double fy,
                double cx, double cy, const Eigen::Isometry3d& X = Eigen::Isometry3d::Identity()) {
  double most = 0.0;
  for (const Vector3d& p : kPoints)
    most = std::max(most, (camera.project(p) - opencv_pixel(X * p, k, fx, fy, cx, cy)).norm());
  return most;
}

const std::string kRos = R"(image_width: 640
image_height: 480
camera_name: narrow stereo/left
camera_matrix:
  rows: 3
  cols: 3
  data: [ 520.5,    0.     ,  310.25,
	0., 518.25, 250.5,
          0.     ,    0.     ,    1.     ]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.3, 0.1, 0.002, -0.0015, 0.01]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [480., 0., 320., 0., 0., 480., 240., 0., 0., 0., 1., 0.]
)";
const std::vector<double> kRosBend{-0.3, 0.1, 0.002, -0.0015, 0.01};

/// The second camera: turned by 0.02 rad about y when rectified, 0.12 m to the right.
std::string ros_right(double px = -480.0 * 0.12) {
  const double c = std::cos(0.02), s = std::sin(0.02);
  std::string out = with(kRos, "0., 0., 480., 240.", std::to_string(px) + ", 0., 480., 240.");
  char turn[200];
  std::snprintf(turn, sizeof turn, "[%.17g, 0, %.17g, 0, 1, 0, %.17g, 0, %.17g]", c, s, -s, c);
  return with(out, "[1, 0, 0, 0, 1, 0, 0, 0, 1]", turn);
}

TEST(ForeignCalibration, RosCameraInfoProjectsByItsOwnFormula) {
  const Imported got = read({kRos});
  EXPECT_EQ(got.kind, "a ROS camera_info");
  ASSERT_EQ(got.rig.cameras.size(), 1u);
  EXPECT_EQ(got.rig.cameras[0].name, "camera");
  EXPECT_LT(furthest(got.rig.cameras[0].camera, kRosBend, 520.5, 518.25, 310.25, 250.5), 1e-9);
  EXPECT_EQ(got.rig.pictures, 0);
  const image::Rig again = model::parse_rig(model::rig_text(got.rig), "rig");
  EXPECT_EQ(again.board, "none: imported from a ROS camera_info (f0.yaml)");
  EXPECT_EQ(again.cameras[0].camera.lens().distortion, got.rig.cameras[0].camera.lens().distortion);
}

TEST(ForeignCalibration, ARosMessageIsReadAsTheFile) {
  const std::string ros1 =
      "header: \n  seq: 3\nheight: 480\nwidth: 640\ndistortion_model: \"plumb_bob\"\n"
      "D: [-0.3, 0.1, 0.002, -0.0015, 0.01]\nK: [520.5, 0.0, 310.25, 0.0, 518.25, 250.5, 0.0, 0.0, "
      "1.0]\nR: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]\n"
      "P: [480.0, 0.0, 320.0, 0.0, 0.0, 480.0, 240.0, 0.0, 0.0, 0.0, 1.0, 0.0]\n"
      "binning_x: 0\nbinning_y: 0\nroi: \n  x_offset: 0\n  y_offset: 0\n  height: 0\n  width: 0\n"
      "  do_rectify: False\n---\n";
  EXPECT_LT(furthest(read({ros1}).rig.cameras[0].camera, kRosBend, 520.5, 518.25, 310.25, 250.5),
            1e-9);
  EXPECT_EQ(
      refused({with(ros1, "binning_x: 0", "binning_x: 2")}),
      "f0.yaml:10:12: binning_x: the pictures are binned, expected a calibration of whole ones");
  EXPECT_EQ(
      refused({with(ros1, "x_offset: 0", "x_offset: 8")}),
      "f0.yaml:13:13: roi.x_offset: the pictures are cut out, expected a calibration of whole "
      "ones");
}

TEST(ForeignCalibration, APairOfRosStandsWhereItsProjectionMatricesSay) {
  const Imported got = read({kRos, ros_right()});
  ASSERT_EQ(got.rig.cameras.size(), 2u);
  EXPECT_EQ(got.rig.cameras[1].name, "right");
  const double c = std::cos(0.02), s = std::sin(0.02);
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();  // rectified = R p_r, and 0.12 m less in x
  Eigen::Matrix3d R;
  R << c, 0, s, 0, 1, 0, -s, 0, c;
  X.linear() = R.transpose();
  X.translation() = R.transpose() * Vector3d(-0.12, 0.0, 0.0);
  EXPECT_LT(furthest(got.rig.cameras[1].camera, kRosBend, 520.5, 518.25, 310.25, 250.5, X), 1e-9);
  EXPECT_LT((got.rig.cameras[1].camera.eye() - Vector3d(0.12, 0, 0)).norm(), 1e-9);
  EXPECT_EQ(refused({ros_right(), kRos}),
            "f0.yaml:20:3: projection_matrix: has a baseline, as the second camera's has; expected "
            "the other file first");
  EXPECT_EQ(refused({kRos, kRos}),
            "f1.yaml:5:3: its projection_matrix has no baseline, so that it does not say where the "
            "second camera is; import each alone, or calibrate them: mimesis calibrate stereo");
  const std::string mm = ros_right(-480.0 * 120.0);
  EXPECT_EQ(
      refused({kRos, mm}),
      "f1.yaml:5:3: the camera is 120 m from the first one, expected 0.001 to 2 m: say what 1 "
      "of the file is, --unit-m 0.001 if millimetres");
  ImportOptions unit = dated();
  unit.unit_m = 0.001;
  EXPECT_LT((read({kRos, mm}, unit).rig.cameras[1].camera.eye() - Vector3d(0.12, 0, 0)).norm(),
            1e-9);
}

const std::string kOpencv = R"(%YAML:1.0
---
nframes: 13
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.205e+02, 0., 310.25, 0.,
       518.25, 250.5, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -0.3, 1.0e-01, 2.0e-03, -1.5e-03,
       1.0e-02 ]
)";

TEST(ForeignCalibration, OpencvYamlAndXmlAreOneCalibration) {
  EXPECT_LT(furthest(read({kOpencv}).rig.cameras[0].camera, kRosBend, 520.5, 518.25, 310.25, 250.5),
            1e-9);
  const std::string xml = R"(<?xml version="1.0"?>
<opencv_storage>
<calibration_Time>"Sat 14 Mar 2026"</calibration_Time>
<image_Width>640</image_Width>
<image_Height>480</image_Height>
<Camera_Matrix type_id="opencv-matrix">
  <rows>3</rows>
  <cols>3</cols>
  <dt>d</dt>
  <data>
    5.205e+02 0. 310.25 0.
    518.25 250.5 0. 0. 1.</data></Camera_Matrix>
<Distortion_Coefficients type_id="opencv-matrix">
  <rows>5</rows>
  <cols>1</cols>
  <dt>f</dt>
  <data>
    -0.3 0.1 2e-03 -1.5e-03 0.01</data></Distortion_Coefficients>
</opencv_storage>
)";
  EXPECT_LT(furthest(read({xml}).rig.cameras[0].camera, kRosBend, 520.5, 518.25, 310.25, 250.5),
            1e-9);
  EXPECT_EQ(refused({with(xml, "518.25 250.5", "518.25 nan")}),
            "f0.yaml:10:3: Camera_Matrix: expected a finite number, found 'nan'");
  EXPECT_EQ(refused({with(xml, "518.25 250.5", "518.25")}),
            "f0.yaml:6:1: Camera_Matrix: 3 rows of 3 cols, but 8 numbers");
  std::string deep;
  for (int i = 0; i < 100'000; ++i) deep += "<a>";
  EXPECT_EQ(refused({"<opencv_storage>" + deep}), "f0.yaml: nested too deeply");
  EXPECT_EQ(refused({with(kOpencv, "image_width: 640\nimage_height: 480\n", "")}),
            "f0.yaml:4:16: does not say how large its pictures are: --size WIDTHxHEIGHT");
  ImportOptions other = dated();
  other.width_px = 1280, other.height_px = 720;
  EXPECT_EQ(refused({kOpencv}, other),
            "f0.yaml:6:16: is of pictures of 640x480, --size says 1280x720: a calibration is not "
            "carried to another size");
}

TEST(ForeignCalibration, AnOpencvPairSaysWhatItsUnitIs) {
  const std::string intrinsics =
      "%YAML:1.0\nM1: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 520.5, 0., "
      "310.25, "
      "0.,\n       518.25, 250.5, 0., 0., 1. ]\nD1: !!opencv-matrix\n   rows: 1\n   cols: 5\n   "
      "dt: d\n"
      "   data: [ -0.3, 0.1, 0.002, -0.0015, 0.01 ]\nM2: !!opencv-matrix\n   rows: 3\n   cols: 3\n "
      "  "
      "dt: d\n   data: [ 500., 0., 300., 0., 510., 230., 0., 0., 1. ]\nD2: !!opencv-matrix\n   "
      "rows: "
      "1\n   cols: 5\n   dt: d\n   data: [ -0.2, 0.05, 0., 0., 0. ]\n";
  const std::string extrinsics =
      "%YAML:1.0\nR: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 0.8, 0., 0.6, "
      "0., "
      "1., 0., -0.6, 0., 0.8 ]\nT: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [ "
      "-3., "
      "0.5, 1. ]\n";
  ImportOptions options = dated();
  options.width_px = 640, options.height_px = 480;
  EXPECT_EQ(
      refused({intrinsics, extrinsics}, options),
      "f1.yaml:7:4: T: is 3.20156 long in the unit of its author's squares: --unit-m 1 if that "
      "is metres, --unit-m 0.001 if millimetres");
  options.unit_m = 0.04;
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();  // p2 = R p1 + T
  X.linear() << 0.8, 0, 0.6, 0, 1, 0, -0.6, 0, 0.8;
  X.translation() = 0.04 * Vector3d(-3.0, 0.5, 1.0);
  for (const auto& order : {std::vector{intrinsics, extrinsics}, {extrinsics, intrinsics}}) {
    const Imported got = read(order, options);
    ASSERT_EQ(got.rig.cameras.size(), 2u);
    EXPECT_LT(furthest(got.rig.cameras[0].camera, kRosBend, 520.5, 518.25, 310.25, 250.5), 1e-9);
    EXPECT_LT(furthest(got.rig.cameras[1].camera, {-0.2, 0.05, 0, 0}, 500, 510, 300, 230, X), 1e-9);
  }
  options.unit_m = 1.0;
  EXPECT_NE(refused({intrinsics, extrinsics}, options).find("the camera is 3.202 m from the first"),
            std::string::npos);
  EXPECT_EQ(refused({intrinsics}, options), "f0.yaml:2:1: R is missing (or Rotation)");
  EXPECT_NE(refused({kOpencv, kOpencv}).find("neither file says where the second camera is"),
            std::string::npos);
  EXPECT_NE(refused({intrinsics, with(extrinsics, "0.6, 0.,", "0.7, 0.,")}, options)
                .find("R: is no rotation matrix"),
            std::string::npos);
}

const std::string kKalibr = R"(cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.28, 0.07, 0.0002, -0.001]
  distortion_model: radtan
  intrinsics: [458.6, 457.2, 367.2, 248.3]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [0.8, 0.0, 0.6, -0.11]
  - [0.0, 1.0, 0.0, 0.002]
  - [-0.6, 0.0, 0.8, 0.01]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [-0.2, 0.05, 0.0001, 0.002]
  distortion_model: radtan
  intrinsics: [457.5, 456.1, 379.9, 255.2]
  resolution: [752, 480]
)";

TEST(ForeignCalibration, AKalibrChainIsARig) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() << 0.8, 0, 0.6, 0, 1, 0, -0.6, 0, 0.8;
  X.translation() = Vector3d(-0.11, 0.002, 0.01);
  const Imported got = read({kKalibr});
  ASSERT_EQ(got.rig.cameras.size(), 2u);
  EXPECT_EQ(got.rig.cameras[1].name, "cam1");
  EXPECT_LT(furthest(got.rig.cameras[0].camera, {-0.28, 0.07, 0.0002, -0.001}, 458.6, 457.2, 367.2,
                     248.3),
            1e-9);
  EXPECT_LT(furthest(got.rig.cameras[1].camera, {-0.2, 0.05, 0.0001, 0.002}, 457.5, 456.1, 379.9,
                     255.2, X),
            1e-9);
  // By way of an IMU at (0.1, 0, 0) of cam0, either way round.
  const std::string own =
      "  T_cn_cnm1:\n  - [0.8, 0.0, 0.6, -0.11]\n  - [0.0, 1.0, 0.0, 0.002]\n  - "
      "[-0.6, 0.0, 0.8, 0.01]\n";
  const std::string to0 =
      "  T_cam_imu: [[1, 0, 0, 0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n";
  const std::string imu = with(with(kKalibr, own,
                                    "  T_cam_imu:\n  - [0.8, 0.0, 0.6, -0.03]\n  - "
                                    "[0.0, 1.0, 0.0, 0.002]\n  - [-0.6, 0.0, 0.8, "
                                    "-0.05]\n"),
                               "cam0:\n", "cam0:\n" + to0);
  EXPECT_LT((read({imu}).rig.cameras[1].camera.eye() - got.rig.cameras[1].camera.eye()).norm(),
            1e-9);
  EXPECT_NE(refused({with(with(kKalibr, "cam0:\n", "cam0:\n" + to0), "cam1:\n", "cam1:\n" + to0)})
                .find("T_cn_cnm1 and T_cam_imu place the camera"),
            std::string::npos);
  EXPECT_EQ(refused({with(kKalibr, "camera_model: pinhole", "camera_model: ds")}),
            "f0.yaml:3:17: camera_model ds: no lens of a rig, expected pinhole or omni");
  EXPECT_EQ(refused({with(kKalibr, "distortion_model: radtan", "distortion_model: fov")}),
            "f0.yaml:2:3: lens model 'fov': no lens of a rig, expected plumb_bob, radtan, "
            "rational_polynomial or equidistant");
  EXPECT_NE(refused({with(kKalibr, "  T_cn_cnm1:", "  T_other:")}).find("expected T_cn_cnm1"),
            std::string::npos);
}

TEST(ForeignCalibration, CamodocalAndOrbSlamAreRead) {
  const std::string vins =
      "%YAML:1.0\n---\nmodel_type: PINHOLE\ncamera_name: camera\nimage_width: 752\nimage_height: "
      "480\n"
      "distortion_parameters:\n   k1: -0.28\n   k2: 0.07\n   p1: 0.0002\n   p2: -0.001\n"
      "projection_parameters:\n   fx: 458.6\n   fy: 457.2\n   cx: 367.2\n   cy: 248.3\n";
  const std::vector<double> k{-0.28, 0.07, 0.0002, -0.001};
  EXPECT_LT(furthest(read({vins}).rig.cameras[0].camera, k, 458.6, 457.2, 367.2, 248.3), 1e-9);
  EXPECT_EQ(
      refused({with(vins, "PINHOLE", "SCARAMUZZA")}),
      "f0.yaml:3:13: model_type SCARAMUZZA: no lens of a rig, expected PINHOLE, KANNALA_BRANDT or "
      "MEI");
  EXPECT_EQ(
      refused({vins, vins}),
      "f1.yaml: is a camodocal (VINS) calibration as the other file: neither says where the other "
      "one's camera is, import each alone");
  const std::string orb =
      "%YAML:1.0\nCamera.type: \"PinHole\"\nCamera1.fx: 458.6\nCamera1.fy: 457.2\nCamera1.cx: "
      "367.2\n"
      "Camera1.cy: 248.3\nCamera1.k1: -0.28\nCamera1.k2: 0.07\nCamera1.p1: 0.0002\nCamera1.p2: "
      "-0.001\n"
      "Camera2.fx: 458.6\nCamera2.fy: 457.2\nCamera2.cx: 367.2\nCamera2.cy: 248.3\nCamera2.k1: "
      "-0.28\n"
      "Camera2.k2: 0.07\nCamera2.p1: 0.0002\nCamera2.p2: -0.001\nCamera.width: 752\nCamera.height: "
      "480\n"
      "Stereo.T_c1_c2: !!opencv-matrix\n  rows: 4\n  cols: 4\n  dt: f\n  data: [0.8,0,0.6,0.11, "
      "0,1,0,0, -0.6,0,0.8,0.01, 0,0,0,1]\n";
  // OpenCV needs no space behind a colon.
  EXPECT_EQ(
      read({with(orb, "Camera1.k1: ", "Camera1.k1:")}).rig.cameras[0].camera.lens().distortion,
      read({orb}).rig.cameras[0].camera.lens().distortion);
  // With LEFT and RIGHT Camera.fx .. are of the rectified pictures.
  std::string sides = orb;
  for (const std::string side : {"LEFT", "RIGHT"}) {
    sides += side + ".width: 640\n" + side + ".height: 480\n" + side +
             ".K: {rows: 3, cols: 3, data: [520.5, 0, 310.25, 0, 518.25, 250.5, 0, 0, 1]}\n" +
             side + ".D:[-0.3, 0.1, 0.002, -0.0015, 0.01]\n" + side +
             ".R: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n" + side + ".P: [480, 0, 320, " +
             (side == "LEFT" ? "0" : "-57.6") + ", 0, 480, 240, 0, 0, 0, 1, 0]\n";
  }
  const Imported raw = read({sides});
  ASSERT_EQ(raw.rig.cameras.size(), 2u);
  EXPECT_LT(furthest(raw.rig.cameras[0].camera, kRosBend, 520.5, 518.25, 310.25, 250.5), 1e-9);
  EXPECT_LT((raw.rig.cameras[1].camera.eye() - Vector3d(0.12, 0, 0)).norm(), 1e-12);
  const Imported pair = read({orb});
  ASSERT_EQ(pair.rig.cameras.size(), 2u);  // T_c1_c2: of the second camera in the first one
  EXPECT_LT((pair.rig.cameras[1].camera.eye() - Vector3d(0.11, 0, 0.01)).norm(), 1e-12);
  EXPECT_LT(furthest(pair.rig.cameras[0].camera, k, 458.6, 457.2, 367.2, 248.3), 1e-9);
  EXPECT_NE(refused({with(orb, "PinHole", "Rectified")}).find("Camera.type Rectified"),
            std::string::npos);
}

TEST(ForeignCalibration, OtherLensesAreFittedToAQuarterOfAPixelOrRefused) {
  const std::string rational = with(
      with(with(kRos, "plumb_bob", "rational_polynomial"), "cols: 5", "cols: 8"),
      "[-0.3, 0.1, 0.002, -0.0015, 0.01]", "[-0.2, 0.05, 0.001, -0.001, 0.01, 0.05, -0.01, 0.002]");
  const Imported got = read({rational});
  ASSERT_FALSE(got.said.empty());
  EXPECT_NE(got.said[0].find("rational lens, approximated by k1 k2 p1 p2 k3 to"),
            std::string::npos);
  for (const Vector3d& p : kPoints) {
    const double x = p.x() / p.z(), y = p.y() / p.z(), r2 = x * x + y * y;
    const double c = (1 - 0.2 * r2 + 0.05 * r2 * r2 + 0.01 * r2 * r2 * r2) /
                     (1 + 0.05 * r2 - 0.01 * r2 * r2 + 0.002 * r2 * r2 * r2);
    const Vector2d own(520.5 * (x * c + 0.002 * x * y - 0.001 * (r2 + 2 * x * x)) + 310.25,
                       518.25 * (y * c + 0.001 * (r2 + 2 * y * y) - 0.002 * x * y) + 250.5);
    EXPECT_LT((got.rig.cameras[0].camera.project(p) - own).norm(), 0.1);
  }
  // Four zeros behind: the same lens as plumb_bob, exactly.
  const std::string zeros = with(rational, "0.05, -0.01, 0.002]", "0.0, 0.0, 0.0]");
  EXPECT_LT(furthest(read({zeros}).rig.cameras[0].camera, {-0.2, 0.05, 0.001, -0.001, 0.01}, 520.5,
                     518.25, 310.25, 250.5),
            1e-9);
  const std::string bend =
      with(with(kKalibr, "distortion_model: radtan", "distortion_model: equidistant"),
           "[-0.28, 0.07, 0.0002, -0.001]", "[0.01, -0.005, 0.001, 0.0]");
  const auto focal = [&bend](const std::string& f) {
    return with(bend, "[458.6, 457.2,", "[" + f + ", " + f + ",");
  };
  const Imported narrow = read({focal("1400")});
  for (const Vector3d& far : kPoints) {
    const Vector3d p(0.3 * far.x(), 0.3 * far.y(), far.z());
    const double r = p.head<2>().norm() / p.z(), a = std::atan(r), s = a * a;
    const double d = a * (1 + 0.01 * s - 0.005 * s * s + 0.001 * s * s * s) / r;
    const Vector2d own(1400 * d * p.x() / p.z() + 367.2, 1400 * d * p.y() / p.z() + 248.3);
    EXPECT_LT((narrow.rig.cameras[0].camera.project(p) - own).norm(), 0.1);
  }
  EXPECT_EQ(
      refused({focal("190")}),
      "f0.yaml:2:3: equidistant: sees more than 80° off its axis, which no lens of a rig does");
  EXPECT_NE(refused({focal("458")})
                .find("equidistant lens: the nearest k1 k2 p1 p2 k3 is off by up to 3"),
            std::string::npos);
  // The sphere of omni: a pinhole xi behind its centre.
  const std::string omni =
      with(with(with(kKalibr, "camera_model: pinhole", "camera_model: omni"),
                "[458.6, 457.2, 367.2, 248.3]", "[0.8, 2500, 2500, 367.2, 248.3]"),
           "[-0.28, 0.07, 0.0002, -0.001]", "[0.02, 0.0, 0.0002, -0.001]");
  const Imported sphere = read({omni});
  for (const Vector3d& far : kPoints) {
    const Vector3d p(0.3 * far.x(), 0.3 * far.y(), far.z());
    const double depth = p.z() + 0.8 * p.norm();
    const Vector2d own =
        opencv_pixel({p.x(), p.y(), depth}, {0.02, 0.0, 0.0002, -0.001}, 2500, 2500, 367.2, 248.3);
    EXPECT_LT((sphere.rig.cameras[0].camera.project(p) - own).norm(), 0.1);
  }
}

TEST(ForeignCalibration, WhatIsNoCalibrationIsRefusedByItsName) {
  struct Case {
    std::string from, to, words;
  };
  const std::string k =
      "[ 520.5,    0.     ,  310.25,\n\t0., 518.25, 250.5,\n          0.     ,    0.     "
      ",    1.     ]";
  for (const Case& c : std::vector<Case>{
           {k, "[0, 0, 0, 0, 0, 0, 0, 0, 0]",
            "f0.yaml:5:3: a focal length of 0: a placeholder, no calibration"},
           {"520.5", ".nan", "f0.yaml:7:11: camera_matrix: expected a finite number, found '.nan'"},
           {"520.5,    0. ", "520.5,    0.3",
            "f0.yaml:5:3: camera_matrix: has a skew, which no lens of a rig has"},
           {"640", "1", "f0.yaml:5:3: pictures of 1x480: a placeholder, no calibration"},
           {"520.5", "0.0036", "f0.yaml:5:3: focal lengths 0.0036 and 518.25 are not in pixels"},
           {"640", "300",
            "f0.yaml:5:3: centre (310.25, 250.5) outside of pictures of 300x480: is it of another "
            "resolution?"},
           {"plumb_bob", "thin_prism",
            "f0.yaml:5:3: lens model 'thin_prism': no lens of a rig, expected plumb_bob, radtan, "
            "rational_polynomial or equidistant"},
           {"plumb_bob", "equidistant",
            "f0.yaml:5:3: equidistant: expected 4 coefficients, found 5"},
           {"[-0.3, 0.1, 0.002, -0.0015, 0.01]", "[0, 0, 0, 0, 0]",
            "f0.yaml:20:3: no distortion, but projection_matrix is not camera_matrix: of rectified "
            "pictures alone; expected the raw pictures' distortion, or both equal"},
           {"[-0.3, 0.1, 0.002, -0.0015, 0.01]", "[-3, 0.1, 0.002, -0.0015, 0.01]",
            "f0.yaml:5:3: its distortion folds the picture over, so that it describes no lens"},
           {"image_width: 640", "image_width: [640]",
            "f0.yaml:1:14: image_width: expected a finite number, found a list"},
           {"distortion_coefficients", "distortion_coefficents",
            "f0.yaml:1:1: distortion_coefficients is missing (or Distortion_Coefficients, "
            "distCoeffs, dist_coeffs, distCoefs, dist_coefs, DistCoeffs, D, d, dist, distortion, "
            "distCoef, dist_coeff, camera_distortion, distortion_coeffs)"}})
    EXPECT_EQ(refused({with(kRos, c.from, c.to)}), c.words);
  EXPECT_EQ(refused({with(kRos, "0.002, -0.0015", "7.8e10, -0.0015")}),
            "f0.yaml:5:3: its focal lengths or distortion are of no lens");
  EXPECT_EQ(refused({with(kRos, "plumb_bob", "\"a\\nb\"")}),
            "f0.yaml:5:3: lens model 'a\\u000ab': no lens of a rig, expected plumb_bob, radtan, "
            "rational_polynomial or equidistant");
  EXPECT_EQ(
      refused({"images:\n  - left01.jpg\n"}),
      "f0.yaml: expected a calibration of ROS (camera_info), OpenCV, Kalibr (camchain), camodocal "
      "or ORB-SLAM");
  EXPECT_EQ(
      refused({kRos, kKalibr}),
      "f1.yaml: is a Kalibr camchain, f0.yaml is a ROS camera_info: expected two of one kind");
  const std::string unnamed =
      with(with(with(kRos, "plumb_bob", "\"\""), "cols: 5", "cols: 4"), ", 0.01]", "]");
  EXPECT_EQ(
      refused({unnamed}),
      "f0.yaml:5:3: four coefficients and no lens model: --lens plumb_bob (k1 k2 p1 p2) or --lens "
      "equidistant (k1 k2 k3 k4, cv::fisheye)");
  ImportOptions lens = dated();
  lens.lens = "plumb_bob";
  EXPECT_LT(furthest(read({unnamed}, lens).rig.cameras[0].camera, {-0.3, 0.1, 0.002, -0.0015},
                     520.5, 518.25, 310.25, 250.5),
            1e-9);
}

TEST(ForeignCalibration, AReaderOfRigsNamesThem) {
  for (const auto& [text, kind] :
       std::vector<std::pair<std::string, std::string>>{{kRos, "a ROS camera_info"},
                                                        {kOpencv, "an OpenCV file"},
                                                        {kKalibr, "a Kalibr camchain"}})
    EXPECT_EQ(testing::refusal([&text = text] { model::parse_rig(text, "cam.yaml"); }),
              "cam.yaml: is " + kind +
                  ", expected a rig: mimesis calibrate import cam.yaml --date "
                  "YYYY-MM-DD -o rig.yaml");
}

}  // namespace
}  // namespace mimesis::tool
