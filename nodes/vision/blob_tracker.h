#pragma once
#include <array>
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
    v("memory_px", memory_px, 1.0, 10000.0);
  }
};

/// Follows one blob of each class from picture to picture: large regions win, near the last place
/// more so.
class BlobTracker {
 public:
  explicit BlobTracker(const TrackerLimits& limits) : limits_(limits) {}
  void update(std::span<const Region> regions);
  const Blob& blob(Kind kind) const { return blobs_[static_cast<std::size_t>(kind)]; }

 private:
  void update(Kind kind, std::span<const Region> regions);
  int choose(Kind kind, std::span<const Region> regions) const;
  struct Place {
    double u = 0.0, v = 0.0;
    bool known = false;
  };

  TrackerLimits limits_;
  std::array<Blob, kKinds> blobs_;
  std::array<Place, kKinds> last_;
};

}  // namespace mimesis::vision
