#pragma once
#include <memory>
#include <string>

#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "common/time.h"
#include "nodes/camera/renderer.h"
#include "nodes/camera/source/source.h"
#include "proto/foxglove/image.pb.h"
#include "proto/vision.pb.h"

namespace mimesis::camera {

/// The renderer as a source: its time starts with the first call.
class Rendered final : public Source {
 public:
  explicit Rendered(const Picture& picture) : renderer_(picture) {}
  std::optional<Frame> next(std::chrono::nanoseconds now) override {
    if (!start_) start_ = now;
    shown_s_ = to_seconds(now - *start_);
    renderer_.render(shown_s_, image_);
    return Frame{&image_, now};
  }
  std::string news() override { return {}; }
  Truth truth() const { return renderer_.truth(shown_s_); }
  void change(const Picture& picture) { renderer_.change_faults(picture.faults); }

 private:
  Renderer renderer_;
  std::optional<std::chrono::nanoseconds> start_;
  double shown_s_ = 0.0;
  image::Image image_;
};

struct CameraParams {
  double rate_hz = 30.0;            ///< rate of looking for frames [Hz]
  std::string source = "renderer";  ///< source of images: renderer, v4l2, video or folder
  std::string path;                 ///< device, film or folder
  bool record_frames = false;       ///< v4l2: keeps the device's frames, for replays
  int repeat = 1;  ///< number of demonstrations, or of passes of a film or folder [1]
  std::string teacher = "precision,above,high";  ///< renderer: grip,transport,goal
  std::string color = "light";                   ///< renderer: colour of the object
  std::string shown = "all";  ///< renderer: all, or grasp (the teacher stops after it)
  int seed = 1;               ///< renderer: seed of noise and clutter [1]
  Picture picture;            ///< renderer: scene and light

  void visit(runtime::ParamVisitor& v);
};

/// Publishes images of the teacher's table; with the renderer also the truth.
class CameraNode {
 public:
  using Params = CameraParams;
  CameraNode(const Params& params, runtime::Bus& bus);
  void step(runtime::Time now);
  void change(const Params& params);  ///< light and lens, from the next image on

 private:
  void publish_truth(runtime::Time stamp);

  std::unique_ptr<Source> source_;
  Rendered* rendered_ = nullptr;  ///< source_, if it is the renderer
  foxglove::RawImage message_;
  runtime::Out<foxglove::RawImage> image_;
  runtime::Out<v1::TeacherScene> truth_;
};

}  // namespace mimesis::camera
