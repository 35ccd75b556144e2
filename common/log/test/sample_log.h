#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/log/pieces.h"
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

/// Result of reading a file with sample messages.
struct Outcome {
  std::vector<std::uint32_t> messages;  ///< which samples, in the order delivered
  std::uint32_t altered = 0;            ///< messages that were never written so
  std::vector<std::string> attachments, metadata;
  std::vector<Damage> damages;

  bool same_content(const Outcome& other) const {
    return messages == other.messages && altered == other.altered &&
           attachments == other.attachments && metadata == other.metadata;
  }
};

Outcome read_streamed(const std::string& file, const ReaderLimits& limits = {});
/// Result by the summary, or by a scan of the file. Metadata is left out: it cannot be checked
/// without the sum over the whole file.
Outcome read_indexed(const std::string& file);

}  // namespace mimesis::log
