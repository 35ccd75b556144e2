#include "tools/mimesis/log/message_difference.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <algorithm>
#include <cmath>

#include "tools/mimesis/message_json.h"

namespace mimesis::tool {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;
using Json = nlohmann::ordered_json;

constexpr int kWhole = -1;                // not an element of a repeated field
constexpr std::size_t kFieldsKept = 100;  // of an array, the first hundred say enough

/// One comparison of two messages.
struct Walk {
  double tolerance;
  const std::set<std::string>& ignored;
  MessageDifference found;
  std::vector<std::pair<std::string, double>> tolerated = {};  ///< field without indices, |a - b|
  bool passed = false;                                         ///< something was not compared

  void messages(const Message& a, const Message& b, const std::string& path,
                const std::string& pattern);
  void field(const Message& a, const Message& b, const FieldDescriptor& f, const std::string& path,
             const std::string& pattern);
  void value(const Message& a, const Message& b, const FieldDescriptor& f, int i,
             const std::string& path, const std::string& pattern);
  void number(double a, double b, const Message& of_a, const Message& of_b,
              const FieldDescriptor& f, int i, const std::string& path, const std::string& pattern);
  void bytes(const std::string& a, const std::string& b, const std::string& path);
  void differs(const std::string& path, Json a, Json b) {
    if (++found.field_count <= kFieldsKept) {
      found.fields.push_back({path, std::move(a), std::move(b)});
    }
  }
};

Json json_of(const Message& m, const FieldDescriptor& f, int i) {
  return field_json(m, i == kWhole ? f.name() : f.name() + "." + std::to_string(i));
}

Json presence(const Message& m, const FieldDescriptor& f) {
  return m.GetReflection()->HasField(m, &f) ? field_json(m, f.name()) : Json(nullptr);
}

std::string text_of(const Message& m, const FieldDescriptor& f, int i) {
  const Reflection& r = *m.GetReflection();
  return i == kWhole ? r.GetString(m, &f) : r.GetRepeatedString(m, &f, i);
}

double number_of(const Message& m, const FieldDescriptor& f, int i) {
  const Reflection& r = *m.GetReflection();
  if (f.cpp_type() == FieldDescriptor::CPPTYPE_FLOAT) {
    return static_cast<double>(i == kWhole ? r.GetFloat(m, &f) : r.GetRepeatedFloat(m, &f, i));
  }
  return i == kWhole ? r.GetDouble(m, &f) : r.GetRepeatedDouble(m, &f, i);
}

void Walk::messages(const Message& a, const Message& b, const std::string& path,
                    const std::string& pattern) {
  for (int i = 0; i < a.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor& f = *a.GetDescriptor()->field(i);
    if (ignored.contains(f.full_name())) {
      passed = true;
      continue;
    }
    field(a, b, f, path + f.name(), pattern + f.name());
  }
}

void Walk::field(const Message& a, const Message& b, const FieldDescriptor& f,
                 const std::string& path, const std::string& pattern) {
  if (!f.is_repeated()) {
    const bool in_a = a.GetReflection()->HasField(a, &f), in_b = b.GetReflection()->HasField(b, &f);
    if (f.has_presence() && in_a != in_b) return differs(path, presence(a, f), presence(b, f));
    if (in_a || in_b) value(a, b, f, kWhole, path, pattern);
    return;
  }
  const int size_a = a.GetReflection()->FieldSize(a, &f);
  const int size_b = b.GetReflection()->FieldSize(b, &f);
  if (size_a != size_b) differs(path, {{"elements", size_a}}, {{"elements", size_b}});
  for (int i = 0; i < std::min(size_a, size_b); ++i) {
    value(a, b, f, i, path + "." + std::to_string(i), pattern + ".*");
  }
}

void Walk::value(const Message& a, const Message& b, const FieldDescriptor& f, int i,
                 const std::string& path, const std::string& pattern) {
  const Reflection &ra = *a.GetReflection(), &rb = *b.GetReflection();
  switch (f.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return messages(i == kWhole ? ra.GetMessage(a, &f) : ra.GetRepeatedMessage(a, &f, i),
                      i == kWhole ? rb.GetMessage(b, &f) : rb.GetRepeatedMessage(b, &f, i),
                      path + ".", pattern + ".");
    case FieldDescriptor::CPPTYPE_STRING: {
      const std::string text_a = text_of(a, f, i), text_b = text_of(b, f, i);
      if (text_a == text_b) return;
      if (f.type() == FieldDescriptor::TYPE_BYTES) return bytes(text_a, text_b, path);
      return differs(path, text_a, text_b);
    }
    case FieldDescriptor::CPPTYPE_FLOAT:
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return number(number_of(a, f, i), number_of(b, f, i), a, b, f, i, path, pattern);
    default: {
      const Json of_a = json_of(a, f, i), of_b = json_of(b, f, i);
      if (of_a != of_b) differs(path, of_a, of_b);
    }
  }
}

void Walk::number(double a, double b, const Message& of_a, const Message& of_b,
                  const FieldDescriptor& f, int i, const std::string& path,
                  const std::string& pattern) {
  if ((a == b && std::signbit(a) == std::signbit(b)) || (std::isnan(a) && std::isnan(b))) return;
  const double distance = std::abs(a - b);
  if (tolerance > 0.0 && distance <= tolerance * std::max({1.0, std::abs(a), std::abs(b)})) {
    tolerated.emplace_back(pattern, distance);
    return;
  }
  differs(path, json_of(of_a, f, i), json_of(of_b, f, i));
}

void Walk::bytes(const std::string& a, const std::string& b, const std::string& path) {
  const std::size_t at = first_difference(a, b);
  const auto shown = [at](const std::string& text) {
    Json object{{"bytes", text.size()}, {"differs_at", at}};
    if (at < text.size()) object["byte"] = static_cast<unsigned char>(text[at]);
    return object;
  };
  differs(path, shown(a), shown(b));
}

}  // namespace

std::size_t first_difference(std::string_view a, std::string_view b) {
  return static_cast<std::size_t>(std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first -
                                  a.begin());
}

MessageComparison::MessageComparison(double tolerance, std::set<std::string> ignored)
    : tolerance_(tolerance), ignored_(std::move(ignored)) {}

std::optional<MessageDifference> MessageComparison::compare(const std::string& topic,
                                                            const std::string& type,
                                                            const std::string& descriptors,
                                                            std::string_view first,
                                                            std::string_view second) {
  if (first == second) return std::nullopt;
  MessageDifference unread;
  unread.offset = first_difference(first, second);
  const auto a = types_.make(type, descriptors), b = types_.make(type, descriptors);
  if (a == nullptr || !a->ParseFromArray(first.data(), static_cast<int>(first.size())) ||
      !b->ParseFromArray(second.data(), static_cast<int>(second.size()))) {
    return unread;
  }
  Walk walk{tolerance_, ignored_, unread};
  walk.messages(*a, *b, "", "");
  for (const auto& [field, distance] : walk.tolerated) {
    double& worst = tolerated_[{topic, field}];
    worst = std::max(worst, distance);
  }
  if (walk.found.field_count > 0) return walk.found;
  // Bytes that differ though all fields are equal (an unknown field) are a difference, unless
  // something was let pass on purpose.
  const bool let_pass = walk.passed || !walk.tolerated.empty();
  return let_pass ? std::nullopt : std::optional(walk.found);
}

}  // namespace mimesis::tool
