#include "experiments/motion/blending_jerk.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/math/circle.h"
#include "experiments/motion/sequencer.h"
#include "nodes/synthesizer/dynamics/motion_series.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kRate_hz = 60.0;
constexpr std::size_t kHalfWindow = 12;  // frames: 0.2 s
constexpr int kOffsets = 4;

/// Joint angles of parameters at a phase.
class Player {
 public:
  explicit Player(const motion::MotionModel& model)
      : series_(model, static_cast<int>((model.sources.cols() - 1) / 2), 0.0),
        factors_(static_cast<std::size_t>(series_.size())) {}

  void set(const MotionParameters& p) {
    series_.make(p.mean_rad, p.weight_rad, p.delay_rad, factors_.data());
  }

  Eigen::VectorXd at(double phase) const {
    phase = math::wrap_two_pi(phase);
    Eigen::VectorXd q = Eigen::VectorXd::Zero(series_.rows());
    const auto add = [&](int block, double basis) {
      q += basis * Eigen::Map<const Eigen::VectorXf>(
                       factors_.data() + static_cast<std::ptrdiff_t>(block) * series_.row_stride(),
                       series_.rows())
                       .cast<double>();
    };
    add(0, 1.0);
    for (int h = 1; h <= series_.harmonics(); ++h) {
      add(2 * h - 1, std::cos(h * phase));
      add(2 * h, std::sin(h * phase));
    }
    for (int f = 0; f < series_.slow_functions(); ++f) {
      const double slow = f < 2 ? 0.5 * phase : 0.25 * phase;
      add(1 + 2 * series_.harmonics() + f, f % 2 == 0 ? std::cos(slow) : std::sin(slow));
    }
    return q;
  }

 private:
  MotionSeries series_;
  std::vector<float> factors_;
};

/// One transition frame by frame, from a cycle before to a cycle after.
struct PlayedTransition {
  std::vector<Eigen::VectorXd> angles_rad;  ///< 60 Hz
  std::vector<double> phase_rad;            ///< negative before the transition
};

/// @param frame_offset  in [0, 1): where between two frames φ = −2π is
PlayedTransition play_transition(const motion::MotionModel& model, const MotionParameters& from,
                                 const MotionParameters& to, const BlendingCase& what,
                                 double frame_offset) {
  Player player(model);
  Sequencer sequencer(from, model.fixed, 0.0, what.beta);
  if (what.least_jerk) sequencer.use_least_jerk(model);
  const bool announced = sequencer.announce(to);
  MIMESIS_ASSERT(announced);
  PlayedTransition out;
  const MotionParameters* last = nullptr;
  double phase = frame_offset * from.frequency_rad_s / kRate_hz;
  while (phase < 2.0 * math::kTwoPi) {
    const MotionParameters& p = what.cut ? (phase < math::kTwoPi ? from : to) : sequencer.at(phase);
    if (&p != last || sequencer.in_transition()) player.set(p);
    last = &p;
    out.angles_rad.push_back(player.at(phase));
    out.phase_rad.push_back(phase - math::kTwoPi);
    phase += p.frequency_rad_s / kRate_hz;
  }
  return out;
}

/// Rms over the rows of the third difference that ends one frame later [rad/s³]; 0 at the ends.
std::vector<double> jerk_rad_s3(const std::vector<Eigen::VectorXd>& x) {
  std::vector<double> out(x.size(), 0.0);
  for (std::size_t i = 2; i + 1 < x.size(); ++i) {
    const double norm = (x[i + 1] - 3.0 * x[i] + 3.0 * x[i - 1] - x[i - 2]).norm();
    out[i] = std::pow(kRate_hz, 3) * norm / std::sqrt(static_cast<double>(x[i].size()));
  }
  return out;
}

/// Mean squares of jerk: around φ = 0, and of all frames.
struct Jerk {
  double window = 0.0, cycle = 0.0;
};

Jerk measure(const PlayedTransition& x) {
  const std::vector<double> jerk = jerk_rad_s3(x.angles_rad);
  const auto zero =
      static_cast<std::size_t>(std::ranges::lower_bound(x.phase_rad, 0.0) - x.phase_rad.begin());
  MIMESIS_ASSERT(zero > kHalfWindow + 2 && zero + kHalfWindow < jerk.size());
  Jerk out;
  for (std::size_t i = 2; i + 1 < jerk.size(); ++i) {
    out.cycle += jerk[i] * jerk[i] / static_cast<double>(jerk.size() - 3);
    if (i + kHalfWindow >= zero && i < zero + kHalfWindow) {
      out.window += jerk[i] * jerk[i] / static_cast<double>(2 * kHalfWindow);
    }
  }
  return out;
}

Jerk over_offsets(const motion::MotionModel& model, const MotionParameters& from,
                  const MotionParameters& to, const BlendingCase& what) {
  Jerk mean;
  for (int i = 0; i < kOffsets; ++i) {
    const Jerk one =
        measure(play_transition(model, from, to, what, static_cast<double>(i) / kOffsets));
    mean.window += one.window / kOffsets;
    mean.cycle += one.cycle / kOffsets;
  }
  return mean;
}

}  // namespace

std::vector<BlendingJerk> blending_jerk(const motion::MotionModel& model, const Styles& styles,
                                        const BlendingCase& what) {
  const std::size_t n = styles.names.size();
  std::vector<Jerk> steady;
  for (const MotionParameters& p : styles.parameters) {
    steady.push_back(over_offsets(model, p, p, {.cut = true}));
  }
  std::vector<BlendingJerk> out;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      if (i == j) continue;
      const double jerk =
          over_offsets(model, styles.parameters[i], styles.parameters[j], what).window;
      const auto relative = [jerk](double to) { return std::sqrt(jerk / to); };
      out.push_back({styles.names[i], styles.names[j],
                     relative(0.5 * (steady[i].window + steady[j].window)),
                     relative(0.5 * (steady[i].cycle + steady[j].cycle)),
                     relative(std::max(steady[i].window, steady[j].window)), std::sqrt(jerk)});
    }
  }
  return out;
}

Spread spread(const std::vector<BlendingJerk>& pairs, double BlendingJerk::*of, double limit) {
  MIMESIS_ASSERT(!pairs.empty());
  std::vector<double> values;
  Spread out;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    values.push_back(pairs[i].*of);
    if (values[i] > values[out.worst_pair]) out.worst_pair = i;
    out.within += values[i] <= limit;
  }
  out.worst = values[out.worst_pair];
  std::ranges::sort(values);
  out.median = 0.5 * (values[values.size() / 2] + values[(values.size() - 1) / 2]);
  return out;
}

}  // namespace mimesis::synthesizer
