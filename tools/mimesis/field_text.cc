#include "tools/mimesis/field_text.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/stubs/strutil.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/runtime/value_text.h"

namespace mimesis::tool {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::EnumValueDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using Json = nlohmann::ordered_json;

}  // namespace

std::string hex(std::string_view bytes, std::size_t from, std::size_t count,
                std::string_view separator) {
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  from = std::min(from, bytes.size());
  return fmt::format(
      "{:02x}",
      fmt::join(data + from, data + from + std::min(count, bytes.size() - from), separator));
}

std::string field_text(const Message& m, const FieldDescriptor& f, int i) {
  return with_field_value(m, f, i, [&f](const auto& value) -> std::string {
    using Value = std::decay_t<decltype(value)>;
    if constexpr (std::is_same_v<Value, bool>) {
      return value ? "true" : "false";
    } else if constexpr (std::is_arithmetic_v<Value>) {
      return fmt::format("{}", value);
    } else if constexpr (std::is_same_v<Value, EnumValueDescriptor>) {
      return value.name();
    } else if constexpr (std::is_same_v<Value, std::string>) {
      return f.type() == FieldDescriptor::TYPE_BYTES ? hex(value, 0, value.size(), "") : value;
    } else {
      return value.ShortDebugString();
    }
  });
}

double field_number(const Message& m, const FieldDescriptor& f, int i) {
  return with_field_value(m, f, i, [](const auto& value) -> double {
    using Value = std::decay_t<decltype(value)>;
    if constexpr (std::is_arithmetic_v<Value>) {
      return static_cast<double>(value);
    } else if constexpr (std::is_same_v<Value, EnumValueDescriptor>) {
      return value.number();
    } else {
      return std::numeric_limits<double>::quiet_NaN();
    }
  });
}

const FieldDescriptor& field_named(const Descriptor& type, const std::string& name,
                                   const std::string& where) {
  if (const FieldDescriptor* f = type.FindFieldByName(name)) return *f;
  std::vector<std::string> known;
  for (int i = 0; i < type.field_count(); ++i) known.push_back(type.field(i)->name());
  throw ConfigError(where + type.full_name() + " has no field '" + name + "'" +
                    runtime::did_you_mean(name, known));
}

bool is_number(const FieldDescriptor& f) {
  return f.cpp_type() != FieldDescriptor::CPPTYPE_STRING &&
         f.cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE;
}

/// Shortest decimal that reads back as the same number; always recognisable as a float.
template <class Float>
void JsonText::floating(Float value) {
  if (!std::isfinite(value)) return raw("null");
  char text[40];
  const char* end = std::to_chars(text, text + sizeof text, value).ptr;
  const std::string_view digits(text, static_cast<std::size_t>(end - text));
  out_ += digits;
  if (digits.find_first_of(".e") == std::string_view::npos) out_ += ".0";
}

void JsonText::string(std::string_view text) {
  out_ += Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

void JsonText::bytes(std::string_view data) {
  if (bytes_ == BytesText::length) {
    raw("{\"bytes\":");
    integer(data.size());
    return raw("}");
  }
  std::string text;
  if (bytes_ == BytesText::base64) {
    google::protobuf::Base64Escape(google::protobuf::StringPiece(data.data(), data.size()), &text);
  } else {
    text = hex(data, 0, data.size(), "");
  }
  out_ += '"' + text + '"';
}

/// One value: of a singular field (index kWholeField), or element `i` of a repeated one.
void JsonText::scalar(const Message& m, const FieldDescriptor& f, int i) {
  with_field_value(m, f, i, [&](const auto& v) {
    using Value = std::decay_t<decltype(v)>;
    if constexpr (std::is_same_v<Value, bool>) {
      raw(v ? "true" : "false");
    } else if constexpr (std::is_integral_v<Value>) {
      integer(v);
    } else if constexpr (std::is_floating_point_v<Value>) {
      floating(v);
    } else if constexpr (std::is_same_v<Value, EnumValueDescriptor>) {
      words_ ? raw(short_word(v).dump()) : string(v.name());
    } else if constexpr (std::is_same_v<Value, std::string>) {
      f.type() == FieldDescriptor::TYPE_BYTES ? bytes(v) : string(v);
    } else {
      message(v);
    }
  });
}

void JsonText::value(const Message& m, const FieldDescriptor& f, int index) {
  if (!f.is_repeated() || index != kWholeField) return scalar(m, f, index);
  out_ += '[';
  const int size = m.GetReflection()->FieldSize(m, &f);
  for (int i = 0; i < size; ++i) {
    if (i > 0) out_ += ',';
    scalar(m, f, i);
  }
  out_ += ']';
}

void JsonText::message(const Message& message) {
  const Descriptor& type = *message.GetDescriptor();
  const auto& reflection = *message.GetReflection();
  bool first = true;
  out_ += '{';
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor& f = *type.field(i);
    if (f.has_presence() && !reflection.HasField(message, &f)) continue;
    if (!first) out_ += ',';
    first = false;
    out_ += '"';
    out_ += f.name();
    out_ += "\":";
    value(message, f);
  }
  out_ += '}';
}

void JsonText::field(const Message& message, const FieldPath& path) {
  const Message* m = &message;
  for (std::size_t k = 0; k < path.steps_.size(); ++k) {
    const auto& [f, index] = path.steps_[k];
    const auto& r = *m->GetReflection();
    if (index != kWholeField && index >= r.FieldSize(*m, f)) return raw("null");
    if (k + 1 == path.steps_.size()) {
      const bool unset =
          unset_is_null_ && f->has_presence() && f->message_type() == nullptr && !r.HasField(*m, f);
      return unset ? raw("null") : value(*m, *f, index);
    }
    m = index == kWholeField ? &r.GetMessage(*m, f) : &r.GetRepeatedMessage(*m, f, index);
  }
}

FieldPath::FieldPath(const Descriptor& type, const std::string& path) : text_(path) {
  const Descriptor* at = &type;
  for (std::size_t start = 0; start <= path.size();) {
    const auto word = [&] {
      const std::size_t dot = std::min(path.find('.', start), path.size());
      std::string text = path.substr(start, dot - start);
      start = dot + 1;
      return text;
    };
    const std::string name = word();
    if (at == nullptr) {
      const FieldDescriptor& last = *steps_.back().field;
      throw ConfigError(path + ": " + last.name() + " of " + last.containing_type()->full_name() +
                        " has no fields");
    }
    const FieldDescriptor* f = &field_named(*at, name);
    int index = kWholeField;
    if (f->is_repeated() && start <= path.size()) {
      const auto number = runtime::to_int(word());
      if (!number || *number < 0) throw ConfigError(path + ": expected an index after " + name);
      index = *number;
    }
    steps_.push_back({f, index});
    at = f->message_type();
  }
}

Json to_json(const Message& message, BytesText bytes) {
  std::string text;
  JsonText(text, bytes).message(message);
  return Json::parse(text);
}

Json short_word(const EnumValueDescriptor& value) {
  std::string prefix;  // prefix of the enum's values: TaskState -> task_state_
  for (const char c : value.type()->name()) {
    if (std::isupper(static_cast<unsigned char>(c)) != 0 && !prefix.empty()) prefix += '_';
    prefix += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  prefix += '_';
  std::string word;
  for (const char c : value.name())
    word += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (word.starts_with(prefix)) word.erase(0, prefix.size());
  if (word == "unspecified") return nullptr;
  return word;
}

Json field_json(const Message& message, const std::string& path, bool words) {
  const FieldPath at(*message.GetDescriptor(), path);
  std::string text;
  JsonText(text, BytesText::length, words && at.leaf().enum_type() != nullptr, true)
      .field(message, at);
  return Json::parse(text);
}

void from_json(const std::string& json, const std::string& what,
               google::protobuf::Message& message) {
  // The type may be a dynamic one: Protobuf resolves it in the message's own pool.
  const auto status = google::protobuf::util::JsonStringToMessage(json, &message);
  if (status.ok()) return;
  std::string why(status.message());
  if (json.find("{\"bytes\":") != std::string::npos) {
    why += "; bytes are text in base64 (topic echo --bytes base64)";
  }
  throw ConfigError(what + ": " + message.GetDescriptor()->full_name() + ": " + why);
}

}  // namespace mimesis::tool
