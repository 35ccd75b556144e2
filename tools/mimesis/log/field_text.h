#pragma once
#include <google/protobuf/message.h>

#include <string>

namespace mimesis::tool {

inline constexpr int kWholeField = -1;  ///< in place of an index: a field that is not repeated

/// Value of a field, or of element `index` of a repeated one, as text that reads back as the same
/// value: numbers with the fewest digits for that ("nan", "inf", "-0" included), enum values by
/// name, strings as they are, bytes as hexadecimal digits, messages in Protobuf's text format.
std::string field_text(const google::protobuf::Message& message,
                       const google::protobuf::FieldDescriptor& field, int index = kWholeField);

/// Value of a number: double and float as they are, integers, booleans (0 or 1) and enum values by
/// number; NaN for everything else. 64-bit integers beyond 2^53 are rounded.
double field_number(const google::protobuf::Message& message,
                    const google::protobuf::FieldDescriptor& field, int index = kWholeField);

/// True if `field_number` has something to say.
bool is_number(const google::protobuf::FieldDescriptor& field);

/// "0a ff 03" of the bytes [from, from + count), as far as there are any.
std::string hex(std::string_view bytes, std::size_t from, std::size_t count,
                std::string_view separator = " ");

}  // namespace mimesis::tool
