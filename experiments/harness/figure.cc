#include "experiments/harness/figure.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace mimesis::reproduce {

Row near(std::string what, double ours, double reference, double tolerance, std::string unit,
         std::string why) {
  const bool passed = std::abs(ours - reference) <= tolerance;  // false for NaN
  return {std::move(what), ours, reference, tolerance, std::move(unit), passed, std::move(why)};
}

Row holds(std::string what, bool ours, std::string why) {
  return {std::move(what), ours ? 1.0 : 0.0, 1.0, 0.0, "1", ours, std::move(why)};
}

Row within(std::string what, double ours, double published, std::string unit,
           const std::string& why) {
  return {std::move(what),
          ours,
          published,
          0.0,
          std::move(unit),
          ours <= published,
          "at most the reference: " + why};
}

Row beside(std::string what, double ours, double published, std::string unit,
           const std::string& why) {
  return {std::move(what),       ours, published, std::nan(""), std::move(unit), !std::isnan(ours),
          "not asserted: " + why};
}

Row at_least(std::string what, double ours, double bound, std::string unit,
             const std::string& why) {
  return {std::move(what),
          ours,
          std::nullopt,
          bound,
          std::move(unit),
          ours >= bound,
          "at least the tolerance: " + why};
}

Row at_most(std::string what, double ours, double bound, std::string unit, const std::string& why) {
  return {std::move(what),
          ours,
          std::nullopt,
          bound,
          std::move(unit),
          ours <= bound,
          "at most the tolerance: " + why};
}

bool Report::passed() const {
  return !rows.empty() && std::ranges::all_of(rows, [](const Row& r) { return r.passed; });
}

}  // namespace mimesis::reproduce
