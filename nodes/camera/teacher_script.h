#pragma once
#include <string>

namespace mimesis::camera {

enum class Grip { precision, full };
enum class Transport { above, below };
enum class Goal { high, low };
enum class Color { light, dark };

/// What the teacher shows [M18 2.1.1].
struct Lesson {
  Grip grip = Grip::precision;
  Transport transport = Transport::above;
  Goal goal = Goal::high;
};

/// Reads "precision,above,high" (grip, transport, goal).
/// @throws ConfigError naming the word that is not understood and the words that are.
Lesson parse_lesson(const std::string& text);

/// When and how often it is shown.
struct TeacherScript {
  Lesson lesson;
  Color color = Color::light;  ///< of the object
  double start_s = 0.5;        ///< rest before the first motion
  double duration_s = 6.0;     ///< of one demonstration, from reaching to having withdrawn
  double pause_s = 1.5;        ///< rest after each, before the object is back at its start
  int repeat = 1;              ///< number of demonstrations
  bool only_grasp = false;     ///< the teacher stops after grasping [M18 Fig. 2.20]
};

/// The teacher's table, frame T: x right, y up, z towards the camera, origin below the middle of
/// the bridge.
struct TeacherTable {
  double object_x_m = -0.27;
  double object_radius_m = 0.024;
  double object_height_m = 0.085;
  double bridge_height_m = 0.20;  ///< lower edge of the bar
  double bar_thickness_m = 0.03;  ///< along y
  double bar_width_m = 0.035;     ///< along x
  double bar_half_span_m = 0.13;  ///< along z
  bool bridge_removed = false;    ///< the bar is missing, the posts stand [M18 Fig. 2.21]
  double goal_low_x_m = 0.19;
  double goal_low_y_m = 0.03;  ///< upper face of the stand
  double goal_high_x_m = 0.35;
  double goal_high_y_m = 0.12;
  double goal_radius_m = 0.046;
};

/// @throws ConfigError if the teacher's hand cannot pass where the lesson leads it.
void check_passable(const Lesson& lesson, const TeacherTable& table);

}  // namespace mimesis::camera
