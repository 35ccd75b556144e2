// Which joints of a skeleton are a person's, by its tree and lengths, with names as help; and how
// the joints' frames stand.
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "common/error.h"
#include "common/motion/mocap/body_map.h"
#include "common/motion/mocap/readers.h"

namespace mimesis::mocap {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using std::string_view_literals::operator""sv;
using Words = std::span<const std::string_view>;

constexpr std::array kArmWords = {"arm"sv,    "hand"sv,  "elbow"sv,  "wrist"sv, "should"sv,
                                  "shldr"sv,  "clav"sv,  "coll"sv,   "humer"sv, "radius"sv,
                                  "finger"sv, "thumb"sv, "scapula"sv};
constexpr std::array kLegWords = {"leg"sv,   "thigh"sv, "knee"sv,  "shin"sv,
                                  "calf"sv,  "foot"sv,  "feet"sv,  "toe"sv,
                                  "ankle"sv, "femur"sv, "tibia"sv, "buttock"sv};
constexpr std::array kKneeWords = {"knee"sv,   "shin"sv,     "calf"sv,     "tibia"sv,
                                   "lowleg"sv, "lowerleg"sv, "lower_leg"sv};
constexpr std::array kElbowWords = {"elbow"sv,    "forearm"sv,   "fore_arm"sv, "lowarm"sv,
                                    "lowerarm"sv, "lower_arm"sv, "radius"sv,   "ulna"sv};
constexpr std::array kTwistWords = {"twist"sv, "roll"sv};
constexpr std::array kTipWords = {"top"sv, "end"sv, "nub"sv, "site"sv, "tip"sv};

bool has_word(const std::string& name, Words words) {
  return std::ranges::any_of(words, [&](std::string_view w) { return name.find(w) != name.npos; });
}

/// The skeleton as a tree, with the longest path below every joint.
struct BodyTree {
  explicit BodyTree(const Skeleton& skeleton);

  double length(int j) const {
    return skeleton.joints[static_cast<std::size_t>(j)].offset_m.norm();
  }
  int parent(int j) const { return skeleton.joints[static_cast<std::size_t>(j)].parent; }
  const std::string& name(int j) const { return names[static_cast<std::size_t>(j)]; }
  /// The joints of the longest path from j on that are away from the one before, without twist
  /// bones.
  std::vector<int> path(int j) const;
  bool below(int j, int ancestor) const {
    while (j > ancestor) j = parent(j);
    return j == ancestor;
  }

  const Skeleton& skeleton;
  std::vector<std::string> names;  ///< in lower case, behind a prefix that all have and a ':'
  std::vector<std::vector<int>> children;
  std::vector<double> reach;  ///< length of the longest path from the joint on
  std::vector<int> next;      ///< joint on it, -1: none
  double longest = 0.0;
};

BodyTree::BodyTree(const Skeleton& s)
    : skeleton(s), children(s.joints.size()), reach(s.joints.size()), next(s.joints.size(), -1) {
  std::string prefix = s.joints.empty() ? "" : s.joints[0].name;
  for (const Joint& joint : s.joints) {
    prefix.erase(std::ranges::mismatch(prefix, joint.name).in1, prefix.end());
  }
  for (const Joint& joint : s.joints) {
    std::string name = joint.name.substr(s.joints.size() > 1 ? prefix.size() : 0);
    name.erase(0, name.find_last_of(":|") + 1);
    for (char& c : name) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    names.push_back(std::move(name));
  }
  for (const Joint& end : s.ends) {
    double& longer = reach[static_cast<std::size_t>(end.parent)];
    longer = std::max(longer, end.offset_m.norm());
  }
  for (int j = static_cast<int>(s.joints.size()) - 1; j > 0; --j) {
    const auto p = static_cast<std::size_t>(parent(j));
    children[p].push_back(j);
    const double whole = length(j) + reach[static_cast<std::size_t>(j)];
    if (whole < reach[p] || (whole == 0.0 && next[p] >= 0)) continue;
    reach[p] = whole;
    next[p] = j;
  }
  if (!reach.empty()) longest = reach[0];
}

std::vector<int> BodyTree::path(int j) const {
  constexpr std::size_t kMost = 64;  // no limb has more joints; files may have any number
  std::vector<int> joints;
  for (; j >= 0 && joints.size() < kMost; j = next[static_cast<std::size_t>(j)]) {
    if (length(j) > 1e-3 * longest && !has_word(name(j), kTwistWords)) joints.push_back(j);
  }
  return joints;
}

/// +1: `a` is the left one by the names, -1: `b`, 0: they do not tell.
int side_by_names(const std::string& a, const std::string& b) {
  const auto [x, y] = std::ranges::mismatch(a, b);
  if (x == a.end() || y == b.end()) return 0;
  return *x == 'l' && *y == 'r' ? 1 : *x == 'r' && *y == 'l' ? -1 : 0;
}

/// Two branches of a joint with the same lengths: legs or arms.
struct LimbPair {
  int from = 0;                            ///< joint that carries both
  std::array<std::vector<int>, 2> limb{};  ///< paths
  int words = 0;                           ///< above 0: words of arms, below: of legs
  double length = 0.0;
};

/// Length from a joint of a path to the next; joints left out between them count.
double step_of(const BodyTree& tree, const std::vector<int>& path, std::size_t i) {
  double sum = 0.0;
  for (int j = path[i + 1]; j != path[i]; j = tree.parent(j)) sum += tree.length(j);
  return sum;
}

bool alike(const BodyTree& tree, const LimbPair& pair) {
  const auto& [a, b] = pair.limb;
  if (std::min(a.size(), b.size()) < 3) return false;
  for (std::size_t i = 0; i + 1 < 3; ++i) {
    const double x = step_of(tree, a, i), y = step_of(tree, b, i);
    if (std::abs(x - y) > 0.2 * std::max(x, y) + 0.02 * pair.length) return false;
  }
  return true;
}

std::vector<LimbPair> limb_pairs(const BodyTree& tree) {
  constexpr double kLeastShare = 0.2;  // of the longest path from the root
  constexpr std::size_t kNeighbours = 6, kMostPairs = 100;
  std::vector<LimbPair> pairs;
  for (int p = 0; p < static_cast<int>(tree.children.size()); ++p) {
    std::vector<int> long_ones;
    const auto reach = [&](int c) { return tree.reach[static_cast<std::size_t>(c)]; };
    for (const int c : tree.children[static_cast<std::size_t>(p)]) {
      if (reach(c) > kLeastShare * tree.longest) long_ones.push_back(c);
    }
    std::ranges::sort(long_ones, std::greater{}, reach);
    for (std::size_t i = 0; i < long_ones.size(); ++i) {
      for (std::size_t k = i + 1; k < std::min(long_ones.size(), i + kNeighbours); ++k) {
        LimbPair pair{.from = p, .limb = {tree.path(long_ones[i]), tree.path(long_ones[k])}};
        pair.length = std::min(reach(long_ones[i]), reach(long_ones[k]));
        if (!alike(tree, pair)) continue;
        for (const std::vector<int>& limb : pair.limb) {
          for (const int j : limb) {
            pair.words += has_word(tree.name(j), kArmWords) ? 1 : 0;
            pair.words -= has_word(tree.name(j), kLegWords) ? 1 : 0;
          }
        }
        pairs.push_back(std::move(pair));
      }
    }
  }
  std::ranges::stable_sort(pairs, std::greater{}, &LimbPair::length);
  if (pairs.size() > kMostPairs) pairs.resize(kMostPairs);
  return pairs;
}

/// Index in both paths of the knee or elbow: by its word, or between the two longest bones in a
/// row.
std::size_t middle_of(const BodyTree& tree, const LimbPair& pair, Words words) {
  const std::vector<int>&left = pair.limb[0], &right = pair.limb[1];
  const auto bone = [&](std::size_t i) { return step_of(tree, left, i) + step_of(tree, right, i); };
  std::size_t best = 1;
  for (std::size_t m = 1; m + 1 < std::min(left.size(), right.size()); ++m) {
    const double ratio = bone(m - 1) / bone(m);
    if (has_word(tree.name(left[m]), words) && has_word(tree.name(right[m]), words) &&
        ratio > 0.5 && ratio < 2.0) {
      return m;
    }
    if (bone(m - 1) + bone(m) > bone(best - 1) + bone(best)) best = m;
  }
  return best;
}

/// What the tree tells: indices of joints.
struct FoundJoints {
  std::array<int, kBodyJoints> joint{};
  std::array<std::string, 2> toes;
  bool sides_named = false;
};

Vector3d offset_below(const BodyTree& tree, int from, int j) {
  Vector3d sum = Vector3d::Zero();
  for (; j > from; j = tree.parent(j)) {
    sum += tree.skeleton.joints[static_cast<std::size_t>(j)].offset_m;
  }
  return sum;
}

/// Ball of the foot: the first joint or end of the foot that is far enough from the ankle to show
/// where the foot points. Empty: the foot has none.
std::string toe_of(const BodyTree& tree, const std::vector<int>& leg, std::size_t ankle,
                   double shank) {
  const int foot = leg[ankle];
  for (std::size_t i = ankle + 1; i < leg.size(); ++i) {
    if (offset_below(tree, foot, leg[i]).norm() > 0.15 * shank) {
      return tree.skeleton.joints[static_cast<std::size_t>(leg[i])].name;
    }
  }
  std::string toe;
  double farthest = 1e-3 * shank;
  for (const Joint& end : tree.skeleton.ends) {
    if (!tree.below(end.parent, foot)) continue;
    const double d = (offset_below(tree, foot, end.parent) + end.offset_m).norm();
    if (d <= farthest) continue;
    farthest = d;
    toe = end.name;
  }
  return toe.empty() && leg.size() > ankle + 1
             ? tree.skeleton.joints[static_cast<std::size_t>(leg[ankle + 1])].name
             : toe;
}

void take_limb(const std::vector<int>& limb, std::size_t middle, std::size_t first,
               FoundJoints& found) {
  for (std::size_t i = 0; i < 3; ++i) found.joint[first + i] = limb[middle - 1 + i];
}

/// Trunk, neck and head; the limbs are known.
bool take_trunk(const BodyTree& tree, const LimbPair& legs, const LimbPair& arms,
                FoundJoints& found) {
  int fork = arms.from;  // where trunk and legs part
  while (!tree.below(legs.from, fork)) fork = tree.parent(fork);
  std::vector<int> spine;
  for (int j = arms.from; j != fork; j = tree.parent(j)) {
    if (tree.length(j) > 1e-3 * tree.longest) spine.insert(spine.begin(), j);
  }
  int neck = -1;
  if (spine.size() > 1 && has_word(tree.name(spine.back()), std::array{"neck"sv})) {
    neck = spine.back();
    spine.pop_back();
  }
  found.joint[kRoot] = legs.from;
  found.joint[kSpine] = spine.empty() ? arms.from : spine.front();
  found.joint[kChest] = spine.empty() ? arms.from : spine.back();

  int start = -1;
  for (const int c : tree.children[static_cast<std::size_t>(arms.from)]) {
    if (tree.below(arms.limb[0][0], c) || tree.below(arms.limb[1][0], c)) continue;
    if (tree.below(legs.limb[0][0], c)) continue;
    const auto rank = [&](int j) {
      return std::pair(has_word(tree.name(j), std::array{"neck"sv, "head"sv}),
                       tree.length(j) + tree.reach[static_cast<std::size_t>(j)]);
    };
    if (start < 0 || rank(c) > rank(start)) start = c;
  }
  std::vector<int> chain;
  for (int j = start; j >= 0; j = tree.next[static_cast<std::size_t>(j)]) {
    const bool ends = tree.reach[static_cast<std::size_t>(j)] < 1e-3 * tree.longest;
    if (chain.size() > 1 && ends) break;  // the tip of the head
    if (!chain.empty() && has_word(tree.name(j), kTipWords)) break;
    chain.push_back(j);
    if (has_word(tree.name(j), std::array{"head"sv})) break;
  }
  if (neck >= 0) chain.insert(chain.begin(), neck);
  if (chain.empty()) return false;
  const bool named = has_word(tree.name(chain.back()), std::array{"head"sv});
  const std::size_t head = named ? chain.size() - 1 : std::min<std::size_t>(1, chain.size() - 1);
  found.joint[kHead] = chain[head];
  found.joint[kNeck] = chain[head > 0 ? head - 1 : 0];
  return true;
}

tl::expected<FoundJoints, Status> find_joints(const BodyTree& tree) {
  const auto fail = [](const std::string& what) { return tl::unexpected(Status{what}); };
  const std::vector<LimbPair> pairs = limb_pairs(tree);
  const LimbPair *legs = nullptr, *arms = nullptr;
  const auto apart = [&](const LimbPair& a, const LimbPair& b) {
    return !tree.below(a.from, b.limb[0][0]) && !tree.below(a.from, b.limb[1][0]);
  };
  // by their words; else the arms are those that hang further from the root than the legs
  for (const LimbPair& a : pairs) {
    for (const LimbPair& b : pairs) {
      if (&a == &b || (arms != nullptr && legs != nullptr)) continue;
      if (!apart(a, b) || !apart(b, a) || a.limb[0] == b.limb[0] || a.limb[0] == b.limb[1])
        continue;
      const bool words = a.words < 0 && b.words > 0;
      const bool tree_tells =
          a.words <= 0 && b.words >= 0 && a.from != b.from && tree.below(b.from, a.from);
      if (!words && !tree_tells) continue;
      legs = &a;
      arms = &b;
    }
  }
  if (legs == nullptr) {
    return fail(pairs.empty() ? "no two limbs of the same lengths from one joint"
                              : "one pair of limbs, or it does not show which are the legs");
  }
  FoundJoints found;
  const std::size_t knee = middle_of(tree, *legs, kKneeWords);
  const std::size_t elbow = middle_of(tree, *arms, kElbowWords);
  const auto name = [&](const LimbPair& pair, std::size_t i, std::size_t m) -> const std::string& {
    return tree.name(pair.limb[i][m]);
  };
  int leg_side = 0, arm_side = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    leg_side += side_by_names(name(*legs, 0, knee - 1 + i), name(*legs, 1, knee - 1 + i));
    arm_side += side_by_names(name(*arms, 0, elbow - 1 + i), name(*arms, 1, elbow - 1 + i));
  }
  found.sides_named = leg_side != 0 && arm_side != 0;
  const std::size_t left_leg = leg_side < 0 ? 1 : 0, left_arm = arm_side < 0 ? 1 : 0;
  take_limb(legs->limb[left_leg], knee, kLeftHip, found);
  take_limb(legs->limb[1 - left_leg], knee, kRightHip, found);
  take_limb(arms->limb[left_arm], elbow, kLeftShoulder, found);
  take_limb(arms->limb[1 - left_arm], elbow, kRightShoulder, found);
  for (std::size_t s = 0; s < 2; ++s) {
    const std::vector<int>& leg = legs->limb[s == 0 ? left_leg : 1 - left_leg];
    found.toes[s] = toe_of(tree, leg, knee + 1, step_of(tree, leg, knee));
    if (found.toes[s].empty()) {
      return fail("joint '" + tree.skeleton.joints[static_cast<std::size_t>(leg[knee + 1])].name +
                  "' has no toe joint and no end, which show where the foot points");
    }
  }
  if (!take_trunk(tree, *legs, *arms, found)) return fail("no neck or head above the arms");
  return found;
}

/// Where the map's joints are in one frame.
struct MappedPose {
  MappedPose(const Clip& clip, const BodyMap& map, Index frame) {
    const SkeletonPose pose = skeleton_pose(clip, frame);
    for (std::size_t j = 0; j < kBodyJoints; ++j) {
      const auto i = static_cast<std::size_t>(clip.skeleton.find(map.joints[j]));
      R[j] = pose.R_WJ[i];
      p[j] = pose.p_WJ[i];
    }
    for (std::size_t s = 0; s < 2; ++s) {
      const std::size_t ankle = s == kLeft ? kLeftAnkle : kRightAnkle;
      toe[s] = p[ankle] + R[ankle] * ball_of_foot(clip, map, static_cast<Side>(s));
    }
  }
  Vector3d hips() const { return 0.5 * (p[kLeftHip] + p[kRightHip]); }
  Vector3d legs() const { return hips() - 0.5 * (p[kLeftAnkle] + p[kRightAnkle]); }
  Vector3d trunk() const { return p[kNeck] - hips(); }

  std::array<Matrix3d, kBodyJoints> R;
  std::array<Vector3d, kBodyJoints> p;
  std::array<Vector3d, 2> toe;
};

std::vector<MappedPose> sampled_poses(const Clip& clip, const BodyMap& map) {
  constexpr Index kMost = 200;
  std::vector<MappedPose> poses;
  const Index frames = clip.frames(), count = std::min(frames, kMost);
  for (Index i = 0; i < count; ++i) {
    poses.emplace_back(clip, map, count < 2 ? 0 : i * (frames - 1) / (count - 1));
  }
  return poses;
}

Vector3d unit(const Vector3d& v) { return v.norm() > 0.0 ? v.normalized() : v; }

Vector3d up_of_poses(std::span<const MappedPose> poses) {
  Vector3d legs = Vector3d::Zero(), trunk = Vector3d::Zero();
  for (const MappedPose& pose : poses) {
    legs += unit(pose.legs()) / static_cast<double>(poses.size());
    trunk += unit(pose.trunk()) / static_cast<double>(poses.size());
  }
  constexpr double kClear = 0.7;
  for (const int axis : {2, 0, 1}) {  // the file's y first
    for (const double sign : {1.0, -1.0}) {
      if (sign * legs[axis] > kClear && sign * trunk[axis] > kClear) {
        return sign * Vector3d::Unit(axis);
      }
    }
  }
  return Vector3d::UnitZ();
}

/// The rotation by multiples of 90° that is nearest to a sum of rotations.
Matrix3d by_quarter_turns(const Matrix3d& sum) {
  Matrix3d best = Matrix3d::Identity();
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) {
      for (int signs = 0; a != b && signs < 4; ++signs) {
        Matrix3d axes = Matrix3d::Zero();
        axes(0, a) = signs % 2 == 0 ? 1.0 : -1.0;
        axes(1, b) = signs < 2 ? 1.0 : -1.0;
        axes.row(2) = axes.row(0).cross(axes.row(1));
        if (axes.cwiseProduct(sum).sum() > best.cwiseProduct(sum).sum() + 1e-9) best = axes;
      }
    }
  }
  return best;
}

/// Columns forward, left, up; `left` is turned square to `up` or the other way round.
Matrix3d facing(const Vector3d& left, const Vector3d& up) {
  const Vector3d y = unit(left), x = unit(y.cross(up));
  Matrix3d R;
  R << x, y, x.cross(y);
  return R;
}

Matrix3d facing(const MappedPose& pose) {
  return facing(pose.p[kLeftHip] - pose.p[kRightHip], pose.trunk());
}

constexpr std::array<BodyJoint, 2> kHips = {kLeftHip, kRightHip},
                                   kShoulders = {kLeftShoulder, kRightShoulder};

/// Axes of all joints if the zero posture is a person's who stands: then they are the same.
std::optional<Matrix3d> axes_of_standing(const MappedPose& zero) {
  const Matrix3d W = facing(zero);
  if (!W.allFinite() || std::abs(W.determinant() - 1.0) > 1e-6) return {};
  const Matrix3d axes = by_quarter_turns(W.transpose());
  const Vector3d forward = axes.row(0), left = axes.row(1), up = axes.row(2);
  const auto bone = [&](std::size_t from) { return unit(zero.p[from + 1] - zero.p[from]); };
  bool stands = up.dot(unit(zero.trunk())) > 0.8 &&
                left.dot(unit(zero.p[kLeftHip] - zero.p[kRightHip])) > 0.8;
  for (std::size_t s = 0; s < 2; ++s) {
    const std::size_t hip = kHips[s], shoulder = kShoulders[s];
    const double side = s == kLeft ? 1.0 : -1.0;
    stands = stands && up.dot(bone(hip)) < -0.6 && up.dot(bone(hip + 1)) < -0.6 &&
             forward.dot(unit(zero.toe[s] - zero.p[hip + 2])) > -0.1 &&
             side * left.dot(bone(shoulder)) > -0.2 && bone(shoulder).dot(bone(shoulder + 1)) > 0.5;
  }
  return stands ? std::optional(axes) : std::nullopt;
}

/// Axes of each joint by itself: limbs have one along the bone and one about which knee or elbow
/// bend, as seen in the motion; the others have those of the joint before, by the mean posture.
std::array<Matrix3d, kBodyJoints> axes_by_motion(std::span<const MappedPose> poses) {
  std::array<Matrix3d, kBodyJoints> axes;
  const auto pelvis = [](const MappedPose& pose) { return facing(pose); };
  const auto chest = [](const MappedPose& pose) {
    return facing(pose.p[kLeftShoulder] - pose.p[kRightShoulder], pose.trunk());
  };
  // those of the joint before unless the joint stands clearly otherwise in the mean
  const auto follow = [&](std::size_t joint, std::size_t before) {
    Matrix3d relative = Matrix3d::Zero();
    for (const MappedPose& pose : poses) {
      relative += pose.R[before].transpose() * pose.R[joint] / static_cast<double>(poses.size());
    }
    constexpr double kClearly = 1.5;  // trace of a rotation by 76°
    axes[joint] =
        relative.trace() > kClearly ? axes[before] : by_quarter_turns(axes[before] * relative);
  };
  Matrix3d root = Matrix3d::Zero();
  for (const MappedPose& pose : poses) root += pelvis(pose).transpose() * pose.R[kRoot];
  axes[kRoot] = by_quarter_turns(root);
  follow(kSpine, kRoot);
  for (const BodyJoint joint : {kChest, kNeck, kHead}) follow(joint, joint - 1);
  for (std::size_t s = 0; s < 2; ++s) {
    const double side = s == kLeft ? 1.0 : -1.0;
    for (const std::size_t first : {kHips[s], kShoulders[s]}) {
      const bool leg = first == kHips[s];
      for (std::size_t joint = first; joint < first + 2; ++joint) {
        Vector3d bone = Vector3d::Zero(), hinge = Vector3d::Zero(), still = Vector3d::Zero();
        for (const MappedPose& pose : poses) {
          const Vector3d upper = unit(pose.p[first + 1] - pose.p[first]);
          const Vector3d lower = unit(pose.p[first + 2] - pose.p[first + 1]);
          const Matrix3d R_JW = pose.R[joint].transpose();
          const Vector3d segment = joint == first ? upper : lower;
          bone += R_JW * segment;
          hinge += R_JW * upper.cross(lower);
          const Vector3d along = leg ? pelvis(pose).col(1) : chest(pose).col(0);
          still += R_JW * (leg ? along : Vector3d(segment.cross(along)));
        }
        constexpr double kBent = 0.03;  // mean sine of the angle between the bones
        if (hinge.norm() < kBent * static_cast<double>(poses.size())) hinge = still;
        // knees bend about the left axis; elbows, in the T-posture, forward: about the upright one
        const Matrix3d axes_J =
            leg ? facing(hinge, -bone) : facing(side * bone, Vector3d(-side * hinge));
        axes[joint] = by_quarter_turns(axes_J.transpose());
      }
      follow(first + 2, first + 1);
    }
  }
  return axes;
}

std::string axes_text(const Matrix3d& axes) {
  std::string text;
  for (Index i = 0; i < 3; ++i) {
    for (Index k = 0; k < 3; ++k) {
      if (axes(i, k) != 0.0) text += {axes(i, k) > 0.0 ? '+' : '-', "xyz"[k]};
    }
  }
  return text;
}

/// Elevation of the ball over the ankle while the foot is slowest: then the sole is flat.
double sole_of(const Clip& clip, const BodyMap& map, const Vector3d& up) {
  constexpr Index kMost = 1000;
  constexpr double kStill = 0.3;  // share of the frames
  struct Instant {
    double speed, elevation;
  };
  std::vector<Instant> instants;
  const Index stride = 1 + clip.frames() / kMost;
  for (Index f = 0; f < clip.frames(); f += stride) {
    const MappedPose pose(clip, map, f), after(clip, map, std::min(f + 1, clip.frames() - 1));
    for (std::size_t s = 0; s < 2; ++s) {
      const Vector3d foot = unit(pose.toe[s] - pose.p[kHips[s] + 2]);
      instants.push_back(
          {(after.toe[s] - pose.toe[s]).norm(), std::asin(std::clamp(foot.dot(up), -1.0, 1.0))});
    }
  }
  const auto at = [&](double share) {
    return instants.begin() +
           static_cast<std::ptrdiff_t>(share * static_cast<double>(instants.size()));
  };
  std::ranges::nth_element(instants, at(kStill), {}, &Instant::speed);
  instants.erase(at(kStill) + 1, instants.end());
  std::ranges::nth_element(instants, at(0.5), {}, &Instant::elevation);
  return std::min(at(0.5)->elevation, 0.3);
}

}  // namespace

Vector3d upward(const Clip& clip, const BodyMap& map) {
  return up_of_poses(sampled_poses(clip, map));
}

tl::expected<BodyMap, Status> find_body_map(const Clip& clip) {
  const auto fail = [&](const std::string& what) {
    return tl::unexpected(Status{one_line(clip.name + ": no person's skeleton: " + what +
                                          ", expected two legs, two arms and a head; --map names "
                                          "the joints")});
  };
  if (clip.frames() < 1) return tl::unexpected(Status{clip.name + ": no frame"});
  const BodyTree tree(clip.skeleton);
  const auto found = find_joints(tree);
  if (!found) return fail(found.error().reason);
  BodyMap map;
  for (std::size_t j = 0; j < kBodyJoints; ++j) {
    map.joints[j] = clip.skeleton.joints[static_cast<std::size_t>(found->joint[j])].name;
    if (clip.skeleton.find(map.joints[j]) != found->joint[j]) {
      return fail("two joints are named '" + map.joints[j] + "'");
    }
  }
  map.toes = found->toes;

  std::vector<MappedPose> poses = sampled_poses(clip, map);
  const Vector3d up = up_of_poses(poses);
  double upright = 0.0, side = 0.0;
  for (const MappedPose& pose : poses) {
    const Vector3d feet =
        unit(pose.toe[0] - pose.p[kLeftAnkle]) + unit(pose.toe[1] - pose.p[kRightAnkle]);
    const Vector3d left = unit(pose.p[kLeftHip] - pose.p[kRightHip]), trunk = unit(pose.trunk());
    upright += up.dot(trunk) / static_cast<double>(poses.size());
    side += 0.5 * trunk.cross(feet).dot(left) / static_cast<double>(poses.size());
  }
  if (upright < 0.3) return fail("the trunk is not upright in most frames");
  if (found->sides_named && side < -0.3) {
    return fail("'" + map.joints[kLeftHip] +
                "' is on the right of the feet's direction (mirrored?)");
  }
  if (!found->sides_named && side < 0.0) {
    for (std::size_t i = 0; i < 3; ++i) {
      std::swap(map.joints[kLeftHip + i], map.joints[kRightHip + i]);
      std::swap(map.joints[kLeftShoulder + i], map.joints[kRightShoulder + i]);
    }
    std::swap(map.toes[0], map.toes[1]);
    poses = sampled_poses(clip, map);
  }

  if (const auto axes = axes_of_standing(MappedPose(clip, map, -1))) {
    map.axes.fill(axes_text(*axes));
  } else {
    const auto each = axes_by_motion(poses);
    for (std::size_t j = 0; j < kBodyJoints; ++j) map.axes[j] = axes_text(each[j]);
  }
  for (const BodyMap& known : known_body_maps()) {
    if (known.joints == map.joints && known.toes == map.toes && known.axes == map.axes)
      return known;
  }
  map.sole_rad = sole_of(clip, map, up);
  return map;
}

double stature_m(const Skeleton& skeleton, const BodyMap& map) {
  const auto way = [&](std::size_t from, std::size_t to) {
    double sum = 0.0;
    int j = skeleton.find(map.joints[to]);
    for (const int end = skeleton.find(map.joints[from]); j > end;) {
      sum += skeleton.joints[static_cast<std::size_t>(j)].offset_m.norm();
      j = skeleton.joints[static_cast<std::size_t>(j)].parent;
    }
    return sum;
  };
  const double thigh = 0.5 * (way(kLeftHip, kLeftKnee) + way(kRightHip, kRightKnee));
  const double shank = 0.5 * (way(kLeftKnee, kLeftAnkle) + way(kRightKnee, kRightAnkle));
  return 1.1 * (thigh + shank) + way(kRoot, kHead) + 0.46 * thigh;
}

}  // namespace mimesis::mocap
