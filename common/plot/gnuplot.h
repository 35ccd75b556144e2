#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace mimesis::plot {

/// A curve or anything else with columns, inlined into a script as `$name`.
struct Data {
  std::string name;                       ///< letters, digits, underscores
  std::vector<std::vector<double>> rows;  ///< NaN leaves a gap
};

/// Draws `png` with an external gnuplot: size in pixels, inline data, then `script`, which ends in
/// `plot`. Colours and fonts are set before; line styles 1..8 are distinct in colour and in grey.
/// @throws std::runtime_error in one line if gnuplot is absent, refuses the script or writes no
/// file.
void plot_png(const std::filesystem::path& png, int width_px, int height_px,
              const std::vector<Data>& data, const std::string& script);
/// Writes the plot as SVG.
void plot_svg(const std::filesystem::path& svg, int width_px, int height_px,
              const std::vector<Data>& data, const std::string& script);

/// Quotes a label for gnuplot.
std::string quoted(const std::string& label);

}  // namespace mimesis::plot
