#pragma once
#include <iosfwd>
#include <nlohmann/json.hpp>
#include <span>

#include "experiments/walk/drawer/drawer_trial.h"

namespace mimesis::walk {

nlohmann::ordered_json to_json(const DrawerResult& result);
/// How many tasks ended in which way, every one that did not end with the object, and the worst
/// figures of the others.
nlohmann::ordered_json summary_json(std::span<const DrawerResult> results);
/// One row a task in the units of people: mm, N m, N, µs.
void print_table(std::span<const DrawerResult> results, std::ostream& out, bool bold_heading);

}  // namespace mimesis::walk
