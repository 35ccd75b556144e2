#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/kin/arm.h"
#include "common/kin/table.h"

namespace mimesis::planner {

/// "(x, y, z) mm", rounded: how reasons name places.
std::string in_mm(const Eigen::Vector3d& p);
/// "the high stand", or "the box at (x, y, z) mm" if it has no name.
std::string in_words(const kin::Box& box);

/// Obstacles that the arm must not touch, in W, and the object that it carries.
struct Obstacles {
  std::vector<kin::Ball> balls;
  std::vector<kin::Box> boxes;
  std::vector<kin::Ball> held;  ///< balls that cover a held object, centres in E [m]
  std::vector<kin::Box>
      supports;  ///< boxes that the held object may touch: it is lifted from or put on them
};

/// Safety balls of an arm against obstacles and against itself [M18 2.3.2], for postures and for
/// whole motions. Two things touch if they are nearer than `margin_m`.
///
/// Motions are certified, not sampled: over a motion whose joints stay within ±δⱼ of a middle
/// posture, a ball i moves at most Dᵢ, where, joints taken from the ball's own frame down to the
/// base,
///   D ← 0;  D ← D + (ρᵢⱼ + D) δⱼ,    ρᵢⱼ = distance of the ball from axis j at the middle posture.
/// (Move the outer joints first: when joint j turns, its axis still stands as at the middle
/// posture, and the ball, already moved by D, is at most ρᵢⱼ + D away from it.) Stopping at frame f
/// bounds the motion relative to f, which is what a pair of own balls needs. Free if every
/// clearance at the middle exceeds its bound; else the motion is halved.
class CollisionChecker {
 public:
  CollisionChecker(const kin::ArmModel& arm, const Obstacles& obstacles, double margin_m);

  /// No ball touches anything at posture q (n) [rad]. Does not allocate.
  bool free(const Eigen::Ref<const Eigen::VectorXd>& q);
  /// Which ball touches what, in words; nothing if the posture is free.
  std::optional<std::string> contact(const Eigen::Ref<const Eigen::VectorXd>& q);
  /// The straight motion from a to b in joint space is proven free. Does not allocate.
  bool certify(const Eigen::Ref<const Eigen::VectorXd>& a,
               const Eigen::Ref<const Eigen::VectorXd>& b);
  /// The Bézier curve with these control points (columns) is proven free.
  bool certify_curve(const Eigen::MatrixXd& control_points);

  const kin::ArmModel& arm() const { return arm_; }
  /// since construction, whole motions included
  long postures_checked() const { return postures_; }

 private:
  enum class Verdict { touches, free, certified };  // certified: free during the whole motion
  struct SelfPair {
    std::size_t a, b;  // into balls_
    double reach;      // sum of radii and margin [m]
  };

  void add_balls(bool against_obstacles);
  void add_self_pairs();
  void place(const Eigen::Ref<const Eigen::VectorXd>& q);
  void bound_motion();
  Verdict judge(bool with_bounds) const;
  double relative_bound(const SelfPair& pair) const;
  bool certify_part(double center, double half_width);
  bool certify_part(const Eigen::MatrixXd& control_points);

  kin::ArmModel arm_;
  Obstacles obstacles_;
  double margin_;

  // All balls: those of the arm checked against obstacles, the held ones, the rest of the arm.
  std::vector<kin::SafetyBall> balls_;
  std::vector<std::string> names_;
  std::size_t of_the_arm_ = 0, against_all_ = 0;  // how many of them, from the first
  std::vector<SelfPair> self_pairs_;

  // For the placed posture, over balls_.
  std::vector<Eigen::Isometry3d> X_WF_;
  std::vector<double> x_, y_, z_, reach_;      // reach_: radius + margin
  std::vector<std::vector<double>> moved_by_;  // [joint][ball]: 1 if the joint moves it, else 0
  std::vector<std::vector<double>> bound_;     // [frame][ball]: motion relative to the frame [m]
  std::vector<double> no_motion_;              // zeros
  Eigen::VectorXd deviation_, middle_, from_, along_;
  long postures_ = 0;
};

}  // namespace mimesis::planner
