// `mimesis calibrate hand-eye` on rendered boards, and the tables of poses that people write.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "common/image/image.h"
#include "common/model/files.h"
#include "common/model/rig_file.h"
#include "common/testing/process.h"
#include "common/testing/refusal.h"
#include "common/testing/temporary_folder.h"
#include "nodes/vision/calibration/testing/board_scene.h"
#include "nodes/vision/verb/calibrate_tools.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;
using Eigen::Isometry3d;
using Eigen::Vector3d;

Isometry3d pose_at(const Vector3d& place, const Vector3d& axis_angle) {
  Isometry3d X = Isometry3d::Identity();
  X.translation() = place;
  X.linear() = Eigen::AngleAxisd(axis_angle.norm(), axis_angle.normalized()).toRotationMatrix();
  return X;
}

/// An arm that looks at a board with the camera that it carries; pictures rendered once.
class HandEyeVerb : public testing::VerbTest {
 protected:
  static constexpr int kPictures = 8;

  static void SetUpTestSuite() {
    std::mt19937 random(404);
    const auto pair = vision::random_pair(random);
    const vision::TrueCamera& c = pair[0];
    const image::Lens lens{c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.k};
    const image::Camera first(lens, Eigen::Matrix3d::Identity(), Vector3d::Zero()),
        second(lens, Eigen::Matrix3d::Identity(), Vector3d(0.1, 0.0, 0.0));
    image::Rig rig{"2026-11-30", "8x5", image::Rig::Frame::camera, 12, 0.1, {}};
    rig.cameras = {{"left", first, 0.1}, {"right", second, 0.1}};
    std::ofstream(folder_ / "rig.yaml") << model::rig_text(rig);
    for (int i = 0; i < kPictures; ++i) {
      const Isometry3d X_CB = vision::random_place(board_, pair, random);
      X_WF_.push_back(X_WB_ * (X_FC_ * X_CB).inverse());
      ASSERT_TRUE(
          image::write_png(folder_ / name(i), vision::board_picture(c, board_, X_CB, 2.0, random)));
    }
  }

  static std::string name(int i) { return "p" + std::to_string(i) + ".png"; }
  static std::string at(const char* file) { return (folder_ / file).string(); }
  /// A table with quaternions under these names, w x y z as they are written.
  static std::string table(const std::string& names, double unit_m = 1.0, int late = 0) {
    std::string out = "# by hand\r\n" + names + "\r\n";
    for (int i = 0; i < kPictures; ++i) {
      const Isometry3d& X = X_WF_[static_cast<std::size_t>((i + late) % kPictures)];
      const Eigen::Quaterniond q(X.linear());
      const Vector3d p = X.translation() / unit_m;
      char line[256];
      std::snprintf(line, sizeof line, "%s;%.6f;%.6f;%.6f;%.7f;%.7f;%.7f;%.7f", name(i).c_str(),
                    p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z());
      out += line + std::string(i + 1 < kPictures ? "\r\n" : "");
    }
    return out;
  }
  int run(const std::string& poses, const std::vector<std::string>& more = {}) {
    std::ofstream(folder_ / "poses.csv", std::ios::binary) << poses;
    std::vector<std::string> words{"calibrate", "hand-eye", at("rig.yaml"), at("poses.csv"),
                                   "--board",   "8x5",      "--square-m",   "0.03",
                                   "--on-arm",  "camera"};
    for (std::size_t i = 0; i < more.size(); ++i) {  // an option instead of the one above
      const auto there = std::ranges::find(words, more[i]);
      if (there == words.end())
        words.push_back(more[i]);
      else
        there[1] = more[++i];
    }
    return call(words, std::chrono::seconds(100));
  }

  static inline const vision::Board board_{8, 5, 0.03};
  static inline testing::TemporaryFolder folder_;
  static inline const Isometry3d X_FC_ = pose_at({0.02, -0.06, 0.09}, {0.1, -0.2, 1.5}),
                                 X_WB_ = pose_at({0.5, 0.1, 0.02}, {3.0, 0.2, 0.1});
  static inline std::vector<Isometry3d> X_WF_;
};

constexpr const char* kNames = "file;x_m;y_m;z_m;qw;qx;qy;qz";

TEST_F(HandEyeVerb, FindsTheCameraOnTheArm) {
  ASSERT_EQ(run(table(kNames), {"--json", "-o", at("hand.yaml")}), 0) << errors_;
  const auto report = nlohmann::json::parse(output_);
  EXPECT_EQ(report["frame"], "flange");
  EXPECT_EQ(report["pictures"].size(), 8u);
  EXPECT_LT(report["rms_px"].get<double>(), 0.3);
  EXPECT_LT(report["rms_m"].get<double>(), 0.5e-3);
  EXPECT_NEAR(report["square_ratio"].get<double>(), 1.0, 0.01);
  EXPECT_EQ(report["advice"][0], "take 12 poses or more, these are 8");
  const image::Rig rig = model::load_rig(at("hand.yaml"));
  EXPECT_EQ(rig.frame, image::Rig::Frame::flange);
  EXPECT_LT((rig.cameras[0].camera.eye() - X_FC_.translation()).norm(), 2e-3);
  EXPECT_GT(rig.position_2sigma_m.norm(), 0.0);
  EXPECT_LT(rig.position_2sigma_m.norm(), 5e-3);
  // The second camera stays 0.1 m to the right of the first.
  const Vector3d right = X_FC_ * Vector3d(0.1, 0.0, 0.0);
  EXPECT_LT((rig.cameras[1].camera.eye() - right).norm(), 2.5e-3);
  EXPECT_EQ(run(table(kNames)), 0) << errors_;
  EXPECT_NE(output_.find("camera in the flange: position ("), std::string::npos) << output_;
  // A picture that does not show the board is named, and the others are used.
  image::Image grey(640, 480);
  std::ranges::fill(grey.bgr, std::uint8_t{120});
  ASSERT_TRUE(image::write_png(folder_ / "grey.png", grey));
  EXPECT_EQ(run(table(kNames) + "\r\ngrey.png;0;0;0;1;0;0;0\r\n"), 0) << errors_;
  EXPECT_NE(output_.find("rejected grey.png: no whole board of 8x5"), std::string::npos) << output_;
  // Names of others are shown, never obeyed: no UTF-8, and what moves a terminal's cursor.
  const std::string odd = "gr\xFC\x1B[2J.png";
  fs::copy(folder_ / "grey.png", folder_ / odd);
  ASSERT_EQ(run(table(kNames) + "\r\n" + odd + ";0;0;0;1;0;0;0", {"--json"}), 0) << errors_;
  EXPECT_EQ(nlohmann::json::parse(output_)["rejected"][0]["name"], "gr\\u00fc\\u001b[2J.png");
}

TEST_F(HandEyeVerb, MistakesOfPeopleAreToldInOneLine) {
  const auto says = [&](const std::string& poses, int exit_code, const char* words,
                        const std::vector<std::string>& more = {}) {
    EXPECT_EQ(run(poses, more), exit_code) << errors_;
    EXPECT_NE(errors_.find(words), std::string::npos) << errors_;
    EXPECT_EQ(std::ranges::count(errors_, '\n'), 1) << errors_;
  };
  says(table(kNames, 1e-3), 1, "if the positions are in mm, not in m");
  says(table("file;x_mm;y_mm;z_mm;qw;qx;qy;qz"), 1, "if the positions are in m, not in mm");
  says(table("file;x_m;y_m;z_m;qx;qy;qz;qw"), 1,
       "if the quaternions are written w x y z, under the names x y z w");
  says(table(kNames, 1.0, 1), 1, "if each pose belongs to the picture one row behind it");
  says(table(kNames, 1.0, kPictures - 1), 1,
       "if each pose belongs to the picture one row before it");
  says(table(kNames), 1, "if each pose is that of the base in the flange", {"--on-arm", "board"});
  says(table(kNames), 1, "if the squares have 30 mm, not 60 mm", {"--square-m", "0.06"});
  says(table("file;x;y;z;qw;qx;qy;qz"), 2, "column 'x': expected x y z with one unit");
  says(table(kNames), 2, "lies in the same way after half a turn", {"--board", "9x5"});
  says("file;x_m\nabsent.png;1", 2, "column 'x_m': expected x y z with one unit");
  says("file;qw;qx;qy;qz\nabsent.png;1;0;0;0", 2, "expected the columns x_m y_m z_m");
  says(std::string(kNames) + "\nabsent.png;0;0;0;1;0;0;0", 2, "poses.csv:2: ");
  says(table(kNames), 2, "no camera 'top'", {"--camera", "top"});
}

/// An arm by its own kinematics holds the board before a camera that stands.
TEST_F(HandEyeVerb, FindsTheCameraBeforeAnArmByItsJoints) {
  const kin::ArmModel arm = model::load_arm("lwr4.yaml");
  const image::Lens lens = model::load_rig(at("rig.yaml")).cameras[0].camera.lens();
  const vision::TrueCamera camera{lens.width_px, lens.height_px, lens.fx_px,     lens.fy_px,
                                  lens.cx_px,    lens.cy_px,     lens.distortion};
  const Isometry3d X_FB = pose_at({0.01, 0.02, 0.05}, {0.1, 0.2, 0.4});
  Isometry3d place = pose_at({0.0, 0.0, 0.5}, {0.1, -0.1, 0.2});
  place.translation() -= place.linear() * board_.middle();
  const Isometry3d X_WC = kin::end_effector(arm, arm.home) * X_FB * place.inverse();
  std::mt19937 random(77);
  std::uniform_real_distribution<double> by(-0.4, 0.4);
  std::string table = "picture";
  for (int i = 1; i <= 7; ++i) table += "\tA" + std::to_string(i) + "_deg";
  for (int i = 0; i < 12;) {
    Eigen::VectorXd q = arm.home;
    for (int k = 0; k < 7; ++k) q[k] += by(random);
    const Isometry3d X_CB = X_WC.inverse() * kin::end_effector(arm, q) * X_FB;
    if (!vision::holds(camera, board_, X_CB) || X_CB.linear()(2, 2) < 0.7) continue;
    const std::string file = "arm" + std::to_string(i++) + ".png";
    ASSERT_TRUE(
        image::write_png(folder_ / file, vision::board_picture(camera, board_, X_CB, 2.0, random)));
    table += "\n" + file;
    for (int k = 0; k < 7; ++k) table += "\t" + std::to_string(q[k] * 180.0 / std::numbers::pi);
  }
  const std::vector<std::string> board_on_arm{"--on-arm",  "board", "--arm",
                                              "lwr4.yaml", "-o",    at("before.yaml")};
  ASSERT_EQ(run(table, board_on_arm), 0) << errors_;
  EXPECT_NE(output_.find("camera in the base: position ("), std::string::npos) << output_;
  const image::Rig rig = model::load_rig(at("before.yaml"));
  EXPECT_EQ(rig.frame, image::Rig::Frame::base);
  EXPECT_LT((rig.cameras[0].camera.eye() - X_WC.translation()).norm(), 2e-3);
  EXPECT_LT((rig.cameras[0].camera.R_CT().transpose() - X_WC.linear()).norm(), 5e-3);
  // The same numbers as radians are beyond the joints' limits.
  for (std::size_t i; (i = table.find("_deg")) != std::string::npos;) table.replace(i, 4, "_rad");
  EXPECT_EQ(run(table, board_on_arm), 2);
  EXPECT_NE(errors_.find("if these are degrees, name the columns A1_deg"), std::string::npos)
      << errors_;
}

std::string refusal_of(const std::string& text, const kin::ArmModel* arm = nullptr) {
  return testing::refusal([&] { read_arm_poses(text, "t.csv", arm); });
}

TEST(ArmPoses, TurnsAreReadByTheNamesOfTheirColumns) {
  const Eigen::Matrix3d expected =
      (Eigen::AngleAxisd(0.3, Vector3d::UnitZ()) * Eigen::AngleAxisd(-0.2, Vector3d::UnitY()) *
       Eigen::AngleAxisd(0.1, Vector3d::UnitX()))
          .toRotationMatrix();
  const Eigen::AngleAxisd about(expected);
  const Eigen::Quaterniond q(expected);
  const Vector3d v = about.angle() * about.axis();
  const auto row = [](const std::string& names, std::vector<double> values) {
    std::string out = "file," + names + ",x_mm,y_mm,z_mm\na.png";
    for (const double value : values) out += "," + std::to_string(value);
    return out + ",100,200,-300\n";
  };
  const double d = 180.0 / std::numbers::pi;
  for (const std::string& text :
       {row("qx,qy,qz,qw", {q.x(), q.y(), q.z(), q.w()}),
        row("qw,qx,qy,qz", {-q.w(), -q.x(), -q.y(), -q.z()}),
        row("rotvec_x_rad,rotvec_y_rad,rotvec_z_rad", {v.x(), v.y(), v.z()}),
        row("rotvec_x_deg,rotvec_y_deg,rotvec_z_deg", {d * v.x(), d * v.y(), d * v.z()}),
        row("yaw_rad,pitch_rad,roll_rad", {0.3, -0.2, 0.1}),
        row("Roll_deg,Pitch_deg,Yaw_deg", {d * 0.1, d * -0.2, d * 0.3}),
        row("A_deg,B_deg,C_deg", {d * 0.3, d * -0.2, d * 0.1})}) {
    const ArmPoses poses = read_arm_poses(text, "t.csv", nullptr);
    const Isometry3d& X = poses.readings[0].X_WF.at(0);
    EXPECT_LT((X.linear() - expected).norm(), 1e-5) << text;
    EXPECT_LT((X.translation() - Vector3d(0.1, 0.2, -0.3)).norm(), 1e-12);
    EXPECT_EQ(poses.files.at(0), "a.png");
    EXPECT_EQ(poses.lines.at(0), 2);
    EXPECT_EQ(poses.readings[0].name, "");
    EXPECT_GE(poses.readings.size(), 3u);
  }
}

TEST(ArmPoses, WhatHasTwoMeaningsIsRefused) {
  const std::string pose = ",x_m,y_m,z_m,qw,qx,qy,qz\n";
  const struct {
    std::string text;
    const char* told;
  } cases[] = {
      {"", "t.csv: has no poses"},
      {"file" + pose, "t.csv: has no poses"},
      {"a.png,0,0,0,1,0,0,0\n", "t.csv:1: expected the names of the columns first"},
      {"when" + pose + "1,0,0,0,1,0,0,0\n", "t.csv:1: expected a column 'file'"},
      {"file,x,y,z,qw,qx,qy,qz\na,0,0,0,1,0,0,0\n",
       "t.csv:1: column 'x': expected x y z with one unit in their names: x_m or x_mm"},
      {"file,x_m,y_m,z_m,rx,ry,rz\na,0,0,0,1,0,0\n",
       "t.csv:1: column 'rx': arms mean different turns by it; expected qw qx qy qz; or rotvec"},
      {"file,x_m,y_m,z_m,roll,pitch,yaw\na,0,0,0,1,0,0\n",
       "t.csv:1: column 'roll': expected all of one kind and unit"},
      {"file,x_m,y_m,z_m,qw,qx,qy\na,0,0,0,1,0,0\n",
       "t.csv:1: column 'qw': expected all of one kind and unit"},
      {"file,time" + pose + "a,1,0,0,0,1,0,0,0\n", "t.csv:1: column 'time': is not known"},
      {"file,x_m,x_m\na,0,0\n", "t.csv:1: column 'x_m' is there twice"},
      {"file,image" + pose + "a,b,0,0,0,1,0,0,0\n", "t.csv:1: columns 'file' and 'image' are both"},
      {"file" + pose + "a,0,0,0,1,0,0\n", "t.csv:2: 7 values, expected 8: one a column"},
      {"file" + pose + "\n# x\na,0,0,0,1,0,0,none\n", "t.csv:4: qz: expected a number"},
      {"file" + pose + "a,0,0,nan,1,0,0,0\n", "t.csv:2: z_m: expected a number"},
      {"file" + pose + "a,0,0,0,1,1,0,0\n",
       "t.csv:2: qw qx qy qz: expected a quaternion of length"},
      {"file" + pose + "a,0,0,0,1,0,0,0\na,0,0,0,1,0,0,0\n",
       "t.csv:3: picture 'a' is in line 2 already"},
      {"file" + pose + ",0,0,0,1,0,0,0\n", "t.csv:2: the picture's file is missing"},
      {"file;x_m;y_m;z_m;qw;qx;qy;qz\na;0,1;0;0;1;0;0;0\n",
       "t.csv:2: x_m: expected a number, found '0,1'"},
      {"file,x_m,y_m,z_m,roll_rad,pitch_rad,yaw_rad\na,0,0,0,90,0,0\n",
       "t.csv:2: roll_rad pitch_rad yaw_rad: 90 rad is more than a turn; if these are degrees"},
      {"file,x_m,y_m,z_m,qw,qx,qy,qz,a_deg,b_deg,c_deg\na,0,0,0,1,0,0,0,0,0,0\n",
       "t.csv:1: two kinds of turn: qw and a_deg; expected one"}};
  for (const auto& c : cases) {
    const std::string told = refusal_of(c.text);
    EXPECT_TRUE(told.starts_with(c.told)) << told;
  }
}

TEST(ArmPoses, JointsOfAnArmGivePoses) {
  const kin::ArmModel arm = model::load_arm("lwr4.yaml");
  std::string names = "file", row = "p.png", degrees = "p.png";
  Eigen::VectorXd q(7);
  for (int i = 0; i < 7; ++i) {
    q[i] = 0.1 * (i + 1);
    names += ",A" + std::to_string(i + 1) + "_rad";
    row += "," + std::to_string(q[i]);
    degrees += "," + std::to_string(q[i] * 180.0 / std::numbers::pi);
  }
  const ArmPoses poses = read_arm_poses(names + "\n" + row, "t.csv", &arm);
  EXPECT_TRUE(poses.readings[0].X_WF[0].isApprox(kin::end_effector(arm, q), 1e-6));
  std::string in_degrees = names;
  for (std::size_t at; (at = in_degrees.find("_rad")) != std::string::npos;)
    in_degrees.replace(at, 4, "_deg");
  const ArmPoses same = read_arm_poses(in_degrees + "\n" + degrees, "t.csv", &arm);
  EXPECT_TRUE(same.readings[0].X_WF[0].isApprox(kin::end_effector(arm, q), 1e-5));
  // What is refused at once, and what only the pictures can tell.
  const std::string large = refusal_of(names + "\n" + degrees, &arm);
  EXPECT_TRUE(large.starts_with("t.csv:2: a1_rad: 5.7")) << large;
  EXPECT_NE(large.find("if these are degrees, name the columns A1_deg"), std::string::npos)
      << large;
  EXPECT_EQ(poses.readings[1].name, "the angles are degrees, not radians");
  EXPECT_TRUE(
      refusal_of("file,A1_rad\np,0", &arm)
          .starts_with("t.csv:1: expected the column A2_rad of the arm 'lwr4', which has 7"));
  EXPECT_TRUE(refusal_of("file,A1_rad\np,0").starts_with("t.csv:1: column 'a1_rad'"));
}

}  // namespace
}  // namespace mimesis::tool
