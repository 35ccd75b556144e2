#pragma once
#include <filesystem>
#include <optional>
#include <vector>

#include "experiments/motion/film.h"
#include "experiments/walk/film/robot_film.h"
#include "experiments/walk/trial/trial.h"

namespace mimesis::walk {

/// Marks of a walk on the ground of a film: prints of the soles where they really stood, in the
/// colours of their legs, and a green cross about the true ZMP, wider than a sole.
class GroundMarks {
 public:
  explicit GroundMarks(const robot::Biped& biped) : biped_(biped) {}

  /// Call at every tick. A print appears at the planned landing and follows its sole until it
  /// lifts.
  void see(const TrialTick& tick);
  void add_to(synthesizer::FilmFrame& frame) const;

 private:
  const robot::Biped& biped_;
  std::vector<synthesizer::FilmBox> prints_;
  std::array<std::size_t, 2> now_{};  // the print that a foot stands on
  std::array<bool, 2> stands_{};
  Eigen::Vector2d zmp_W_m_ = Eigen::Vector2d::Zero();
};

/// Takes pictures of a trial, beside the robot or from a fixed place, with marks on the ground.
class Scene {
 public:
  struct Options {
    double from_s = 0.0, until_s = 1e9;  ///< filmed time
    double camera_rad = -0.9;            ///< see film::camera_beside()
    double height_m = 1.9;               ///< height of the picture
    double aspect = 2.0 / 3.0;           ///< width over height
    /// Place that the camera looks at; empty: it follows the robot.
    std::optional<Eigen::Vector2d> fixed_W_m{};
    std::vector<hw::sim::Push> pushes{};  ///< shown for a while
    double picture_s = 0.04;              ///< from one picture to the next
  };
  Scene(const Robot& robot, const Options& options);

  /// Call at every tick; takes a picture when it is due. `drawer`: may be null.
  void see(const TrialTick& tick, const film::FilmDrawer* drawer = nullptr);
  /// Like synthesizer::write_film(). @throws std::runtime_error if nothing was filmed
  std::vector<std::filesystem::path> write(const std::filesystem::path& dir,
                                           const std::string& name, int count) const;
  /// Only `count` pictures side by side, evenly chosen, half as large. @throws std::runtime_error
  /// as write()
  void write_strip(const std::filesystem::path& png, int count) const;

 private:
  film::RobotFigure figure_;
  int trunk_;
  Eigen::Vector3d com_L_m_;  ///< CoM of the trunk, where pushes act
  robot::Kinematics kinematics_;
  Options options_;
  double next_s_;
  GroundMarks marks_;
  std::vector<synthesizer::FilmFrame> frames_;
};

}  // namespace mimesis::walk
