#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/image/image.h"
#include "common/image/pinhole.h"
#include "nodes/camera/moving_layer.h"
#include "nodes/camera/picture_faults.h"
#include "nodes/camera/table_picture.h"
#include "nodes/camera/teacher_motion.h"

namespace mimesis::camera {

/// What is where in a rendered frame, in the plane of motion [m].
struct Truth {
  Eigen::Vector2d object, palm;         ///< centres
  Eigen::Vector2d goal_high, goal_low;  ///< middle of the upper faces
  double bridge_height = 0.0;           ///< lower edge of the bar
  bool hand_in_view = false;
  bool bridge_in_view = false;
  bool held = false;
};

struct Picture {
  TeacherScript script;
  TeacherTable table;
  image::View view;
  Faults faults;
  int clutter = 12;        ///< coloured things lying about [1]
  std::uint64_t seed = 1;  ///< of clutter and noise
};

/// Draws the teacher at his table: a pure function of (picture, time).
class Renderer {
 public:
  /// @throws ConfigError if the lesson cannot be shown on this table or the view is impossible.
  explicit Renderer(const Picture& picture);
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// @param t_s time since the start [s]; `out` is resized to the view.
  void render(double t_s, image::Image& out);
  Truth truth(double t_s) const;
  double end_s() const { return motion_.end_s(); }

 private:
  Picture picture_;
  image::Pinhole camera_;
  TeacherMotion motion_;
  TablePicture table_;
  MovingLayer layer_;
  PictureFaults faults_;
  std::vector<Capsule> hand_;
};

}  // namespace mimesis::camera
