#include "common/motion/mocap/c3d_parameters.h"

#include <algorithm>
#include <cstdlib>

namespace mimesis::mocap {
namespace {

std::string upper(std::string name) {
  for (char& c : name) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  return name;
}

std::string text_at(const C3dWords& words, std::size_t at, std::size_t length) {
  std::string text;
  for (std::size_t i = 0; i < length; ++i) text += static_cast<char>(words.u8(at + i));
  return text;
}

bool printable(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c < '\x7f'; });
}

}  // namespace

// A record: length of the name (negative: locked), group (negative: defines it), name, way to the
// next record from here, then what the kind of record needs.
C3dParameters::C3dParameters(const C3dWords& words, std::size_t begin, std::size_t limit)
    : words_(words), end_(begin) {
  for (std::size_t at = begin; at + 4 <= limit;) {
    const auto length = static_cast<std::size_t>(std::abs(words.i8(at)));
    if (length == 0) break;
    const std::size_t behind_name = at + 2 + length;
    if (behind_name + 2 > limit || !printable(text_at(words, at + 2, length))) break;
    read_record(at, limit);
    const std::size_t step = words.u16(behind_name);
    if (step < 2) break;
    at = behind_name + step;
  }
}

void C3dParameters::read_record(std::size_t at, std::size_t limit) {
  const auto length = static_cast<std::size_t>(std::abs(words_.i8(at)));
  const int group = words_.i8(at + 1);
  const std::string name = upper(text_at(words_, at + 2, length));
  const std::size_t behind_name = at + 2 + length;
  end_ = std::max(end_, behind_name + 2);
  if (group < 0) {
    groups_.emplace(-group, name);
  } else {
    Parameter parameter;
    end_ = std::max(end_, read_data(behind_name + 2, limit, name, parameter));
    parameters_.emplace(std::pair(group, name), parameter);
  }
}

// Type, number of dimensions, dimensions, data. Returns where they end.
std::size_t C3dParameters::read_data(std::size_t at, std::size_t limit, const std::string& name,
                                     Parameter& p) {
  if (at + 2 > limit) words_.fail(at, "parameter '" + name + "' is cut off");
  p.type = words_.i8(at);
  if (p.type != -1 && p.type != 1 && p.type != 2 && p.type != 4) {
    words_.fail(at, "parameter '" + name + "' of type " + std::to_string(p.type) +
                        ", expected -1, 1, 2 or 4");
  }
  const std::size_t dimensions = words_.u8(at + 1);
  if (dimensions > 7 || at + 2 + dimensions > limit) {
    words_.fail(at + 1, "parameter '" + name + "' of " + std::to_string(dimensions) +
                            " dimensions, expected 0 to 7");
  }
  p.count = p.length = 1;
  for (std::size_t d = 0; d < dimensions; ++d) {
    const std::size_t size = words_.u8(at + 2 + d);
    if (d == 0) p.length = size;
    p.count *= size;  // at most 255⁷
  }
  p.at = at + 2 + dimensions;
  const std::size_t size = p.count * static_cast<std::size_t>(std::abs(p.type));
  if (size > limit - p.at) {
    words_.fail(at, "parameter '" + name + "' of " + std::to_string(size) + " bytes, expected " +
                        std::to_string(limit - p.at) + " or fewer before the end of the section");
  }
  return p.at + size;
}

const C3dParameters::Parameter* C3dParameters::find(const std::string& name) const {
  const std::size_t colon = name.find(':');
  for (const auto& [number, group] : groups_) {
    if (group != name.substr(0, colon)) continue;
    const auto found = parameters_.find({number, name.substr(colon + 1)});
    if (found != parameters_.end()) return &found->second;
  }
  return nullptr;
}

double C3dParameters::value(const Parameter& p, std::size_t index, bool is_unsigned) const {
  const std::size_t at = p.at + index * static_cast<std::size_t>(std::abs(p.type));
  if (p.type == 4) return words_.f32(at);
  if (p.type == 1) return words_.u8(at);
  if (is_unsigned) return words_.u16(at);
  return words_.i16(at);
}

std::optional<double> C3dParameters::number(const std::string& name) const {
  const Parameter* p = find(name);
  if (!p || p->count == 0 || p->type < 0) return std::nullopt;
  return value(*p, 0, false);
}

std::optional<double> C3dParameters::count(const std::string& name) const {
  const Parameter* p = find(name);
  if (!p || p->count == 0 || p->type < 0) return std::nullopt;
  return value(*p, 0, true);
}

std::vector<double> C3dParameters::numbers(const std::string& name, bool is_unsigned) const {
  std::vector<double> all;
  const Parameter* p = find(name);
  for (int part = 2; p && p->type > 0; p = find(name + std::to_string(part++))) {
    for (std::size_t i = 0; i < p->count; ++i) all.push_back(value(*p, i, is_unsigned));
  }
  return all;
}

std::vector<std::string> C3dParameters::texts(const std::string& name) const {
  std::vector<std::string> all;
  const Parameter* p = find(name);
  for (int part = 2; p && p->type == -1; p = find(name + std::to_string(part++))) {
    for (std::size_t at = 0; p->length > 0 && at + p->length <= p->count; at += p->length) {
      std::string text = text_at(words_, p->at + at, p->length);
      const std::size_t end = text.find_last_not_of(std::string(" \0\t", 3));
      text.resize(end == text.npos ? 0 : end + 1);
      all.push_back(std::move(text));
    }
  }
  return all;
}

}  // namespace mimesis::mocap
