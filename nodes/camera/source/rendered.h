#pragma once
#include "nodes/camera/renderer.h"
#include "nodes/camera/source/source.h"

namespace mimesis::camera {

/// The renderer as a source: its time starts with the first call.
class Rendered final : public Source {
 public:
  explicit Rendered(const Picture& picture) : renderer_(picture) {}
  std::optional<Frame> next(std::chrono::nanoseconds now) override {
    if (!start_) start_ = now;
    shown_s_ = std::chrono::duration<double>(now - *start_).count();
    renderer_.render(shown_s_, image_);
    return Frame{&image_, now};
  }
  std::string news() override { return {}; }
  /// Of the frame returned last.
  Truth truth() const { return renderer_.truth(shown_s_); }

 private:
  Renderer renderer_;
  std::optional<std::chrono::nanoseconds> start_;
  double shown_s_ = 0.0;
  image::Image image_;
};

}  // namespace mimesis::camera
