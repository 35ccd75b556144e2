#pragma once
#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <vector>

#include "nodes/crowd/engine/testing/navigation.h"
#include "nodes/synthesizer/dynamics/character_batch.h"

namespace mimesis::synthesizer {

enum class DanceSector { corridor = 1, parting = 2, outside = 3, entrance = 4 };

/// The closed way of the left row of dancers; the right row's is its mirror image in y = 0. W: the
/// corridor begins at the origin and goes along x. Places are arc lengths from its entrance: the
/// corridor, half a circle to the outside, straight back, half a circle to the entrance.
struct DanceTrack {
  double corridor_m = 10.0, radius_m = 1.6, half_width_m = 0.5;

  double curve_m() const { return std::numbers::pi * radius_m; }
  double length_m() const { return 2.0 * (corridor_m + curve_m()); }

  DanceSector sector(double s) const {
    if (s < corridor_m) return DanceSector::corridor;
    if (s < corridor_m + curve_m()) return DanceSector::parting;
    return s < 2.0 * corridor_m + curve_m() ? DanceSector::outside : DanceSector::entrance;
  }
  /// Direction of the way at s, s in [0, length); of the left row [rad].
  double heading(double s) const {
    switch (sector(s)) {
      case DanceSector::corridor:
        return 0.0;
      case DanceSector::parting:
        return (s - corridor_m) / radius_m;
      case DanceSector::outside:
        return std::numbers::pi;
      case DanceSector::entrance:
        return std::numbers::pi + (s - 2.0 * corridor_m - curve_m()) / radius_m;
    }
    return 0.0;
  }
  Eigen::Vector2d point(double s) const {
    const double a = heading(s), y = half_width_m + radius_m;
    const Eigen::Vector2d on_circle(radius_m * std::sin(a), y - radius_m * std::cos(a));
    switch (sector(s)) {
      case DanceSector::corridor:
        return {s, half_width_m};
      case DanceSector::parting:
        return {corridor_m + on_circle.x(), on_circle.y()};
      case DanceSector::outside:
        return {2.0 * corridor_m + curve_m() - s, half_width_m + 2.0 * radius_m};
      case DanceSector::entrance:
        return on_circle;
    }
    return {0.0, 0.0};
  }
  double wrapped(double s) const { return s - length_m() * std::floor(s / length_m()); }
};

/// Patterns of the model by number, of tied delays.
struct DanceSteps {
  int happy = 0, normal = 0, left = 0, right = 0;
};

struct DanceSettings {
  int couples = 8;
  int cycles_between = 3;  ///< beats (gait cycles) from one couple's entrance to the next one's
  double dt_s = 1.0 / 60.0;
  double radius_m = 1.6, half_width_m = 0.55;  ///< see DanceTrack
  double beat_1_s = 2.0;                       ///< α to the music in the corridor [M18 eq. 3.18]
  double partner_1_s = 1.0;                    ///< α to the partner, and to the dancer in front
};

struct Dancer {
  int couple = 0, side = 1;  ///< +1: the left row
  double track_m = 0.0;      ///< place on the track, in [0, length)
  DanceSector sector = DanceSector::corridor;
  int laps = 0;                      ///< entrances so far
  double entrance_s = 0.0;           ///< when it entered the corridor, or will
  double beat_error_rad = 0.0;       ///< phase ahead of the music
  double frequency_rad_s = 0.0;      ///< eigenfrequency
  double happy = 0.0, length = 1.0;  ///< share of the happy style; scale of the steps
  double turn_rad_s = 0.0;           ///< wished
  double own_pace = 1.0;             ///< factor of the eigenfrequency where no neighbour counts
};

/// Measures that a dance must keep, since the start.
struct DanceNumbers {
  double beat_error_rad = 0.0;        ///< largest in the corridor, one cycle after the entrance
  double couple_error_rad = 0.0;      ///< between partners, since the start
  double apart_m = 0.0;               ///< between partners along the corridor, since the start
  int entrances = 0, wrong_foot = 0;  ///< with more than a quarter of a cycle of phase error
  double entrance_error_rad = 0.0;    ///< largest phase error at an entrance
  double least_distance_m = 1e9;      ///< between pelvises
  double spread_rad = 0.0;            ///< largest phase difference of partners outside
};

/// The folk dance of [M18 fig. 3.33]: couples walk through a corridor in step with the music and
/// with each other; at its end the partners part, walk back outside and enter again. Every dancer
/// decides alone, from its own state, the music, its partner and the dancers it sees:
///   1 corridor  happy steps; the oscillator coupled to music, partner and the dancer in front
///   2 parting   couplings off, neutral style, curve by the navigation dynamics (nodes/crowd)
///   3 outside   straight, at the higher frequency that brings it back in time
///   4 entrance  slower; frequency and length of the steps such that it enters with the left foot
///               on its beat
/// A couple's beat is every couples·cycles_between-th.
class FolkDance {
 public:
  /// @throws ConfigError as CharacterBatch
  FolkDance(const motion::MotionModel& model, const DanceSteps& steps,
            const DanceSettings& settings);

  void step();
  double time_s() const { return time_; }
  double beat_rad() const { return omega_ * time_; }  ///< phase of the music, not wrapped
  int size() const { return static_cast<int>(dancers_.size()); }
  const Dancer& dancer(int i) const { return dancers_[static_cast<std::size_t>(i)]; }
  const CharacterBatch& batch() const { return batch_; }
  const DanceTrack& track() const { return track_; }
  const DanceNumbers& numbers() const { return numbers_; }
  const motion::MotionModel& model() const { return model_; }  ///< with the pattern of standing

 private:
  struct Gait {
    /// travel, turn and duration of a cycle
    double stride_m = 0.0, turn_rad = 0.0, duration_s = 0.0;
  };
  Gait measure(int pattern) const;
  DanceTrack lay_out() const;
  double curve_speed_m_s() const;
  double lap_s() const;
  void start(int i);
  void decide(int i);
  void dance(Dancer& d);
  void hurry(Dancer& d);
  void arrive(int i, Dancer& d);
  void couple(int i, const Dancer& d);
  void turn(int i, Dancer& d);
  void mix(int i, const Dancer& d, double curve);
  void follow_track(int i, Dancer& d);
  void count();

  DanceSettings settings_;
  DanceSteps steps_;
  motion::MotionModel model_;
  Gait happy_, normal_, left_, right_;
  double omega_;  // angular frequency of the music
  DanceTrack track_;
  CharacterBatch batch_;
  double time_ = 0.0;
  std::vector<Dancer> dancers_;
  std::vector<crowd::Pedestrian> seen_;
  DanceNumbers numbers_;
};

}  // namespace mimesis::synthesizer
