#include "common/motion/mocap/body_map.h"

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <new>

#include "common/math/so3.h"
#include "common/motion/mocap/body.h"
#include "common/motion/mocap/clip_file.h"
#include "common/motion/mocap/cycles.h"
#include "common/motion/mocap/test/shared_folder.h"
#include "common/testing/refusal.h"

namespace mimesis::mocap {
namespace {

using Eigen::Vector3d;

/// The skeleton of the map's joints in a row of branches, without a motion.
Clip bare_clip(const BodyMap& map) {
  Clip clip;
  clip.name = "bare.bvh";
  clip.rate_hz = 60.0;
  auto& joints = clip.skeleton.joints;
  for (std::size_t j = 0; j < kBodyJoints; ++j) {
    joints.push_back({map.joints[j], kBodyParents[j], standard_body().offset_m[j]});
  }
  joints[0].offset_m.setZero();
  const Vector3d ball(0.15, 0.0, 0.15 * std::tan(map.sole_rad));
  joints.push_back({map.toes[kLeft], kLeftAnkle, ball});
  joints.push_back({map.toes[kRight], kRightAnkle, ball});
  clip.skeleton.ends.push_back({"head_end", kHead, {0.0, 0.0, 0.19}});
  clip.root_position_W_m = Eigen::Matrix3Xd::Constant(3, 2, 0.9);
  clip.rotation_rad = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(3 * joints.size()), 2);
  return clip;
}

std::string refusal(const Clip& clip) {
  return testing::refusal([&] { to_body(clip); }, "accepted");
}

TEST(BodyMap, TakesSegmentsAndAnglesOver) {
  const BodyMap& map = known_body_maps()[0];
  Clip clip = bare_clip(map);
  clip.rotation_rad(3 * kLeftKnee + 1, 1) = 0.7;
  const BodyClip body = to_body(clip);
  EXPECT_NEAR(body.angles_rad(3 * kLeftKnee + 1, 1), 0.7, 1e-12);
  EXPECT_LT((body.body.offset_m[kRightElbow] - standard_body().offset_m[kRightElbow]).norm(),
            1e-12);
  const double ground = 0.15 * std::tan(map.sole_rad) - 0.04;
  EXPECT_LT((body.body.toe_m[kLeft] - Vector3d(0.15, 0.0, ground)).norm(), 1e-9);
  EXPECT_LT((body.body.heel_m[kLeft] - Vector3d(-0.045, 0.0, ground)).norm(), 1e-9);
}

// Arms that hang at 40° in the file's zero posture: lifted to the T-posture, the elbow's axis
// along.
TEST(BodyMap, StraightensLimbsOfAnotherZeroPosture) {
  Clip clip = bare_clip(known_body_maps()[0]);
  const Eigen::Matrix3d hang = math::exp_so3({-0.7, 0.0, 0.0});
  for (const BodyJoint joint : {kLeftElbow, kLeftWrist}) {
    clip.skeleton.joints[joint].offset_m = hang * clip.skeleton.joints[joint].offset_m;
  }
  const Vector3d bend_file = hang * Vector3d(0.0, 0.0, 0.5);
  clip.rotation_rad.block<3, 1>(3 * kLeftElbow, 1) = bend_file;
  const BodyClip body = to_body(clip);
  EXPECT_LT((body.body.offset_m[kLeftWrist] - standard_body().offset_m[kLeftWrist]).norm(), 1e-9);
  const Vector3d shoulder = body.angles_rad.block<3, 1>(3 * kLeftShoulder, 0);
  const Vector3d elbow = body.angles_rad.block<3, 1>(3 * kLeftElbow, 1);
  EXPECT_LT((shoulder - Vector3d(-0.7, 0.0, 0.0)).norm(), 1e-9);
  EXPECT_LT((elbow - Vector3d(0.0, 0.0, 0.5)).norm(), 1e-9);
}

TEST(BodyMap, RefusesMapsThatDoNotFitTheFile) {
  const Clip clip = bare_clip(known_body_maps()[0]);
  const BodyMap fits = *find_body_map(clip);
  const auto says = [&](const auto& change) {
    BodyMap map = fits;
    change(map);
    return testing::refusal([&] { to_body(clip, map); }, "accepted");
  };
  EXPECT_EQ(says([](BodyMap&) {}), "accepted");
  EXPECT_EQ(says([](BodyMap& map) { map.joints[kHead] = "Kopf"; }),
            "bare.bvh: joint 'Kopf' of the map (head), expected one that the file has");
  EXPECT_EQ(says([](BodyMap& map) { map.joints[kLeftAnkle] = "RightFoot"; }),
            "bare.bvh: joint 'RightFoot' of the map (lank), expected one that hangs on 'LeftLeg'");
  EXPECT_EQ(
      says([](BodyMap& map) { map.toes[kRight] = "LeftToeBase"; }),
      "bare.bvh: joint 'LeftToeBase' of the map (rtoe), expected a joint or an end that hangs "
      "on 'RightFoot'");
  EXPECT_EQ(says([](BodyMap& map) { map.axes[kNeck] = "+x+y-z"; }),
            "bare.bvh: joint 'Neck1' of the map (neck), expected axes like +x+y+z, of a "
            "right-handed frame, not '+x+y-z'");
}

TEST(BodyMap, RefusesEmptyClips) {
  Clip clip = bare_clip(known_body_maps()[0]);
  clip.rotation_rad.resize(clip.rotation_rad.rows(), 0);
  EXPECT_NE(refusal(clip).find("no frame"), std::string::npos);
}

class BodyMapOf : public ::testing::Test {
 protected:
  void SetUp() override { SKIP_WITHOUT_SHARED(); }
};

BodyClip body_of(const std::string& clip) { return to_body(read_clip(path_of(clip))); }

TEST_F(BodyMapOf, TheFigureStandsUprightOnTheFloorAndBendsItsKneesBackwards) {
  for (const std::string name : {"07_01.bvh", "16_15.amc", "35_02.amc",
                                 "dataset-1_walk_happy_001.bvh", "dataset-2_walk_normal_001.bvh"}) {
    const BodyClip clip = body_of(name);
    double lowest = 1.0, knee_bend = 0.0;
    for (Eigen::Index f = 0; f < clip.frames(); ++f) {
      const BodyPose pose = clip.pose(f);
      const Vector3d forward = pose.R_WJ[kRoot].col(0), left = pose.R_WJ[kRoot].col(1);
      EXPECT_GT(pose.p_WJ[kHead].z() - pose.p_WJ[kRoot].z(), 0.3) << name;
      EXPECT_GT(pose.R_WJ[kRoot](2, 2), 0.9) << name;
      EXPECT_GT(left.dot(pose.p_WJ[kLeftShoulder] - pose.p_WJ[kRightShoulder]), 0.15) << name;
      EXPECT_GT(left.dot(pose.p_WJ[kLeftHip] - pose.p_WJ[kRightHip]), 0.1) << name;
      for (std::size_t s = 0; s < 2; ++s) {
        const std::size_t hip = s == kLeft ? kLeftHip : kRightHip;
        lowest = std::min({lowest, pose.point(static_cast<int>(hip) + 2, clip.body.toe_m[s]).z(),
                           pose.point(static_cast<int>(hip) + 2, clip.body.heel_m[s]).z()});
        // the shank lags the thigh: + about y
        knee_bend =
            std::max(knee_bend, clip.angles_rad(static_cast<Eigen::Index>(3 * (hip + 1) + 1), f));
        EXPECT_GT(clip.angles_rad(static_cast<Eigen::Index>(3 * (hip + 1) + 1), f), -0.1) << name;
        const Vector3d sole = clip.body.toe_m[s] - clip.body.heel_m[s];
        EXPECT_GT(forward.dot(pose.R_WJ[hip + 2] * sole), -0.05) << name;
      }
    }
    // elbows bend the forearms forward of the T-posture
    EXPECT_LT(clip.angles_rad.row(3 * kLeftElbow + 2).mean(), -0.1) << name;
    EXPECT_GT(clip.angles_rad.row(3 * kRightElbow + 2).mean(), 0.1) << name;
    EXPECT_NEAR(lowest, 0.0, 0.05) << name;
    EXPECT_GT(knee_bend, 0.8) << name;
  }
}

TEST_F(BodyMapOf, InTheTPostureTheLimbsAreStraight) {
  for (const std::string name : {"07_01.bvh", "35_02.amc", "dataset-1_walk_happy_001.bvh"}) {
    const Body body = body_of(name).body;
    for (const BodyJoint joint : {kLeftKnee, kLeftAnkle, kRightKnee, kRightAnkle}) {
      EXPECT_NEAR(body.offset_m[joint].head<2>().norm(), 0.0, 1e-4) << name;
      EXPECT_LT(body.offset_m[joint].z(), -0.3) << name;
    }
    EXPECT_GT(body.offset_m[kLeftElbow].y(), 0.2) << name;
    EXPECT_LT(body.offset_m[kRightElbow].y(), -0.2) << name;
    EXPECT_NEAR(body.toe_m[kLeft].z(), body.heel_m[kLeft].z(), 1e-9) << name;
    EXPECT_GT(body.toe_m[kLeft].x(), 0.08) << name;
  }
}

TEST_F(BodyMapOf, TheLeftHandIsTheLeftHand) {
  const BodyClip clip = body_of("dataset-2_raise-up-left-hand_normal_001.bvh");
  const BodyPose pose = clip.pose(clip.frames() / 2);
  EXPECT_GT(pose.p_WJ[kLeftWrist].z(), pose.p_WJ[kHead].z());
  EXPECT_LT(pose.p_WJ[kRightWrist].z(), pose.p_WJ[kChest].z());
  EXPECT_FALSE(cut_cycles(clip));
}

// Segments that span a joint of the file are replaced by their mean: legs are exact, hands are not.
TEST_F(BodyMapOf, TheFigureIsWhereTheFilesSkeletonIs) {
  for (const std::string name : {"07_01.bvh", "35_02.amc", "dataset-1_walk_happy_001.bvh"}) {
    const Clip file = read_clip(path_of(name));
    const BodyClip clip = body_of(name);
    const auto& joints = file.skeleton.joints;
    const bool bandai = name.starts_with("dataset");
    const std::string foot = bandai ? "Foot_L" : name.ends_with("amc") ? "lfoot" : "LeftFoot";
    const std::string hand = bandai ? "Hand_R" : name.ends_with("amc") ? "rwrist" : "RightHand";
    for (Eigen::Index f = 0; f < clip.frames(); f += 20) {
      std::vector<Eigen::Matrix3d> R(joints.size());
      std::vector<Vector3d> p(joints.size());
      for (std::size_t j = 0; j < joints.size(); ++j) {
        const Eigen::Index column = f + clip.first_frame;
        const auto row = static_cast<Eigen::Index>(3 * j);
        R[j] = math::exp_so3(file.rotation_rad.block<3, 1>(row, column));
        p[j] = file.root_position_W_m.col(column);
        if (joints[j].parent < 0) continue;
        const auto parent = static_cast<std::size_t>(joints[j].parent);
        p[j] = p[parent] + R[parent] * joints[j].offset_m;
        R[j] = R[parent] * R[j];
      }
      const BodyPose pose = clip.pose(f);
      auto at = [&](const std::string& joint) {
        return p[static_cast<std::size_t>(file.skeleton.find(joint))];
      };
      EXPECT_LT((pose.p_WJ[kLeftAnkle] - at(foot)).norm(), 1e-6) << name;
      EXPECT_LT((pose.p_WJ[kRightWrist] - at(hand)).norm(), 0.03) << name;
    }
  }
}

TEST_F(BodyMapOf, AddedFirstFramesAreLeftOut) {
  EXPECT_EQ(body_of("07_01.bvh").first_frame, 1);
  EXPECT_EQ(body_of("05_01.bvh").first_frame, 1);
  EXPECT_EQ(body_of("07_12.bvh").first_frame, 2);  // a T-posture, then zeros
  EXPECT_EQ(body_of("16_15.amc").first_frame, 0);
  EXPECT_EQ(body_of("dataset-1_dance-short_normal_001.bvh").first_frame, 0);
}

TEST(Body, WhatIsNotSetIsTheOriginWhateverTheMemoryWas) {
  alignas(Body) std::byte memory[sizeof(Body)];
  std::memset(memory, 0xFF, sizeof memory);  // as doubles: NaN
  const auto* body = new (memory) Body;
  for (const Eigen::Vector3d& offset : body->offset_m) EXPECT_EQ(offset.norm(), 0.0);
  for (const Side side : {kLeft, kRight}) {
    EXPECT_EQ(body->toe_m[side].norm(), 0.0);
    EXPECT_EQ(body->heel_m[side].norm(), 0.0);
    EXPECT_EQ(body->hand_m[side].norm(), 0.0);
  }
  EXPECT_EQ(body->head_top_m.norm(), 0.0);
  std::destroy_at(body);
  EXPECT_EQ(standard_body().offset_m[kRoot].norm(), 0.0);
}
}  // namespace
}  // namespace mimesis::mocap
