#pragma once
#include <memory>
#include <string>

#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "nodes/camera/source/rendered.h"
#include "proto/foxglove/image.pb.h"
#include "proto/vision.pb.h"

namespace mimesis::camera {

struct CameraParams {
  double rate_hz = 30.0;            ///< frames looked for [Hz]
  std::string source = "renderer";  ///< renderer, v4l2, video or folder
  std::string path;                 ///< device, film or folder
  bool record_frames = false;       ///< v4l2: keeps what the device delivers, for replays
  int repeat = 1;                   ///< demonstrations, or passes of a film or folder [1]
  std::string teacher = "precision,above,high";  ///< renderer: grip,transport,goal
  std::string color = "light";                   ///< renderer: of the object
  std::string shown = "all";  ///< renderer: all, or grasp (the teacher stops there)
  int seed = 1;               ///< renderer: of noise and clutter [1]
  Picture picture;            ///< renderer: all else

  void visit(runtime::ParamVisitor& v);
};

/// Publishes what a camera sees of the teacher's table; with the renderer also what is true.
class CameraNode {
 public:
  using Params = CameraParams;
  CameraNode(const Params& params, runtime::Bus& bus);
  void step(runtime::Time now);

 private:
  void publish_truth(runtime::Time stamp);

  std::unique_ptr<Source> source_;
  Rendered* rendered_ = nullptr;  ///< source_, if it is the renderer
  foxglove::RawImage message_;
  runtime::Out<foxglove::RawImage> image_;
  runtime::Out<v1::TeacherScene> truth_;
};

}  // namespace mimesis::camera
