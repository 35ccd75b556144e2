#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/image/image.h"
#include "common/image/rig.h"
#include "nodes/camera/moving_layer.h"
#include "nodes/camera/table_picture.h"
#include "nodes/camera/teacher.h"

namespace mimesis::camera {

/// Faults that a real camera and real light add to a picture.
struct Faults {
  double noise = 3.0;    ///< standard deviation per channel, of 255 [1]
  double blur_px = 0.6;  ///< standard deviation of the lens' blur
  double gain = 1.0;     ///< brightness [1]
  double warmth = 1.0;   ///< red is multiplied by it, blue divided [1]
};

/// Applies blur, light and noise, in this order. Deterministic: the noise depends on seed and
/// `frame` alone.
class PictureFaults {
 public:
  PictureFaults(const Faults& faults, std::uint64_t seed);
  void apply(std::uint64_t frame, image::Image& image) const;

 private:
  void add_noise(std::uint64_t frame, image::Image& image) const;

  Faults faults_;
  std::uint64_t seed_;
  std::vector<std::int8_t>
      noise_;  ///< normally distributed, read from a different place in every row
};

/// Places of the things in a rendered frame, in the plane of motion [m].
struct Truth {
  Eigen::Vector2d object, palm;         ///< centres
  Eigen::Vector2d goal_high, goal_low;  ///< middle of the upper faces
  double bar_height = 0.0;              ///< lower edge of the bar
  bool hand_in_view = false;
  bool bar_in_view = false;
  bool held = false;
};

struct Picture {
  TeacherScript script;
  TeacherTable table;
  image::View view;
  Faults faults;
  Looks looks;
  Room room;
  Passer passer;
  int clutter = 12;        ///< coloured things lying about [1]
  int skin_clutter = 0;    ///< how many of them have the colour of the skin [1]
  std::uint64_t seed = 1;  ///< seed of clutter and noise
};

/// Draws the teacher at his table: a pure function of (picture, time).
class Renderer {
 public:
  /// @throws ConfigError if the demonstration cannot be shown on this table or the view is
  /// impossible.
  explicit Renderer(const Picture& picture) : Renderer(picture, picture.view, 0) {}
  /// The same seen by another eye, which has noise of its own. @param eye 0, 1, ...
  Renderer(const Picture& picture, const image::Camera& camera, int eye);
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// @param t_s time since the start [s]; `out` is resized to the view.
  void render(double t_s, image::Image& out);
  /// Light and lens of the images to come; the still part of the table stays as it was painted.
  void change_faults(const Faults& faults) { faults_ = PictureFaults(faults, noise_seed_); }
  Truth truth(double t_s) const;
  double end_s() const { return motion_.end_s(); }

 private:
  Picture picture_;
  image::Camera camera_;
  std::uint64_t noise_seed_;
  TeacherMotion motion_;
  TablePicture table_;
  MovingLayer layer_;
  PictureFaults faults_;
  std::vector<Capsule> hand_;
};

}  // namespace mimesis::camera
