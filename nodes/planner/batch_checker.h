#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "common/kin/arm.h"
#include "common/kin/table.h"

namespace mimesis::planner {

/// Obstacles that the arm must not touch, in W, and the object that it carries.
struct Obstacles {
  std::vector<kin::Ball> balls;
  std::vector<kin::Box> boxes;
  std::vector<kin::Ball> held;  ///< balls that cover a held object, centres in E [m]
  std::vector<kin::Box>
      supports;  ///< boxes that the held object may touch: it is lifted from or put on them
  std::vector<kin::Hull> hulls{};
};

/// [0, n) in parts of at most `most` that are near each other, by halves along the longest side.
std::vector<std::vector<std::size_t>> near_each_other(const Eigen::Matrix3Xd& points,
                                                      std::size_t most);

/// Several postures are judged at once, one in each lane of the vectors.
inline constexpr int kLanes = 8;
using Lanes = float __attribute__((vector_size(4 * kLanes), aligned(4 * kLanes)));

/// Safety balls [M18 2.3.2] of kLanes postures at a time, in single precision, with vector
/// registers: AVX2 where the processor has it, and the same bits without. What is nearer than the
/// margin and 10 µm more, which covers all rounding, touches.
///
/// The balls of one link are a cluster, near obstacle balls another: only where the balls around
/// two clusters overlap are their members looked at.
class BatchChecker {
 public:
  static constexpr std::size_t kMostJoints = 12;

  BatchChecker(const kin::ArmModel& arm, const Obstacles& obstacles, double margin_m);

  struct PerJoint {
    Lanes lanes[kMostJoints + 1];
    Lanes& operator[](std::size_t joint) { return lanes[joint]; }
    const Lanes& operator[](std::size_t joint) const { return lanes[joint]; }
  };
  struct Postures {
    PerJoint q;          ///< [rad]
    PerJoint deviation;  ///< motion of the joints to both sides of q [rad]
  };
  struct Verdicts {
    std::uint32_t touches = 0;  ///< a bit for each lane: q touches something
    std::uint32_t near = 0;     ///< something may touch during the motion; of lanes not touching
  };
  /// Postures alone.
  Verdicts judge(const Postures& postures);
  /// Any of them touches: as soon as one is known to, the rest is not looked at.
  bool any_touches(const Postures& postures);
  /// Postures with all motions around them: those of a lane that neither touches nor is near are
  /// proven free. Of the motion, a cluster moves at most D, where, from its frame to the base,
  ///   D ← 0;  D ← D + (ρⱼ + D) δⱼ,   ρⱼ = largest distance of its centres from axis j at q,
  /// or D ← D + δⱼ where joint j slides.
  /// (Move the outer joints first: when joint j turns, its axis still stands as at q, and the ball,
  /// already moved by D, is at most ρⱼ + D away from it.) Down to frame f only it is the motion
  /// relative to f, which counts for pairs of own clusters.
  /// Where one lane touches, the others may not have been looked at.
  Verdicts judge_motions(const Postures& postures);
  /// The same, but the joints of a lane move together on a straight line, from q − deviation to
  /// q + deviation (signed). A point of a cluster moves by its velocity u = J·deviation at q, and
  /// at most by
  ///   R = ½ Σⱼ Lⱼ |δⱼ| (|δⱼ| + 2 Σᵢ﹤ⱼ |δᵢ|)
  /// more, Lⱼ = its largest distance from axis j at any posture: the second derivatives are
  /// zᵢ × (zⱼ × (p − oⱼ)), i the inner joint. In a frame that moves itself, by Σ Lⱼ |δⱼ|.
  Verdicts judge_lines(const Postures& postures);
  using Levers = std::array<double, kMostJoints>;
  /// Largest distance of any cluster from the axis of each joint [m]; 1 if it slides.
  const Levers& levers() const { return levers_; }

 private:
  enum class Mode : std::uint8_t { postures, any_posture, boxes, lines };
  /// Constant part of the chain before a joint: R turns and t moves, in the frame before it.
  struct Step {
    enum class Turn : std::uint8_t { none, x_by_90, x_by_minus_90, any } turn = Turn::none;
    std::array<float, 9> R{};  // row after row
    std::array<float, 3> t{};
    float offset = 0.0f;  // of the joint behind it
    bool slides = false;  // that joint
  };
  struct Point {
    std::array<float, 3> p{};  // in its frame, or in W
    float r = 0.0f;            // with margin and rounding if a ball of the arm
  };
  struct Cluster {
    std::size_t frame = 0, begin = 0, end = 0;  // balls
    Point ball;                                 // around all balls
    float spread = 0.0f;                        // largest distance of a centre from ball.p
    bool held = false, against_obstacles = true;
    std::array<float, kMostJoints> reach{};  // L of each joint; 1 if it slides
  };
  struct Pair {
    std::size_t a, b;  // clusters; b's frame is not below a's
  };
  struct Group {
    std::size_t begin, end;  // obstacle balls
    Point ball;
  };
  struct Cuboid {
    std::array<float, 3> c, h;
  };
  struct Place {
    Lanes x, y, z;
  };
  struct Frame {
    Place x, y, z, p;  // axes and origin
  };
  struct Twist {
    Place turn, move;  // of a lane's line: velocity of point p is turn × p + move
    Lanes speed;       // |turn|
  };

  void bound_reach(const kin::ArmModel& arm, Cluster& cluster);
  void add_arm(const kin::ArmModel& arm, const Obstacles& obstacles, double margin_m);
  void add_obstacles(const Obstacles& obstacles);

  Levers levers_{};
  float margin_;  // of a pair of own balls it is counted once
  std::vector<Step> steps_;
  std::vector<Point> balls_;  // of the arm, in the order of clusters
  std::vector<Cluster> clusters_;
  std::vector<Pair> pairs_;
  std::vector<Point> obstacles_;
  std::vector<Group> groups_;
  std::vector<Cuboid> boxes_, supports_;

  // Scratch, of the postures at hand.
  std::array<Frame, kMostJoints + 1> frames_;  // the axes of the joints: turned by them
  std::array<Twist, kMostJoints + 1> twists_;
  PerJoint squares_;                 // |δⱼ| (|δⱼ| + 2 Σᵢ﹤ⱼ |δᵢ|)
  std::vector<Place> centers_, at_;  // of clusters, of balls
  std::vector<char> placed_;         // clusters whose balls are
  std::vector<PerJoint> bounds_;     // [cluster][relative to frame]

  friend struct BatchKernel;
};

}  // namespace mimesis::planner
