#pragma once
#include <google/protobuf/message.h>

#include <chrono>
#include <functional>
#include <string>

namespace mimesis::tool {

/// Takes a message for a topic of the log that is being written, stamped with the time it shows.
using Draw = std::function<void(const std::string& topic, const google::protobuf::Message& message,
                                std::chrono::nanoseconds stamp)>;

}  // namespace mimesis::tool
