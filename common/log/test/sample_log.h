#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/log/writer.h"

namespace mimesis::log {

struct SampleMessage {
  std::uint16_t channel_id;
  std::uint32_t sequence;
  std::uint64_t log_time, publish_time;
  std::string data;
  bool operator==(const SampleMessage&) const = default;
};

inline SampleMessage sample(const Message& m) {
  return {m.channel_id, m.sequence, m.log_time, m.publish_time, std::string(m.data)};
}

/// Message `i` of two channels: half of its payload repeats, half is pseudo-random, so that codecs
/// work for their living. Every third log time equals its predecessor's.
SampleMessage sample_message(std::uint32_t i);

/// A finished log of `count` sample messages in chunks of `chunk_size`, with attachment and
/// metadata.
std::string sample_log(std::uint32_t count, Compression compression, std::size_t chunk_size);

/// Adds the two schemas and channels of the samples.
void add_sample_channels(Writer& writer);

}  // namespace mimesis::log
