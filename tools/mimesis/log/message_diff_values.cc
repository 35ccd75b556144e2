#include "tools/mimesis/log/message_diff_values.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace mimesis::tool {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

constexpr std::size_t kShownBytes = 16;
constexpr std::size_t kShownText = 100;

std::string shortened(std::string text) {
  if (text.size() <= kShownText) return text;
  return text.substr(0, kShownText) + "...";
}

}  // namespace

FieldKind kind_of(const FieldDescriptor& f) {
  switch (f.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
    case FieldDescriptor::CPPTYPE_FLOAT:
      return FieldKind::floating;
    case FieldDescriptor::CPPTYPE_BOOL:
    case FieldDescriptor::CPPTYPE_ENUM:
      return FieldKind::other_number;
    case FieldDescriptor::CPPTYPE_STRING:
      return f.type() == FieldDescriptor::TYPE_BYTES ? FieldKind::bytes : FieldKind::text;
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return FieldKind::message;
    default:
      return FieldKind::integer;
  }
}

std::string FieldValue::text() const { return shortened(field_text(message, field, index)); }

// long double has at least 64 bits of mantissa where we run.
static_assert(std::numeric_limits<long double>::digits >= 64);
long double FieldValue::integer() const {
  const auto& r = *message.GetReflection();
  const bool one = index == kWholeField;
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT64:
      return static_cast<long double>(one ? r.GetInt64(message, &field)
                                          : r.GetRepeatedInt64(message, &field, index));
    case FieldDescriptor::CPPTYPE_UINT64:
      return static_cast<long double>(one ? r.GetUInt64(message, &field)
                                          : r.GetRepeatedUInt64(message, &field, index));
    default:
      return static_cast<long double>(number());
  }
}

std::string FieldValue::string() const {
  const auto& r = *message.GetReflection();
  return index == kWholeField ? r.GetString(message, &field)
                              : r.GetRepeatedString(message, &field, index);
}

const Message& FieldValue::inner() const {
  const auto& r = *message.GetReflection();
  return index == kWholeField ? r.GetMessage(message, &field)
                              : r.GetRepeatedMessage(message, &field, index);
}

double distance(double a, double b) {
  if (a == b || (std::isnan(a) && std::isnan(b))) return 0.0;
  const double d = std::abs(a - b);
  return std::isnan(d) ? std::numeric_limits<double>::infinity() : d;
}

FieldDifference byte_difference(std::string path, std::string_view a, std::string_view b) {
  const auto at = static_cast<std::size_t>(std::ranges::mismatch(a, b).in1 - a.begin());
  const auto side = [&](std::string_view bytes) {
    const std::string shown = hex(bytes, at, kShownBytes);
    return fmt::format("{} bytes, at {}: {}{}", bytes.size(), at, shown.empty() ? "end" : shown,
                       at + kShownBytes < bytes.size() ? " ..." : "");
  };
  return {std::move(path), side(a), side(b)};
}

FieldDifference text_difference(std::string path, const std::string& a, const std::string& b) {
  const auto at = static_cast<std::size_t>(std::ranges::mismatch(a, b).in1 - a.begin());
  const std::size_t from = at < kShownText / 2 ? 0 : at - kShownText / 4;
  const auto side = [&](const std::string& s) {
    return (from > 0 ? "...\"" : "\"") + shortened(s.substr(std::min(from, s.size()))) + "\"";
  };
  return {std::move(path), side(a), side(b)};
}

}  // namespace mimesis::tool
