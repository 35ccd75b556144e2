// Figures written as BVH and glTF, and scenes read: by a foreign reader and by ours.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>

#include "common/motion/mocap/clip_file.h"
#include "common/motion/mocap/clip_writers.h"
#include "common/motion/mocap/test/foreign_scene.h"
#include "common/motion/mocap/test/walker.h"
#include "common/testing/temporary_folder.h"

namespace mimesis::mocap {
namespace {

using nlohmann::json;

/// The walker with everything turned by something, at one frame even by a right angle about x.
BodyClip turning() {
  BodyClip clip = walk({.seconds = 0.5, .turn_rad_s = 0.4, .heading_rad = 2.0});
  std::mt19937 random(7);
  std::uniform_real_distribution<double> some(-0.6, 0.6);
  for (double& angle : clip.angles_rad.reshaped()) angle += some(random);
  clip.angles_rad.col(3).segment<3>(3 * kLeftElbow) << 0.0, 0.5 * M_PI, 0.0;  // x of the file
  clip.angles_rad.col(4).segment<3>(3 * kRightHip) << 0.0, -0.5 * M_PI, 0.0;
  return clip;
}

/// In this project's axes [m].
Eigen::Vector3d in_project(const Eigen::Vector3d& file, double unit_m) {
  return unit_m * Eigen::Vector3d(file.z(), file.x(), file.y());
}

const std::map<std::string, BodyJoint> kSome = {
    {"Hips", kRoot},   {"LeftFoot", kLeftAnkle}, {"RightLeg", kRightKnee},
    {"Head", kHead},   {"LeftHand", kLeftWrist}, {"RightForeArm", kRightElbow},
    {"Spine1", kChest}};

/// A glb with another document.
std::string edited(const std::string& glb, const std::function<void(json&)>& edit) {
  std::uint32_t size = 0;
  std::memcpy(&size, glb.data() + 12, 4);
  json document = json::parse(glb.substr(20, size));
  edit(document);
  std::string text = document.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string out = glb.substr(0, 12) + glb.substr(12, 8) + text + glb.substr(20 + size);
  const auto put = [&out](std::size_t at, std::size_t value) {
    const auto number = static_cast<std::uint32_t>(value);
    std::memcpy(out.data() + at, &number, 4);
  };
  put(8, out.size());
  put(12, text.size());
  return out;
}

class Scene : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& bytes) {
    const std::string path = folder_.path() + "/" + name;
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }
  std::string refusal(const std::string& file) {
    try {
      (void)to_body(read_clip(file));
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  }
  testing::TemporaryFolder folder_;
};

TEST_F(Scene, AForeignReaderSeesTheFigureWhereItIs) {
  const BodyClip clip = turning();
  struct Kind {
    std::string file;
    double unit_m, within_m;
  };
  for (const Kind& kind : {Kind{write("a.bvh", bvh_text(clip)), 0.01, 2e-5},
                           Kind{write("a.glb", glb_bytes(clip)), 1.0, 2e-5}}) {
    const ForeignScene scene(kind.file);
    ASSERT_EQ(scene.frames(), clip.frames()) << kind.file;
    EXPECT_NEAR(scene.time(12), 12.0 / clip.rate_hz, 1e-6) << kind.file;
    for (unsigned t = 0; t < scene.frames(); ++t) {
      const BodyPose pose = clip.pose(t);
      for (const auto& [name, joint] : kSome) {
        const Eigen::Vector3d p = in_project(scene.place(name, t), kind.unit_m);
        EXPECT_LT((p - pose.point(joint, Eigen::Vector3d::Zero())).norm(), kind.within_m)
            << kind.file << ' ' << name << " frame " << t;
      }
    }
  }
}

TEST_F(Scene, ANameThatIsNoUtf8IsWritten) {
  BodyClip clip = walk({.seconds = 0.5});
  clip.name = "l\xe4ufer";
  EXPECT_EQ(read_clip(write("a.glb", glb_bytes(clip))).frames(), clip.frames());
}

TEST_F(Scene, BonesReachFromJointToJoint) {
  const ForeignScene scene(write("a.glb", glb_bytes(turning())));
  for (const std::string to : {"LeftLeg", "RightFoot", "LeftForeArm", "Neck"}) {
    const Eigen::Vector3d tip = scene.place(to + "_bone", 12, aiVector3D(0.0f, 1.0f, 0.0f));
    EXPECT_LT((tip - scene.place(to, 12)).norm(), 2e-5) << to;
  }
}

TEST_F(Scene, OursReadsBackWhatWasWritten) {
  const BodyClip clip = walk({.turn_rad_s = 0.3});
  for (const std::string& file :
       {write("a.bvh", bvh_text(clip)), write("a.glb", glb_bytes(clip))}) {
    const Clip read = read_clip(file);
    ASSERT_EQ(read.frames(), clip.frames()) << file;
    EXPECT_DOUBLE_EQ(read.rate_hz, clip.rate_hz);
    const BodyClip again = to_body(read);
    for (Eigen::Index t = 0; t < clip.frames(); t += 50) {
      const BodyPose is = again.pose(t), was = clip.pose(t);
      for (std::size_t j = 0; j < kBodyJoints; ++j) {
        EXPECT_LT((is.p_WJ[j] - was.p_WJ[j]).norm(), 2e-5) << file << ' ' << kBodyJointNames[j];
      }
    }
  }
}

/// As exporters write it: in cm, z up, below a node that turns and shrinks all.
TEST_F(Scene, NodesAboveTheHipsCount) {
  const BodyClip clip = walk({.seconds = 1.0, .turn_rad_s = 0.3});
  constexpr double kScale = 1.15;
  const double half = std::sqrt(0.5);
  const std::string file =
      write("b.glb", edited(glb_bytes(clip), [&](json& document) {
              const std::size_t at = document["nodes"].size();
              document["nodes"].push_back({{"name", "Armature"},
                                           {"children", {0}},
                                           {"translation", {1.0, 0.0, 0.0}},
                                           {"rotation", {0.0, half, 0.0, half}},
                                           {"scale", {kScale, kScale, kScale}}});
              document["scenes"][0]["nodes"] = json::array({at});
            }));
  const BodyClip read = to_body(read_clip(file));
  // a quarter turn about the file's y: its z goes to x, its x to -z; so ours goes from x to y
  Eigen::Matrix3d turn;
  turn << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  for (Eigen::Index t = 0; t < clip.frames(); t += 20) {
    const BodyPose is = read.pose(t), was = clip.pose(t);
    for (std::size_t j = 0; j < kBodyJoints; ++j) {
      const Eigen::Vector3d wanted = kScale * turn * was.p_WJ[j] + Eigen::Vector3d(0.0, 1.0, 0.0);
      EXPECT_LT((is.p_WJ[j] - wanted).norm(), 1e-4) << kBodyJointNames[j] << " frame " << t;
    }
  }
}

/// Angles are those from the posture that the nodes show without their animation.
TEST_F(Scene, ARestPostureIsTheZeroPosture) {
  const BodyClip clip = walk({.seconds = 0.5, .turn_rad_s = 0.4});
  const Eigen::Quaterniond rest(Eigen::AngleAxisd(0.5, Eigen::Vector3d(0.6, 0.0, 0.8)));
  const std::string glb = glb_bytes(clip);
  const std::string file =
      write("rest.glb", edited(glb, [&](json& document) {
              document["nodes"][kLeftHip]["rotation"] = {rest.x(), rest.y(), rest.z(), rest.w()};
            }));
  const Clip was = read_clip(write("a.glb", glb)), is = read_clip(file);
  const auto knee_of = [](const Clip& of) {
    return std::ranges::find(of.skeleton.joints, "LeftLeg", &Joint::name)->offset_m;
  };
  const Eigen::Vector3d knee_m = knee_of(was);
  const Eigen::Vector3d in_file(knee_m.y(), knee_m.z(), knee_m.x());
  EXPECT_LT((knee_of(is) - in_project(rest * in_file, 1.0)).norm(), 1e-5);
  const BodyPose pose = to_body(is).pose(7), wanted = clip.pose(7);
  for (std::size_t j = 0; j < kBodyJoints; ++j) {
    EXPECT_LT((pose.p_WJ[j] - wanted.p_WJ[j]).norm(), 1e-4) << kBodyJointNames[j];
  }
}

TEST_F(Scene, JointsBelowAMeshCount) {
  const BodyClip clip = walk({.seconds = 0.5});
  const std::string file =
      write("m.glb", edited(glb_bytes(clip), [](json& document) {
              json& children = document["nodes"][kLeftHip]["children"];
              const std::size_t at = document["nodes"].size();
              for (json& child : children) {
                if (child == int{kLeftKnee}) child = at;
              }
              document["nodes"].push_back(
                  {{"name", "Thigh"}, {"mesh", 0}, {"children", {int{kLeftKnee}}}});
            }));
  const BodyClip read = to_body(read_clip(file));
  const BodyPose is = read.pose(7), was = clip.pose(7);
  EXPECT_LT((is.p_WJ[kLeftAnkle] - was.p_WJ[kLeftAnkle]).norm(), 1e-4);
}

TEST_F(Scene, OneOfSeveralAnimationsIsNamed) {
  const BodyClip clip = walk({.seconds = 1.0});
  const std::string file = write("two.glb", edited(glb_bytes(clip), [](json& document) {
                                   json second = document["animations"][0];
                                   second["name"] = "Run";
                                   document["animations"][0]["name"] = "Walk";
                                   document["animations"].push_back(second);
                                 }));
  EXPECT_EQ(refusal(file),
            file + ": 2 animations: Walk, Run, expected one of them behind '#': FILE#NAME");
  EXPECT_EQ(refusal(file + "#Hop"),
            file + ": no animation 'Hop': Walk, Run, expected one of them behind '#': FILE#NAME");
  EXPECT_EQ(read_clip(file + "#Run").name, "two.glb#Run");
}

TEST_F(Scene, WhatIsNoMotionOfAPersonIsNamed) {
  const BodyClip clip = walk({.seconds = 1.0});
  const std::string glb = glb_bytes(clip);
  const auto without = [&](const char* part) {
    return write("w.glb", edited(glb, [&](json& document) { document.erase(part); }));
  };
  EXPECT_NE(refusal(without("animations")).find("no animation, expected a motion"),
            std::string::npos);
  EXPECT_NE(refusal(write("cut.glb", glb.substr(0, glb.size() / 2))).find("cannot be read"),
            std::string::npos);
  EXPECT_NE(refusal(write("text.fbx", "hello")).find("cannot be read"), std::string::npos);
  EXPECT_NE(refusal("absent.glb").find("cannot be read"), std::string::npos);
  EXPECT_NE(refusal(write("a.obj", "v 0 0 0")).find("expected .bvh, .amc, .c3d, .glb"),
            std::string::npos);
  // legs alone
  const std::string legs = write("legs.glb", edited(glb, [](json& document) {
                                   document["nodes"][0]["children"] = json::array({1, 4});
                                 }));
  EXPECT_NE(refusal(legs).find("expected"), std::string::npos) << refusal(legs);
}

}  // namespace
}  // namespace mimesis::mocap
