#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/interrupt.h"
#include "nodes/planner/batch_checker.h"
#include "nodes/planner/part_checker.h"

namespace mimesis::planner {

/// "(x, y, z) mm", rounded: how reasons name places.
std::string in_mm(const Eigen::Vector3d& p);
/// "the high stand", or "the box at (x, y, z) mm" if it has no name.
std::string in_words(const kin::Box& box);

/// Stops without the path: every joint is slowed down by its own drive until all are at rest. They
/// begin anywhere between two near points of a path, at the speeds v there or slower, after at most
/// `delay_s` in which the drives go on at these speeds, with the decelerations a or harder. ρ(u)
/// being the ramp from v with a, a stop at r v with k a leads along q + r v τ + (r²/k) ρ(u): all of
/// them are a fan of curves, r²/k from 0 to 1.
///
/// One drive may fail alone: it stands or slows down up to `alone_s` before the others are told, or
/// hears of it so much later. They stop as above, without delay; its joint is anywhere between its
/// place on the path `alone_s` before and where it gets to if it starts its ramp `alone_s` after.
struct Stops {
  Eigen::VectorXd q0, v0, q1, v1;  ///< [rad], [rad/s]
  Eigen::VectorXd a;               ///< [rad/s²]
  double delay_s = 0.0;
  double bow_rad = 0.0;  ///< how far the path leaves the line between the points
  double alone_s = 0.0;
  Eigen::VectorXd before0{},
      before1{};                ///< places `alone_s` before q0 and q1; empty: none fails alone
  double before_bow_rad = 0.0;  ///< how far the way since then leaves the box of its ends
  int pieces = 1;  ///< of a path's grid between the points: of several only what is soon proven is
};

/// Safety balls of an arm against obstacles and against itself [M18 2.3.2], for postures and for
/// whole motions; where balls of convex parts touch, the parts decide. Two things touch if they are
/// nearer than `margin_m`.
///
/// Motions are certified, not sampled: a part of the motion whose joints stay within ±δⱼ of a
/// middle posture is free if BatchChecker proves it; else it is divided. Parts are judged kLanes at
/// a time, the coarse ones first, so that most motions that touch are refused by the first batch.
///
/// Before each batch `interrupt` is asked: once it has said yes nothing is free, and no motion.
class CollisionChecker {
 public:
  /// The arm is not copied: it must outlive the checker.
  CollisionChecker(const kin::ArmModel& arm, const Obstacles& obstacles, double margin_m,
                   Interrupt interrupt = {});
  CollisionChecker(kin::ArmModel&&, const Obstacles&, double, Interrupt = {}) = delete;

  /// No ball touches anything at posture q (n) [rad]. Does not allocate.
  bool free(const Eigen::Ref<const Eigen::VectorXd>& q);
  /// The same of every column.
  std::vector<char> free_columns(const Eigen::Ref<const Eigen::MatrixXd>& postures);
  /// Which ball or part touches what, in words; nothing if the posture is free.
  std::optional<std::string> contact(const Eigen::Ref<const Eigen::VectorXd>& q);
  /// The same of the pair that is nearest, though it may not touch.
  std::string nearest(const Eigen::Ref<const Eigen::VectorXd>& q);
  /// PartChecker::torn; empty without parts.
  std::string torn(const Eigen::Ref<const Eigen::VectorXd>& a,
                   const Eigen::Ref<const Eigen::VectorXd>& b) {
    return parts_ ? parts_->torn(a, b, interrupt_) : "";
  }
  /// The straight motion from a to b in joint space is proven free. Does not allocate in the long
  /// run.
  bool certify(const Eigen::Ref<const Eigen::VectorXd>& a,
               const Eigen::Ref<const Eigen::VectorXd>& b);
  /// None of kLanes postures spread over the straight motion from a to b, b among them, touches.
  /// Does not allocate.
  bool seems_free(const Eigen::Ref<const Eigen::VectorXd>& a,
                  const Eigen::Ref<const Eigen::VectorXd>& b);
  /// The Bézier curve with these control points (columns) is proven free.
  bool certify_curve(const Eigen::MatrixXd& control_points);
  /// All these stops are proven free.
  bool certify_stops(const Stops& stops);
  /// Convex parts decide: proofs take long, so one proof of many stops at once pays.
  bool has_parts() const { return parts_.has_value(); }

  const kin::ArmModel& arm() const { return arm_; }
  const Interrupt& interrupt() const { return interrupt_; }
  /// since construction, whole motions included
  long postures_checked() const { return postures_; }

 private:
  template <class Motion>
  bool certify_family(const Motion& motion, std::vector<typename Motion::Part>& open, long most);

  /// Places lane's posture and deviation in scratch.
  void take_lane(int lane);
  bool parts_free(int lane);

  const kin::ArmModel& arm_;
  Obstacles obstacles_;
  double margin_;
  BatchChecker batch_;
  std::optional<PartChecker> parts_;  // if arm or obstacles have parts
  Interrupt interrupt_;
  BatchChecker::Postures lanes_;                  // scratch
  Eigen::VectorXd q_, deviation_;                 // scratch
  std::vector<std::array<float, 2>> line_parts_;  // scratch
  // Scratch of certify_family: what PartChecker found near, and of each open part its share.
  std::vector<PartChecker::Near> near_;
  std::vector<std::array<std::size_t, 2>> near_of_;
  long postures_ = 0;
};

}  // namespace mimesis::planner
