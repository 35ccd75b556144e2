#pragma once
#include <optional>

#include "common/image/image.h"
#include "common/image/rig.h"
#include "experiments/sight/truth/hand_mesh.h"

namespace mimesis::truth {

inline constexpr double kFrame_s = 1.0 / 30.0;

/// What is asked of a world; the seed draws all the rest.
struct HandWorldSetup {
  std::uint64_t seed = 1;
  int cameras = 1;
  double baseline_m = 0.12;                  ///< distance of the second camera
  double noise = 8.0;                        ///< standard deviation per channel, of 255 [1]
  int clutter = 40;                          ///< coloured things behind the hand [1]
  int skin_patches = 0;                      ///< of these, how many have the colour of the skin [1]
  bool grasping = true;                      ///< fingers close and open together now and then
  std::optional<std::array<int, 2>> hidden;  ///< a board covers the hand in frames [first, last)
  int light_changes = -1;  ///< from this frame on the light is dimmer (0.6) and warmer (1.3)
};

/// Where the hand is, frame T of image::View.
struct HandTruth {
  Eigen::Vector3d palm_T;                 ///< origin of frame H, see Mesh [m]
  Eigen::Matrix3d R_TH;                   ///< orientation of H
  std::array<Eigen::Vector3d, 5> tips_T;  ///< thumb, index, ..., little [m]
  Gesture gesture;
};

/// A moving hand before a cluttered background, seen by one or two cameras: a pure function of
/// (setup, frame). Person, side, cameras, light, colours and motion are drawn from ranges that are
/// written in the source and nowhere else.
class HandWorld {
 public:
  explicit HandWorld(const HandWorldSetup& setup);

  void render(int frame, int camera, image::Image& out);
  HandTruth truth(int frame) const;
  const image::View& view(int camera) const { return views_.at(static_cast<std::size_t>(camera)); }
  const Anatomy& anatomy() const { return anatomy_; }

 private:
  /// Sum of three sines with amplitudes that add up to 1.
  struct Wave {
    std::array<double, 3> amplitude, omega_1_s, phase;
    double at(double t_s) const;
  };
  struct Camera {
    Eigen::Matrix3d R_CT;
    Eigen::Vector3d eye_T;
    double focal_px, cu, cv;
    image::Image background;
  };
  Wave wave(double slowest_hz, double fastest_hz);
  void draw_cameras();
  void draw_background(Camera& camera, std::uint64_t seed) const;
  void draw_motion();
  void draw_light();
  void draw_mesh(const Camera& camera, const HandTruth& hand, image::Image& out);
  void draw_board(const Camera& camera, const HandTruth& hand, image::Image& out) const;
  void add_faults(int frame, int camera, image::Image& out) const;

  HandWorldSetup setup_;
  std::mt19937_64 random_;
  Anatomy anatomy_;
  std::vector<image::View> views_;
  std::vector<Camera> cameras_;
  // motion
  Eigen::Vector3d centre_T_;
  Eigen::Matrix3d base_TH_;
  std::array<Wave, 6> body_;
  std::array<double, 6> reach_;  ///< amplitudes: three of translation [m], three of rotation [rad]
  std::array<Wave, 4> fist_;     ///< closing of each finger
  std::array<Wave, 12> own_;     ///< what every joint does on its own
  Wave together_, thumb_a_, thumb_b_, wrist_a_, wrist_b_;
  // light and colours
  Eigen::Vector3f skin_bgr_, cloth_bgr_, light_bgr_;
  Eigen::Vector3d to_light_T_;
  float ambient_ = 0.4f, shine_ = 0.1f;
  double blur_px_ = 0.7;
  std::vector<std::int8_t> noise_;
  Mesh mesh_;
  std::vector<float> nearest_;  ///< 1 / depth of every pixel
};

}  // namespace mimesis::truth
