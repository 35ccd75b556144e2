#pragma once
#include <google/protobuf/message.h>

#include <string>
#include <string_view>

#include "tools/mimesis/log/field_text.h"
#include "tools/mimesis/log/message_diff.h"

namespace mimesis::tool {

/// Fields of one kind can be compared whatever their wire type.
enum class FieldKind { floating, integer, other_number, text, bytes, message };
FieldKind kind_of(const google::protobuf::FieldDescriptor& field);

/// One side of a comparison: a field that is not repeated, or an element of one that is.
struct FieldValue {
  const google::protobuf::Message& message;
  const google::protobuf::FieldDescriptor& field;
  int index = kWholeField;

  std::string text() const;  ///< shortened
  double number() const { return field_number(message, field, index); }
  long double integer() const;  ///< of any width, without loss
  std::string string() const;
  const google::protobuf::Message& inner() const;
};

/// |a - b|, 0 for equal ones, infinite if they cannot be subtracted.
double distance(double a, double b);

/// Both sides from the first byte that differs.
FieldDifference byte_difference(std::string path, std::string_view a, std::string_view b);

/// Both sides quoted; long ones from shortly before the first character that differs.
FieldDifference text_difference(std::string path, const std::string& a, const std::string& b);

}  // namespace mimesis::tool
