#include "tools/mimesis/message_json.h"

#include <google/protobuf/descriptor.h>

#include <cctype>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/runtime/value_text.h"
#include "tools/mimesis/field_text.h"

namespace mimesis::tool {
namespace {

using google::protobuf::EnumValueDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;
using Json = nlohmann::ordered_json;

/// A field, or element `index` of a repeated one; enum values by name or as short `words`.
Json value(const Message& m, const FieldDescriptor& f, int index, bool words) {
  const Reflection& r = *m.GetReflection();
  if (!words || f.enum_type() == nullptr) {
    std::string text;
    JsonText(text, BytesText::length).value(m, f, index);
    return Json::parse(text);
  }
  if (!f.is_repeated()) return short_word(*r.GetEnum(m, &f));
  if (index != kWholeField) return short_word(*r.GetRepeatedEnum(m, &f, index));
  Json list = Json::array();
  for (int i = 0; i < r.FieldSize(m, &f); ++i) list.push_back(value(m, f, i, words));
  return list;
}

Json at_path(const Message& m, const std::string& path, bool words) {
  const std::size_t dot = path.find('.');
  const std::string name = path.substr(0, dot);
  const FieldDescriptor* f = &field_named(*m.GetDescriptor(), name);
  const bool optional = f->has_presence() && f->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE;
  if (optional && !m.GetReflection()->HasField(m, f)) return nullptr;
  if (dot == std::string::npos) return value(m, *f, kWholeField, words);
  std::string rest = path.substr(dot + 1);
  const Reflection& r = *m.GetReflection();
  int index = kWholeField;
  if (f->is_repeated()) {
    const std::size_t next = rest.find('.');
    const auto number = runtime::to_int(rest.substr(0, next));
    if (!number || *number < 0) throw ConfigError(path + ": expected an index after " + name);
    if (*number >= r.FieldSize(m, f)) return nullptr;
    index = *number;
    if (next == std::string::npos) return value(m, *f, index, words);
    rest = rest.substr(next + 1);
  }
  if (f->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) {
    throw ConfigError(path + ": " + name + " of " + m.GetTypeName() + " has no fields");
  }
  return at_path(index == kWholeField ? r.GetMessage(m, f) : r.GetRepeatedMessage(m, f, index),
                 rest, words);
}

}  // namespace

Json to_json(const Message& message) {
  std::string text;
  JsonText(text, BytesText::length).message(message);
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

Json field_json(const Message& message, const std::string& path) {
  return at_path(message, path, /*words=*/false);
}

Json field_word(const Message& message, const std::string& path) {
  return at_path(message, path, /*words=*/true);
}

}  // namespace mimesis::tool
