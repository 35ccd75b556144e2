#pragma once
#include "common/runtime/log.h"
#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "nodes/vision/table_watcher.h"
#include "proto/foxglove/image.pb.h"
#include "proto/vision.pb.h"

namespace mimesis::vision {

/// The watcher's knowledge as messages (headers are filled in by the ports).
v1::Blobs blobs_message(const TableWatcher& watcher);
v1::Observation observation_message(const ActionRecognizer& action);
v1::TeacherScene scene_message(const TableWatcher& watcher);
/// Overlay for viewers: boxes around the blobs, axis of the hand, a line of symbols.
foxglove::ImageAnnotations annotations_message(const TableWatcher& watcher);

struct VisionParams {
  double rate_hz = 60.0;  ///< rate of looking for a new image [Hz]
  std::string rig;        ///< calibrated cameras (`mimesis calibrate`), instead of `view`
  std::string camera;     ///< which of them this is; empty: the first
  std::string colors;     ///< taught colours (`mimesis vision teach`), instead of boxes and light
  int rig_days = 0;  ///< images that are this many days younger than the rig are refused; 0: none
  std::vector<double> reference_bgr{145.0, 151.0,
                                    155.0};  ///< see WatcherSetup; zeros: no correction
  WatcherSetup setup;

  void visit(runtime::ParamVisitor& v);
};

/// Watches the teacher's table: image in; blobs, symbols, geometry and an overlay out, once per
/// image.
class VisionNode {
 public:
  using Params = VisionParams;
  VisionNode(const Params& params, runtime::Bus& bus);
  void step(runtime::Time now);

 private:
  VisionNode(const Params& params, const std::optional<image::Rig>& rig, runtime::Bus& bus);
  bool accept(const foxglove::RawImage& message);
  void refuse(const std::string& why);

  TableWatcher watcher_;
  std::string calibrated_by_;          ///< what gave the camera, for messages
  std::optional<int> calibrated_day_;  ///< since 1970; nothing if any age will do
  int rig_days_;
  image::Image image_;
  YuyvImage yuyv_;
  runtime::Throttle refused_{std::chrono::seconds(5)};
  runtime::Latest<foxglove::RawImage> in_;
  runtime::Out<v1::Blobs> blobs_;
  runtime::Out<v1::Observation> observation_;
  runtime::Out<v1::TeacherScene> scene_;
  runtime::Out<foxglove::ImageAnnotations> annotations_;
};

}  // namespace mimesis::vision
