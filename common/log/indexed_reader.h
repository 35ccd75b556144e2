#pragma once
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <vector>

#include "common/log/read_ahead.h"
#include "common/log/summary.h"

namespace mimesis::log {

struct Selection {
  std::function<bool(const Channel&)> channel;  ///< null: all
  std::uint64_t start_time = 0;                 ///< log times [start_time, end_time)
  std::uint64_t end_time = std::numeric_limits<std::uint64_t>::max();
};

/// Delivers the messages of a log in the order of their log time; equal ones in the order of the
/// file. Seeks by the summary; two threads read and unpack ahead from the third chunk on. Holds the
/// unpacked chunks that overlap in time (one, in logs of our recorder) and those read ahead (64
/// MiB).
class IndexedReader {
 public:
  /// `source` and `summary` outlive the reader; the source is read from several threads.
  IndexedReader(const Source& source, const Summary& summary, Selection selection = {});
  ~IndexedReader();

  /// Next message, or null at the end. Its data lives until the next call.
  const Message* next();
  /// Chunks that could not be read; their messages are left out.
  const std::vector<Damage>& damages() const { return damages_; }

 private:
  struct Loaded;
  bool wanted(const Segment& segment) const;
  void take();
  static bool later(const std::unique_ptr<Loaded>& a, const std::unique_ptr<Loaded>& b);

  const Source& source_;
  Selection selection_;
  std::vector<bool> channels_;              ///< by id: selected
  std::map<std::uint16_t, Channel> known_;  ///< as the summary defines them
  std::vector<const Segment*> segments_;    ///< wanted ones, earliest first
  std::size_t claimed_ = 0, taken_ = 0;     ///< number of segments claimed and taken so far
  std::unique_ptr<ReadAhead<Loaded>> ahead_;
  std::vector<std::unique_ptr<Loaded>> loaded_;  ///< a heap, next message first
  bool delivered_ = false;                       ///< the first one's message was the last delivered
  Message message_;
  std::vector<Damage> damages_;
};

}  // namespace mimesis::log
