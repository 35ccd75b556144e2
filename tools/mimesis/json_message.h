#pragma once
#include <google/protobuf/message.h>

#include <string>

namespace mimesis::tool {

/// Fills a message from JSON with the field names of its .proto file, as `topic echo --json` and
/// to_json write it: null is nothing given. @throws ConfigError that names `what`
void from_json(const std::string& json, const std::string& what,
               google::protobuf::Message& message);

}  // namespace mimesis::tool
