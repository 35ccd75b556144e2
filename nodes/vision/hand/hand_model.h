#pragma once
#include <Eigen/Core>
#include <array>
#include <cmath>

namespace mimesis::vision {

inline constexpr std::size_t kHandJoints = 20;
inline constexpr std::size_t kHandCapsules = 22, kForearmCapsules = 2;  ///< the forearm's are last

/// Palm of a hand: from the wrist to the middle knuckle, in lengths of the hand.
inline constexpr double kPalm = 0.446;
/// Logarithm of the longest bare forearm, in lengths of the hand: it leaves the picture.
inline constexpr double kLongestArm = 1.1;

/// How a person's hand differs from the published one: logarithms of ratios. At most kMostShape.
struct HandShape {
  double palm = 0.0;     ///< of the palm's length; the fingers are what is left of the hand's
  double breadth = 0.0;  ///< of the palm's breadth and the thickness of all parts
  double length = 0.0;   ///< of the hand's length over that of the model
};
inline constexpr HandShape kMostShape{0.20, 0.20, 0.12};

/// State of a hand: 26 degrees of freedom, the wrist's two, the person's shape and that of the
/// forearm, by which it is known from the hand. Frame H of the hand: origin halfway between wrist
/// and middle knuckle, x towards this knuckle, z out of the palm; y = z × x points to the thumb of
/// a left hand.
struct HandPose {
  bool left = true;                                    ///< it is a left hand
  Eigen::Vector3d p_CH = Eigen::Vector3d::Zero();      ///< in the frame of the first camera [m]
  Eigen::Matrix3d R_CH = Eigen::Matrix3d::Identity();  ///< orientation in that frame
  /// Thumb: abduction, flexion across the palm, MCP, IP; index, middle, ring, little: spread
  /// (+ towards the thumb), MCP, PIP, DIP. Flexion is positive.
  std::array<double, kHandJoints> joint_rad{};
  std::array<double, 2> wrist_rad{};  ///< flexion, deviation of the forearm
  HandShape shape;
  /// Logarithms of the forearm's breadth at wrist and elbow over the usual ones, and of the bare
  /// length over that of the hand: where the sleeve begins.
  std::array<double, 3> arm{0.0, 0.0, kLongestArm};
};

/// Range of a joint and its angle in a hand at rest [rad].
struct JointRange {
  double least, most, rest;
};
/// Ranges of the fingers: about those of Lin, Wu & Huang 2000, "Modeling the constraints of human
/// hand motion"; the thumb's are ours.
const std::array<JointRange, kHandJoints>& hand_joint_ranges();

/// Part of a hand: cone between two balls, frame of the first camera [m]; nothing if radius_a is 0.
struct Capsule {
  Eigen::Vector3f a, b;
  float radius_a, radius_b;
};
using HandCapsules = std::array<Capsule, kHandCapsules>;

/// Kinematics of a hand of given length (wrist crease to tip of the middle finger). But for the
/// pose's shape bones are shares of it after Buchholz, Armstrong & Goldstein, Ergonomics
/// 35(3):261-273, 1992.
class HandModel {
 public:
  explicit HandModel(double length_m) : length_m_(length_m) {}

  double length_m() const { return length_m_; }
  double length_m(const HandPose& pose) const { return length_m_ * std::exp(pose.shape.length); }
  /// Wrist in the frame of the first camera [m].
  Eigen::Vector3d wrist(const HandPose& pose) const;
  /// Does not allocate.
  void capsules(const HandPose& pose, HandCapsules& out) const;
  /// Tips of thumb, index, middle, ring and little finger in the frame of the first camera [m].
  std::array<Eigen::Vector3d, 5> tips(const HandPose& pose) const;

 private:
  double length_m_;
};

}  // namespace mimesis::vision
