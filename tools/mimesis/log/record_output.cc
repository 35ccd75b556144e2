#include "tools/mimesis/log/record_output.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>
#include <filesystem>

#include "common/error.h"
#include "tools/mimesis/log/byte_size.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;

std::string date_and_time() {
  return fmt::format("{:%Y%m%d-%H%M%S}", fmt::localtime(std::time(nullptr)));
}

}  // namespace

RecordOutput::RecordOutput(const std::string& output, const SplitOptions& split,
                           const SnapshotOptions& snapshot, OpenRecordFile open,
                           std::function<void(const std::string& line)> report)
    : output_(SplitLog(output, split, open)) {
  if (snapshot.on()) {
    output_ = Snapshots(snapshot, output, std::move(open), date_and_time, std::move(report));
  }
}

log::Result RecordOutput::start() {
  auto* log = std::get_if<SplitLog>(&output_);
  return log != nullptr ? log->start() : log::Result{};
}

log::Result RecordOutput::write(Recorded message, WallTime now) {
  return std::visit([&](auto& output) { return output.write(std::move(message), now); }, output_);
}

log::Result RecordOutput::advance(WallTime now) {
  return std::visit([&](auto& output) { return output.advance(now); }, output_);
}

log::Result RecordOutput::finish(WallTime now) {
  return std::visit([&](auto& output) { return output.finish(now); }, output_);
}

log::Result RecordOutput::trigger(const std::string& why, WallTime now) {
  auto* snapshots = std::get_if<Snapshots>(&output_);
  return snapshots != nullptr ? snapshots->trigger(why, now) : log::Result{};
}

OwnFiles& RecordOutput::files() {
  return std::visit([](auto& output) -> OwnFiles& { return output.files(); }, output_);
}

std::uint64_t RecordOutput::messages() const {
  return std::visit([](const auto& output) { return output.messages(); }, output_);
}

std::string RecordOutput::activity() const {
  if (const auto* log = std::get_if<SplitLog>(&output_)) return log->path();
  return "in memory " + bytes_text(std::get<Snapshots>(output_).bytes_in_memory());
}

void refuse_older_parts(const std::string& output) {
  const fs::path path(output);
  const std::string stem = path.stem().string() + "_";
  std::error_code ignored;  // no folder, no parts
  for (const auto& entry : fs::directory_iterator(
           path.has_parent_path() ? path.parent_path() : fs::path("."), ignored)) {
    const std::string name = entry.path().stem().string();
    if (entry.path().extension() != path.extension() || !name.starts_with(stem)) continue;
    constexpr std::size_t kDigits = 3;
    if (name.size() >= stem.size() + kDigits &&
        name.find_first_not_of("0123456789", stem.size()) == std::string::npos) {
      throw ConfigError(fmt::format(
          "'{}' is there from an earlier recording: remove its files, or choose another --output",
          entry.path().string()));
    }
  }
}

}  // namespace mimesis::tool
