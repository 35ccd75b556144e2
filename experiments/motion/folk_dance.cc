#include "experiments/motion/folk_dance.h"

#include <algorithm>
#include <cmath>

#include "common/math/circle.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kHurry = 1.2;        // frequency outside, of the neutral one, if all goes well
constexpr double kLookAhead_m = 1.0;  // the goal's place on the way
constexpr double kSight_m = 3.0;
constexpr double kFarthestPull = 1.0;                           // rad; see Walkers
constexpr double kStyle_s = 0.4, kTurn_s = 0.2, kPace_s = 0.4;  // time constants

void approach(double& value, double target, double dt_s, double within_s) {
  value += (target - value) * std::min(1.0, dt_s / within_s);
}

/// The model with a pattern of weights zero, which takes from the length of steps.
motion::MotionModel with_standing(motion::MotionModel model, int normal) {
  motion::Pattern still = model.patterns[static_cast<std::size_t>(normal)];
  still.trial.style = "still";
  still.weight_rad.setZero();
  model.patterns.push_back(still);
  return model;
}

/// In [0, 1), different for neighbours: multiples of the golden section.
double scattered(int i) {
  const double x = 0.6180339887498949 * (i + 1);
  return x - std::floor(x);
}

}  // namespace

FolkDance::FolkDance(const motion::MotionModel& model, const DanceSteps& steps,
                     const DanceSettings& settings)
    : settings_(settings),
      steps_(steps),
      model_(with_standing(model, steps.normal)),
      happy_(measure(steps.happy)),
      normal_(measure(steps.normal)),
      left_(measure(steps.left)),
      right_(measure(steps.right)),
      omega_(math::kTwoPi / happy_.duration_s),
      track_(lay_out()),
      batch_(model_, 2 * settings.couples,
             {.dt_s = settings.dt_s, .harmonics = 14, .foot_lock = true}),
      dancers_(static_cast<std::size_t>(2 * settings.couples)) {
  for (int i = 0; i < size(); ++i) start(i);
}

FolkDance::Gait FolkDance::measure(int pattern) const {
  constexpr double kDt = 1.0 / 120.0;
  CharacterBatch batch(model_, 1, {.dt_s = kDt, .harmonics = 14});
  const double duration = model_.patterns[static_cast<std::size_t>(pattern)].trial.duration_s;
  batch.set_pattern(0, pattern);
  batch.set_frequency(0, math::kTwoPi / duration);
  const int steps = static_cast<int>(std::ceil(duration / kDt));
  for (int k = 0; k < steps; ++k) batch.step();  // the standing foot is found
  const RootPose from = batch.root(0);
  for (int k = 0; k < steps; ++k) batch.step();
  const RootPose to = batch.root(0);
  return {(to.position_W_m - from.position_W_m).norm(), to.heading_rad - from.heading_rad,
          duration};
}

/// On the half circles, where a share of the steps is curved.
double FolkDance::curve_speed_m_s() const {
  const double share = std::clamp(normal_.stride_m / settings_.radius_m / left_.turn_rad, 0.0, 1.0);
  return ((1.0 - share) * normal_.stride_m + share * left_.stride_m) / normal_.duration_s;
}

double FolkDance::lap_s() const {
  return settings_.couples * settings_.cycles_between * happy_.duration_s;
}

/// The corridor is as long as makes a lap last its beats.
DanceTrack FolkDance::lay_out() const {
  DanceTrack track{0.0, settings_.radius_m, settings_.half_width_m};
  const double in = happy_.stride_m / happy_.duration_s,
               out = normal_.stride_m / normal_.duration_s;
  const double curves = 2.0 * track.curve_m() / (curve_speed_m_s());
  track.corridor_m = std::max(3.0, (lap_s() - curves) / (1.0 / in + 1.0 / (kHurry * out)));
  return track;
}

/// Everybody begins where the plan has it, in the corridor in step, elsewhere at any phase.
void FolkDance::start(int i) {
  Dancer& d = dancers_[static_cast<std::size_t>(i)];
  d.couple = i / 2;
  d.side = i % 2 == 0 ? 1 : -1;
  d.own_pace = 0.95 + 0.1 * scattered(3 * i + 1);
  const double every = settings_.cycles_between * happy_.duration_s;
  const double in = happy_.stride_m / happy_.duration_s,
               out = normal_.stride_m / normal_.duration_s;
  double since = lap_s() - d.couple * every;  // its last entrance
  d.entrance_s = d.couple * every;
  if (d.couple == 0) d.entrance_s = since = 0.0;
  double left = since;
  const auto walk = [&](double length_m, double speed) {
    const double t = std::min(left, length_m / speed);
    left -= t;
    d.track_m += t * speed;
  };
  walk(track_.corridor_m, in);
  const bool inside = left <= 0.0;
  walk(track_.curve_m(), curve_speed_m_s());
  walk(track_.corridor_m, kHurry * out);
  walk(track_.curve_m(), curve_speed_m_s());
  d.track_m = track_.wrapped(d.track_m);
  d.sector = track_.sector(d.track_m);
  if (inside && d.couple > 0) d.entrance_s -= lap_s();
  d.happy = inside ? 1.0 : 0.0;
  d.frequency_rad_s = inside ? omega_ : math::kTwoPi / normal_.duration_s;
  Eigen::Vector2d p = track_.point(d.track_m);
  p.y() *= d.side;
  batch_.set_root(i, p, d.side * track_.heading(d.track_m));
  batch_.set_phase(i, inside ? 0.0 : math::kTwoPi * scattered(i));
  const bool curve = d.sector == DanceSector::parting || d.sector == DanceSector::entrance;
  d.turn_rad_s = curve ? d.side * curve_speed_m_s() / track_.radius_m : 0.0;
  mix(i, d, 0.0);
}

void FolkDance::step() {
  for (int i = 0; i < size(); ++i) decide(i);
  batch_.step();
  time_ += settings_.dt_s;
  for (int i = 0; i < size(); ++i) follow_track(i, dancers_[static_cast<std::size_t>(i)]);
  count();
}

void FolkDance::decide(int i) {
  Dancer& d = dancers_[static_cast<std::size_t>(i)];
  switch (d.sector) {
    case DanceSector::corridor:
      dance(d);
      break;
    case DanceSector::parting:
      approach(d.frequency_rad_s, d.own_pace * math::kTwoPi / normal_.duration_s, settings_.dt_s,
               kPace_s);
      approach(d.length, 1.0, settings_.dt_s, kPace_s);
      break;
    case DanceSector::outside:
      hurry(d);
      break;
    case DanceSector::entrance:
      arrive(i, d);
      break;
  }
  approach(d.happy, d.sector == DanceSector::corridor ? 1.0 : 0.0, settings_.dt_s, kStyle_s);
  batch_.set_frequency(i, d.frequency_rad_s);
  couple(i, d);
  turn(i, d);
}

/// With the music; the steps are as long as keeps the place that belongs to the beat.
void FolkDance::dance(Dancer& d) {
  const double place = happy_.stride_m * (time_ - d.entrance_s) / happy_.duration_s;
  approach(d.frequency_rad_s, omega_, settings_.dt_s, kPace_s);
  approach(d.length, std::clamp(1.0 + 0.5 * (place - d.track_m), 0.8, 1.15), settings_.dt_s,
           kPace_s);
}

/// Sets the pace so that the usual time for the curve to the entrance remains.
void FolkDance::hurry(Dancer& d) {
  const double out = normal_.stride_m / normal_.duration_s;
  const double for_curve = track_.curve_m() / (curve_speed_m_s());
  const double way = 2.0 * track_.corridor_m + track_.curve_m() - d.track_m;
  const double time = std::max(d.entrance_s - time_ - for_curve, 0.5);
  const double pace = std::clamp(way / time / out, 0.8, 1.45);
  approach(d.frequency_rad_s, pace * math::kTwoPi / normal_.duration_s, settings_.dt_s, kPace_s);
  approach(d.length, 1.0, settings_.dt_s, kPace_s);
}

/// The phase that is left to the left foot's strike on the beat of the entrance, in the time that
/// is left: whole cycles are added so that the steps keep their length.
void FolkDance::arrive(int i, Dancer& d) {
  const double time = d.entrance_s - time_, way = track_.length_m() - d.track_m;
  if (time < 0.3) return;  // the coupling corrects the rest
  const double stride = curve_speed_m_s() * normal_.duration_s;
  const double part = math::wrap_two_pi(-batch_.phase(i));
  // −1: the foot strikes already, and the phase waits
  const double cycles = std::round(way / stride - part / math::kTwoPi);
  const double phase = part + math::kTwoPi * cycles;
  const double own = math::kTwoPi / normal_.duration_s;
  approach(d.frequency_rad_s, std::clamp(phase / time, 0.6 * own, 1.5 * own), settings_.dt_s,
           0.5 * kPace_s);
  approach(d.length, std::clamp(way / (stride * std::max(phase, 0.5) / math::kTwoPi), 0.7, 1.2),
           settings_.dt_s, 0.5 * kPace_s);
}

/// Σ α (x_j − x) = A (x̄ − x): one external oscillator at the phase of the sum.
void FolkDance::couple(int i, const Dancer& d) {
  const double own = batch_.phase(i);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  const auto add = [&](double phase_rad, double alpha) {
    const double pull = std::clamp(math::wrap_pi(phase_rad - own), -kFarthestPull, kFarthestPull);
    sum += alpha * Eigen::Vector2d(std::cos(own + pull), std::sin(own + pull));
  };
  if (d.sector == DanceSector::corridor) {
    // held for a whole step of time: what counts is the phase in its middle
    const double ahead = 0.5 * settings_.dt_s * omega_;
    add(beat_rad() + ahead, settings_.beat_1_s);
    const int partner = i ^ 1, front = (i + size() - 2) % size();
    for (const int other : {partner, front}) {
      if (dancer(other).sector == DanceSector::corridor) {
        add(batch_.phase(other) + ahead, settings_.partner_1_s);
      }
    }
  }
  const double strength = sum.norm();
  batch_.set_external(i, strength > 0.0 ? std::atan2(sum.y(), sum.x()) : 0.0, strength);
}

/// Navigation decides how fast to turn; curved steps do it as far as they can, the standing foot
/// turns for the rest.
void FolkDance::turn(int i, Dancer& d) {
  const RootPose root = batch_.root(i);
  const auto pedestrian = [&](int k) {
    const RootPose r = batch_.root(k);
    return crowd::Pedestrian{r.position_W_m, r.heading_rad, r.velocity_H_m_s.x()};
  };
  seen_.clear();
  for (int k = 0; k < size() && d.sector != DanceSector::corridor; ++k) {
    const double apart = (batch_.root(k).position_W_m - root.position_W_m).norm();
    if (k != i && apart < kSight_m && dancer(k).sector != DanceSector::corridor) {
      seen_.push_back(pedestrian(k));
    }
  }
  Eigen::Vector2d goal = track_.point(track_.wrapped(d.track_m + kLookAhead_m));
  goal.y() *= d.side;
  const double rate = crowd::heading_rate(pedestrian(i), goal, 3.0, seen_);
  approach(d.turn_rad_s, std::clamp(rate, -1.5, 1.5), settings_.dt_s, kTurn_s);

  const Gait& curved = d.turn_rad_s > 0.0 ? left_ : right_;
  const double cycle_s = math::kTwoPi / d.frequency_rad_s;
  const double curve =
      (1.0 - d.happy) * std::clamp(d.turn_rad_s * cycle_s / curved.turn_rad, 0.0, 1.0);
  mix(i, d, d.turn_rad_s > 0.0 ? curve : -curve);
  const double by_steps = (d.happy * happy_.turn_rad + (1.0 - d.happy - curve) * normal_.turn_rad +
                           curve * curved.turn_rad) /
                          cycle_s;
  batch_.set_turn(i, d.turn_rad_s - by_steps);
}

/// @param curve  share of the curved steps, + to the left
void FolkDance::mix(int i, const Dancer& d, double curve) {
  std::vector<double> beta(model_.patterns.size(), 0.0);
  const auto add = [&](int pattern, double share) {
    beta[static_cast<std::size_t>(pattern)] += share * d.length;
  };
  add(steps_.happy, d.happy);
  add(steps_.normal, 1.0 - d.happy - std::abs(curve));
  add(curve > 0.0 ? steps_.left : steps_.right, std::abs(curve));
  beta.back() = 1.0 - d.length;
  batch_.set_blend(i, beta);
}

void FolkDance::follow_track(int i, Dancer& d) {
  // the place on the way that is nearest: a step of Newton's method from the last one
  const Eigen::Vector2d p = batch_.root(i).position_W_m;
  for (int turns = 0; turns < 2; ++turns) {
    const double a = track_.heading(d.track_m);
    const Eigen::Vector2d off = Eigen::Vector2d(p.x(), d.side * p.y()) - track_.point(d.track_m);
    // never back: an entrance counts once
    const double ahead = std::max(0.0, std::cos(a) * off.x() + std::sin(a) * off.y());
    if (d.track_m + ahead >= track_.length_m()) {
      ++d.laps;
      ++numbers_.entrances;
      const double error = std::abs(math::wrap_pi(batch_.phase(i) - beat_rad()));
      numbers_.entrance_error_rad = std::max(numbers_.entrance_error_rad, error);
      numbers_.wrong_foot += error > 0.25 * math::kTwoPi ? 1 : 0;
    }
    d.track_m = track_.wrapped(d.track_m + ahead);
  }
  const DanceSector was = d.sector;
  d.sector = track_.sector(d.track_m);
  if (was == DanceSector::corridor && d.sector == DanceSector::parting) d.entrance_s += lap_s();
  d.beat_error_rad = math::wrap_pi(batch_.phase(i) - beat_rad());
}

void FolkDance::count() {
  const auto settled = [&](const Dancer& d) {
    return d.sector == DanceSector::corridor && d.track_m > happy_.stride_m;
  };
  for (int i = 0; i < size(); ++i) {
    const Dancer &d = dancer(i), &partner = dancer(i ^ 1);
    for (int k = 0; k < i; ++k) {
      const double apart = (batch_.root(k).position_W_m - batch_.root(i).position_W_m).norm();
      numbers_.least_distance_m = std::min(numbers_.least_distance_m, apart);
    }
    const double off = std::abs(math::wrap_pi(batch_.phase(i) - batch_.phase(i ^ 1)));
    if (d.sector == DanceSector::outside && partner.sector == DanceSector::outside) {
      numbers_.spread_rad = std::max(numbers_.spread_rad, off);
    }
    if (!settled(d)) continue;
    numbers_.beat_error_rad = std::max(numbers_.beat_error_rad, std::abs(d.beat_error_rad));
    if (!settled(partner)) continue;
    numbers_.couple_error_rad = std::max(numbers_.couple_error_rad, off);
    numbers_.apart_m = std::max(numbers_.apart_m, std::abs(d.track_m - partner.track_m));
  }
}

}  // namespace mimesis::synthesizer
