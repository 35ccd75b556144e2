#include "tools/mimesis/json_message.h"

#include <google/protobuf/util/json_util.h>

#include "common/error.h"

namespace mimesis::tool {

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
