// What is drawn: units, thinning.
#include <algorithm>
#include <cmath>

#include "tools/mimesis/log/plot.h"

namespace mimesis::tool {
namespace {

struct Unit {
  std::string_view suffix, text;
};
/// The closed list of proto/README.md; longer ones first, for they end like shorter ones.
constexpr Unit kUnits[] = {
    {"_rad_s2", "rad/s²"}, {"_rad_s", "rad/s"}, {"_m_s2", "m/s²"}, {"_m_s", "m/s"},
    {"_n_m", "N·m"},       {"_1_s", "1/s"},     {"_rad", "rad"},   {"_px", "px"},
    {"_hz", "Hz"},         {"_kg", "kg"},       {"_ns", "ns"},     {"_m", "m"},
    {"_s", "s"},           {"_n", "N"},         {"_v", "V"},       {"_a", "A"}};

}  // namespace

Quantity quantity_of(const std::string& field) {
  Quantity q{field, ""};
  for (const Unit& unit : kUnits) {
    if (!field.ends_with(unit.suffix) || field.size() == unit.suffix.size()) continue;
    q = {field.substr(0, field.size() - unit.suffix.size()), std::string(unit.text)};
    break;
  }
  std::ranges::replace(q.name, '_', ' ');
  return q;
}

std::string derivative_unit(const std::string& unit) {
  if (unit.empty()) return "1/s";
  if (unit == "s") return "";
  if (unit.ends_with("/s")) return unit + "²";
  return unit + "/s";
}

CurveThinning::CurveThinning(double start_s, double end_s, std::size_t columns)
    : start_s_(start_s),
      columns_per_s_(end_s > start_s ? static_cast<double>(columns) / (end_s - start_s) : 0.0),
      columns_(columns) {}

void CurveThinning::add(const Point& point) {
  const double at = std::floor((point.time_s - start_s_) * columns_per_s_);
  const double last = static_cast<double>(columns_.size() - 1);
  Column& column = columns_[static_cast<std::size_t>(std::clamp(at, 0.0, last))];
  const Numbered numbered{count_++, point};
  if (!std::isfinite(point.value)) {
    column.gap = {numbered.number, {point.time_s, std::numeric_limits<double>::quiet_NaN()}};
    column.has_gap = true;
    return;
  }
  if (!column.any) column.first = column.least = column.greatest = numbered;
  if (point.value < column.least.point.value) column.least = numbered;
  if (point.value > column.greatest.point.value) column.greatest = numbered;
  column.last = numbered;
  column.any = true;
}

std::vector<CurveThinning::Point> CurveThinning::points() const {
  std::vector<Point> all;
  for (const Column& c : columns_) {
    std::map<std::uint64_t, Point> in_order;
    if (c.has_gap) in_order[c.gap.number] = c.gap.point;
    if (c.any) {
      for (const Numbered* n : {&c.first, &c.least, &c.greatest, &c.last}) {
        in_order[n->number] = n->point;
      }
    }
    for (const auto& [number, point] : in_order) all.push_back(point);
  }
  return all;
}

}  // namespace mimesis::tool
