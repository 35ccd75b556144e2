#include "tools/mimesis/log/field_text.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <limits>

namespace mimesis::tool {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

}  // namespace

std::string hex(std::string_view bytes, std::size_t from, std::size_t count,
                std::string_view separator) {
  std::string out;
  const std::size_t end = std::min(bytes.size(), from + std::min(count, bytes.size()));
  for (std::size_t i = from; i < end; ++i) {
    if (i > from) out += separator;
    out += fmt::format("{:02x}", static_cast<unsigned char>(bytes[i]));
  }
  return out;
}

std::string field_text(const Message& m, const FieldDescriptor& f, int i) {
  const Reflection& r = *m.GetReflection();
  const bool one = i == kWholeField;
  switch (f.cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return std::to_string(one ? r.GetInt32(m, &f) : r.GetRepeatedInt32(m, &f, i));
    case FieldDescriptor::CPPTYPE_INT64:
      return std::to_string(one ? r.GetInt64(m, &f) : r.GetRepeatedInt64(m, &f, i));
    case FieldDescriptor::CPPTYPE_UINT32:
      return std::to_string(one ? r.GetUInt32(m, &f) : r.GetRepeatedUInt32(m, &f, i));
    case FieldDescriptor::CPPTYPE_UINT64:
      return std::to_string(one ? r.GetUInt64(m, &f) : r.GetRepeatedUInt64(m, &f, i));
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return fmt::format("{}", one ? r.GetDouble(m, &f) : r.GetRepeatedDouble(m, &f, i));
    case FieldDescriptor::CPPTYPE_FLOAT:
      return fmt::format("{}", one ? r.GetFloat(m, &f) : r.GetRepeatedFloat(m, &f, i));
    case FieldDescriptor::CPPTYPE_BOOL:
      return (one ? r.GetBool(m, &f) : r.GetRepeatedBool(m, &f, i)) ? "true" : "false";
    case FieldDescriptor::CPPTYPE_ENUM:
      return (one ? r.GetEnum(m, &f) : r.GetRepeatedEnum(m, &f, i))->name();
    case FieldDescriptor::CPPTYPE_STRING: {
      std::string text = one ? r.GetString(m, &f) : r.GetRepeatedString(m, &f, i);
      return f.type() == FieldDescriptor::TYPE_BYTES ? hex(text, 0, text.size(), "") : text;
    }
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return (one ? r.GetMessage(m, &f) : r.GetRepeatedMessage(m, &f, i)).ShortDebugString();
  }
  return {};
}

double field_number(const Message& m, const FieldDescriptor& f, int i) {
  const Reflection& r = *m.GetReflection();
  const bool one = i == kWholeField;
  switch (f.cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return one ? r.GetInt32(m, &f) : r.GetRepeatedInt32(m, &f, i);
    case FieldDescriptor::CPPTYPE_INT64:
      return static_cast<double>(one ? r.GetInt64(m, &f) : r.GetRepeatedInt64(m, &f, i));
    case FieldDescriptor::CPPTYPE_UINT32:
      return one ? r.GetUInt32(m, &f) : r.GetRepeatedUInt32(m, &f, i);
    case FieldDescriptor::CPPTYPE_UINT64:
      return static_cast<double>(one ? r.GetUInt64(m, &f) : r.GetRepeatedUInt64(m, &f, i));
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return one ? r.GetDouble(m, &f) : r.GetRepeatedDouble(m, &f, i);
    case FieldDescriptor::CPPTYPE_FLOAT:
      return static_cast<double>(one ? r.GetFloat(m, &f) : r.GetRepeatedFloat(m, &f, i));
    case FieldDescriptor::CPPTYPE_BOOL:
      return (one ? r.GetBool(m, &f) : r.GetRepeatedBool(m, &f, i)) ? 1.0 : 0.0;
    case FieldDescriptor::CPPTYPE_ENUM:
      return one ? r.GetEnumValue(m, &f) : r.GetRepeatedEnumValue(m, &f, i);
    case FieldDescriptor::CPPTYPE_STRING:
    case FieldDescriptor::CPPTYPE_MESSAGE:
      break;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

bool is_number(const FieldDescriptor& f) {
  return f.cpp_type() != FieldDescriptor::CPPTYPE_STRING &&
         f.cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE;
}

}  // namespace mimesis::tool
