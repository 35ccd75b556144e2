// Made-up recordings of one walk by skeletons of many habits: the figure is the same in all.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "common/math/so3.h"
#include "common/motion/mocap/clip_file.h"
#include "common/motion/mocap/test/walker.h"
#include "common/testing/refusal.h"

namespace mimesis::mocap {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Names = std::array<std::string, kBodyJoints + 2>;  // the last two: toes

const Names kLafan = {"Hips",         "LeftUpLeg", "LeftLeg",     "LeftFoot",    "RightUpLeg",
                      "RightLeg",     "RightFoot", "Spine",       "Spine2",      "Neck",
                      "Head",         "LeftArm",   "LeftForeArm", "LeftHand",    "RightArm",
                      "RightForeArm", "RightHand", "LeftToeBase", "RightToeBase"};
const Names kXsens = {"Hips",       "LeftHip",      "LeftKnee",  "LeftAnkle", "RightHip",
                      "RightKnee",  "RightAnkle",   "Chest",     "Chest4",    "Neck",
                      "Head",       "LeftShoulder", "LeftElbow", "LeftWrist", "RightShoulder",
                      "RightElbow", "RightWrist",   "LeftToe",   "RightToe"};
const Names kBiped = {"Bip01 Pelvis",    "Bip01 L Thigh", "Bip01 L Calf",     "Bip01 L Foot",
                      "Bip01 R Thigh",   "Bip01 R Calf",  "Bip01 R Foot",     "Bip01 Spine",
                      "Bip01 Spine1",    "Bip01 Neck",    "Bip01 Head",       "Bip01 L UpperArm",
                      "Bip01 L Forearm", "Bip01 L Hand",  "Bip01 R UpperArm", "Bip01 R Forearm",
                      "Bip01 R Hand",    "Bip01 L Toe0",  "Bip01 R Toe0"};
const Names kUnreal = {"pelvis",     "thigh_l",    "calf_l",     "foot_l",   "thigh_r",
                       "calf_r",     "foot_r",     "spine_01",   "spine_03", "neck_01",
                       "head",       "upperarm_l", "lowerarm_l", "hand_l",   "upperarm_r",
                       "lowerarm_r", "hand_r",     "ball_l",     "ball_r"};
Names prefixed(const std::string& prefix, Names names) {
  for (std::string& name : names) name.insert(0, prefix);
  return names;
}
Names nameless() {
  Names names;
  for (std::size_t j = 0; j < names.size(); ++j) names[j] = "bone" + std::to_string(j);
  return names;
}

/// A walk with knees and elbows that bend; the head turns.
BodyClip person() {
  BodyClip clip = walk({.rate_hz = 60.0, .seconds = 2.0});
  for (Eigen::Index f = 0; f < clip.frames(); ++f) {
    const double phase = 5.0 * static_cast<double>(f) / 60.0;
    clip.angles_rad(3 * kLeftKnee + 1, f) = 0.5 + 0.4 * std::sin(phase);
    clip.angles_rad(3 * kRightKnee + 1, f) = 0.5 - 0.4 * std::sin(phase);
    for (const BodyJoint knee : {kLeftKnee, kRightKnee}) {  // the feet stay level
      clip.angles_rad(3 * (knee + 1) + 1, f) -= clip.angles_rad(3 * knee + 1, f);
    }
    clip.angles_rad.block<3, 1>(3 * kLeftShoulder, f) << -1.2, 0.1, 0.0;
    clip.angles_rad.block<3, 1>(3 * kRightShoulder, f) << 1.2, 0.1, 0.0;
    clip.angles_rad(3 * kLeftElbow + 2, f) = -0.4;
    clip.angles_rad(3 * kRightElbow + 2, f) = 0.4;
    clip.angles_rad(3 * kHead + 2, f) = 0.3 * std::sin(phase);
  }
  return clip;
}

using Frames = std::array<Matrix3d, kBodyJoints>;
Frames parallel() {
  Frames frames;
  frames.fill(Matrix3d::Identity());
  return frames;
}
Matrix3d turned(double x, double y, double z) {
  return math::exp_so3(0.5 * M_PI * Vector3d(x, y, z));
}

/// The person recorded by joints whose frames stand as `Q` in the T-posture; all of it turned.
Clip recorded(const Names& names, const Frames& Q = parallel(),
              const Matrix3d& world = Matrix3d::Identity()) {
  const BodyClip person_clip = person();
  Clip clip;
  clip.name = "made.bvh";
  clip.rate_hz = person_clip.rate_hz;
  clip.root_position_W_m = world * person_clip.root_position_W_m;
  clip.rotation_rad.setZero(3 * (kBodyJoints + 2), person_clip.frames());
  for (std::size_t j = 0; j < kBodyJoints; ++j) {
    const int parent = kBodyParents[j];
    const Matrix3d before = j == 0 ? world : Q[static_cast<std::size_t>(parent)].transpose();
    clip.skeleton.joints.push_back(
        {names[j], parent,
         j == 0 ? Vector3d::Zero() : Vector3d(before * person_clip.body.offset_m[j])});
    const auto row = static_cast<Eigen::Index>(3 * j);
    for (Eigen::Index f = 0; f < person_clip.frames(); ++f) {
      const Vector3d angles = person_clip.angles_rad.block<3, 1>(row, f);
      const Matrix3d R_PJ = before * math::exp_so3(angles) * Q[j];
      clip.rotation_rad.block<3, 1>(row, f) = math::log_so3(R_PJ);
    }
  }
  for (std::size_t s = 0; s < 2; ++s) {
    const int ankle = s == kLeft ? kLeftAnkle : kRightAnkle,
              wrist = s == kLeft ? kLeftWrist : kRightWrist;
    const Matrix3d foot = Q[static_cast<std::size_t>(ankle)].transpose();
    const Vector3d ball = person_clip.body.toe_m[s] + Vector3d(0.0, 0.0, 0.04);
    clip.skeleton.joints.push_back({names[kBodyJoints + s], ankle, foot * ball});
    clip.skeleton.ends.push_back({names[kBodyJoints + s] + "_end",
                                  static_cast<int>(kBodyJoints + s),
                                  foot * Vector3d(0.05, 0.0, 0.0)});
    clip.skeleton.ends.push_back(
        {"hand_end", wrist,
         Q[static_cast<std::size_t>(wrist)].transpose() * person_clip.body.hand_m[s]});
  }
  clip.skeleton.ends.push_back(
      {"head_end", kHead, Q[kHead].transpose() * person_clip.body.head_top_m});
  return clip;
}

/// The clip as a BVH file, y up.
std::string bvh_text(const Clip& clip, double unit_m) {
  const auto line = [](const Vector3d& v) { return fmt::format("{} {} {} ", v.y(), v.z(), v.x()); };
  const std::vector<Joint>& joints = clip.skeleton.joints;
  std::string text = "HIERARCHY\n";
  std::vector<Eigen::Index> order;
  const std::function<void(int)> write = [&](int j) {
    const Joint& joint = joints[static_cast<std::size_t>(j)];
    text += fmt::format("{} {}\n{{\nOFFSET {}\nCHANNELS {}Zrotation Yrotation Xrotation\n",
                        j == 0 ? "ROOT" : "JOINT", joint.name, line(joint.offset_m / unit_m),
                        j == 0 ? "6 Xposition Yposition Zposition " : "3 ");
    order.push_back(j);
    for (int k = j + 1; k < static_cast<int>(joints.size()); ++k) {
      if (joints[static_cast<std::size_t>(k)].parent == j) write(k);
    }
    for (const Joint& end : clip.skeleton.ends) {
      if (end.parent == j) text += "End Site\n{\nOFFSET " + line(end.offset_m / unit_m) + "\n}\n";
    }
    text += "}\n";
  };
  write(0);
  text += fmt::format("MOTION\nFrames: {}\nFrame Time: {}\n", clip.frames(), 1.0 / clip.rate_hz);
  for (Eigen::Index t = 0; t < clip.frames(); ++t) {
    text += line(clip.root_position_W_m.col(t) / unit_m);
    for (const Eigen::Index j : order) {
      const Vector3d v = clip.rotation_rad.block<3, 1>(3 * j, t);
      const Matrix3d R = math::exp_so3(Vector3d(v.y(), v.z(), v.x()));
      text += fmt::format("{} {} {} ", std::atan2(R(1, 0), R(0, 0)) * 180.0 / M_PI,
                          std::asin(std::clamp(-R(2, 0), -1.0, 1.0)) * 180.0 / M_PI,
                          std::atan2(R(2, 1), R(2, 2)) * 180.0 / M_PI);
    }
    text += '\n';
  }
  return text;
}

void expect_person(const BodyClip& found, double tolerance = 1e-9) {
  const BodyClip wanted = person();
  ASSERT_EQ(found.frames(), wanted.frames());
  for (Eigen::Index f = 0; f < found.frames(); f += 7) {
    const BodyPose a = found.pose(f), b = wanted.pose(f);
    for (std::size_t j = 0; j < kBodyJoints; ++j) {
      EXPECT_LT((a.p_WJ[j] - b.p_WJ[j]).norm(), tolerance) << kBodyJointNames[j] << ' ' << f;
      EXPECT_LT((a.R_WJ[j] - b.R_WJ[j]).norm(), 3 * tolerance) << kBodyJointNames[j] << ' ' << f;
    }
  }
  for (std::size_t s = 0; s < 2; ++s) {
    EXPECT_LT((found.body.toe_m[s] - wanted.body.toe_m[s]).norm(), tolerance);
  }
}

TEST(BodyFinder, TakesManyNames) {
  for (const Names& names :
       {kLafan, kXsens, kBiped, kUnreal, prefixed("mixamorig:", kLafan), prefixed("Model_", kXsens),
        prefixed("Armature|", kUnreal), nameless()}) {
    SCOPED_TRACE(names[0]);
    const auto map = find_body_map(recorded(names));
    ASSERT_TRUE(map) << map.error().reason;
    for (std::size_t j = 0; j < kBodyJoints; ++j) EXPECT_EQ(map->joints[j], names[j]);
    EXPECT_EQ(map->toes[kLeft], names[kBodyJoints]);
    expect_person(to_body(recorded(names)));
  }
}

// Every joint's frame stands otherwise, as in files whose zero posture is folded.
TEST(BodyFinder, FindsTheAxesOfEveryJoint) {
  Frames Q;
  for (std::size_t j = 0; j < kBodyJoints; ++j) {
    const auto k = static_cast<int>(j);
    Q[j] = turned(k % 4, 0, 0) * turned(0, (k / 2) % 4, 0) * turned(0, 0, (k / 3) % 4);
  }
  for (const Names& names : {kLafan, nameless()}) expect_person(to_body(recorded(names, Q)));
  Frames along_bones = parallel();  // legs and arms with x along the bones, as Rokoko's
  for (const BodyJoint joint :
       {kLeftHip, kLeftKnee, kLeftAnkle, kRightHip, kRightKnee, kRightAnkle}) {
    along_bones[joint] = turned(0, 1, 0);
  }
  expect_person(to_body(recorded(kLafan, along_bones)));
}

/// With joints that do not turn: collar bones, twist bones of the thighs, one more in spine and
/// neck, and a finger at one hand alone.
Clip with_more_joints(const Clip& clip) {
  const std::array<std::pair<BodyJoint, std::string>, 6> added = {
      {{kLeftKnee, "LeftUpLegTwist"},
       {kRightKnee, "RightUpLegTwist"},
       {kChest, "Spine1"},
       {kNeck, "Neck0"},
       {kLeftShoulder, "LeftShoulder"},
       {kRightShoulder, "RightShoulder"}}};
  Clip out = clip;
  out.skeleton.joints.clear();
  out.rotation_rad.setZero(clip.rotation_rad.rows() + 3 * 7, clip.frames());
  std::vector<int> place;
  for (std::size_t j = 0; j < clip.skeleton.joints.size(); ++j) {
    Joint joint = clip.skeleton.joints[j];
    if (joint.parent >= 0) joint.parent = place[static_cast<std::size_t>(joint.parent)];
    for (const auto& [of, name] : added) {
      if (static_cast<std::size_t>(of) != j) continue;
      out.skeleton.joints.push_back({name, joint.parent, 0.5 * joint.offset_m});
      joint = {joint.name, static_cast<int>(out.skeleton.joints.size()) - 1, 0.5 * joint.offset_m};
    }
    place.push_back(static_cast<int>(out.skeleton.joints.size()));
    out.skeleton.joints.push_back(joint);
    out.rotation_rad.middleRows<3>(3 * place.back()) =
        clip.rotation_rad.middleRows<3>(static_cast<Eigen::Index>(3 * j));
  }
  for (Joint& end : out.skeleton.ends) end.parent = place[static_cast<std::size_t>(end.parent)];
  out.skeleton.joints.push_back({"LeftHandIndex1", place[kLeftWrist], {0.0, 0.08, 0.0}});
  return out;
}

TEST(BodyFinder, PassesOverJointsThatTheFigureLacks) {
  const Clip clip = with_more_joints(recorded(prefixed("Character1_", kLafan)));
  const auto map = find_body_map(clip);
  ASSERT_TRUE(map) << map.error().reason;
  EXPECT_EQ(map->joints[kChest], "Character1_Spine2");
  EXPECT_EQ(map->joints[kNeck], "Character1_Neck");
  EXPECT_EQ(map->joints[kLeftShoulder], "Character1_LeftArm");
  expect_person(to_body(clip));
}

TEST(BodyFinder, ToesMayBeEndsAndTheTrunkOneJoint) {
  Clip clip = recorded(kXsens);
  auto& [joints, ends] = clip.skeleton;
  for (Joint& end : ends) {  // the toe joints go
    if (end.parent < kBodyJoints) continue;
    const Joint toe = joints[static_cast<std::size_t>(end.parent)];
    end = {joints[static_cast<std::size_t>(toe.parent)].name + "_end", toe.parent, toe.offset_m};
  }
  joints.resize(kBodyJoints);
  clip.rotation_rad.conservativeResize(3 * kBodyJoints, Eigen::NoChange);
  const auto map = find_body_map(clip);
  ASSERT_TRUE(map) << map.error().reason;
  EXPECT_EQ(map->toes[kRight], "RightAnkle_end");
  expect_person(to_body(clip));
}

TEST(BodyFinder, RefusesMirroredFiguresAndThoseThatAreNone) {
  const auto says = [](const Clip& clip) { return testing::refusal([&] { to_body(clip); }); };
  Names mirrored = kLafan;
  for (const BodyJoint j : {kLeftHip, kLeftKnee, kLeftAnkle})
    std::swap(mirrored[j], mirrored[j + 3]);
  for (const BodyJoint j : {kLeftShoulder, kLeftElbow, kLeftWrist})
    std::swap(mirrored[j], mirrored[j + 3]);
  std::swap(mirrored[kBodyJoints], mirrored[kBodyJoints + 1]);
  EXPECT_NE(
      says(recorded(mirrored)).find("made.bvh: no person's skeleton: 'LeftUpLeg' is on the right"),
      std::string::npos);
  Clip dog = recorded(kLafan);
  const Matrix3d pitch = turned(0, 1, 0);
  for (Eigen::Index f = 0; f < dog.frames(); ++f) {
    for (const BodyJoint j : {kRoot, kLeftHip, kRightHip}) {
      const Vector3d angles = dog.rotation_rad.block<3, 1>(3 * j, f);
      const Matrix3d R = j == kRoot ? pitch : Matrix3d(pitch.transpose());
      dog.rotation_rad.block<3, 1>(3 * j, f) = math::log_so3(Matrix3d(R * math::exp_so3(angles)));
    }
  }
  EXPECT_NE(says(dog).find("the trunk is not upright"), std::string::npos) << says(dog);
  Clip arm = recorded(kLafan);
  arm.skeleton.joints[kRightKnee].offset_m *= 0.3;
  EXPECT_NE(says(arm).find("--map"), std::string::npos);
}

TEST(BodyFinder, TheUnitIsThatOfAPersonsHeight) {
  for (const double unit_m : {1.0, 0.01, 0.001, 0.0254, 0.0254 / 0.45}) {
    const Clip clip = parse_bvh(bvh_text(recorded(kLafan), unit_m), "walk.bvh");
    expect_person(to_body(clip), 1e-6);
    EXPECT_EQ(clip.notes.empty(), unit_m == 0.01) << unit_m;
    EXPECT_NEAR(stature_m(clip.skeleton, *find_body_map(clip)), 1.70, 0.05);
  }
  const auto says = [](double unit_m, double told_m) {
    return testing::refusal(
        [&] { parse_bvh(bvh_text(recorded(kLafan), unit_m), "walk.bvh", {.unit_m = told_m}); });
  };
  EXPECT_EQ(says(0.01, 0.01), "");
  EXPECT_EQ(says(0.01, 1.0),
            "walk.bvh: with --unit-m 1 the figure is 167 m tall, expected 0.5 to 2.5 m");
  const std::string giant = says(0.004, 0.0);
  for (const std::string part : {"walk.bvh: ", "4.17 m in cm", "0.417 m in mm", "--unit-m"}) {
    EXPECT_NE(giant.find(part), std::string::npos) << giant;
  }
  EXPECT_EQ(says(0.004, 0.004), "");
}

TEST(BodyFinder, AnotherAxisOfTheFileMayBeUp) {
  for (const Matrix3d& world :
       {turned(1, 0, 0), turned(0, 1, 0), turned(0, 3, 0), turned(2, 0, 0)}) {
    const Clip clip = parse_bvh(bvh_text(recorded(kLafan, parallel(), world), 0.01), "walk.bvh");
    ASSERT_EQ(clip.notes.size(), 1u);
    EXPECT_TRUE(clip.notes[0].starts_with("up is the file's ")) << clip.notes[0];
    const BodyClip found = to_body(clip), wanted = person();
    for (Eigen::Index f = 0; f < found.frames(); f += 7) {
      const BodyPose a = found.pose(f), b = wanted.pose(f);
      for (std::size_t j = 0; j < kBodyJoints; ++j) EXPECT_NEAR(a.p_WJ[j].z(), b.p_WJ[j].z(), 1e-6);
    }
  }
}

}  // namespace
}  // namespace mimesis::mocap
