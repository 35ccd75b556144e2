#pragma once
#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "common/runtime/raw.h"
#include "tools/mimesis/launch/process.h"
#include "tools/mimesis/launch/result.h"

namespace mimesis::launch {

/// Follows the topics of `result:` on a thread of its own and ends the run when the result is
/// complete, the graph's time is up, or the guard of wall time is.
class ResultWatcher final : public RunEnd {
 public:
  /// Create before the nodes start: publishers hold back for reliable subscribers that exist.
  /// @param epoch graph time at which the run starts: 0 on a simulated clock
  ResultWatcher(const ResultSpec& spec, const std::string& graph, std::chrono::nanoseconds epoch);
  ~ResultWatcher() override;

  int fd() const override { return event_.get(); }
  /// Ends the thread; after this the rest may be asked.
  void stop();
  const ResultCollector& collector() const { return collector_; }
  const std::string& failure() const { return failure_; }  ///< why there is no result, or empty
  bool misconfigured() const { return misconfigured_; }    ///< the failure is the launch file's
  double graph_s() const;  ///< time from the start to the result, or to the newest message seen [s]

 private:
  void follow();
  void take(const runtime::Tapped& tapped);

  ResultSpec spec_;
  std::chrono::nanoseconds epoch_, newest_;
  ResultCollector collector_;
  runtime::TypePool types_;
  runtime::Tap tap_;
  Fd event_;
  std::string failure_;
  bool misconfigured_ = false;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace mimesis::launch
