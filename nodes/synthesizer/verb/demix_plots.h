#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

namespace mimesis::synthesizer {

/// Sources over one period, one panel each, as in [M18 fig. 3.11, 3.14]; the first `fixed`, which
/// are not periodic, dashed. @throws std::runtime_error as plot::plot_png
void plot_sources(const std::filesystem::path& png, const Eigen::MatrixXd& sources, int fixed,
                  const std::string& title);

/// Approximation quality against the number of sources.
struct QualityCurve {
  std::string name;
  std::vector<double> sources, quality;  ///< K and Q or Q2
  bool dashed = false;
};

/// Curves as in [M18 fig. 3.10, 3.13]. @param measure "Q" or "Q2": label of the axis
void plot_quality(const std::filesystem::path& png, const std::vector<QualityCurve>& curves,
                  const std::string& measure, const std::string& title);

}  // namespace mimesis::synthesizer
