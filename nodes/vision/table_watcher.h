#pragma once
#include <array>
#include <optional>

#include "common/image/rig.h"
#include "nodes/vision/action_recognizer.h"
#include "nodes/vision/blob_tracker.h"
#include "nodes/vision/regions.h"
#include "nodes/vision/solids.h"
#include "nodes/vision/stereo_scene.h"
#include "nodes/vision/teach.h"
#include "nodes/vision/teacher_hand.h"

namespace mimesis::vision {

/// Sizes of the things on the teacher's table [m]: with them one calibrated view gives positions.
struct TableSizes {
  double object_radius_m = 0.024;  ///< radius of the cylinder
  double object_height_m = 0.085;  ///< height of the cylinder
  double bar_thickness_m = 0.03;   ///< thickness of the bar along y
  double bar_width_m = 0.035;      ///< width of the bar along x
  double bar_span_m = 0.26;        ///< span of the bar along z
  double goal_radius_m = 0.046;    ///< radius of a stand's coloured cap
  double goal_cap_m = 0.02;        ///< height of that cap
  double hand_length_m = 0.15;     ///< finger tips to wrist, fingers half bent

  template <class Visitor>
  void visit(Visitor& v) {
    v("object_radius_m", object_radius_m, 0.001, 1.0);
    v("object_height_m", object_height_m, 0.001, 1.0);
    v("bar_thickness_m", bar_thickness_m, 0.001, 1.0);
    v("bar_width_m", bar_width_m, 0.001, 1.0);
    v("bar_span_m", bar_span_m, 0.001, 5.0);
    v("goal_radius_m", goal_radius_m, 0.001, 1.0);
    v("goal_cap_m", goal_cap_m, 0.001, 1.0);
  }
};

struct WatcherSetup {
  image::View view;
  std::optional<image::Camera> camera;  ///< calibrated, instead of `view`
  ColorBoxes boxes;
  std::optional<ColorSpots> spots;  ///< taught, instead of `boxes`
  /// Colour, in the light for which boxes or spots hold, of the table that fills the picture; zero:
  /// none does. See LightMeter.
  Eigen::Vector3d reference_bgr{145.0, 151.0, 155.0};
  bool open = false;  ///< remove what is thinner than 3 pixels before regions are sought
  std::optional<image::Camera> right;  ///< second camera; with it places and sizes are measured
  SceneLimits stereo;
  double small_gap_m = 0.125;  ///< a lone goal that is nearer to the bar's height is a high one
  TrackerLimits tracker;
  TableSizes sizes;
  TeacherHandSetup hand;
  RecognizerLimits recognizer;
};

/// Mean position of something that stands still, over the pictures in which it is neither hidden
/// nor grown together with something: those whose area is within 3 % of the upper quartile of the
/// last
/// 60. What is hidden for less than three quarters of them stays where it is, and no single picture
/// decides what is whole.
class SteadyPlace {
 public:
  void update(const std::optional<Eigen::Vector2d>& place_m, double area);
  const std::optional<Eigen::Vector2d>& get() const { return mean_; }

 private:
  double usual_area() const;

  static constexpr int kMemory = 60;  // pictures
  std::optional<Eigen::Vector2d> mean_;
  std::array<double, kMemory> areas_{};
  int seen_ = 0, absent_ = 0, elsewhere_ = 0, count_ = 0;
};

/// Where a table without a hand has the colour of skin: bright wood, things. A cell of the picture
/// is forgotten once it has lost that colour.
class TableSkin {
 public:
  void learn(std::span<const std::uint8_t> labels, int width, int height);
  void update(std::span<const std::uint8_t> labels);
  /// Share of each region's pixels that lie there [1].
  std::span<const double> shares(std::span<const Region> regions, std::span<const Run> runs);

 private:
  static constexpr int kCell = 16;  // pixels
  void count(std::span<const std::uint8_t> labels);

  int width_ = 0, columns_ = 0;
  std::vector<int> learned_, now_;  ///< pixels of skin in each cell
  std::vector<double> shares_;
};

/// From picture to symbols: segmentation, regions, tracking, positions in frame T, recognition.
class TableWatcher {
 public:
  /// @throws ConfigError if the view is impossible.
  explicit TableWatcher(const WatcherSetup& setup);

  /// Blobs only: for pictures of any size.
  void segment(const image::Image& image);
  /// Everything. Precondition: the picture has the size of the calibrated view.
  void watch(const image::Image& image) { watch_any(image); }
  void watch(const YuyvImage& image) { watch_any(image); }
  /// The second camera's picture of the time of the next one to watch. Precondition: there is a
  /// second camera, and the picture has its size.
  void watch_right(const image::Image& image) { watch_right_any(image); }
  void watch_right(const YuyvImage& image) { watch_right_any(image); }

  /// Learns the colours of things from regions of a picture: in the light of the reference, in both
  /// cameras. A hand that is not among them keeps its box, and is taken not to be in the picture:
  /// what has the colour of skin there is none until it changes. @returns why not
  tl::expected<void, Status> teach(const image::Image& image,
                                   std::span<const TaughtRegion> regions);

  const Blob& blob(Kind kind) const { return tracker_.blob(kind); }
  std::span<const Region> regions() const { return segmentation_.regions(); }
  std::span<const Run> runs() const { return segmentation_.runs(); }
  std::span<const std::uint8_t> labels() const { return segmentation_.labels(); }
  const Sight& sight() const { return sight_; }
  const std::optional<Palm>& palm() const { return palm_; }
  const ActionRecognizer& action() const { return recognizer_; }
  /// What is to be said of the light; mostly nothing.
  const std::string& light_remark() const { return segmentation_.light().remark(); }
  /// The hand by its model; null with one camera, or where a hand is too small for it.
  const TeacherHand* hand() const { return hand_ ? &*hand_ : nullptr; }
  /// A second skin region as large as a hand, and no part of an arm that something cuts in two for
  /// moments: symbols would mean nothing.
  bool two_hands() const { return second_hand_ >= kSecondHand; }
  /// Lower edge of the bar above the table [m]; nothing if no bar is seen.
  std::optional<double> bar_height_m() const;
  const TableSizes& sizes() const { return sizes_; }
  const image::Camera& camera() const { return camera_; }
  const std::optional<image::Camera>& right_camera() const { return right_; }
  /// Measurements of two cameras; null with one.
  const StereoScene* stereo() const { return stereo_ ? &*stereo_ : nullptr; }
  /// Between a goal's upper face and the lower edge of the bar [m]; nothing if no bar is seen.
  std::optional<double> gap_m(const Thing& goal) const;
  /// Whether it is a high goal (small gap) or a low one: by order if there are others of another
  /// height, else by the gap.
  Goal classify(const Thing& goal) const;

 private:
  template <class Picture>
  void watch_any(const Picture& picture);
  template <class Picture>
  void watch_right_any(const Picture& picture);
  void leave_out_skin_of_table();
  void look_for_second_hand();
  void look();
  void look_with_one();
  void look_with_two();
  std::optional<Eigen::Vector2d> place(Kind kind, const Body& body) const;
  void look_at_hand();
  void follow_hand();
  void look_beside_bar();
  const image::Image& as_bgr(const image::Image& picture) { return picture; }
  const image::Image& as_bgr(const YuyvImage& picture);
  template <class Picture>
  std::optional<double> object_luma(const Picture& picture) const;

  image::Camera camera_;
  std::optional<image::Camera> right_;
  TableSizes sizes_;
  double small_gap_m_;
  ColorBox hand_box_;
  Eigen::Vector3d reference_bgr_;
  Segmentation segmentation_, right_segmentation_;
  bool right_new_ = false, skin_unlearned_ = false;
  std::optional<TableSkin> table_skin_;
  std::optional<StereoScene> stereo_;
  BlobTracker tracker_;
  static constexpr int kSecondHand = 10;  // pictures in a row
  int min_hand_area_, second_hand_ = 0;
  double clearance_m_;
  std::optional<TeacherHand> hand_;
  image::Image bgr_;
  ActionRecognizer recognizer_;
  Body object_body_, bar_body_, cap_body_;
  SteadyPlace bar_, goal_high_, goal_low_;
  std::optional<Palm> palm_;
  Sight sight_;
};

}  // namespace mimesis::vision
