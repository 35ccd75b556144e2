#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "nodes/vision/regions.h"
#include "nodes/vision/solids.h"

namespace mimesis::vision {

/// Standard deviations of the calibration; the defaults are those of `mimesis calibrate` on real
/// pairs.
struct RigAccuracy {
  double focal = 5e-4;          ///< of both focal lengths together, share [1]
  double place_m = 3e-4;        ///< of the pair in frame T, per axis
  double turn_rad = 1.75e-4;    ///< of the pair, per axis
  double pair_place_m = 1e-4;   ///< of the second camera against the first
  double pair_turn_rad = 7e-5;  ///< of the second camera against the first
};

struct SceneLimits {
  int min_area = 30;          ///< smaller regions are noise [pixels]
  double epipolar_px = 4.0;   ///< a small thing's regions are this near to their epipolar lines
  double rows_px = 0.7;       ///< rows of one thing in rectified pictures differ by less, rms
  double moved_m = 0.01;      ///< a thing that is seen this far from its place has moved
  int pictures = 5;           ///< as many are needed for a thing to be known
  int settled_pictures = 10;  ///< as many are needed for its place to be told for good
  int gone_pictures = 45;     ///< a thing that is not seen for longer was taken away
  double smallest_m = 0.0115,
         largest_m = 1.5;              ///< sizes of things: from half the width to the span
  double bar_aspect = 1.0;             ///< width of the bar over its thickness [1]
  std::string goal_form = "cylinder";  ///< of the caps of goals: cylinder or block
  RigAccuracy rig;

  template <class Visitor>
  void visit(Visitor& v) {
    v("min_area", min_area, 1, 100000);
    v("epipolar_px", epipolar_px, 0.1, 100.0);
    v("rows_px", rows_px, 0.1, 100.0);
    v("bar_aspect", bar_aspect, 0.1, 10.0);
    v("goal_form", goal_form, {"cylinder", "block"});
  }
};

inline constexpr double kSameHeight_m = 0.01;  ///< goals that differ by less are of one height

/// Something that rests on the table, measured by two cameras.
struct Thing {
  Kind kind = Kind::none;
  int id = 0;  ///< kept while it is followed, also to another place
  Solid solid;
  Eigen::Matrix3d covariance_m2 =
      Eigen::Matrix3d::Zero();  ///< of its centre, frame T; the calibration's errors are part of it
  int pictures = 0;             ///< that went into it
  bool seen = true;             ///< in the newest pair
};

/// What stands on the table: objects, bars and goals, any number of each, from the regions of two
/// calibrated cameras. Regions of one class that lie on each other's epipolar lines are one thing;
/// what is seen in the same place again and again is averaged over the pictures in which neither
/// camera has less of it (hidden) or more (grown together) than usual, and a solid is fitted to it.
/// A body that another one hides or stands on stays as it was last seen without it, however long.
class StereoScene {
 public:
  StereoScene(const image::Camera& left, const image::Camera& right, const SceneLimits& limits);

  /// What was seen so far was seen in other colours: all is measured anew.
  void forget() {
    tracks_.clear();
    things_.clear();
    objects_.clear();
  }
  /// The regions of a pair of pictures taken at the same time.
  void update(std::span<const Region> left, std::span<const Region> right);

  /// Known bodies by id. One that moves is not among them until it rests.
  const std::vector<Thing>& things() const { return things_; }
  /// Things of a kind, the highest first.
  std::vector<Thing> of(Kind kind) const;
  /// Where the object is that the newest left picture shows nearest to a pixel, at rest or not;
  /// nothing if the right one shows none with it.
  std::optional<Eigen::Vector3d> object_at(const Eigen::Vector2d& left_px) const;
  /// Bar that is known longest; null without one.
  const Thing* bar() const;
  /// Goals of all colours, the highest first.
  std::vector<Thing> goals() const;
  /// Whether all that was ever announced rests and is known from enough pictures.
  bool settled() const;
  /// Kinds of which both newest pictures show something, but no two regions that are one thing.
  int unmatched() const { return unmatched_; }
  /// By how many rows the rectified pictures differ in what is one thing, rms over all things but
  /// the worst, which may be hidden from one camera, and mean over their pictures, apart from what
  /// its form explains: a calibration of other cameras, or of these before they were turned.
  /// Nothing with fewer than three things.
  std::optional<double> rows_off_px() const;
  int version() const { return version_; }  ///< number of changes so far
  /// Sudden changes in the newest pair, one line each: appeared, moved by, gone.
  const std::vector<std::string>& changes() const { return changes_; }

 private:
  static constexpr int kMemory = 60;  // pictures
  struct Pair {
    std::array<Outline, 2> seen;
    Eigen::Vector3d middle;  ///< where the rays through the centroids meet, T
  };
  struct Track {
    Thing thing;
    std::vector<Pair> memory;  ///< the last kMemory in this place
    std::size_t next = 0;
    int count = 0, missing = 0, elsewhere = 0, unlike = 0;
    std::optional<double> rows_px;  ///< right row less left row, less what the solid explains
    bool known = false, announced = false;
    Eigen::Vector3d last = Eigen::Vector3d::Zero();  ///< newest middle
  };

  std::vector<Pair> pairs(Kind kind, std::span<const Region> left,
                          std::span<const Region> right) const;
  void follow(Kind kind, std::vector<Pair> pairs);
  std::optional<std::pair<std::size_t, std::size_t>> sole_move(std::span<Track* const> waiting,
                                                               std::span<const Pair> pairs) const;
  void see(Track& track, const Pair& pair);
  bool covered(Kind kind, const Pair& pair) const;
  void restart(Track& track, const Pair& pair);
  void measure(Track& track);
  double rows_px(const Solid& solid, const std::array<Outline, 2>& seen) const;
  Eigen::Matrix3d rig_covariance(const Eigen::Vector3d& center) const;
  Eigen::Vector3d usual_place(const Track& track) const;
  std::array<double, 2> usual_areas(const Track& track) const;

  std::array<image::Camera, 2> cameras_;
  SceneLimits limits_;
  std::array<std::span<const Region>, 2> regions_;  ///< of the newest pair, during update()
  std::vector<Track> tracks_;
  std::vector<Thing> things_;
  std::vector<Pair> objects_;  ///< of the newest pair
  std::vector<std::string> changes_;
  int ids_ = 0, version_ = 0, unmatched_ = 0;
};

/// Outline of a region, from its sums.
Outline outline_of(const Moments& moments);

}  // namespace mimesis::vision
