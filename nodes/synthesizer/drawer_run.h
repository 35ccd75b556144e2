#pragma once
#include <string>
#include <vector>

#include "nodes/synthesizer/drawer/drawer_sequence.h"
#include "nodes/synthesizer/walkers.h"

namespace mimesis::synthesizer {

/// A drawer in the world: the middle of its closed front, which faces who comes.
struct DrawerPlace {
  Eigen::Vector2d front_W_m = Eigen::Vector2d::Zero();
  double object_depth_m = 0.2;
  bool operator==(const DrawerPlace&) const = default;
};

/// The way of one character to a drawer: a DrawerSequence laid into the world, from where the
/// character is, straight towards the drawer.
class DrawerRun {
 public:
  /// The reason if no trained sequence of actions leads there. `maps` must outlive the run.
  static tl::expected<DrawerRun, Status> start(const ActionMaps& maps, const DrawerPlace& place,
                                               const Eigen::Vector2d& from_W_m, double dt_s);

  /// The drawer is elsewhere. What it moved across the way is made up for by the reach of the arm,
  /// up to kAcross_m: farther aside it is refused with the reason, and the old place stays.
  std::string move(const DrawerPlace& place);
  /// Advances by dt. Allocates.
  void step();

  const DrawerPlace& place() const { return place_; }
  const SequenceState& sequence() const { return sequence_.state(); }
  const std::vector<PlannedAction>& plan() const { return sequence_.plan(); }
  double heading_rad() const { return heading_rad_; }
  Eigen::Vector2d position_W_m() const;
  double distance_m() const { return sequence_.distance_m(); }  ///< pelvis to the front
  const char* action() const;                                   ///< "step", "reach" or "take"

  static constexpr double kAcross_m = 0.15;

 private:
  DrawerRun(DrawerSequence sequence, const DrawerPlace& place, const Eigen::Vector2d& from_W_m,
            double heading_rad)
      : sequence_(std::move(sequence)), place_(place), from_(from_W_m), heading_rad_(heading_rad) {}

  DrawerSequence sequence_;
  DrawerPlace place_;
  Eigen::Vector2d from_;  // where its way begins, W
  double heading_rad_;    // of its way
};

}  // namespace mimesis::synthesizer
