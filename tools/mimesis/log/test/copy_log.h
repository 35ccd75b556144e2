#pragma once
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <string>

#include "common/log/writer.h"
#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// Writes a copy of a log without the messages for which `keep` is false; it may change the
/// payload.
inline void copy_log(const std::string& from, const std::string& to,
                     const std::function<bool(const log::Channel& channel, std::uint32_t seq,
                                              std::string& payload)>& keep) {
  const auto logs = open_logs({from});
  const auto sink = log::create_file(to);
  ASSERT_TRUE(sink);
  log::Writer writer(**sink, {});
  std::map<std::uint16_t, std::uint16_t> channels;
  auto reader = merged(logs);
  while (const auto* item = reader.next()) {
    std::string payload(item->message->data);
    if (!keep(*item->channel, item->message->sequence, payload)) continue;
    std::uint16_t& id = channels[item->channel->id];
    if (id == 0) {
      const auto schema =
          writer.add_schema(item->schema->name, item->schema->encoding, item->schema->data);
      id = *writer.add_channel(*schema, item->channel->topic, "protobuf", item->channel->metadata);
    }
    log::Message message = *item->message;
    message.channel_id = id;
    message.data = payload;
    ASSERT_TRUE(writer.write(message));
  }
  ASSERT_TRUE(writer.finish());
}

}  // namespace mimesis::tool
