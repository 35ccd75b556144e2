#include "nodes/synthesizer/character/characters.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "common/math/circle.h"

namespace mimesis::synthesizer {

namespace {

constexpr double kFarthestPull = 1.0;  // rad: of the coupled phase from the own one
constexpr double kRateChange = 0.5;    // share of the eigenfrequency, by coupling
constexpr double kMoves_m = 0.05;      // a step longer than this gets somewhere

// Recorded cycles do not close: more harmonics would jump where one ends.
constexpr Eigen::Index kHarmonics = 12;

int harmonics(const motion::MotionModel& model) {
  return static_cast<int>(std::min(kHarmonics, (model.sources.cols() - 1) / 2));
}

bool gets_somewhere(const Repertoire& repertoire) {
  return std::ranges::any_of(repertoire.styles(), [&](const StyleMotions& style) {
    return repertoire.motion(style.straight).step_length_m > kMoves_m;
  });
}

/// Place and heading of one, relative to the centre and to the formation's heading.
CharacterStart place(int i, int count, const Formation& f) {
  CharacterStart start;
  if (f.arrangement == "circle") {
    const double radius = f.spacing_m / (2.0 * std::sin(std::numbers::pi / std::max(count, 2)));
    const double angle = math::kTwoPi * i / count;
    start.position_W_m = count > 1 ? radius * Eigen::Vector2d(std::cos(angle), std::sin(angle))
                                   : Eigen::Vector2d(0.0, 0.0);
    start.heading_rad = count > 1 ? math::wrap_pi(angle + std::numbers::pi) : 0.0;
    return start;
  }
  const int columns = f.arrangement == "row"
                          ? count
                          : static_cast<int>(std::ceil(std::sqrt(static_cast<double>(count))));
  const int rows = (count + columns - 1) / columns;
  start.position_W_m = {f.spacing_m * (0.5 * (rows - 1) - i / columns),
                        f.spacing_m * (0.5 * (columns - 1) - i % columns)};
  return start;
}

}  // namespace

Characters::Characters(const motion::MotionModel& model, std::span<const CharacterStart> starts,
                       const CharactersSettings& settings)
    : settings_(settings),
      repertoire_(std::make_unique<const Repertoire>(model)),
      batch_(repertoire_->model(), static_cast<int>(starts.size()),
             {.dt_s = settings.walk.dt_s,
              .harmonics = harmonics(repertoire_->model()),
              .individual = true,
              .foot_lock = settings.foot_lock}),
      moves_(gets_somewhere(*repertoire_)) {
  const int style = settings.style.empty() ? 0 : repertoire_->find(settings.style);
  if (style < 0) {
    throw ConfigError("style: '" + settings.style +
                      "' is none of the model's: " + repertoire_->known());
  }
  for (const RepertoireMotion& motion : repertoire_->motions()) parts_.push_back(motion.parameters);
  mixed_ = parts_.front();
  each_.reserve(starts.size());
  for (std::size_t k = 0; k < starts.size(); ++k) {
    const CharacterStart& start = starts[k];
    const int i = static_cast<int>(k);
    each_.push_back(
        {.walk = {*repertoire_, settings.walk, style, settings.walking, start.heading_rad},
         .coordinator = {},
         .gait = {},
         .state = {}});
    place(i, start, settings.walking);
    set_motion(i, walk(i));
  }
  batch_.settle();
  for (int i = 0; i < size(); ++i) {
    each_[static_cast<std::size_t>(i)].state.root = batch_.root(i);
  }
}

void Characters::set_beat(double phase_rad, double rate_rad_s) {
  beat_ = {true, phase_rad, rate_rad_s};
}

void Characters::set_gait(int i, const GaitWish& wish, std::optional<double> phase_rad) {
  One& c = each_[static_cast<std::size_t>(i)];
  c.gait = wish;
  c.coordinator.on = phase_rad.has_value();
  c.coordinator.phase_rad = phase_rad.value_or(0.0);
  if (c.walk.task() == WalkTask::free) c.walk.set_free(true);
}

void Characters::release(int i) {
  One& c = each_[static_cast<std::size_t>(i)];
  c.gait = {};
  c.coordinator.on = false;
  if (c.walk.task() == WalkTask::free) c.walk.set_free(false);
}

void Characters::place(int i, const CharacterStart& start, bool walking) {
  One& c = each_[static_cast<std::size_t>(i)];
  batch_.set_root(i, start.position_W_m, start.heading_rad);
  batch_.set_phase(i, start.phase_rad);
  c.walk.resume(walking, start.heading_rad);
  c.state.root = batch_.root(i);
  c.state.phase_rad = batch_.phase(i);
}

void Characters::step() {
  for (int i = 0; i < size(); ++i) decide(i, each_[static_cast<std::size_t>(i)]);
  batch_.step();
  beat_.advance(settings_.walk.dt_s);
  for (int i = 0; i < size(); ++i) observe(i, each_[static_cast<std::size_t>(i)]);
}

void Characters::decide(int i, One& c) {
  const bool coordinated = c.coordinator.on;
  const Rhythm& rhythm = coordinated ? c.coordinator : beat_;
  GaitWish wish = c.gait;
  if (!wish.phase_rate_rad_s && !coordinated && beat_.on) wish.phase_rate_rad_s = beat_.rate_rad_s;
  c.walk.set_gait(wish);
  const RootPose& root = c.state.root;
  c.walk.step(root.position_W_m, root.heading_rad, c.state.phase_rad,
              rhythm.on ? std::optional(rhythm.phase_rad) : std::nullopt);
  double phase = c.state.phase_rad;
  if (const auto start = c.walk.phase_rad()) {
    batch_.set_phase(i, *start);
    phase = *start;
  }
  if (c.walk.blending()) set_motion(i, c.walk);
  batch_.set_frequency(i, c.walk.frequency_rad_s());
  couple(i, rhythm, coordinated ? settings_.crowd_alpha_1_s : settings_.beat_alpha_1_s, c.walk,
         phase);
  batch_.set_turn(i, c.walk.pivot_rad_s());
  if (coordinated) {
    // a coordinator that names no rate means the character's own
    c.coordinator.rate_rad_s = c.gait.phase_rate_rad_s.value_or(c.walk.frequency_rad_s());
    c.coordinator.advance(settings_.walk.dt_s);
  }
}

void Characters::couple(int i, const Rhythm& rhythm, double alpha_1_s, const WalkControl& walk,
                        double phase_rad) {
  const double omega = walk.frequency_rad_s();
  if (!rhythm.on || alpha_1_s <= 0.0 || omega <= 0.0) {
    batch_.set_external(i, 0.0, 0.0);
    return;
  }
  // the coupling holds for the whole step: what counts is the rhythm's phase in its middle
  const double ahead = rhythm.phase_rad + 0.5 * settings_.walk.dt_s * rhythm.rate_rad_s;
  const double sine = std::min(kRateChange * omega / alpha_1_s, 1.0);
  const double farthest = std::min(kFarthestPull, std::asin(sine));
  const double pull = std::clamp(math::wrap_pi(ahead - phase_rad), -farthest, farthest);
  batch_.set_external(i, phase_rad + pull, alpha_1_s);
}

void Characters::observe(int i, One& c) {
  const double rate = 1.0 / settings_.walk.dt_s;
  const RootPose before = c.state.root;
  const double phase_before = c.walk.phase_rad().value_or(c.state.phase_rad);
  RootPose& root = c.state.root;
  root = batch_.root(i);
  c.state.phase_rad = batch_.phase(i);
  c.state.phase_rate_rad_s = math::wrap_pi(c.state.phase_rad - phase_before) * rate;
  const Eigen::Vector2d v = (root.position_W_m - before.position_W_m) * rate;
  const double cosine = std::cos(root.heading_rad), sine = std::sin(root.heading_rad);
  root.velocity_H_m_s = {cosine * v.x() + sine * v.y(), cosine * v.y() - sine * v.x()};
  root.yaw_rate_rad_s = math::wrap_pi(root.heading_rad - before.heading_rad) * rate;
}

void Characters::set_motion(int i, const WalkControl& walk) {
  if (repertoire_->same_delays(walk.beta())) {
    batch_.set_blend(i, walk.beta());
    return;
  }
  blend(parts_, walk.beta(), mixed_);
  batch_.set_parameters(i, mixed_.mean_rad, mixed_.weight_rad, mixed_.delay_rad, walk.beta());
}

std::vector<CharacterStart> form(int count, const Formation& formation) {
  std::vector<CharacterStart> starts;
  const double c = std::cos(formation.heading_rad), s = std::sin(formation.heading_rad);
  for (int i = 0; i < count; ++i) {
    CharacterStart start = place(i, count, formation);
    const Eigen::Vector2d p = start.position_W_m;
    start.position_W_m =
        formation.centre_W_m + Eigen::Vector2d(c * p.x() - s * p.y(), s * p.x() + c * p.y());
    start.heading_rad = math::wrap_pi(start.heading_rad + formation.heading_rad);
    constexpr double kGolden = 0.6180339887498949;
    if (formation.spread_phases) start.phase_rad = math::kTwoPi * std::fmod(i * kGolden, 1.0);
    starts.push_back(start);
  }
  return starts;
}

constexpr double kLambda = 20.0;  // 1/s

PelvisVelocity::PelvisVelocity(double dt_s) : dt_s_(dt_s), fade_(std::exp(-kLambda * dt_s)) {}

// The deviation e = v − u from a constant u has the solution (e + (ė + λe)t) exp(−λt).
void PelvisVelocity::step(const RootPose& root) {
  const Eigen::Vector3d u(root.velocity_H_m_s.x(), root.velocity_H_m_s.y(), root.yaw_rate_rad_s);
  const Eigen::Vector3d e = value_ - u, a = rate_ + kLambda * e;
  const Eigen::Vector3d next = (e + dt_s_ * a) * fade_;
  rate_ = a * fade_ - kLambda * next;
  value_ = u + next;
}

}  // namespace mimesis::synthesizer
