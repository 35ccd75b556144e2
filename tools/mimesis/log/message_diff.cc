#include "tools/mimesis/log/message_diff.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/unknown_field_set.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

#include "tools/mimesis/field_text.h"

namespace mimesis::tool {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

constexpr std::size_t kShownText = 100;

/// Fields of one kind can be compared for any wire type.
enum class FieldKind { floating, integer, other_number, text, bytes, message };

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

std::string shortened(std::string text) {
  if (text.size() <= kShownText) return text;
  return text.substr(0, kShownText) + "...";
}

/// One side of a comparison: a field that is not repeated, or an element of one that is.
struct FieldValue {
  const Message& message;
  const FieldDescriptor& field;
  int index = kWholeField;

  std::string text() const { return shortened(field_text(message, field, index)); }
  double number() const { return field_number(message, field, index); }
  /// Integer of any width, without loss: long double has at least 64 bits of mantissa on our
  /// platforms.
  long double integer() const {
    static_assert(std::numeric_limits<long double>::digits >= 64);
    return with_field_value(message, field, index, [](const auto& v) {
      if constexpr (std::is_arithmetic_v<std::decay_t<decltype(v)>>) {
        return static_cast<long double>(v);
      } else {
        return 0.0L;
      }
    });
  }
  std::string string() const {
    const auto& r = *message.GetReflection();
    return index == kWholeField ? r.GetString(message, &field)
                                : r.GetRepeatedString(message, &field, index);
  }
  const Message& inner() const {
    const auto& r = *message.GetReflection();
    return index == kWholeField ? r.GetMessage(message, &field)
                                : r.GetRepeatedMessage(message, &field, index);
  }
};

/// |a - b|, 0 for equal ones, infinite if they cannot be subtracted.
double distance_of(double a, double b) {
  if (a == b || (std::isnan(a) && std::isnan(b))) return 0.0;
  const double d = std::abs(a - b);
  return std::isnan(d) ? std::numeric_limits<double>::infinity() : d;
}

/// Both sides quoted; long ones from shortly before the first character that differs.
FieldDifference text_difference(std::string path, const std::string& a, const std::string& b) {
  const auto at = static_cast<std::size_t>(std::ranges::mismatch(a, b).in1 - a.begin());
  const std::size_t from = at < kShownText / 2 ? 0 : at - kShownText / 4;
  const auto side = [&](const std::string& s) {
    return (from > 0 ? "...\"" : "\"") + shortened(s.substr(std::min(from, s.size()))) + "\"";
  };
  return {std::move(path), side(a), side(b)};
}

class MessageComparison {
 public:
  MessageComparison(const DiffRules& rules, WorstDifferences* worst)
      : rules_(rules), worst_(worst) {}

  void messages(const Message& a, const Message& b) {
    const auto& type_a = *a.GetDescriptor();
    const auto& type_b = *b.GetDescriptor();
    for (int i = 0; i < type_a.field_count(); ++i) {
      const FieldDescriptor& f = *type_a.field(i);
      const FieldDescriptor* in_b = same_field(f, type_b);
      enter(f.name(), true, [&] { in_b != nullptr ? fields(a, f, b, *in_b) : only(a, f, true); });
    }
    for (int i = 0; i < type_b.field_count(); ++i) {
      const FieldDescriptor& f = *type_b.field(i);
      if (same_field(f, type_a) == nullptr) {
        enter(f.name(), true, [&] { only(b, f, false); });
      }
    }
    unknown_fields(a, b);
  }

  MessageDifference result;

 private:
  const FieldDescriptor* same_field(const FieldDescriptor& f,
                                    const google::protobuf::Descriptor& type) const {
    return rules_.across_versions ? type.FindFieldByNumber(f.number())
                                  : type.FindFieldByName(f.name());
  }

  /// Runs `compare` one level down, unless the field is ignored.
  template <class Compare>
  void enter(const std::string& name, bool is_field, const Compare& compare) {
    const std::size_t path_size = path_.size(), field_size = field_.size();
    const double tolerance = tolerance_;
    const bool given = tolerance_given_;
    path_ += (path_.empty() ? "" : ".") + name;
    if (is_field) field_ += (field_.empty() ? "" : ".") + name;
    for (const std::string* key : {&field_, &path_}) {
      const auto it = rules_.field_tolerance.find(*key);
      if (it == rules_.field_tolerance.end()) continue;
      tolerance_ = it->second;
      tolerance_given_ = true;
    }
    if (!rules_.ignore.contains(path_) && !rules_.ignore.contains(field_)) compare();
    path_.resize(path_size);
    field_.resize(field_size);
    tolerance_ = tolerance;
    tolerance_given_ = given;
  }

  void differ(FieldDifference difference) {
    if (result.count++ < rules_.limit) result.fields.push_back(std::move(difference));
  }

  static std::string whole_text(const Message& m, const FieldDescriptor& f) {
    if (f.is_repeated()) return fmt::format("{} elements", m.GetReflection()->FieldSize(m, &f));
    return f.has_presence() && !m.GetReflection()->HasField(m, &f) ? "unset"
                                                                   : FieldValue{m, f}.text();
  }

  void only(const Message& m, const FieldDescriptor& f, bool in_a) {
    if (rules_.across_versions) return;
    const auto& r = *m.GetReflection();
    if (f.is_repeated() ? r.FieldSize(m, &f) == 0 : !r.HasField(m, &f)) return;
    const std::string text = whole_text(m, f), none = "no such field";
    differ({path_, in_a ? text : none, in_a ? none : text});
  }

  void fields(const Message& a, const FieldDescriptor& fa, const Message& b,
              const FieldDescriptor& fb) {
    if (kind_of(fa) != kind_of(fb) || fa.is_repeated() != fb.is_repeated()) {
      differ({path_, std::string(fa.type_name()) + " " + whole_text(a, fa),
              std::string(fb.type_name()) + " " + whole_text(b, fb)});
    } else if (fa.is_map() && fb.is_map()) {
      maps(a, fa, b, fb);
    } else if (fa.is_repeated()) {
      elements(a, fa, b, fb);
    } else {
      const bool set_a = !fa.has_presence() || a.GetReflection()->HasField(a, &fa);
      const bool set_b = !fb.has_presence() || b.GetReflection()->HasField(b, &fb);
      if (set_a != set_b) {
        differ({path_, whole_text(a, fa), whole_text(b, fb)});
      } else if (set_a) {
        values({a, fa}, {b, fb});
      }
    }
  }

  void elements(const Message& a, const FieldDescriptor& fa, const Message& b,
                const FieldDescriptor& fb) {
    const int size_a = a.GetReflection()->FieldSize(a, &fa);
    const int size_b = b.GetReflection()->FieldSize(b, &fb);
    if (size_a != size_b) differ({path_, whole_text(a, fa), whole_text(b, fb)});
    for (int i = 0; i < std::min(size_a, size_b); ++i) {
      enter(std::to_string(i), false, [&] { values({a, fa, i}, {b, fb, i}); });
    }
  }

  static std::map<std::string, const Message*> entries(const Message& m, const FieldDescriptor& f) {
    std::map<std::string, const Message*> by_key;
    for (int i = 0; i < m.GetReflection()->FieldSize(m, &f); ++i) {
      const Message& entry = m.GetReflection()->GetRepeatedMessage(m, &f, i);
      by_key[field_text(entry, *f.message_type()->map_key())] = &entry;
    }
    return by_key;
  }

  void maps(const Message& a, const FieldDescriptor& fa, const Message& b,
            const FieldDescriptor& fb) {
    const auto in_a = entries(a, fa), in_b = entries(b, fb);
    const FieldDescriptor& value_a = *fa.message_type()->map_value();
    const FieldDescriptor& value_b = *fb.message_type()->map_value();
    for (const auto& [key, entry] : in_a) {
      const auto other = in_b.find(key);
      enter(key, false, [&, entry = entry] {
        if (other == in_b.end())
          return differ({path_, FieldValue{*entry, value_a}.text(), "no entry"});
        fields(*entry, value_a, *other->second, value_b);
      });
    }
    for (const auto& [key, entry] : in_b) {
      if (in_a.contains(key)) continue;
      enter(key, false, [&, entry = entry] {
        differ({path_, "no entry", FieldValue{*entry, value_b}.text()});
      });
    }
  }

  void values(const FieldValue& a, const FieldValue& b) {
    switch (kind_of(a.field)) {
      case FieldKind::floating: {
        const double x = a.number(), y = b.number();
        const bool same = rules_.exact
                              ? std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y)
                              : distance_of(x, y) == 0.0;
        if (!same) numbers(a, b, distance_of(x, y), rules_.exact ? -1.0 : tolerance_);
        break;
      }
      case FieldKind::integer: {
        const auto d = static_cast<double>(std::abs(a.integer() - b.integer()));
        if (d > 0.0) numbers(a, b, d, tolerance_given_ ? tolerance_ : 0.0);
        break;
      }
      case FieldKind::other_number:
        if (a.number() != b.number()) differ({path_, a.text(), b.text()});
        break;
      case FieldKind::text:
        if (a.string() != b.string()) differ(text_difference(path_, a.string(), b.string()));
        break;
      case FieldKind::bytes:
        if (a.string() != b.string()) differ(byte_difference(path_, a.string(), b.string()));
        break;
      case FieldKind::message:
        messages(a.inner(), b.inner());
        break;
    }
  }

  void numbers(const FieldValue& a, const FieldValue& b, double difference, double tolerance) {
    if (worst_ != nullptr) {
      const auto [it, first] = worst_->try_emplace(field_);
      if (first || difference > it->second.difference) {
        it->second = {difference, path_, a.text(), b.text()};
      }
    }
    if (difference > tolerance) differ({path_, a.text(), b.text()});
  }

  void unknown_fields(const Message& a, const Message& b) {
    const auto bytes = [](const Message& m) {
      std::string out;
      const auto& unknown = m.GetReflection()->GetUnknownFields(m);
      if (!unknown.empty()) unknown.SerializeToString(&out);
      return out;
    };
    const std::string in_a = bytes(a), in_b = bytes(b);
    if (in_a == in_b) return;
    enter("(unknown fields)", true, [&] { differ(byte_difference(path_, in_a, in_b)); });
  }

  const DiffRules& rules_;
  WorstDifferences* worst_;
  std::string path_, field_;  ///< with and without indexes
  double tolerance_ = rules_.tolerance;
  bool tolerance_given_ = false;  ///< for this field or one above it
};

}  // namespace

FieldDifference byte_difference(std::string path, std::string_view a, std::string_view b,
                                const char* more) {
  constexpr std::size_t kShownBytes = 16;  // a CAN frame
  const auto at = static_cast<std::size_t>(std::ranges::mismatch(a, b).in1 - a.begin());
  const auto side = [&](std::string_view bytes) {
    const std::string shown = hex(bytes, at, kShownBytes);
    return fmt::format("{} bytes, at {}: {}{}", bytes.size(), at, shown.empty() ? "end" : shown,
                       at + kShownBytes < bytes.size() ? more : "");
  };
  return {std::move(path), side(a), side(b)};
}

MessageDifference diff_messages(const Message& a, const Message& b, const DiffRules& rules,
                                WorstDifferences* worst) {
  MessageComparison comparison(rules, worst);
  comparison.messages(a, b);
  return std::move(comparison.result);
}

std::unique_ptr<Message> PayloadDiff::decode(const Payload& payload) {
  if (payload.schema == nullptr) return nullptr;
  if (cdr::RosType::reads(payload.schema->encoding)) {
    const LogType* type = ros_.type(*payload.schema);
    if (type == nullptr || !type->read(payload.bytes).empty()) return nullptr;
    std::unique_ptr<Message> message(type->message().New());
    message->CopyFrom(type->message());
    return message;
  }
  if (payload.schema->encoding != "protobuf") return nullptr;
  auto message = types_.make(payload.schema->name, payload.schema->data);
  return message && parse(payload.bytes, *message) ? std::move(message) : nullptr;
}

MessageDifference PayloadDiff::diff(const Payload& a, const Payload& b, const DiffRules& rules,
                                    WorstDifferences* worst) {
  if (a.bytes == b.bytes) return {};
  const auto in_a = decode(a), in_b = decode(b);
  MessageDifference difference;
  if (in_a && in_b) difference = diff_messages(*in_a, *in_b, rules, worst);
  const bool must_be_same_bytes =
      rules.exact && !rules.across_versions && rules.ignore.empty() && difference.equal();
  if (!in_a || !in_b || must_be_same_bytes) return {{byte_difference("", a.bytes, b.bytes)}, 1};
  return difference;
}

}  // namespace mimesis::tool
