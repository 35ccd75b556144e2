#include "tools/mimesis/crowd/gait_of_model.h"

#include <cmath>

#include "common/error.h"
#include "common/math/circle.h"
#include "nodes/synthesizer/character/repertoire.h"
#include "nodes/synthesizer/dynamics/character_batch.h"

namespace mimesis::tool {
namespace {

constexpr int kStepsPerCycle = 256, kCycles = 4;
constexpr int kHarmonicsOfMotion = 12;  // smoother velocities than all of them
constexpr double kShortestStep_m = 0.1;

struct Sample {
  double phase_rad, g_m_rad, turn;  // turn: ψ̇/φ̇ [1]
};

std::vector<Sample> walk(const synthesizer::Repertoire& repertoire, int motion) {
  const double omega = repertoire.motion(motion).parameters.frequency_rad_s;
  const double dt = math::kTwoPi / (omega * kStepsPerCycle);
  synthesizer::CharacterBatch batch(repertoire.model(), 1,
                                    {.dt_s = dt, .harmonics = kHarmonicsOfMotion});
  batch.set_pattern(0, motion);
  batch.set_frequency(0, omega);
  batch.set_phase(0, 0.0);
  for (int k = 0; k < kStepsPerCycle; ++k) batch.step();  // the standing foot is found
  std::vector<Sample> samples;
  const double per_step = math::kTwoPi / kStepsPerCycle;
  for (int k = 0; k < kCycles * kStepsPerCycle; ++k) {
    const double phase = batch.phase(0) + 0.5 * per_step;
    batch.step();
    samples.push_back(
        {phase, batch.root(0).velocity_H_m_s.x() / omega, batch.root(0).yaw_rate_rad_s / omega});
  }
  return samples;
}

MeasuredGait fitted(const std::vector<Sample>& samples, int harmonics) {
  MeasuredGait m;
  const double n = static_cast<double>(samples.size());
  crowd::Gait& g = m.gait;
  g.mean_m_rad = 0.0;
  for (const Sample& s : samples) g.mean_m_rad += s.g_m_rad / n;
  for (int k = 1; k <= harmonics; ++k) {
    double c = 0.0, d = 0.0, sway_c = 0.0, sway_d = 0.0;
    for (const Sample& s : samples) {
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
  const crowd::SpeedFunction speed = g.speed();
  for (const Sample& s : samples) {
    const double left = s.g_m_rad - speed(s.phase_rad);
    m.rms_m_rad += left * left / n;
  }
  m.rms_m_rad = std::sqrt(m.rms_m_rad);
  m.least_m_rad = speed.least();
  m.most_m_rad = speed.most();
  m.step_length_m = 0.5 * speed.cycle_m();
  return m;
}

}  // namespace

std::vector<MeasuredGait> measure_gaits(const motion::MotionModel& model, const std::string& style,
                                        int harmonics) {
  const synthesizer::Repertoire repertoire(model);
  if (!style.empty() && repertoire.find(style) < 0) {
    throw ConfigError("no style '" + style + "'; the model has: " + repertoire.known());
  }
  std::vector<MeasuredGait> all;
  for (const synthesizer::StyleMotions& motions : repertoire.styles()) {
    if (!style.empty() && motions.name != style) continue;
    const synthesizer::RepertoireMotion& motion = repertoire.motion(motions.straight);
    if (style.empty() && motion.step_length_m < kShortestStep_m) continue;
    try {
      MeasuredGait measured = fitted(walk(repertoire, motions.straight), harmonics);
      measured.gait.name = motions.name;
      measured.gait.eigenfrequency_rad_s = motion.parameters.frequency_rad_s;
      all.push_back(measured);
    } catch (const ConfigError& e) {
      throw ConfigError("style " + motions.name + ": " + e.what());
    }
  }
  return all;
}

}  // namespace mimesis::tool
