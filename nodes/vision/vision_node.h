#pragma once
#include <Eigen/Geometry>
#include <array>
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "common/model/drawing.h"
#include "common/runtime/log.h"
#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "nodes/vision/robot_table.h"
#include "nodes/vision/table_watcher.h"
#include "proto/foxglove/image.pb.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/scene.pb.h"
#include "proto/vision.pb.h"

namespace mimesis::vision {

/// The watcher's knowledge as messages (headers are filled in by the ports).
v1::Blobs blobs_message(const TableWatcher& watcher);
v1::Observation observation_message(const ActionRecognizer& action);
v1::TeacherScene scene_message(const TableWatcher& watcher);
/// The robot's table, with the spreads of its places.
v1::Scene table_message(const SeenTable& seen);
/// Overlay for viewers: boxes around the blobs, axis of the hand, a line of symbols.
foxglove::ImageAnnotations annotations_message(const TableWatcher& watcher);

/// The colour of a kind of things in all drawings.
const model::Rgba& color_of(Kind kind);

/// What two cameras see of a table, in frame W: entity "things", bodies as they were measured, each
/// with an ellipsoid of three standard deviations of its centre; entity "hand", the capsules of the
/// hand model, while it follows a hand. With one camera there is nothing to draw.
/// @param X_WT  frame T in W
foxglove::SceneUpdate draw_sight(const TableWatcher& watcher, const Eigen::Isometry3d& X_WT,
                                 std::chrono::nanoseconds stamp);

struct VisionParams {
  double rate_hz = 60.0;  ///< rate of looking for a new image [Hz]
  std::string rig;        ///< calibrated cameras (`mimesis calibrate`), instead of `view`
  std::string camera;     ///< which of them this is; empty: the first
  std::string colors;     ///< taught colours (`mimesis vision teach`), instead of boxes and light
  double pair_s = 0.002;  ///< two cameras: images that are so far apart are of one moment [s]
  double wait_s = 0.05;   ///< two cameras: so long an image waits for its partner [s]
  double blind_s = 0.3;   ///< the robot's table holds as long as its last image is not older [s]
  double frozen_s =
      3.0;  ///< pictures that are equal to the last bit for so long are refused [s]; 0: none
  RobotTableSetup table;  ///< the robot's own table
  int rig_days = 0;  ///< images that are this many days younger than the rig are refused; 0: none
  std::vector<double> reference_bgr{145.0, 151.0,
                                    155.0};  ///< of the table that fills the picture; zeros: none
  WatcherSetup setup;

  void visit(runtime::ParamVisitor& v);
};

/// Tells from the bytes of a camera's frames, as they come, which of them are no new picture: equal
/// to the last bit for long, rows missing at the end, or rows of a frame before. The latter are
/// known by a band of rows that is the same to the last bit as in one of the last frames while
/// another is not, which noise rules out. A source without noise, whose bands stay equal now and
/// then (films, too), is not judged so.
class FrameCheck {
 public:
  /// @param frozen_s frames that are equal for so long are refused [s]; 0: none
  explicit FrameCheck(double frozen_s) : frozen_s_(frozen_s) {}

  /// Takes a frame of `height` rows.
  /// @returns what is wrong with it, if anything is
  std::optional<std::string> fault(std::string_view data, std::size_t height, double stamp_s);

 private:
  static constexpr std::size_t kBands = 48, kFrames = 8;  ///< drivers have up to 8 buffers
  /// Hash of each band of rows; 0: all its bytes are the same, which tells nothing.
  using Bands = std::array<std::size_t, kBands>;
  std::optional<std::string> torn(const Bands& bands, std::size_t height);

  double frozen_s_;
  std::array<Bands, kFrames> last_{};
  std::size_t seen_ = 0;   ///< frames so far
  std::size_t whole_ = 0;  ///< hash of the newest frame
  double same_since_s_ = 0.0;
  int same_ = 0;            ///< frames in a row that were like it
  std::size_t lively_ = 0;  ///< frames in a row that had no band of an earlier one
  int torn_ = 0;            ///< frames in a row that were torn
};

/// Watches a table: images in; blobs, symbols, geometry and an overlay out, once per image. With
/// two cameras also places and sizes of all things, and the table as a planner needs it.
class VisionNode {
 public:
  using Params = VisionParams;
  VisionNode(const Params& params, runtime::Bus& bus);
  void step(runtime::Time now);

 private:
  VisionNode(const Params& params, const std::optional<image::Rig>& rig, runtime::Bus& bus);
  void use_rig(const v1::CameraRig& message);
  void take_lesson();
  /// The left image to be looked at now; null if there is none, or its partner may still come.
  const foxglove::RawImage* due(runtime::Time now);
  const foxglove::RawImage* partner_of(const foxglove::RawImage& left);
  bool accept(const foxglove::RawImage& message, const image::Camera& camera, FrameCheck& check);
  std::string rig_too_old(const foxglove::RawImage& message) const;
  void copy(const foxglove::RawImage& message);
  bool rig_fits();
  void miss_hand(runtime::Time stamp);
  void say_what_is_not_told();
  void refuse(const std::string& why);
  void look(const foxglove::RawImage& left);
  void publish(runtime::Time stamp, bool fits);
  void publish_table(runtime::Time now);
  void miss_table(const std::string& why, runtime::Time stamp);

  WatcherSetup setup_;
  RobotTableSetup table_setup_;
  runtime::Time alone_since_{};  ///< since then there is a single goal
  std::optional<runtime::Time>
      missed_since_;  ///< since then, or since it was said, there is no table
  runtime::Time pair_, wait_, blind_;
  std::optional<TableWatcher> watcher_;
  std::optional<v1::ColorLesson> lesson_;  ///< to be learned from the next image
  std::optional<v1::Scene> table_;         ///< as published, until something changes
  int table_version_ = -1;                 ///< of the things it shows
  runtime::Time looked_{};                 ///< stamp of the newest image looked at
  bool waiting_ = false;                   ///< an image that was not looked at
  FrameCheck left_check_, right_check_;
  std::optional<runtime::Time> handless_since_;  ///< since then no hand is seen
  bool handless_told_ = false;
  std::array<std::string, 3> untold_;  ///< why grip, transport, goal are not told
  int unfit_ = 0;                      ///< pairs in a row that the calibration does not fit
  std::string calibrated_by_;          ///< what gave the camera, for messages
  std::optional<int> calibrated_day_;  ///< since 1970; nothing if any age will do
  int rig_days_;
  image::Image image_;
  YuyvImage yuyv_;
  runtime::Throttle refused_{std::chrono::seconds(5)}, withheld_{std::chrono::seconds(5)};
  runtime::Latest<foxglove::RawImage> in_, right_in_;
  runtime::Latest<v1::CameraRig> rig_in_;
  runtime::Latest<v1::ColorLesson> lesson_in_;
  runtime::Out<v1::Blobs> blobs_;
  runtime::Out<v1::Observation> observation_;
  runtime::Out<v1::TeacherScene> scene_;
  runtime::Out<v1::Scene> table_out_;
  runtime::Out<foxglove::ImageAnnotations> annotations_;
  runtime::Out<foxglove::SceneUpdate> seen_;
  runtime::Time seen_due_{};
};

}  // namespace mimesis::vision
