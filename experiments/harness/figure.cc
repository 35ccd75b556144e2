#include "experiments/harness/figure.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace mimesis::reproduce {

Source published(std::string where) { return {Origin::published, std::move(where)}; }
Source closed_form(std::string which) { return {Origin::closed_form, std::move(which)}; }
Source prototype(std::string file) { return {Origin::prototype, std::move(file)}; }
Source goal() { return {Origin::goal, {}}; }
Reference published(double value, std::string where) {
  return {published(std::move(where)), value};
}
Reference closed_form(double value, std::string which) {
  return {closed_form(std::move(which)), value};
}
Reference prototype(double value, std::string file) { return {prototype(std::move(file)), value}; }
Reference goal(double value) { return {goal(), value}; }

Row near(std::string what, double ours, Reference reference, double tolerance, std::string unit,
         std::string why) {
  const bool passed = std::abs(ours - reference.value) <= tolerance;  // false for NaN
  return {std::move(what), ours,   std::move(reference), tolerance,
          std::move(unit), passed, std::move(why)};
}

Row holds(std::string what, bool ours, Source source, std::string why) {
  return near(std::move(what), ours, {std::move(source), 1.0}, 0.0, "1", std::move(why));
}

Row at_least(std::string what, double ours, Bound bound, std::string unit, const std::string& why) {
  const bool passed = ours >= bound.value;
  return {std::move(what),
          ours,
          std::move(bound),
          0.0,
          std::move(unit),
          passed,
          "at least the reference: " + why};
}

Row at_most(std::string what, double ours, Bound bound, std::string unit, const std::string& why) {
  const bool passed = ours <= bound.value;
  return {std::move(what),
          ours,
          std::move(bound),
          0.0,
          std::move(unit),
          passed,
          "at most the reference: " + why};
}

Row beside(std::string what, double ours, Reference reference, std::string unit,
           const std::string& why) {
  return {std::move(what),       ours,
          std::move(reference),  std::nan(""),
          std::move(unit),       !std::isnan(ours),
          "not asserted: " + why};
}

void Report::near(std::string what, double ours, Reference reference, double tolerance,
                  std::string unit, std::string why) {
  rows.push_back(reproduce::near(std::move(what), ours, std::move(reference), tolerance,
                                 std::move(unit), std::move(why)));
}
void Report::holds(std::string what, bool ours, Source source, std::string why) {
  rows.push_back(reproduce::holds(std::move(what), ours, std::move(source), std::move(why)));
}
void Report::at_least(std::string what, double ours, Bound bound, std::string unit,
                      const std::string& why) {
  rows.push_back(
      reproduce::at_least(std::move(what), ours, std::move(bound), std::move(unit), why));
}
void Report::at_most(std::string what, double ours, Bound bound, std::string unit,
                     const std::string& why) {
  rows.push_back(reproduce::at_most(std::move(what), ours, std::move(bound), std::move(unit), why));
}
void Report::beside(std::string what, double ours, Reference reference, std::string unit,
                    const std::string& why) {
  rows.push_back(
      reproduce::beside(std::move(what), ours, std::move(reference), std::move(unit), why));
}

RowCounts count(const std::vector<Row>& rows) {
  RowCounts counts{};
  for (const Row& row : rows) ++counts[static_cast<std::size_t>(row.reference.origin)];
  return counts;
}

std::string to_text(const RowCounts& counts) {
  std::string text;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] == 0) continue;
    text += (text.empty() ? "" : ", ") + std::to_string(counts[i]) + ' ' + kOriginNames[i];
  }
  return text;
}

bool Report::passed() const {
  return !rows.empty() && std::ranges::all_of(rows, [](const Row& r) { return r.passed; });
}

Report Figure::run(const PlotDir& plot_dir) const {
  Report report = compute(plot_dir);
  const RowCounts declared = rows.counts(), found = count(report.rows);
  if (found != declared) {
    report.rows.push_back(
        holds("rows as declared", false, goal(),
              "declared are " + to_text(declared) + "; found were " + to_text(found)));
  }
  return report;
}

}  // namespace mimesis::reproduce
