#include "tools/mimesis/log/json_text.h"

#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>

#include "common/error.h"
#include "common/runtime/suggest.h"
#include "common/runtime/value_text.h"

namespace mimesis::tool {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

constexpr int kWhole = -1;  ///< not an element of a repeated field
constexpr std::string_view kHex = "0123456789abcdef";
constexpr std::string_view kBase64 =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

unsigned byte_at(std::string_view text, std::size_t i) {
  return static_cast<unsigned char>(text[i]);
}

/// Length of the UTF-8 sequence at `i`; 0 if it is none.
std::size_t utf8_length(std::string_view text, std::size_t i) {
  const unsigned first = byte_at(text, i);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xC2 && first < 0xE0   ? 2
                             : first >= 0xE0 && first < 0xF0 ? 3
                             : first >= 0xF0 && first < 0xF5 ? 4
                                                             : 0;
  if (length == 0 || i + length > text.size()) return 0;
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte_at(text, i + k) & 0xC0) != 0x80) return 0;
  }
  const unsigned second = byte_at(text, i + 1);
  const bool forbidden = (first == 0xE0 && second < 0xA0) || (first == 0xED && second >= 0xA0) ||
                         (first == 0xF0 && second < 0x90) || (first == 0xF4 && second >= 0x90);
  return forbidden ? 0 : length;
}

void append_base64(std::string& out, std::string_view data) {
  for (std::size_t i = 0; i < data.size(); i += 3) {
    const std::size_t n = std::min<std::size_t>(3, data.size() - i);
    unsigned bits = byte_at(data, i) << 16;
    if (n > 1) bits |= byte_at(data, i + 1) << 8;
    if (n > 2) bits |= byte_at(data, i + 2);
    for (std::size_t k = 0; k < 4; ++k) {
      out += k <= n ? kBase64[(bits >> (18 - 6 * k)) & 63] : '=';
    }
  }
}

}  // namespace

template <class Integer>
void JsonText::integer(Integer value) {
  char text[24];
  out_.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}
template void JsonText::integer(std::int32_t);
template void JsonText::integer(std::uint32_t);
template void JsonText::integer(std::int64_t);
template void JsonText::integer(std::uint64_t);

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
  out_ += '"';
  for (std::size_t i = 0; i < text.size();) {
    const unsigned c = byte_at(text, i);
    const std::size_t length = utf8_length(text, i);
    if (c == '"' || c == '\\') {
      out_ += '\\';
      out_ += text[i];
    } else if (c == '\n') {
      out_ += "\\n";
    } else if (c < 0x20) {
      out_ += "\\u00";
      out_ += kHex[c >> 4];
      out_ += kHex[c & 15];
    } else if (length == 0) {
      out_ += "\xEF\xBF\xBD";
    } else {
      out_ += text.substr(i, length);
    }
    i += std::max<std::size_t>(length, 1);
  }
  out_ += '"';
}

void JsonText::bytes(std::string_view data) {
  if (bytes_ == BytesText::length) {
    raw("{\"bytes\":");
    integer<std::uint64_t>(data.size());
    return raw("}");
  }
  out_ += '"';
  if (bytes_ == BytesText::base64) {
    append_base64(out_, data);
  } else {
    for (std::size_t i = 0; i < data.size(); ++i) {
      out_ += kHex[byte_at(data, i) >> 4];
      out_ += kHex[byte_at(data, i) & 15];
    }
  }
  out_ += '"';
}

/// One value: of a singular field (index kWhole), or element `i` of a repeated one.
void JsonText::scalar(const Message& m, const FieldDescriptor& f, int i) {
  const Reflection& r = *m.GetReflection();
  const bool one = i == kWhole;
  switch (f.cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return integer<std::int32_t>(one ? r.GetInt32(m, &f) : r.GetRepeatedInt32(m, &f, i));
    case FieldDescriptor::CPPTYPE_INT64:
      return integer<std::int64_t>(one ? r.GetInt64(m, &f) : r.GetRepeatedInt64(m, &f, i));
    case FieldDescriptor::CPPTYPE_UINT32:
      return integer<std::uint32_t>(one ? r.GetUInt32(m, &f) : r.GetRepeatedUInt32(m, &f, i));
    case FieldDescriptor::CPPTYPE_UINT64:
      return integer<std::uint64_t>(one ? r.GetUInt64(m, &f) : r.GetRepeatedUInt64(m, &f, i));
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return floating(one ? r.GetDouble(m, &f) : r.GetRepeatedDouble(m, &f, i));
    case FieldDescriptor::CPPTYPE_FLOAT:
      return floating(one ? r.GetFloat(m, &f) : r.GetRepeatedFloat(m, &f, i));
    case FieldDescriptor::CPPTYPE_BOOL:
      return raw((one ? r.GetBool(m, &f) : r.GetRepeatedBool(m, &f, i)) ? "true" : "false");
    case FieldDescriptor::CPPTYPE_ENUM:
      return string((one ? r.GetEnum(m, &f) : r.GetRepeatedEnum(m, &f, i))->name());
    case FieldDescriptor::CPPTYPE_STRING: {
      std::string scratch;
      const std::string& text = one ? r.GetStringReference(m, &f, &scratch)
                                    : r.GetRepeatedStringReference(m, &f, i, &scratch);
      return f.type() == FieldDescriptor::TYPE_BYTES ? bytes(text) : string(text);
    }
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return message(one ? r.GetMessage(m, &f) : r.GetRepeatedMessage(m, &f, i));
  }
}

void JsonText::value(const Message& m, const FieldDescriptor& f) {
  if (!f.is_repeated()) return scalar(m, f, kWhole);
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
  const Reflection& reflection = *message.GetReflection();
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
    const Reflection& r = *m->GetReflection();
    if (index != kWhole && index >= r.FieldSize(*m, f)) return raw("null");
    if (k + 1 == path.steps_.size()) return index == kWhole ? value(*m, *f) : scalar(*m, *f, index);
    m = index == kWhole ? &r.GetMessage(*m, f) : &r.GetRepeatedMessage(*m, f, index);
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
      throw ConfigError(path + ": " + steps_.back().field->name() + " of " + type.full_name() +
                        " has no fields");
    }
    const FieldDescriptor* f = at->FindFieldByName(name);
    if (f == nullptr) {
      std::vector<std::string> known;
      for (int i = 0; i < at->field_count(); ++i) known.push_back(at->field(i)->name());
      throw ConfigError(at->full_name() + " has no field '" + name + "'" +
                        runtime::did_you_mean(name, known));
    }
    int index = kWhole;
    if (f->is_repeated() && start <= path.size()) {
      const auto number = runtime::to_int(word());
      if (!number || *number < 0) throw ConfigError(path + ": expected an index after " + name);
      index = *number;
    }
    steps_.push_back({f, index});
    at = f->message_type();
  }
}

}  // namespace mimesis::tool
