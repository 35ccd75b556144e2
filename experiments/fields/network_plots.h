#pragma once
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "common/plot/gnuplot.h"
#include "nodes/cognition/trial.h"

namespace mimesis::cognition {

/// The course of a trial: the final activity of all fields, and max u over time.
struct Recording {
  NetworkSpec spec;
  TrialResult result{};
  std::array<std::vector<double>, kLayers> final_u{};
  std::vector<double> time_s{};
  std::array<std::vector<double>, kLayers> max_u{};

  /// Largest u near one site (within a quarter of the distance of sites), over the whole trial.
  std::array<std::array<double, 4>, kLayers> highest{};
  double highest_at(Layer layer, int site) const {
    return highest[index(layer)][static_cast<std::size_t>(site)];
  }
};

Recording record(FieldNetwork<double>& network, const Trial& trial);

/// Panels u(x) of all fields, laid out as in M18 fig. 2.2: observation, matching and goals,
/// execution.
void plot_snapshot(const std::filesystem::path& png, const std::string& title, const Recording& r);

/// max u(t) of all fields in one panel, [from_s, to_s].
void plot_courses(const std::filesystem::path& png, const std::string& title, const Recording& r,
                  double from_s, double to_s);

/// Columns time [ms] and max u of one field.
plot::Data course(const std::string& name, const Recording& r, Layer layer);

}  // namespace mimesis::cognition
