#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/log/pieces.h"

namespace mimesis::log {

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
