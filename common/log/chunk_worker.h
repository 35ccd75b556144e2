#pragma once
#include <condition_variable>
#include <memory>
#include <mutex>
#include <queue>
#include <thread>
#include <vector>

#include "common/log/file_body.h"

namespace mimesis::log {

/// Writes closed chunks into the file on a thread of its own, in the order they are handed over. At
/// most kInFlight are pending: then the caller waits. Their memory is reused.
class ChunkWorker {
 public:
  static constexpr std::size_t kInFlight = 3;

  explicit ChunkWorker(FileBody& body);
  /// Everything handed over is written before.
  ~ChunkWorker();

  /// Takes the chunk (nothing, if it is empty) and gives back a cleared one. `flush`: the data so
  /// far is handed to the operating system as soon as it is written. Returns errors of earlier
  /// chunks.
  Result put(ChunkBuffer& chunk, bool flush);
  /// Waits until all is written; the body is the caller's until the next `put`.
  Result wait();
  /// Errors so far.
  Result status();

 private:
  struct Job {
    std::unique_ptr<ChunkBuffer> chunk;
    bool flush;
  };
  void run();

  FileBody& body_;
  std::mutex mutex_;
  std::condition_variable to_do_, done_;
  std::queue<Job> jobs_;  ///< the first one is in work
  std::vector<std::unique_ptr<ChunkBuffer>> spare_;
  bool stopping_ = false;
  Result status_;  ///< copy of the body's
  std::atomic<bool> failed_ = false;
  std::thread thread_;
};

}  // namespace mimesis::log
