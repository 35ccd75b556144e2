#include "nodes/vision/files/colors_file.h"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "common/error.h"
#include "common/runtime/param_source.h"
#include "common/runtime/value_text.h"

namespace mimesis::vision {
namespace {

using runtime::ParamVisitor;

constexpr std::string_view kColorsFormat = "mimesis-colors-2";

struct ClassEntry {
  std::string name;
  double u = -1.0, v = -1.0, u_deviation = 0.0, v_deviation = 0.0, correlation = 2.0;
  double y = -1.0, y_min = -1.0, y_max = -1.0;

  void visit(ParamVisitor& g) {
    g("name", name);
    g("u", u, 0.0, 255.0);
    g("v", v, 0.0, 255.0);
    g("u_deviation", u_deviation, 0.5, 100.0);
    g("v_deviation", v_deviation, 0.5, 100.0);
    g("correlation", correlation, -0.99, 0.99);
    g("y", y, 0.0, 255.0);
    g("y_min", y_min, 0.0, 255.0);
    g("y_max", y_max, 0.0, 255.0);
  }
};

struct ColorsFile {
  std::string format;
  std::vector<double> reference_bgr;
  std::vector<ClassEntry> classes;

  void visit(ParamVisitor& v) {
    v("format", format, {kColorsFormat});
    v("reference_bgr", reference_bgr, 0.0, 255.0, 3);
    list(v, "classes", classes);
  }
};

}  // namespace

Kind kind_named(const std::string& text, const std::string& where) {
  std::vector<std::string> names;
  for (std::size_t k = 1; k < kKinds; ++k) {
    names.emplace_back(name(static_cast<Kind>(k)));
    if (names.back() == text) return static_cast<Kind>(k);
  }
  throw ConfigError(fmt::format("{}: no class '{}'{}; there are: {}", where, text,
                                runtime::did_you_mean(text, names), fmt::join(names, ", ")));
}

TaughtColors load_colors(const std::string& file) {
  const runtime::ParamSource source(runtime::find_model_file(file), {}, {});
  ColorsFile read;
  source.read("", [&read](ParamVisitor& v) { read.visit(v); });
  TaughtColors out;
  out.reference_bgr = Eigen::Vector3d::Map(read.reference_bgr.data());
  if (read.classes.empty()) {
    throw ConfigError(runtime::to_string(source.place_of("classes")) + ": classes: there is none");
  }
  for (std::size_t i = 0; i < read.classes.size(); ++i) {
    const ClassEntry& c = read.classes[i];
    const std::string at = fmt::format("classes.{}.name", i),
                      place = runtime::to_string(source.place_of(at)) + ": " + at;
    auto& spot = out.spots.of.at(static_cast<std::size_t>(kind_named(c.name, place)));
    if (spot) throw ConfigError(place + ": '" + c.name + "' is there twice");
    const double mixed = c.correlation * c.u_deviation * c.v_deviation;
    spot.emplace();
    spot->mean = {c.u, c.v};
    spot->y = c.y;
    spot->y_min = c.y_min;
    spot->y_max = c.y_max;
    spot->covariance << c.u_deviation * c.u_deviation, mixed, mixed, c.v_deviation * c.v_deviation;
  }
  return out;
}

std::string colors_text(const TaughtColors& colors) {
  ColorsFile file;
  file.format = kColorsFormat;
  file.reference_bgr.assign(colors.reference_bgr.begin(), colors.reference_bgr.end());
  for (std::size_t k = 1; k < kKinds; ++k) {
    const auto& spot = colors.spots.of[k];
    if (!spot) continue;
    const double u = std::sqrt(spot->covariance(0, 0)), v = std::sqrt(spot->covariance(1, 1));
    file.classes.push_back({std::string(name(static_cast<Kind>(k))), spot->mean.x(), spot->mean.y(),
                            u, v, spot->covariance(0, 1) / (u * v), spot->y, spot->y_min,
                            spot->y_max});
  }
  return "# Written by `mimesis vision teach`; meaning: nodes/vision/README.md\n" +
         runtime::dump_params([&file](ParamVisitor& v) { file.visit(v); });
}

}  // namespace mimesis::vision
