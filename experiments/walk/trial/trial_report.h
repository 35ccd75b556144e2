#pragma once
#include <iosfwd>
#include <nlohmann/json.hpp>
#include <span>

#include "experiments/walk/trial/trial.h"

namespace mimesis::walk {

nlohmann::ordered_json to_json(const TrialResult& result);
/// Worst figures of all, and every fall.
nlohmann::ordered_json summary_json(std::span<const TrialResult> results);
/// One row a trial in the units of people: mm, N m, N, µs.
void print_table(std::span<const TrialResult> results, std::ostream& out, bool bold_heading);

}  // namespace mimesis::walk
