#include "experiments/fields/network_plots.h"

#include <algorithm>
#include <limits>
#include <sstream>

namespace mimesis::cognition {
namespace {

using plot::Data;
using plot::quoted;

/// Where the panel of a layer sits on the page.
struct Place {
  Layer layer;
  double x, y;  // lower left corner, fractions of the page
  const char* title;
};

constexpr std::array<Place, kLayers> kPlaces = {
    {{Layer::sts_grip, 0.00, 0.46, "STS grip (seen)"},
     {Layer::sts_transport, 0.00, 0.02, "STS transport (seen)"},
     {Layer::pf, 0.25, 0.24, "PF (means for a goal)"},
     {Layer::f5_grip, 0.50, 0.46, "F5 grip (to do)"},
     {Layer::f5_transport, 0.50, 0.02, "F5 transport (to do)"},
     {Layer::pfc, 0.75, 0.46, "PFC (goal)"},
     {Layer::color, 0.75, 0.02, "COL (colour cue)"}}};

/// Neuron at a site.
double middle_of(const NetworkSpec& a, Layer layer, int site) {
  const FieldSpec& field = a.fields[index(layer)];
  return site_place(field, site).x / field.params.dx;
}

std::string tics(const Recording& r, Layer layer) {
  std::ostringstream out;
  out << "set xtics (";
  for (int s = 0; s < sites(layer); ++s) {
    out << (s > 0 ? ", " : "") << quoted(std::string(site_label(layer, s))) << ' '
        << middle_of(r.spec, layer, s);
  }
  out << ") scale 0.6\n";
  return out.str();
}

}  // namespace

Recording record(FieldNetwork<double>& network, const Trial& trial) {
  Recording r{.spec = network.spec()};
  for (auto& layer : r.highest) layer.fill(-std::numeric_limits<double>::infinity());
  r.result = run_trial(network, trial, [&](double t_s) {
    r.time_s.push_back(t_s);
    for (const Layer layer : kAllLayers) {
      const auto u = network.field(layer).activity();
      r.max_u[index(layer)].push_back(std::ranges::max(u));
      for (int s = 0; s < sites(layer); ++s) {
        const auto n = static_cast<double>(u.size());
        const auto middle = static_cast<std::size_t>(middle_of(r.spec, layer, s));
        const auto reach = static_cast<std::size_t>(0.25 * n / sites(layer));
        auto& top = r.highest[index(layer)][static_cast<std::size_t>(s)];
        for (std::size_t i = middle - reach; i <= middle + reach; ++i) top = std::max(top, u[i]);
      }
    }
  });
  for (const Layer layer : kAllLayers) {
    const auto u = network.field(layer).activity();
    r.final_u[index(layer)].assign(u.begin(), u.end());
  }
  return r;
}

void plot_snapshot(const std::filesystem::path& png, const std::string& title, const Recording& r) {
  std::vector<Data> data;
  std::ostringstream script;
  script
      << "set multiplot\nset label 1 " << quoted(title)
      << " at screen 0.5,0.965 center font 'sans,13'\nunset key\nset yrange [-7:15]\n"
      << "set size 0.25,0.44\nset lmargin 6.5\nset rmargin 1\nset tmargin 2.2\nset bmargin 2.2\n";
  for (const Place& place : kPlaces) {
    const auto& u = r.final_u[index(place.layer)];
    Data d{std::string(layer_name(place.layer)), {}};
    for (std::size_t i = 0; i < u.size(); ++i) d.rows.push_back({static_cast<double>(i), u[i]});
    data.push_back(d);
    const bool active = r.result.peaks[index(place.layer)].count > 0;
    script << "set origin " << place.x << ',' << place.y << "\nset title " << quoted(place.title)
           << " offset 0,-0.6\nset xrange [0:" << u.size() - 1 << "]\n"
           << tics(r, place.layer) << "set ytics -5,5,15\n"
           << (place.x == 0.0 ? "set ylabel 'u(x)' offset 1,0\n" : "unset ylabel\n")
           << "plot 0 lt 7 dt 2 notitle, $" << d.name
           << " using 1:($2>0?$2:0) with filledcurves y1=0 lt " << (active ? 2 : 1) << ", $"
           << d.name << " using 1:2 with lines lt " << (active ? 2 : 1) << "\nunset label 1\n";
  }
  script << "unset multiplot\n";
  plot::plot_png(png, 1200, 560, data, script.str());
}

Data course(const std::string& name, const Recording& r, Layer layer) {
  Data d{name, {}};
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    d.rows.push_back({1000.0 * r.time_s[i], r.max_u[index(layer)][i]});
  }
  return d;
}

void plot_courses(const std::filesystem::path& png, const std::string& title, const Recording& r,
                  double from_s, double to_s) {
  constexpr std::array<Layer, 5> kShown = {Layer::sts_grip, Layer::pf, Layer::f5_grip,
                                           Layer::f5_transport, Layer::pfc};
  std::vector<Data> data;
  std::ostringstream script;
  script
      << "set title " << quoted(title)
      << " font 'sans,13'\nset xlabel 'time from the onset of vision [ms]'\n"
      << "set ylabel 'max u'\nset key bottom right opaque\nset arrow from 0,graph 0 to 0,graph 1 "
         "nohead lt 7 dt 3\n"
      << "set xrange [" << 1000 * from_s << ':' << 1000 * to_s << "]\nset yrange [-4:*]\n"
      << "plot 0 lt 7 dt 2 notitle";
  for (std::size_t i = 0; i < kShown.size(); ++i) {
    data.push_back(course(std::string(layer_name(kShown[i])), r, kShown[i]));
    script << ", $" << data.back().name << " using 1:2 with lines lt " << i + 1 << " title '"
           << layer_name(kShown[i]) << "'";
  }
  plot::plot_png(png, 760, 460, data, script.str());
}

}  // namespace mimesis::cognition
