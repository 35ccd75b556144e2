#include "tools/mimesis/message_json.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <cctype>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/runtime/value_text.h"

namespace mimesis::tool {
namespace {

using google::protobuf::EnumValueDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;
using Json = nlohmann::ordered_json;
using EnumText = Json (*)(const EnumValueDescriptor&);

constexpr int kWhole = -1;  ///< not an element of a repeated field

Json full_name(const EnumValueDescriptor& value) { return value.name(); }

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

/// Shortest decimal that reads back as the same float: 0.1, not 0.10000000149011612.
Json short_number(float value) {
  if (!std::isfinite(value)) return nullptr;
  return std::strtod(fmt::format("{}", value).c_str(), nullptr);
}

/// One value: of a singular field (index kWhole), or element `i` of a repeated one.
Json scalar(const Message& m, const FieldDescriptor& f, int i, EnumText enum_text) {
  const Reflection& r = *m.GetReflection();
  const bool one = i == kWhole;
  switch (f.cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return one ? r.GetInt32(m, &f) : r.GetRepeatedInt32(m, &f, i);
    case FieldDescriptor::CPPTYPE_INT64:
      return one ? r.GetInt64(m, &f) : r.GetRepeatedInt64(m, &f, i);
    case FieldDescriptor::CPPTYPE_UINT32:
      return one ? r.GetUInt32(m, &f) : r.GetRepeatedUInt32(m, &f, i);
    case FieldDescriptor::CPPTYPE_UINT64:
      return one ? r.GetUInt64(m, &f) : r.GetRepeatedUInt64(m, &f, i);
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return number(one ? r.GetDouble(m, &f) : r.GetRepeatedDouble(m, &f, i));
    case FieldDescriptor::CPPTYPE_FLOAT:
      return short_number(one ? r.GetFloat(m, &f) : r.GetRepeatedFloat(m, &f, i));
    case FieldDescriptor::CPPTYPE_BOOL:
      return one ? r.GetBool(m, &f) : r.GetRepeatedBool(m, &f, i);
    case FieldDescriptor::CPPTYPE_ENUM:
      return enum_text(*(one ? r.GetEnum(m, &f) : r.GetRepeatedEnum(m, &f, i)));
    case FieldDescriptor::CPPTYPE_STRING: {
      std::string text = one ? r.GetString(m, &f) : r.GetRepeatedString(m, &f, i);
      if (f.type() == FieldDescriptor::TYPE_BYTES) return {{"bytes", text.size()}};
      return text;
    }
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return to_json(one ? r.GetMessage(m, &f) : r.GetRepeatedMessage(m, &f, i));
  }
  return nullptr;
}

Json value(const Message& m, const FieldDescriptor& f, EnumText enum_text) {
  if (!f.is_repeated()) return scalar(m, f, kWhole, enum_text);
  Json list = Json::array();
  for (int i = 0; i < m.GetReflection()->FieldSize(m, &f); ++i)
    list.push_back(scalar(m, f, i, enum_text));
  return list;
}

Json at_path(const Message& m, const std::string& path, EnumText enum_text) {
  const std::size_t dot = path.find('.');
  const std::string name = path.substr(0, dot);
  const FieldDescriptor* f = m.GetDescriptor()->FindFieldByName(name);
  if (f == nullptr) {
    std::vector<std::string> known;
    for (int i = 0; i < m.GetDescriptor()->field_count(); ++i) {
      known.push_back(m.GetDescriptor()->field(i)->name());
    }
    throw ConfigError(m.GetTypeName() + " has no field '" + name + "'" +
                      runtime::did_you_mean(name, known));
  }
  const bool optional = f->has_presence() && f->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE;
  if (optional && !m.GetReflection()->HasField(m, f)) return nullptr;
  if (dot == std::string::npos) return value(m, *f, enum_text);
  std::string rest = path.substr(dot + 1);
  const Reflection& r = *m.GetReflection();
  int index = kWhole;
  if (f->is_repeated()) {
    const std::size_t next = rest.find('.');
    const auto number = runtime::to_int(rest.substr(0, next));
    if (!number || *number < 0) throw ConfigError(path + ": expected an index after " + name);
    if (*number >= r.FieldSize(m, f)) return nullptr;
    index = *number;
    if (next == std::string::npos) return scalar(m, *f, index, enum_text);
    rest = rest.substr(next + 1);
  }
  if (f->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) {
    throw ConfigError(path + ": " + name + " of " + m.GetTypeName() + " has no fields");
  }
  return at_path(index == kWhole ? r.GetMessage(m, f) : r.GetRepeatedMessage(m, f, index), rest,
                 enum_text);
}

}  // namespace

Json to_json(const Message& message) {
  Json object = Json::object();
  const auto* type = message.GetDescriptor();
  for (int i = 0; i < type->field_count(); ++i) {
    const FieldDescriptor& f = *type->field(i);
    if (f.has_presence() && !message.GetReflection()->HasField(message, &f)) continue;
    object[f.name()] = value(message, f, full_name);
  }
  return object;
}

Json short_word(const EnumValueDescriptor& value) {
  std::string prefix;  // of the enum's values: TaskState -> task_state_
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

Json field_json(const Message& message, const std::string& path) {
  return at_path(message, path, full_name);
}

Json field_word(const Message& message, const std::string& path) {
  return at_path(message, path, short_word);
}

}  // namespace mimesis::tool
