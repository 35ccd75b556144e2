#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "tools/mimesis/log/open_log.h"
#include "tools/mimesis/progress.h"

namespace mimesis::tool {

/// Progress through logs that are read by time: bytes are told from the share of their time.
class LogProgress {
 public:
  LogProgress(const std::string& what, const std::vector<OpenLog>& logs);
  void at(std::uint64_t log_time_ns);

 private:
  Span span_;
  std::uint64_t size_ = 0;  ///< of the files [bytes]
  Progress bar_;
};

}  // namespace mimesis::tool
