#include "nodes/crowd/verb/measured_gait.h"

#include <cmath>

#include "common/error.h"
#include "common/math/circle.h"
#include "nodes/synthesizer/character/repertoire.h"
#include "nodes/synthesizer/dynamics/character_batch.h"

namespace mimesis::crowd {
namespace {

constexpr int kStepsPerCycle = 256, kCycles = 4;
constexpr int kHarmonicsOfMotion = 12;  // smoother velocities than all of them
constexpr double kShortestStep_m = 0.1;

MeasuredGait fitted(const std::vector<SpeedSample>& samples, int harmonics) {
  MeasuredGait m;
  const double n = static_cast<double>(samples.size());
  Gait& g = m.gait;
  g.mean_m_rad = 0.0;
  for (const SpeedSample& s : samples) g.mean_m_rad += s.g_m_rad / n;
  for (int k = 1; k <= harmonics; ++k) {
    double c = 0.0, d = 0.0, sway_c = 0.0, sway_d = 0.0;
    for (const SpeedSample& s : samples) {
      c += 2.0 / n * s.g_m_rad * std::cos(k * s.phase_rad);
      d += 2.0 / n * s.g_m_rad * std::sin(k * s.phase_rad);
      sway_c += 2.0 / n * s.turn * std::cos(k * s.phase_rad);
      sway_d += 2.0 / n * s.turn * std::sin(k * s.phase_rad);
    }
    g.cosine_m_rad.push_back(c);
    g.sine_m_rad.push_back(d);
    g.sway_cosine.push_back(sway_c);
    g.sway_sine.push_back(sway_d);
  }
  const SpeedFunction speed = g.speed();
  for (const SpeedSample& s : samples) {
    const double left = s.g_m_rad - speed(s.phase_rad);
    m.rms_m_rad += left * left / n;
  }
  m.rms_m_rad = std::sqrt(m.rms_m_rad);
  m.least_m_rad = speed.least();
  m.most_m_rad = speed.most();
  m.step_length_m = 0.5 * speed.cycle_m();
  return m;
}

std::vector<SpeedSample> walk(const synthesizer::Repertoire& repertoire,
                              const synthesizer::StyleMotions& style, double step) {
  const double omega = repertoire.motion(style.straight).parameters.frequency_rad_s;
  const double dt = math::kTwoPi / (omega * kStepsPerCycle);
  synthesizer::CharacterBatch batch(repertoire.model(), 1,
                                    {.dt_s = dt, .harmonics = kHarmonicsOfMotion});
  batch.set_pattern(0, style.straight);
  if (step != 1.0) {
    std::vector<double> beta(repertoire.motions().size(), 0.0);
    beta[static_cast<std::size_t>(style.straight)] = step;
    beta[static_cast<std::size_t>(style.standing)] = 1.0 - step;
    batch.set_blend(0, beta);
  }
  batch.set_frequency(0, omega);
  batch.set_phase(0, 0.0);
  for (int k = 0; k < kStepsPerCycle; ++k) batch.step();  // the standing foot is found
  std::vector<SpeedSample> samples;
  const double per_step = math::kTwoPi / kStepsPerCycle;
  for (int k = 0; k < kCycles * kStepsPerCycle; ++k) {
    const double phase = batch.phase(0) + 0.5 * per_step;
    batch.step();
    samples.push_back(
        {phase, batch.root(0).velocity_H_m_s.x() / omega, batch.root(0).yaw_rate_rad_s / omega});
  }
  return samples;
}

const synthesizer::StyleMotions& found(const synthesizer::Repertoire& repertoire,
                                       const std::string& style) {
  const int number = repertoire.find(style);
  if (number >= 0) return repertoire.style(number);
  throw ConfigError("no style '" + style + "'; the model has: " + repertoire.known());
}

}  // namespace

std::vector<std::vector<SpeedSample>> walk_straight(const motion::MotionModel& model,
                                                    const std::string& style,
                                                    const std::vector<double>& steps) {
  const synthesizer::Repertoire repertoire(model);
  std::vector<std::vector<SpeedSample>> all;
  for (const double step : steps) all.push_back(walk(repertoire, found(repertoire, style), step));
  return all;
}

std::vector<MeasuredGait> measure_gaits(const motion::MotionModel& model, const std::string& style,
                                        int harmonics) {
  const synthesizer::Repertoire repertoire(model);
  if (!style.empty()) (void)found(repertoire, style);
  std::vector<MeasuredGait> all;
  for (const synthesizer::StyleMotions& motions : repertoire.styles()) {
    if (!style.empty() && motions.name != style) continue;
    const synthesizer::RepertoireMotion& motion = repertoire.motion(motions.straight);
    if (style.empty() && motion.step_length_m < kShortestStep_m) continue;
    try {
      MeasuredGait measured = fitted(walk(repertoire, motions, 1.0), harmonics);
      measured.gait.name = motions.name;
      measured.gait.eigenfrequency_rad_s = motion.parameters.frequency_rad_s;
      all.push_back(measured);
    } catch (const ConfigError& e) {
      throw ConfigError("style " + motions.name + ": " + e.what());
    }
  }
  return all;
}

}  // namespace mimesis::crowd
