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

// Lengths that files lack. The ball of the foot is 3 to 5.5 cm above the ground in the stances of
// all CMU and Bandai-Namco clips at hand; heels, hands and heads have usual proportions.
constexpr double kBallHeight_m = 0.04;
constexpr double kHeelShare = 0.3;  // behind the ankle, of the ball's distance before it
constexpr double kFootShare =
    0.4;  // of the shank: the ball before the ankle, of a foot straight down
constexpr double kHandShare = 0.65;  // share of the forearm
constexpr double kHeadShare = 0.46;  // share of the thigh

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
  Matrix3d axes = Matrix3d::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    axes(static_cast<Index>(i), text[2 * i + 1] - 'x') = text[2 * i] == '+' ? 1.0 : -1.0;
  }
  return axes;
}

/// Index in the file by body joint, balls of the feet in the ankles' frames, and the orientation of
/// all file joints' frames in the T-posture.
struct Correspondence {
  std::array<std::size_t, kBodyJoints> joint;
  std::array<Vector3d, 2> ball;
  std::array<Matrix3d, kBodyJoints> R_WJ_T;
};

/// A joint in the frame of one that it hangs on; joints between them are taken at zero.
Vector3d offset_between(const Skeleton& skeleton, std::size_t from, std::size_t to) {
  Vector3d offset = Vector3d::Zero();
  for (std::size_t j = to; j > from; j = static_cast<std::size_t>(skeleton.joints[j].parent)) {
    offset += skeleton.joints[j].offset_m;
  }
  return offset;
}

bool hangs_on(const Skeleton& skeleton, int joint, int ancestor) {
  while (joint > ancestor) joint = skeleton.joints[static_cast<std::size_t>(joint)].parent;
  return joint == ancestor;
}

/// The end of that name; null: none.
const Joint* find_end(const Skeleton& skeleton, const std::string& name) {
  const auto end = std::ranges::find(skeleton.ends, name, &Joint::name);
  return end == skeleton.ends.end() ? nullptr : &*end;
}

bool are_axes(const std::string& text) {
  const auto is_axis = [](char c) { return c == 'x' || c == 'y' || c == 'z'; };
  if (text.size() != 6) return false;
  for (std::size_t i = 0; i < 6; i += 2) {
    if ((text[i] != '+' && text[i] != '-') || !is_axis(text[i + 1])) return false;
  }
  return std::abs(axes_of(text).determinant() - 1.0) < 1e-9;
}

/// Straightens a limb to the T-posture: the frames turn with the segments that they carry.
void straighten(const Clip& clip, std::span<const BodyJoint> limb,
                std::span<const Vector3d> directions, const Vector3d& end, Correspondence& c) {
  Matrix3d turn = Matrix3d::Identity();
  for (std::size_t i = 0; i < limb.size(); ++i) {
    const BodyJoint joint = limb[i];
    c.R_WJ_T[joint] = turn * c.R_WJ_T[joint];
    if (i >= directions.size()) continue;
    const Vector3d next = i + 1 < limb.size()
                              ? offset_between(clip.skeleton, c.joint[joint], c.joint[limb[i + 1]])
                              : end;
    const Vector3d bone = c.R_WJ_T[joint] * next;
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
  c.ball = {ball_of_foot(clip, map, kLeft), ball_of_foot(clip, map, kRight)};

  const Vector3d down = -Vector3d::UnitZ(), left = Vector3d::UnitY();
  const Vector3d sole(std::cos(map.sole_rad), 0.0, std::sin(map.sole_rad));
  const std::array<Vector3d, 3> leg = {down, down, sole};
  const std::array<Vector3d, 2> left_arm = {left, left}, right_arm = {-left, -left};
  straighten(clip, std::array{kLeftHip, kLeftKnee, kLeftAnkle}, leg, c.ball[kLeft], c);
  straighten(clip, std::array{kRightHip, kRightKnee, kRightAnkle}, leg, c.ball[kRight], c);
  straighten(clip, std::array{kLeftShoulder, kLeftElbow, kLeftWrist}, left_arm, Vector3d::Zero(),
             c);
  straighten(clip, std::array{kRightShoulder, kRightElbow, kRightWrist}, right_arm,
             Vector3d::Zero(), c);
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

/// Points at the ends of the limbs; the body's segments are set.
void set_end_points(const Clip& clip, const Correspondence& c, Body& body) {
  const std::array<BodyJoint, 2> ankles = {kLeftAnkle, kRightAnkle};
  const std::array<BodyJoint, 2> wrists = {kLeftWrist, kRightWrist};
  for (std::size_t s = 0; s < 2; ++s) {
    const BodyJoint ankle = ankles[s], wrist = wrists[s];
    Vector3d ball = c.R_WJ_T[ankle] * c.ball[s];
    const double shank = body.offset_m[ankle].norm();
    if (ball.x() < 0.25 * kFootShare * shank) ball.x() = kFootShare * shank;
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
  static const std::string same = "+x+y+z", trunk = "+z+x+y", left = "+x+z-y", right = "-x+z+y",
                           arm = "-x+y-z";
  static const std::array<std::string, kBodyJoints> parallel = {same, same, same, same, same, same,
                                                                same, same, same, same, same, same,
                                                                same, same, same, same, same};
  static const std::array<BodyMap, 3> maps = {
      // CMU's frames are parallel to the world in the zero posture; only the legs are spread.
      BodyMap{.joints = {"Hips", "LeftUpLeg", "LeftLeg", "LeftFoot", "RightUpLeg", "RightLeg",
                         "RightFoot", "Spine", "Spine1", "Neck1", "Head", "LeftArm", "LeftForeArm",
                         "LeftHand", "RightArm", "RightForeArm", "RightHand"},
              .toes = {"LeftToeBase", "RightToeBase"},
              .axes = parallel,
              .sole_rad = kCmuSole_rad},
      BodyMap{.joints = {"root", "lfemur", "ltibia", "lfoot", "rfemur", "rtibia", "rfoot",
                         "upperback", "thorax", "upperneck", "head", "lhumerus", "lradius",
                         "lwrist", "rhumerus", "rradius", "rwrist"},
              .toes = {"ltoes", "rtoes"},
              .axes = parallel,
              .sole_rad = kCmuSole_rad},
      // Bandai-Namco's frames have x along the bone (on the right side of the limbs: against it),
      // so the zero posture is folded together; the T-posture turns all by multiples of 90°.
      BodyMap{.joints = {"Hips", "UpperLeg_L", "LowerLeg_L", "Foot_L", "UpperLeg_R", "LowerLeg_R",
                         "Foot_R", "Spine", "Chest", "Neck", "Head", "UpperArm_L", "LowerArm_L",
                         "Hand_L", "UpperArm_R", "LowerArm_R", "Hand_R"},
              .toes = {"Toes_L", "Toes_R"},
              .axes = {"+x-z+y", left, left, left, right, right, right, trunk, trunk, trunk, trunk,
                       same, same, same, arm, arm, arm},
              .sole_rad = kBandaiSole_rad}};
  return maps;
}

void check_body_map(const Clip& clip, const BodyMap& map) {
  const Skeleton& skeleton = clip.skeleton;
  const auto fail = [&](const std::string& name, std::string_view of, const std::string& expected) {
    throw ConfigError(one_line(clip.name + ": joint '" + name + "' of the map (" + std::string(of) +
                               "), expected " + expected));
  };
  for (std::size_t j = 0; j < kBodyJoints; ++j) {
    const int joint = skeleton.find(map.joints[j]);
    if (joint < 0) fail(map.joints[j], kBodyJointNames[j], "one that the file has");
    if (!are_axes(map.axes[j])) {
      fail(map.joints[j], kBodyJointNames[j],
           "axes like +x+y+z, of a right-handed frame, not '" + map.axes[j] + "'");
    }
    const bool limb = j != kRoot && j != kLeftHip && j != kRightHip && j < kSpine;
    const bool arm = j > kLeftShoulder && j != kRightShoulder;
    if (!limb && !arm) continue;
    const std::string& parent = map.joints[static_cast<std::size_t>(kBodyParents[j])];
    if (joint == skeleton.find(parent) || !hangs_on(skeleton, joint, skeleton.find(parent))) {
      fail(map.joints[j], kBodyJointNames[j], "one that hangs on '" + parent + "'");
    }
  }
  for (std::size_t s = 0; s < 2; ++s) {
    const std::string& ankle = map.joints[s == kLeft ? kLeftAnkle : kRightAnkle];
    const Joint* end = find_end(skeleton, map.toes[s]);
    const int toe = end != nullptr ? end->parent : skeleton.find(map.toes[s]);
    if (toe < 0 || !hangs_on(skeleton, toe, skeleton.find(ankle))) {
      fail(map.toes[s], s == kLeft ? "ltoe" : "rtoe",
           "a joint or an end that hangs on '" + ankle + "'");
    }
  }
}

Vector3d ball_of_foot(const Clip& clip, const BodyMap& map, Side side) {
  const Skeleton& skeleton = clip.skeleton;
  const auto ankle =
      static_cast<std::size_t>(skeleton.find(map.joints[side == kLeft ? kLeftAnkle : kRightAnkle]));
  const Joint* end = find_end(skeleton, map.toes[side]);
  const int toe = end != nullptr ? end->parent : skeleton.find(map.toes[side]);
  const Vector3d ball = offset_between(skeleton, ankle, static_cast<std::size_t>(toe));
  return end != nullptr ? Vector3d(ball + end->offset_m) : ball;
}

BodyClip to_body(const Clip& clip) {
  const auto map = find_body_map(clip);
  if (!map) throw ConfigError(map.error().reason);
  return to_body(clip, *map);
}

BodyClip to_body(const Clip& clip, const BodyMap& map) {
  check_body_map(clip, map);
  const Correspondence c = correspond(clip, map);
  const Index first = frames_apart(clip), frames = clip.frames() - first;
  if (frames < 1) throw ConfigError(clip.name + ": no frame, expected at least one");

  BodyClip out;
  out.name = out.body.name = clip.name;
  out.rate_hz = clip.rate_hz;
  out.first_frame = first;
  out.root_position_W_m.resize(3, frames);
  out.angles_rad.resize(kBodyRows, frames);
  for (Index f = 0; f < frames; ++f) {
    const SkeletonPose file = skeleton_pose(clip, f + first);
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
