#pragma once
#include <google/protobuf/message.h>

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace mimesis::tool {

/// A message as JSON with the field names of its .proto file. All fields without presence are
/// there; enum values by name, 64-bit integers as numbers, bytes as {"bytes": LENGTH}, NaN and
/// infinity as null.
nlohmann::ordered_json to_json(const google::protobuf::Message& message);

/// Value at "object_position_in_world_m.x_m" or "blobs.0.u_px"; null for an element that is not
/// there.
/// @throws ConfigError with a suggestion if the type has no such field.
nlohmann::ordered_json field_json(const google::protobuf::Message& message,
                                  const std::string& path);

/// Value of an enum as people write it: GRIP_PRECISION of enum Grip -> "precision"; null for
/// UNSPECIFIED.
nlohmann::ordered_json short_word(const google::protobuf::EnumValueDescriptor& value);

/// Like `field_json`, with enum values as short words.
nlohmann::ordered_json field_word(const google::protobuf::Message& message,
                                  const std::string& path);

}  // namespace mimesis::tool
