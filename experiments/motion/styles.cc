#include "experiments/motion/styles.h"

#include <algorithm>
#include <array>

#include "common/error.h"

namespace mimesis::synthesizer {

std::size_t Styles::index(const std::string& name) const {
  const auto found = std::ranges::find(names, name);
  if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  std::string known;
  for (const std::string& n : names) known += (known.empty() ? "" : ", ") + n;
  throw ConfigError("style '" + name + "' is unknown, expected one of " + known);
}

MotionParameters balanced_mixture(const MotionParameters& emotional, const MotionParameters& left,
                                  const MotionParameters& right, double beta) {
  const std::array parts = {emotional, left, right};
  MotionParameters out;
  blend(parts, std::array{0.75, 0.125 * (1.0 + beta), 0.125 * (1.0 - beta)}, out);
  return out;
}

Styles styles_of(const motion::MotionModel& model, double min_similarity) {
  if (model.patterns.empty()) throw ConfigError("model '" + model.name + "' has no pattern");
  std::vector<MotionParameters> all;
  Styles styles;
  for (const motion::Pattern& pattern : model.patterns) {
    all.push_back(parameters_of(pattern));
    if (all.back().mean_rad.size() != all.front().mean_rad.size()) {
      throw ConfigError("model '" + model.name + "': patterns of different rows");
    }
    if (std::ranges::find(styles.names, pattern.trial.style) == styles.names.end()) {
      styles.names.push_back(pattern.trial.style);
    }
  }
  // before averaging: the mean of two equal motions at different delays is neither
  if (!model.tied) {
    styles.disambiguation =
        remove_delay_ambiguities(model.sources, model.fixed, all, min_similarity);
  }
  for (const std::string& name : styles.names) {
    std::vector<MotionParameters> of_style;
    for (std::size_t p = 0; p < all.size(); ++p) {
      if (model.patterns[p].trial.style == name) of_style.push_back(all[p]);
    }
    const std::vector<double> equal(of_style.size(), 1.0 / static_cast<double>(of_style.size()));
    blend(of_style, equal, styles.parameters.emplace_back());
  }
  return styles;
}

}  // namespace mimesis::synthesizer
