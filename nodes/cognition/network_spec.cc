#include "nodes/cognition/network_spec.h"

#include <algorithm>

#include "common/error.h"

namespace mimesis::cognition {

std::size_t NetworkSpec::field_index(std::string_view name) const {
  return static_cast<std::size_t>(std::ranges::find(fields, name, &FieldSpec::name) -
                                  fields.begin());
}

std::size_t NetworkSpec::link_index(std::string_view name) const {
  const auto it = std::ranges::find(links, name, &LinkSpec::name);
  if (it == links.end()) fail("links", "there is no link " + std::string(name));
  return static_cast<std::size_t>(it - links.begin());
}

int NetworkSpec::site_index(const FieldSpec& field, std::string_view site) {
  const auto it = std::ranges::find(field.sites, site);
  return it == field.sites.end() ? -1 : static_cast<int>(it - field.sites.begin());
}

double& NetworkSpec::input_gain(std::string_view name, std::string_view into) {
  const auto it = std::ranges::find_if(
      inputs, [&](const InputSpec& i) { return i.name == name && i.into == into; });
  if (it == inputs.end()) {
    fail("inputs", "there is no input " + std::string(name) + " into " + std::string(into));
  }
  return it->gain;
}

void NetworkSpec::fail(const std::string& path, const std::string& what) const {
  throw ConfigError((place ? place(path) + ": " : "") + path + ": " + what);
}

SitePlace site_place(const FieldSpec& field, int site) {
  const auto s = static_cast<std::size_t>(site);
  if (field.params.rows > 1) return {field.at[2 * s], field.at[2 * s + 1]};
  if (!field.at.empty()) return {field.at[s], 0.0};
  const double length = field.params.neurons * field.params.dx;
  return {(site + 0.5) / static_cast<double>(field.sites.size()) * length, 0.0};
}

}  // namespace mimesis::cognition
