#pragma once
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "tools/mimesis/log/playback.h"

namespace mimesis::tool {

/// So much is read before it is due; the first bound that is reached counts.
struct PlayAheadLimits {
  double seconds =
      0.0;  ///< of log time; 0: half a second, twice as much whenever it was too little
  std::size_t bytes = std::size_t{128} << 20U;
};

/// Reads and unpacks a playback on a thread of its own, so that neither the disk nor a large chunk
/// makes messages late.
class PlayAhead {
 public:
  /// `arrived` is called on the thread when messages are there after `front` had none, and at the
  /// end. The playback is this object's until it is gone.
  PlayAhead(Playback& playback, PlayAheadLimits limits, std::function<void()> arrived);
  ~PlayAhead();

  /// As Playback::seek.
  std::vector<PlayedValue> seek(std::uint64_t log_time_ns);
  /// Next message, valid until `pop`; null if there is none now, or none at all (`ended`).
  const Played* front();
  void pop();
  bool ended();  ///< all was delivered
  bool full();   ///< reads no further before something is taken
  /// Seconds of log time per second: what `seconds` of the limits is worth.
  void set_rate(double rate);
  void stop();  ///< the playback may be used again

 private:
  struct Batch {
    std::vector<char> bytes;
    std::vector<Played> messages;
    std::vector<std::size_t> ends;  ///< of the payloads in `bytes`
  };
  void read(const std::stop_token& stop);
  bool fill(Batch& batch);
  bool enough() const;  ///< with the lock

  Playback& playback_;
  PlayAheadLimits limits_;
  std::function<void()> arrived_;

  std::mutex mutex_;
  std::condition_variable_any taken_;
  std::deque<Batch> batches_, spare_;
  std::size_t bytes_ = 0;  ///< in batches_
  double seconds_, rate_ = 1.0;
  bool at_end_ = false, awaited_ = false, full_ = false;

  Batch current_;  ///< being delivered
  std::size_t next_ = 0;
  bool primed_ = false;  ///< something was delivered since the seek
  std::jthread thread_;
};

}  // namespace mimesis::tool
