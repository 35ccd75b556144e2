#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace mimesis::runtime {

/// Fewest insertions, deletions, replacements and swaps of neighbours that turn `a` into `b`
/// (optimal string alignment). O(|a|·|b|).
std::size_t edit_distance(std::string_view a, std::string_view b);

/// ", did you mean 'k_1_s'?" with the best of `known`, or "" if none is near `word`.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& known);

}  // namespace mimesis::runtime
