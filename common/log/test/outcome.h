#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/log/pieces.h"

namespace mimesis::log {

/// What a reader made of a file with sample messages.
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
/// By the summary, or by what a scan makes of the file. Metadata is left out: without the sum over
/// the whole file nobody can check it.
Outcome read_indexed(const std::string& file);

}  // namespace mimesis::log
