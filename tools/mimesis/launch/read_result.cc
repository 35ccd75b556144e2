#include <fmt/format.h>

#include "tools/mimesis/launch/graph_file.h"

namespace mimesis::launch {
namespace {

using runtime::Yaml;

std::optional<FieldPath> field_path(const Text& text, Mistakes& mistakes) {
  const std::size_t dot = text.text.find('.');
  if (dot == std::string::npos || dot == 0 || dot + 1 == text.text.size()) {
    mistakes.add(text.place, fmt::format("expected TOPIC.FIELD, found '{}'", text.text));
    return std::nullopt;
  }
  return FieldPath{text.text.substr(0, dot), text.text.substr(dot + 1), text.place};
}

std::optional<ResultField> result_field(const Text& name, const Yaml& value, Section& section) {
  ResultField field;
  field.name = name.text;
  std::optional<Text> from;
  if (value.kind == Yaml::Kind::map) {
    Section s(value, section.variables(), section.mistakes());
    from = s.text("from");
    if (!s.has("from"))
      section.mistakes().add(value.place, "a result field needs from: TOPIC.FIELD");
    field.scale = s.number("scale", -1e12, 1e12);
    field.digits = s.whole("digits", 0, 15);
    field.none = s.number("none", -1e12, 1e12);
    s.finish();
  } else {
    from = section.expand(value, "TOPIC.FIELD");
  }
  if (!from) return std::nullopt;
  const auto path = field_path(*from, section.mistakes());
  if (!path) return std::nullopt;
  field.from = *path;
  return field;
}

}  // namespace

ResultSpec read_result(Section& section) {
  ResultSpec result;
  if (auto until = section.text("until")) {
    result.until = std::move(*until);
  } else if (!section.has("until")) {
    section.mistakes().add(section.place(), "result needs until: TOPIC");
  }
  result.timeout = section.duration("timeout").value_or(result.timeout);
  result.wall_timeout = section.duration("wall_timeout").value_or(result.wall_timeout);
  if (const auto success = section.text("success")) {
    result.success = field_path(*success, section.mistakes());
  }
  section.entries("fields", [&](const Text& name, const Yaml& value) {
    if (auto field = result_field(name, value, section)) result.fields.push_back(std::move(*field));
  });
  section.finish();
  return result;
}

}  // namespace mimesis::launch
