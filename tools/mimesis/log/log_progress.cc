#include "tools/mimesis/log/log_progress.h"

#include <algorithm>

namespace mimesis::tool {
namespace {

std::uint64_t size_of(const std::vector<OpenLog>& logs) {
  std::uint64_t size = 0;
  for (const OpenLog& log : logs) size += log.source->size();
  return size;
}

}  // namespace

LogProgress::LogProgress(const std::string& what, const std::vector<OpenLog>& logs)
    : span_(span_of(logs)), size_(size_of(logs)), bar_(what, size_) {}

void LogProgress::at(std::uint64_t log_time_ns) {
  const auto passed = static_cast<double>(std::max(log_time_ns, span_.start_ns) - span_.start_ns);
  const auto whole = static_cast<double>(std::max<std::uint64_t>(1, span_.end_ns - span_.start_ns));
  bar_.at(static_cast<std::uint64_t>(passed / whole * static_cast<double>(size_)));
}

}  // namespace mimesis::tool
