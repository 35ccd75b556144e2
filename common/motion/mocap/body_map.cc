#include "common/motion/mocap/body_map.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/error.h"
#include "common/math/so3.h"

namespace mimesis::mocap {
namespace {

// Medians over the slow stances of the clips at hand: CMU 15 to 23°, Bandai-Namco 39.6°.
constexpr double kCmuSole_rad = -0.314, kBandaiSole_rad = -0.691;

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// The known map whose joints the skeleton has.
const BodyMap& find_map(const Clip& clip) {
  std::size_t fewest = 2 * kBodyJoints;
  std::string nearest;
  for (const BodyMap& map : known_body_maps()) {
    std::size_t count = 0;
    std::string missing;
    auto need = [&](const std::string& name) {
      if (clip.skeleton.find(name) < 0) missing += (count++ == 0 ? "" : ", ") + name;
    };
    for (const std::string& name : map.joints) need(name);
    for (const std::string& name : map.toes) need(name);
    if (count == 0) return map;
    if (count >= fewest) continue;
    fewest = count;
    nearest = map.name + " these joints are missing: " + missing;
  }
  throw ConfigError(clip.name + ": no known skeleton; for " + nearest);
}

// Lengths that files lack. The ball of the foot is 3 to 5.5 cm above the ground in the stances of
// all CMU and Bandai-Namco clips at hand; heels, hands and heads have usual proportions.
constexpr double kBallHeight_m = 0.04;
constexpr double kHeelShare = 0.3;   // behind the ankle, of the ball's distance before it
constexpr double kHandShare = 0.65;  // share of the forearm
constexpr double kHeadShare = 0.46;  // share of the thigh

/// Where every joint of the file's skeleton is in one frame.
struct FilePose {
  std::vector<Matrix3d> R_WJ;
  std::vector<Vector3d> p_WJ;
};

FilePose file_pose(const Clip& clip, Index frame) {
  const std::vector<Joint>& joints = clip.skeleton.joints;
  FilePose pose{std::vector<Matrix3d>(joints.size()), std::vector<Vector3d>(joints.size())};
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const Matrix3d R_PJ =
        math::exp_so3(clip.rotation_rad.block<3, 1>(static_cast<Index>(3 * j), frame));
    if (joints[j].parent < 0) {
      pose.R_WJ[j] = R_PJ;
      pose.p_WJ[j] = clip.root_position_W_m.col(frame);
    } else {
      const auto parent = static_cast<std::size_t>(joints[j].parent);
      pose.R_WJ[j] = pose.R_WJ[parent] * R_PJ;
      pose.p_WJ[j] = pose.p_WJ[parent] + pose.R_WJ[parent] * joints[j].offset_m;
    }
  }
  return pose;
}

/// Largest turn of a joint from a frame to the next [rad].
double leap(const Clip& clip, Index frame) {
  double largest = 0.0;
  for (Index j = 0; j + 2 < clip.rotation_rad.rows(); j += 3) {
    const Matrix3d before = math::exp_so3(clip.rotation_rad.block<3, 1>(j, frame));
    const Matrix3d after = math::exp_so3(clip.rotation_rad.block<3, 1>(j, frame + 1));
    largest = std::max(largest, math::log_so3(before.transpose() * after).norm());
  }
  return largest;
}

/// Number of frames at the start that are no part of the motion: a joint leaps out of them by far
/// more than joints usually move. CMU's conversions have one or two.
Index frames_apart(const Clip& clip) {
  constexpr double kLeap_rad = 0.3, kTimesMedian = 10.0;
  constexpr Index kMost = 3;
  if (clip.frames() < 2 * kMost) return 0;
  std::vector<double> leaps;
  for (Index f = 0; f + 1 < clip.frames(); ++f) leaps.push_back(leap(clip, f));
  std::vector<double> sorted = leaps;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  Index apart = 0;
  for (Index f = 0; f < kMost; ++f) {
    const double x = leaps[static_cast<std::size_t>(f)];
    if (x > kLeap_rad && x > kTimesMedian * *middle) apart = f + 1;
  }
  return apart;
}

/// Rows: the local axes that point forward, left and up.
Matrix3d axes_of(const std::string& text) {
  if (text.empty()) return Matrix3d::Identity();
  Matrix3d axes = Matrix3d::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    axes(static_cast<Index>(i), text[2 * i + 1] - 'x') = text[2 * i] == '+' ? 1.0 : -1.0;
  }
  return axes;
}

/// Index in the file by body joint and of the toes, and the orientation of all file joints' frames
/// in the T-posture.
struct Correspondence {
  std::array<std::size_t, kBodyJoints> joint;
  std::array<std::size_t, 2> toe;
  std::array<Matrix3d, kBodyJoints> R_WJ_T;
};

/// Straightens a limb to the T-posture: the frames turn with the segments that they carry.
void straighten(const Clip& clip, std::span<const BodyJoint> limb,
                std::span<const Vector3d> directions, std::size_t end, Correspondence& c) {
  Matrix3d turn = Matrix3d::Identity();
  for (std::size_t i = 0; i < limb.size(); ++i) {
    const BodyJoint joint = limb[i];
    c.R_WJ_T[joint] = turn * c.R_WJ_T[joint];
    if (i >= directions.size()) continue;
    const std::size_t next = i + 1 < limb.size() ? c.joint[limb[i + 1]] : end;
    const Vector3d bone = c.R_WJ_T[joint] * clip.skeleton.joints[next].offset_m;
    if (bone.norm() < 1e-9) continue;
    const Matrix3d more = math::rotation_onto(bone, directions[i]);
    c.R_WJ_T[joint] = more * c.R_WJ_T[joint];
    turn = more * turn;
  }
}

Correspondence correspond(const Clip& clip, const BodyMap& map) {
  Correspondence c;
  auto index = [&](const std::string& name) {
    return static_cast<std::size_t>(clip.skeleton.find(name));
  };
  for (std::size_t j = 0; j < kBodyJoints; ++j) {
    c.joint[j] = index(map.joints[j]);
    c.R_WJ_T[j] = axes_of(map.axes[j]);
  }
  c.toe = {index(map.toes[kLeft]), index(map.toes[kRight])};

  const Vector3d down = -Vector3d::UnitZ(), left = Vector3d::UnitY();
  const Vector3d sole(std::cos(map.sole_rad), 0.0, std::sin(map.sole_rad));
  const std::array<Vector3d, 3> leg = {down, down, sole};
  const std::array<Vector3d, 2> left_arm = {left, left}, right_arm = {-left, -left};
  straighten(clip, std::array{kLeftHip, kLeftKnee, kLeftAnkle}, leg, c.toe[kLeft], c);
  straighten(clip, std::array{kRightHip, kRightKnee, kRightAnkle}, leg, c.toe[kRight], c);
  straighten(clip, std::array{kLeftShoulder, kLeftElbow, kLeftWrist}, left_arm, 0, c);
  straighten(clip, std::array{kRightShoulder, kRightElbow, kRightWrist}, right_arm, 0, c);
  return c;
}

/// End of the chain that starts at a joint, in that joint's frame [m]: the farthest end there is
/// when all joints beyond are at zero.
Vector3d chain_end(const Skeleton& skeleton, std::size_t from) {
  Vector3d farthest = Vector3d::Zero();
  for (const Joint& end : skeleton.ends) {
    Vector3d p = end.offset_m;
    int j = end.parent;
    for (; j > static_cast<int>(from); j = skeleton.joints[static_cast<std::size_t>(j)].parent) {
      p += skeleton.joints[static_cast<std::size_t>(j)].offset_m;
    }
    if (j == static_cast<int>(from) && p.norm() > farthest.norm()) farthest = p;
  }
  return farthest;
}

/// Ball of the foot in the ankle's frame; joints between them are taken at zero. @throws
/// ConfigError
Vector3d ball_of_foot(const Clip& clip, std::size_t ankle, std::size_t toe) {
  const std::vector<Joint>& joints = clip.skeleton.joints;
  Vector3d ball = Vector3d::Zero();
  std::size_t j = toe;
  while (j != ankle) {
    ball += joints[j].offset_m;
    if (joints[j].parent < static_cast<int>(ankle)) {
      throw ConfigError(clip.name + ": joint " + joints[toe].name + " does not hang on " +
                        joints[ankle].name);
    }
    j = static_cast<std::size_t>(joints[j].parent);
  }
  return ball;
}

/// Points at the ends of the limbs; the body's segments are set.
void set_end_points(const Clip& clip, const Correspondence& c, Body& body) {
  const std::array<BodyJoint, 2> ankles = {kLeftAnkle, kRightAnkle};
  const std::array<BodyJoint, 2> wrists = {kLeftWrist, kRightWrist};
  for (std::size_t s = 0; s < 2; ++s) {
    const BodyJoint ankle = ankles[s], wrist = wrists[s];
    const Vector3d ball = c.R_WJ_T[ankle] * ball_of_foot(clip, c.joint[ankle], c.toe[s]);
    const double ground = ball.z() - kBallHeight_m;
    body.toe_m[s] = {ball.x(), ball.y(), ground};
    body.heel_m[s] = {-kHeelShare * ball.x(), -kHeelShare * ball.y(), ground};
    body.hand_m[s] = c.R_WJ_T[wrist] * chain_end(clip.skeleton, c.joint[wrist]);
    if (body.hand_m[s].norm() < 0.01) body.hand_m[s] = kHandShare * body.offset_m[wrist];
  }
  body.head_top_m = c.R_WJ_T[kHead] * chain_end(clip.skeleton, c.joint[kHead]);
  if (body.head_top_m.norm() < 0.01) {
    body.head_top_m = kHeadShare * body.offset_m[kLeftKnee].norm() * Vector3d::UnitZ();
  }
}

}  // namespace

std::span<const BodyMap> known_body_maps() {
  static const std::string trunk = "+z+x+y", left = "+x+z-y", right = "-x+z+y", arm = "-x+y-z";
  static const std::array<BodyMap, 3> maps = {
      // CMU's frames are parallel to the world in the zero posture; only the legs are spread.
      BodyMap{.name = "CMU BVH",
              .joints = {"Hips", "LeftUpLeg", "LeftLeg", "LeftFoot", "RightUpLeg", "RightLeg",
                         "RightFoot", "Spine", "Spine1", "Neck1", "Head", "LeftArm", "LeftForeArm",
                         "LeftHand", "RightArm", "RightForeArm", "RightHand"},
              .toes = {"LeftToeBase", "RightToeBase"},
              .axes = {},
              .sole_rad = kCmuSole_rad},
      BodyMap{.name = "CMU ASF",
              .joints = {"root", "lfemur", "ltibia", "lfoot", "rfemur", "rtibia", "rfoot",
                         "upperback", "thorax", "upperneck", "head", "lhumerus", "lradius",
                         "lwrist", "rhumerus", "rradius", "rwrist"},
              .toes = {"ltoes", "rtoes"},
              .axes = {},
              .sole_rad = kCmuSole_rad},
      // Bandai-Namco's frames have x along the bone (on the right side of the limbs: against it),
      // so the zero posture is folded together; the T-posture turns all by multiples of 90°.
      BodyMap{.name = "Bandai-Namco BVH",
              .joints = {"Hips", "UpperLeg_L", "LowerLeg_L", "Foot_L", "UpperLeg_R", "LowerLeg_R",
                         "Foot_R", "Spine", "Chest", "Neck", "Head", "UpperArm_L", "LowerArm_L",
                         "Hand_L", "UpperArm_R", "LowerArm_R", "Hand_R"},
              .toes = {"Toes_L", "Toes_R"},
              .axes = {"+x-z+y", left, left, left, right, right, right, trunk, trunk, trunk, trunk,
                       "", "", "", arm, arm, arm},
              .sole_rad = kBandaiSole_rad}};
  return maps;
}

BodyClip to_body(const Clip& clip) {
  const Correspondence c = correspond(clip, find_map(clip));
  const Index first = frames_apart(clip), frames = clip.frames() - first;
  if (frames < 1) throw ConfigError(clip.name + ": no frame, expected at least one");

  BodyClip out;
  out.name = out.body.name = clip.name;
  out.rate_hz = clip.rate_hz;
  out.first_frame = first;
  out.root_position_W_m.resize(3, frames);
  out.angles_rad.resize(kBodyRows, frames);
  for (Index f = 0; f < frames; ++f) {
    const FilePose file = file_pose(clip, f + first);
    BodyPose pose;
    for (std::size_t j = 0; j < kBodyJoints; ++j) {
      pose.R_WJ[j] = file.R_WJ[c.joint[j]] * c.R_WJ_T[j].transpose();
      pose.p_WJ[j] = file.p_WJ[c.joint[j]];
    }
    out.root_position_W_m.col(f) = pose.p_WJ[kRoot];
    put_angles(pose, f, out.angles_rad);
    for (std::size_t j = 1; j < kBodyJoints; ++j) {
      const auto p = static_cast<std::size_t>(kBodyParents[j]);
      const Vector3d segment = pose.p_WJ[j] - pose.p_WJ[p];
      out.body.offset_m[j] += pose.R_WJ[p].transpose() * segment / static_cast<double>(frames);
    }
  }
  set_end_points(clip, c, out.body);
  return out;
}

}  // namespace mimesis::mocap
