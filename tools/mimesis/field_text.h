#pragma once
#include <google/protobuf/message.h>

#include <charconv>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace mimesis::tool {

inline constexpr int kWholeField = -1;  ///< in place of an index: a field that is not repeated

/// Calls `take` with the value of a field, or of element `index` of a repeated one: an integer, a
/// double, a float, a bool, an EnumValueDescriptor, a std::string or a Message.
template <class Take>
auto with_field_value(const google::protobuf::Message& m,
                      const google::protobuf::FieldDescriptor& f, int index, const Take& take) {
  using Field = google::protobuf::FieldDescriptor;
  const auto& r = *m.GetReflection();
  const bool one = index == kWholeField;
  switch (f.cpp_type()) {
    case Field::CPPTYPE_INT32:
      return take(one ? r.GetInt32(m, &f) : r.GetRepeatedInt32(m, &f, index));
    case Field::CPPTYPE_INT64:
      return take(one ? r.GetInt64(m, &f) : r.GetRepeatedInt64(m, &f, index));
    case Field::CPPTYPE_UINT32:
      return take(one ? r.GetUInt32(m, &f) : r.GetRepeatedUInt32(m, &f, index));
    case Field::CPPTYPE_UINT64:
      return take(one ? r.GetUInt64(m, &f) : r.GetRepeatedUInt64(m, &f, index));
    case Field::CPPTYPE_DOUBLE:
      return take(one ? r.GetDouble(m, &f) : r.GetRepeatedDouble(m, &f, index));
    case Field::CPPTYPE_FLOAT:
      return take(one ? r.GetFloat(m, &f) : r.GetRepeatedFloat(m, &f, index));
    case Field::CPPTYPE_BOOL:
      return take(one ? r.GetBool(m, &f) : r.GetRepeatedBool(m, &f, index));
    case Field::CPPTYPE_ENUM:
      return take(*(one ? r.GetEnum(m, &f) : r.GetRepeatedEnum(m, &f, index)));
    case Field::CPPTYPE_STRING: {
      std::string scratch;
      return take(one ? r.GetStringReference(m, &f, &scratch)
                      : r.GetRepeatedStringReference(m, &f, index, &scratch));
    }
    case Field::CPPTYPE_MESSAGE:
      break;
  }
  return take(one ? r.GetMessage(m, &f) : r.GetRepeatedMessage(m, &f, index));
}

/// Value of a field, or of element `index` of a repeated one, as text that reads back as the same
/// value: numbers with the fewest digits for that ("nan", "inf", "-0" included), enum values by
/// name, strings as they are, bytes as hexadecimal digits, messages in Protobuf's text format.
std::string field_text(const google::protobuf::Message& message,
                       const google::protobuf::FieldDescriptor& field, int index = kWholeField);

/// Value of a number: double and float as they are, integers, booleans (0 or 1) and enum values by
/// number; NaN for everything else. 64-bit integers beyond 2^53 are rounded.
double field_number(const google::protobuf::Message& message,
                    const google::protobuf::FieldDescriptor& field, int index = kWholeField);

/// Field of a type by its name. @throws ConfigError with a suggestion, behind `where`.
const google::protobuf::FieldDescriptor& field_named(const google::protobuf::Descriptor& type,
                                                     const std::string& name,
                                                     const std::string& where = "");

/// True if `field_number` has a value for this field.
bool is_number(const google::protobuf::FieldDescriptor& field);

/// "0a ff 03" of the bytes [from, from + count), as far as there are any.
std::string hex(std::string_view bytes, std::size_t from, std::size_t count,
                std::string_view separator = " ");

/// How fields of type bytes look: {"bytes": LENGTH}, or a string.
enum class BytesText { length, base64, hex };

/// Appends JSON text to a buffer: messages with the field names of their .proto files. All fields
/// without presence are there; enum values by name, 64-bit integers as numbers, NaN and infinity as
/// null.
class JsonText {
 public:
  /// `words`: enum values as `short_word`. `unset_is_null`: `field` tells an unset field from 0.
  JsonText(std::string& out, BytesText bytes, bool words = false, bool unset_is_null = false)
      : out_(out), bytes_(bytes), words_(words), unset_is_null_(unset_is_null) {}

  void message(const google::protobuf::Message& message);
  /// A field, or element `index` of a repeated one.
  void value(const google::protobuf::Message& m, const google::protobuf::FieldDescriptor& f,
             int index = kWholeField);
  /// Value at the end of a path; null for an element that is not there.
  void field(const google::protobuf::Message& message, const class FieldPath& path);
  void string(std::string_view text);  ///< escaped; invalid UTF-8 becomes U+FFFD
  void raw(std::string_view text) { out_ += text; }
  template <class Integer>
  void integer(Integer value) {
    char text[24];
    out_.append(text, std::to_chars(text, text + sizeof text, value).ptr);
  }
  void bytes(std::string_view data);

 private:
  void scalar(const google::protobuf::Message& m, const google::protobuf::FieldDescriptor& f,
              int i);
  template <class Float>
  void floating(Float value);

  std::string& out_;
  BytesText bytes_;
  bool words_, unset_is_null_;
};

/// "blobs.0.u_px" resolved once for a type.
class FieldPath {
 public:
  /// @throws ConfigError with a suggestion if the type has no such field.
  FieldPath(const google::protobuf::Descriptor& type, const std::string& path);
  const std::string& text() const { return text_; }
  const google::protobuf::FieldDescriptor& leaf() const { return *steps_.back().field; }

 private:
  friend class JsonText;
  struct Step {
    const google::protobuf::FieldDescriptor* field;
    int index;  ///< index in a repeated field, or kWholeField
  };
  std::string text_;
  std::vector<Step> steps_;
};

/// A message as JSON, as JsonText writes it.
nlohmann::ordered_json to_json(const google::protobuf::Message& message,
                               BytesText bytes = BytesText::length);

/// Value at "object_position_in_world_m.x_m" or "blobs.0.u_px"; null for what is not there.
/// `words`: enum values as short words. @throws ConfigError as FieldPath
nlohmann::ordered_json field_json(const google::protobuf::Message& message, const std::string& path,
                                  bool words = false);

/// Value of an enum as people write it: GRIP_PRECISION of enum Grip -> "precision"; null for
/// UNSPECIFIED.
nlohmann::ordered_json short_word(const google::protobuf::EnumValueDescriptor& value);

/// Fills a message from JSON with the field names of its .proto file, as `topic echo --json` and
/// to_json write it: null is nothing given. @throws ConfigError that names `what`
void from_json(const std::string& json, const std::string& what,
               google::protobuf::Message& message);

}  // namespace mimesis::tool
