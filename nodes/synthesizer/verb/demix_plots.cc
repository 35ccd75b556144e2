#include "nodes/synthesizer/verb/demix_plots.h"

#include <algorithm>
#include <sstream>

#include "common/plot/gnuplot.h"

namespace mimesis::synthesizer {

using plot::Data;
using plot::quoted;

void plot_sources(const std::filesystem::path& png, const Eigen::MatrixXd& sources, int fixed,
                  const std::string& title) {
  const Eigen::Index count = sources.rows(), samples = sources.cols();
  const double top = 1.1 * sources.cwiseAbs().maxCoeff();
  std::vector<Data> data;
  std::ostringstream script;
  script << "set multiplot layout " << count << ",1 title " << quoted(title)
         << "\nunset key\nset xrange [0:1]\nset yrange [" << -top << ':' << top
         << "]\nset ytics 1\nset xzeroaxis\nset lmargin 8\n";
  for (Eigen::Index k = 0; k < count; ++k) {
    Data d{"s" + std::to_string(k), {}};
    for (Eigen::Index t = 0; t < samples; ++t) {
      d.rows.push_back({static_cast<double>(t) / static_cast<double>(samples), sources(k, t)});
    }
    data.push_back(std::move(d));
    const bool last = k + 1 == count, dashed = k < fixed;
    script << "set ylabel " << quoted("s" + std::to_string(k + 1))
           << (last ? "\nset format x '%g'\nset xlabel 'phase / 2π'" : "\nset format x ''")
           << "\nplot $s" << k << " with lines lw 2 lc " << (dashed ? "rgb '#888888' dt 2" : "1")
           << '\n';
  }
  script << "unset multiplot\n";
  plot::plot_png(png, 640, static_cast<int>(120 + 130 * count), data, script.str());
}

void plot_quality(const std::filesystem::path& png, const std::vector<QualityCurve>& curves,
                  const std::string& measure, const std::string& title) {
  std::vector<Data> data;
  double least = 1.0, most_sources = 1.0;
  std::ostringstream plot;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const QualityCurve& c = curves[i];
    Data d{"c" + std::to_string(i), {}};
    for (std::size_t k = 0; k < c.sources.size(); ++k) {
      d.rows.push_back({c.sources[k], c.quality[k]});
      least = std::min(least, c.quality[k]);
      most_sources = std::max(most_sources, c.sources[k]);
    }
    data.push_back(std::move(d));
    plot << (i == 0 ? "plot " : ", ") << "$c" << i << " with linespoints ls " << i + 1
         << " lw 2 pt 7 " << (c.dashed ? "dt 2 " : "") << "title " << quoted(c.name);
  }
  std::ostringstream script;
  script << "set title " << quoted(title) << "\nset xlabel 'number of sources'\nset ylabel "
         << quoted("approximation quality " + measure) << "\nset key bottom right\nset grid\n"
         << "set xtics 1\nset xrange [0.5:" << most_sources + 0.5 << "]\nset yrange ["
         << std::max(0.0, least - 0.05) << ":1]\n"
         << plot.str() << '\n';
  plot::plot_png(png, 760, 520, data, script.str());
}

}  // namespace mimesis::synthesizer
