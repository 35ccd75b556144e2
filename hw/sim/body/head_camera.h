#pragma once
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <random>

namespace mimesis::hw::sim {

struct HeadCameraSettings {
  double rate_hz = 30.0;   ///< images
  double delay_s = 0.05;   ///< from an image to what it shows
  double noise_m = 0.005;  ///< deviation of each coordinate of a place
  /// Lens in the frame of the head's link, and how far it looks down.
  double ahead_m = 0.10, above_m = 0.10, down_rad = 0.6;
  double half_width_rad = 0.7, half_height_rad = 0.6;  ///< half angles of view
  double hand_radius_m = 0.06;  ///< a hand hides what lies behind a ball about it
  std::uint64_t seed = 1;

  template <class Visitor>
  void visit(Visitor& v) {
    v("rate_hz", rate_hz, 1.0, 200.0);
    v("noise_m", noise_m, 0.0, 0.1);
  }
};

/// What an image shows, in the frame H of the head's link: empty if it is hidden or out of view.
struct HeadSight {
  double taken_s = 0.0;
  std::optional<Eigen::Vector3d> handle_H_m, object_H_m;
};

/// A camera in the head that finds the handle of a drawer and the object in it, late, with noise,
/// and not through a hand. Deterministic: the same calls give the same bits. Does not allocate.
class HeadCamera {
 public:
  struct Scene {
    Eigen::Isometry3d X_WH;  ///< head's link
    Eigen::Vector3d handle_W_m, object_W_m;
    std::array<Eigen::Vector3d, 2> hand_W_m;
  };
  explicit HeadCamera(const HeadCameraSettings& settings);

  /// Once a step of the world, in the order of time: takes an image when one is due.
  void look(double time_s, const Scene& scene);
  /// The next of the images that have arrived by now; null: none. Valid until the next look().
  const HeadSight* arrived(double time_s);

 private:
  static constexpr std::size_t kMost = 64;  // images on their way: 0.3 s at 200 Hz and some more
  std::optional<Eigen::Vector3d> find(const Scene& scene, const Eigen::Vector3d& p_W_m);
  bool in_view(const Eigen::Vector3d& p_C_m) const;

  HeadCameraSettings settings_;
  Eigen::Isometry3d X_HC_ = Eigen::Isometry3d::Identity();  ///< C: z forward, x right, y down
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::optional<double> first_s_;  ///< time of the first image
  std::uint64_t taken_ = 0, given_ = 0;
  std::array<HeadSight, kMost> sight_;  ///< ring
};

}  // namespace mimesis::hw::sim
