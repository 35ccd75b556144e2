#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "nodes/vision/regions.h"

namespace mimesis::vision {

/// One tracked thing: regions of one class that belong together.
struct Blob {
  Moments moments;
  std::vector<int> regions;  ///< indices, ascending

  bool found() const { return moments.area > 0.0; }
};

struct TrackerLimits {
  int min_area = 30;        ///< smaller regions are noise [pixels]
  int min_hand_area = 600;  ///< a hand is larger [pixels]
  int gap_px = 14;          ///< regions closer than this belong together: fingers, posts split them
  double memory_px = 80.0;  ///< nearness to the last place counts within this distance

  template <class Visitor>
  void visit(Visitor& v) {
    v("min_area", min_area, 1, 100000);
    v("min_hand_area", min_hand_area, 1, 1000000);
    v("gap_px", gap_px, 0, 500);
  }
};

/// Follows one blob of each class from picture to picture: large regions win, near the last place
/// more so. An object keeps its size and moves by steps: what is 1.6 times as large as it was, a
/// twentieth, or far from where it was is something else, such as a sleeve, unless for a second
/// nothing else is seen.
class BlobTracker {
 public:
  explicit BlobTracker(const TrackerLimits& limits) : limits_(limits) {}
  void update(std::span<const Region> regions);
  const Blob& blob(Kind kind) const { return blobs_[static_cast<std::size_t>(kind)]; }

 private:
  void update(Kind kind, std::span<const Region> regions);
  int choose(Kind kind, std::span<const Region> regions) const;
  bool possible(Kind kind, const Region& region) const;
  void follow_object(const Blob& blob);
  struct Place {
    double u = 0.0, v = 0.0;
    bool known = false;
  };

  TrackerLimits limits_;
  std::array<Blob, kKinds> blobs_;
  std::array<Place, kKinds> last_;
  double object_area_ = 0.0;         ///< of the whole object; 0: unknown
  Place object_place_;               ///< where much of it was seen last
  int hidden_ = 0, objectless_ = 0;  ///< pictures since then; without any of it
};

/// The hand proper within the skin-coloured blob, without the forearm.
struct Palm {
  Eigen::Vector2d tip = Eigen::Vector2d::Zero();  ///< foremost point along the arm [px]
  Eigen::Vector2d center =
      Eigen::Vector2d::Zero();  ///< centroid of what lies within a hand's length of it [px]
};

/// Finds the hand at the end of an arm: along the blob's major axis, at the end that points towards
/// `reach`, the part within `length_px` of the foremost pixel. Empty if no pixel is there.
/// @param reach     direction in the picture away from the teacher's body
std::optional<Palm> find_palm(std::span<const Run> runs, const Blob& blob,
                              const Eigen::Vector2d& reach, double length_px);

/// Angle of the palm's normal against the vertical [rad], 0 = from above, π/2 = from the side. A
/// palm faces the grasped object, so this is the direction from its centre to the object's. One
/// view shows two components of it; where they are shorter than `clearance_m`, the rest points
/// along the line of sight, since palm and object cannot fill the same space. Frame T [m].
/// @param clearance_m least distance of the centres of palm and object
double palm_angle(const Eigen::Vector2d& palm_m, const Eigen::Vector2d& object_m,
                  double clearance_m);

}  // namespace mimesis::vision
