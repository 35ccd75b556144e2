// Prints the topics of a log, and the texts on one of them: log_reader FILE TOPIC
#include <iostream>

#include "common/log/indexed_reader.h"
#include "proto/foxglove/log.pb.h"

using namespace mimesis;

int fail(const std::string& reason) {
  std::cerr << reason << '\n';
  return 1;
}

int main(int argc, char** argv) {
  if (argc != 3) return fail("usage: log_reader FILE TOPIC");
  const auto source = log::open_file(argv[1]);
  if (!source) return fail(source.error().reason);
  const auto summary = log::summarize(**source);  // of a killed recorder's file, too
  if (!summary) return fail(summary.error().reason);

  auto counts = summary->statistics.channel_message_counts;
  for (const auto& [id, channel] : summary->channels) {
    const auto schema = summary->schemas.find(channel.schema_id);
    std::cout << channel.topic << ": " << counts[id] << " x "
              << (schema != summary->schemas.end() ? schema->second.name : "?") << '\n';
  }

  const std::string topic = argv[2];
  log::IndexedReader reader(**source, *summary,
                            {.channel = [&](const log::Channel& c) { return c.topic == topic; }});
  while (const log::Message* message = reader.next()) {
    foxglove::Log line;
    if (!line.ParseFromArray(message->data.data(), static_cast<int>(message->data.size())))
      return fail(topic + " carries no foxglove.Log");
    std::cout << message->publish_time << ' ' << line.message() << '\n';
  }
  for (const log::Damage& damage : reader.damages())
    std::cerr << "damaged: " << damage.what << '\n';
  return reader.damages().empty() ? 0 : 1;
}
