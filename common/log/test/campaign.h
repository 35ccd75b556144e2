#pragma once
#include <cstdint>

#include "common/log/codec.h"

namespace mimesis::log {

/// A file to be damaged: sample messages in chunks (0: none), an attachment and metadata.
struct Victim {
  Compression codec;
  std::size_t chunk_size;
  std::uint32_t messages;
};

/// Flips one byte at a time, anywhere in the file, and expects of both readers a report or
/// identical messages; no altered message from chunks. Prints the counts.
void flip_bytes(const Victim& victim, int flips, unsigned seed);

/// Cuts the file anywhere and expects of both readers: the messages up to some place and no other,
/// at least those of whole chunks, the end reported. Returns the share of the complete messages
/// that was recovered; of a compressed chunk as many count as complete as its share of bytes says.
double truncate(const Victim& victim, int cuts, unsigned seed);

/// Like the function above, but zeros stand where bytes are missing: a power cut.
void blank_the_end(const Victim& victim, int cuts, unsigned seed);

}  // namespace mimesis::log
