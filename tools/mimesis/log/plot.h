#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// Unit of a quantity by the end of its name, as an axis shows it: "velocity_rad_s" -> "rad/s";
/// empty if it has none.
struct Quantity {
  std::string name;  ///< without the unit, in words: "velocity"
  std::string unit;
};
Quantity quantity_of(const std::string& field);

/// Thins a curve to a few points per column of pixels: the first, the least, the greatest, the last
/// and one that is not a number. Its picture is the same, spikes of one sample included. Memory is
/// bounded by the number of columns.
class CurveThinning {
 public:
  struct Point {
    double time_s, value;
  };
  /// Thins [start_s, end_s] into `columns` > 0.
  CurveThinning(double start_s, double end_s, std::size_t columns)
      : start_s_(start_s),
        columns_per_s_(end_s > start_s ? static_cast<double>(columns) / (end_s - start_s) : 0.0),
        columns_(columns) {}
  /// In any order of time; points of one column keep theirs.
  void add(const Point& point) {
    const double at = std::floor((point.time_s - start_s_) * columns_per_s_);
    const double last = static_cast<double>(columns_.size() - 1);
    Column& column = columns_[static_cast<std::size_t>(std::clamp(at, 0.0, last))];
    const Numbered numbered{count_++, point};
    if (!std::isfinite(point.value)) {
      column.gap = {numbered.number, {point.time_s, std::numeric_limits<double>::quiet_NaN()}};
      return;
    }
    if (!column.first) column.first = column.least = column.greatest = numbered;
    if (point.value < column.least->point.value) column.least = numbered;
    if (point.value > column.greatest->point.value) column.greatest = numbered;
    column.last = numbered;
  }
  std::vector<Point> points() const {
    std::vector<Point> all;
    for (const Column& c : columns_) {
      std::map<std::uint64_t, Point> in_order;
      for (const auto* n : {&c.gap, &c.first, &c.least, &c.greatest, &c.last}) {
        if (*n) in_order[(*n)->number] = (*n)->point;
      }
      for (const auto& [number, point] : in_order) all.push_back(point);
    }
    return all;
  }

 private:
  struct Numbered {
    std::uint64_t number = 0;
    Point point{};
  };
  struct Column {
    std::optional<Numbered> first, least, greatest, last, gap;
  };
  double start_s_, columns_per_s_;
  std::uint64_t count_ = 0;
  std::vector<Column> columns_;
};

/// Values of one field, or of one element, over time.
struct Curve {
  std::size_t field = 0;  ///< index in PlotOptions::fields
  std::string label;      ///< "bridge/joint_states.position_rad[0]"
  Quantity quantity;
  /// names of the values that occur in an enum or a boolean field
  std::map<int, std::string> words;
  bool discrete = false;  ///< enum or boolean
  CurveThinning thinning;
  std::uint64_t samples = 0;
  double least = std::numeric_limits<double>::infinity();
  double greatest = -std::numeric_limits<double>::infinity();  ///< finite ones alone
};

struct PlotOptions {
  std::vector<std::string> words = {};   ///< files, then fields
  std::vector<std::string> fields = {};  ///< "TOPIC.FIELD"
  TimeRange range = {};
  std::string output = {};      ///< *.png or *.svg
  std::string style = "lines";  ///< lines, steps or dots
  bool json = false;
};

/// Reads the curves, in the order of the options. Times are from the start of the log.
/// `failures` counts messages that could not be decoded, and damages.
/// @throws ConfigError for a topic or field that is not there or has no numbers.
std::vector<Curve> read_curves(const std::vector<OpenLog>& logs, const PlotOptions& options,
                               std::uint64_t& failures);

/// Draws them with gnuplot: a panel for each unit.
/// @throws std::runtime_error in one line if that does not work.
void draw_curves(const std::vector<Curve>& curves, const PlotOptions& options);

}  // namespace mimesis::tool
