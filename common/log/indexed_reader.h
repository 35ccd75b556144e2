#pragma once
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "common/log/summary.h"

namespace mimesis::log {

struct Selection {
  std::function<bool(const Channel&)> channel;  ///< null: all
  std::uint64_t start_time = 0;                 ///< log times [start_time, end_time)
  std::uint64_t end_time = std::numeric_limits<std::uint64_t>::max();
};

/// Delivers the messages of a log in the order of their log time; equal ones in the order of the
/// file. Seeks by the summary. Holds the unpacked chunks that overlap in time: one, in logs of our
/// recorder.
class IndexedReader {
 public:
  /// `source` and `summary` outlive the reader.
  IndexedReader(const Source& source, const Summary& summary, Selection selection = {});
  ~IndexedReader();

  /// Next message, or null at the end. Its data lives until the next call.
  const Message* next();
  /// Chunks that could not be read; their messages are left out.
  const std::vector<Damage>& damages() const { return damages_; }

 private:
  struct Loaded;
  bool wanted(const Segment& segment) const;
  void load(const Segment& segment);

  const Source& source_;
  const Summary& summary_;
  Selection selection_;
  std::vector<bool> channels_;           ///< by id: selected
  std::vector<const Segment*> pending_;  ///< not yet loaded, earliest last
  std::vector<std::unique_ptr<Loaded>> loaded_;
  std::unique_ptr<Loaded> spare_;  ///< memory for the next chunk
  Message message_;
  std::vector<Damage> damages_;
};

}  // namespace mimesis::log
