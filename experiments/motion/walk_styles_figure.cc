// One character walks through recorded styles [M18 3.4.1].
#include <algorithm>
#include <cmath>

#include "common/math/circle.h"
#include "common/motion/demix/held_out.h"
#include "experiments/motion/figures.h"
#include "experiments/motion/sequencer.h"
#include "experiments/motion/styled_walks.h"
#include "experiments/motion/styles.h"

namespace mimesis::synthesizer {
namespace {

using namespace reproduce;

constexpr int kStyleSources = 5;
constexpr double kDt = 1.0 / 60.0;
const std::vector<std::string> kWalkStyles = {"normal", "happy", "sad", "angry", "tired", "active"};

std::vector<std::string> clips() {
  std::vector<std::string> out;
  for (const std::string& s : kWalkStyles) {
    out.push_back("bandai_nc/dataset-1_walk_" + s + "_001.bvh");
  }
  return out;
}

const motion::MotionModel& styles_model() {
  static const motion::MotionModel model = styled_walks(recorded_walks(clips()), kStyleSources);
  return model;
}

/// A character that goes from style to style.
class StyleWalk {
 public:
  StyleWalk(const motion::MotionModel& model, const MotionParameters& first, double beta, bool lock)
      : batch_(model, 1, {.dt_s = kDt, .harmonics = 14, .individual = true, .foot_lock = lock}),
        course_(first, model.fixed, 0.0, beta),
        beta_(model.patterns.size(), 0.0) {
    beta_.front() = 1.0;
  }
  /// Pelvis and contacts are this pattern's; else the first one's.
  void ground(int pattern) {
    beta_.front() = 0.0;
    beta_[static_cast<std::size_t>(pattern)] = 1.0;
  }
  void announce(const MotionParameters& next) { next_ = &next; }
  void step() {
    const double now = batch_.phase(0);
    turns_ += now < last_ - 1.0 ? 1 : 0;
    last_ = now;
    if (next_ && course_.announce(*next_)) next_ = nullptr;
    const MotionParameters& p = course_.at(now + math::kTwoPi * turns_);
    batch_.set_parameters(0, p.mean_rad, p.weight_rad, p.delay_rad, beta_);
    batch_.set_frequency(0, p.frequency_rad_s);
    batch_.step();
  }
  const CharacterBatch& batch() const { return batch_; }
  int cycles() const { return turns_; }
  Eigen::VectorXd angles() const {
    const auto a = batch_.angles(0);
    return Eigen::Map<const Eigen::VectorXf>(a.data(), static_cast<Eigen::Index>(a.size()))
        .cast<double>();
  }

 private:
  CharacterBatch batch_;
  Sequencer course_;
  std::vector<double> beta_;
  const MotionParameters* next_ = nullptr;
  double last_ = 0.0;
  int turns_ = 0;
};

/// Root mean square of the third difference of all joint angles over frames [first, last) [rad/s³].
double rms_jerk(const std::vector<Eigen::VectorXd>& x, std::size_t first, std::size_t last) {
  double sum = 0.0, count = 0.0;
  for (std::size_t i = std::max<std::size_t>(first, 3); i < std::min(last, x.size()); ++i) {
    sum += (x[i] - 3.0 * x[i - 1] + 3.0 * x[i - 2] - x[i - 3]).squaredNorm();
    count += static_cast<double>(x[i].size());
  }
  return std::sqrt(sum / count) / (kDt * kDt * kDt);
}

struct Jerk {
  double around = 0.0, all = 0.0;  ///< within 0.2 s of the transition; of the whole walk
};

/// Two cycles of `from`, then of `to`, without foot lock, which has jerks of its own.
Jerk jerk(const motion::MotionModel& model, const MotionParameters& from,
          const MotionParameters& to, double beta) {
  StyleWalk walk(model, from, beta, false);
  std::vector<Eigen::VectorXd> frames;
  std::size_t zero = 0;
  walk.step();
  while (walk.cycles() < 4) {
    if (walk.cycles() == 1) walk.announce(to);
    walk.step();
    frames.push_back(walk.angles());
    if (walk.cycles() < 2) zero = frames.size();
  }
  return {rms_jerk(frames, zero - 12, zero + 12), rms_jerk(frames, 0, frames.size())};
}

struct Ratios {
  double mean = 0.0, worst = 0.0;
};

/// Over all ordered pairs: rms jerk within 0.2 s of the transition, relative to the larger of the
/// two styles alone (at the same place of the cycle or over all of it, whichever is more).
Ratios jerk_ratios(const motion::MotionModel& model, const Styles& styles, double beta) {
  const std::size_t n = styles.names.size();
  std::vector<double> steady;
  for (const MotionParameters& p : styles.parameters) {
    const Jerk j = jerk(model, p, p, beta);
    steady.push_back(std::max(j.around, j.all));
  }
  Ratios r;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < n; ++k) {
      if (i == k) continue;
      const double ratio = jerk(model, styles.parameters[i], styles.parameters[k], beta).around /
                           std::max(steady[i], steady[k]);
      r.mean += ratio / static_cast<double>(n * (n - 1));
      r.worst = std::max(r.worst, ratio);
    }
  }
  return r;
}

double foot_slide(const motion::MotionModel& model, const MotionParameters& style,
                  const std::string& name, bool lock) {
  StyleWalk walk(model, style, 0.2, lock);
  walk.ground(pattern_of(model, name));
  FootSlide slide(kDt);
  for (int i = 0; i < 600; ++i) {
    walk.step();
    if (i > 120) slide.observe(walk.batch(), 0);
  }
  return slide.mean_m_s();
}

Report walk_styles(const PlotDir&) {
  if (const auto clip = absent_clip(clips()); !clip.empty()) return report_absent(clip);
  const motion::MotionModel& model = styles_model();
  const Styles styles = styles_of(model);
  Report report;
  report.at_least("Q of the tied mixture, 5 sources, 6 styles", model.quality, 0.8, "1",
                  "all cycles of six Bandai-Namco clips");
  const mocap::Trials cycles = styled_cycles(recorded_walks(clips()));
  const demix::SisaOptions tied{.sources = kStyleSources, .tied = true};
  const auto learn_pca = [](const mocap::Trials& t) {
    return demix::principal_components(t, kStyleSources);
  };
  report.at_least("the same, each clip, hence style, left out once",
                  demix::sisa_held_out(cycles, tied, demix::sisa(cycles, tied).mixture).quality,
                  demix::held_out(cycles, demix::Delays::none, false, learn_pca).quality, "1",
                  "PCA, K = 5, held out: sources and delays are learned from other styles, weights "
                  "and means fitted");
  for (const std::string& name : kWalkStyles) {
    const MotionParameters& p = styles.parameters[styles.index(name)];
    report.at_most(name + ": feet on the ground slide, with lock", foot_slide(model, p, name, true),
                   prototype(0.083, "motion.md"), "m/s",
                   "what feet of recordings do; without lock " +
                       std::to_string(foot_slide(model, p, name, false)).substr(0, 5));
  }
  const char* goal = "goal 1.15 for every pair: not reached at β = 1/5";
  const Ratios fifth = jerk_ratios(model, styles, 0.2), half = jerk_ratios(model, styles, 0.5);
  report.at_most("jerk ratio at β = 1/5, mean of pairs", fifth.mean, 1.25, "1",
                 "rms within 0.2 s of the transition / larger steady style");
  report.at_most("jerk ratio at β = 1/5, worst pair", fifth.worst, 1.75, "1", goal);
  report.at_most("jerk ratio at β = 1/2, worst pair", half.worst, 1.15, "1",
                 "a wider interval helps");
  return report;
}

}  // namespace

void add_walk_styles_figure(std::vector<reproduce::Figure>& to) {
  to.emplace_back("walk-styles", "one character walks through recorded styles", "M18",
                  Declared{.prototype = 6, .goal = 5}, walk_styles);
}

}  // namespace mimesis::synthesizer
