#pragma once
#include <optional>
#include <span>
#include <string>

#include "nodes/vision/hand/hand_tracker.h"

namespace mimesis::vision {

struct TeacherHandSetup {
  std::string side = "either";  ///< of the hand that acts: left, right, either
  double length_m = 0.185;      ///< of this hand, wrist crease to tip of the middle finger

  template <class Visitor>
  void visit(Visitor& v) {
    v("side", side, {"left", "right", "either"});
    v("length_m", length_m, 0.1, 0.3);
  }
};

/// The teacher's hand by the hand model, frame T.
struct HandSight {
  Eigen::Vector3d wrist;        ///< [m]
  Eigen::Vector3d palm;         ///< origin of frame H [m]
  double palm_angle_rad = 0.0;  ///< palm's normal against the vertical: 0 down, π/2 sideways
};

/// Begins the hand tracker where the skin blob says that a whole hand is, with the palm turned in
/// each of four ways; a left and a right hand are followed until it is clear which fits better.
/// Begins again when it has lost the hand or follows something else.
class TeacherHand {
 public:
  TeacherHand(const TeacherHandSetup& setup, std::span<const image::Camera> cameras);
  /// Whether the cameras' pictures are alike, and a hand large enough in them for its orientation
  /// to be no guess.
  static bool possible(const TeacherHandSetup& setup, std::span<const image::Camera> cameras);

  /// Takes a camera's newest picture.
  /// @param labels  classes of its pixels: object and bar may hide the hand
  void see(std::size_t camera, const image::Image& picture, std::span<const std::uint8_t> labels);
  /// Fits the hand to what was seen of all cameras; one that is not followed is sought.
  /// @param blob  centre of the hand's blob in the plane of motion [m], if there is one
  void follow(const std::optional<Eigen::Vector2d>& blob);
  /// The next demonstration begins with a new search.
  void forget() { following_ = false, sight_.reset(); }
  const std::optional<HandSight>& sight() const { return sight_; }
  const HandTracker& tracker() const { return hypotheses_[best_].tracker; }

 private:
  struct Hypothesis {
    bool left;
    HandTracker tracker;
    double sum = 0.0;  ///< of its scores
  };
  bool whole(const Eigen::Vector2d& blob) const;
  void begin(const Eigen::Vector2d& blob);
  bool chosen() const;
  /// Steps all hypotheses, or the best once it is chosen.
  void step();

  image::Camera camera_;
  std::vector<Hypothesis> hypotheses_;
  std::size_t best_ = 0;
  int pictures_ = 0;  ///< since they began
  std::vector<std::uint8_t> hidden_;
  std::optional<HandSight> sight_;
  bool following_ = false;
  int astray_ = 0;  ///< pictures in which it was not found, or far from the blob
};

}  // namespace mimesis::vision
