#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/interrupt.h"
#include "nodes/planner/batch_checker.h"

namespace mimesis::planner {

/// Convex parts of an arm, in double precision: what decides where balls of BatchChecker touch. Two
/// things touch if they are nearer than `margin_m`.
class PartChecker {
 public:
  /// The arm is not copied: it must outlive the checker.
  PartChecker(const kin::ArmModel& arm, const Obstacles& obstacles, double margin_m);

  enum class Verdict : std::uint8_t {
    free,     ///< proven of the whole motion
    near,     ///< of the posture; something may touch during the motion
    touches,  ///< the posture
  };
  /// Two parts: of a pair of bodies, by their numbers.
  struct Near {
    std::uint32_t pair, parts;
  };
  /// Posture q with all motions of the joints by ±deviation around it, both n [rad]. Of the motion,
  /// a part moves as BatchChecker::judge_motions says, with the balls that cover it.
  Verdict judge(const Eigen::Ref<const Eigen::VectorXd>& q,
                const Eigen::Ref<const Eigen::VectorXd>& deviation) {
    return judge(q, deviation, {}, nullptr, false);
  }
  /// Of motions that are a part of others judged before.
  /// @param only  what was near in those: the rest is proven free; empty: all is looked at
  /// @param near  not null: what is near is put behind this, in its order
  /// @param often  many such motions lie side by side: pairs with few joints between them, which
  ///               may be near each other all the time, are proven free in cells of these joints
  ///               once and for all
  Verdict judge(const Eigen::Ref<const Eigen::VectorXd>& q,
                const Eigen::Ref<const Eigen::VectorXd>& deviation, std::span<const Near> only,
                std::vector<Near>* near, bool often);
  /// The nearest pair at posture q: "part 3 (hand) touches the high stand".
  std::string nearest(const Eigen::Ref<const Eigen::VectorXd>& q);
  /// A pair with at most two joints between its links that keeps posture b from posture a, in
  /// words: no free places on a grid of these joints connect the two. Ways narrower than the grid
  /// are not seen. Empty: there is none.
  std::string torn(const Eigen::Ref<const Eigen::VectorXd>& a,
                   const Eigen::Ref<const Eigen::VectorXd>& b, const Interrupt& interrupt);

 private:
  /// Balls, a row each: centre and radius, in their frame or in W.
  using Cover = Eigen::ArrayX4d;
  struct Part {
    kin::SafetyPart shape;  // in its frame, or in W
    std::string name;
    math::RoundBound around{};  // the cover
    Cover cover{};
  };
  /// Parts of a frame and group, or obstacles that are near each other.
  struct Body {
    int frame = 0, group = 0;
    bool held = false, obstacle = false, support = false;
    std::size_t number = 0;  // of obstacles
    std::vector<std::size_t> parts{};
    const math::ConvexPart* hull = nullptr;  // around several parts; none: all are looked at
    Cover cover{}, around_cover{};           // the latter holds the former in a ball
    math::RoundBound around{};
    std::vector<double>
        lever_m{};  // its farthest point is at most so far from axes below its frame
  };
  static constexpr Eigen::Index kCellJoints = 3;
  using Corner = Eigen::Array<double, kCellJoints, 1>;
  /// A box of the joints between the links of a pair, halved where that was needed.
  struct Cell {
    Corner lo, hi;  // of missing joints 0
    enum class Is : std::uint8_t { open, free, near, halved } is = Is::open;
    std::size_t halves = 0;    // the first of two
    std::vector<Near> near{};  // in what this is a half of; empty: all may be
  };
  struct Pair {
    std::size_t inner, outer;                         // bodies; an obstacle is the inner one
    Eigen::Vector3d apart = Eigen::Vector3d::Zero();  // direction in which hulls were
    std::vector<Eigen::Vector3d> parts_apart{};  // those of its parts; empty: not looked at yet
    std::size_t touched = 0;                     // its parts that did last
    std::vector<Cell> cells{};                   // the first holds all; none: not looked at yet
  };
  void add_obstacles(const Obstacles& obstacles);
  void add(kin::SafetyPart shape, std::string name, Body body);
  void place(const Eigen::Ref<const Eigen::VectorXd>& q);
  void place_next(std::size_t j, double q);
  double apart(const Pair& pair) const;
  double motion(const Cover& cover, std::vector<double>& known, std::size_t frame,
                std::size_t relative_to);
  bool touches(std::uint32_t number, std::span<const Near> only, std::vector<Near>& near);
  bool free_by_cells(std::uint32_t number, const Eigen::Ref<const Eigen::VectorXd>& q,
                     const Eigen::Ref<const Eigen::VectorXd>& deviation, int most);
  void judge_cell(std::uint32_t number, std::size_t cell);
  Eigen::Isometry3d between(const Body& inner, const Body& outer) const;

  const kin::ArmModel& arm_;
  double margin_;
  std::vector<Part> parts_;
  std::vector<Body> bodies_;
  std::vector<Pair> pairs_;
  std::vector<std::uint32_t> order_;  // of pairs: what touched last is the first

  std::vector<Eigen::Isometry3d> around_joint_;  // before_joint() of modified links, else after

  // Scratch, of the posture at hand.
  bool still_ = true;  // no joint moves
  std::vector<Eigen::Isometry3d> frames_;
  std::vector<Eigen::Vector3d> origins_, directions_;  // of the joints' axes
  struct Axis {
    Eigen::Vector3d origin, direction;
  };
  std::vector<std::vector<Axis>> axes_;  // below a frame, in it; empty: not known yet
  std::vector<Near> near_, near_in_cell_;
  std::vector<std::size_t> open_cells_;
  Eigen::VectorXd deviation_;
  std::vector<Eigen::Vector3d> centers_;  // of bodies, obstacles last
  std::vector<double> most_motion_;       // of bodies that move
  // [part or body that moves][relative to frame]; empty: not known yet
  std::vector<std::vector<double>> motion_, body_motion_, around_motion_;
};

}  // namespace mimesis::planner
