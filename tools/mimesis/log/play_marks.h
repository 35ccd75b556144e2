#pragma once
#include <mutex>
#include <thread>

#include "proto/foxglove/log.pb.h"
#include "proto/player.pb.h"
#include "tools/mimesis/log/playback.h"

namespace mimesis::tool {

/// The lines that nodes logged, for a time line. A thread of its own reads them from the log when
/// they are first asked for: the player goes on meanwhile.
class PlayMarks {
 public:
  explicit PlayMarks(const Playback& playback) : playback_(playback) {}

  /// Those found so far; at most kMost, then the rest of the log is left out.
  v1::PlayerMarks found() {
    if (!reader_.joinable())
      reader_ = std::jthread([this](const std::stop_token& stop) { read(stop); });
    const std::lock_guard lock(mutex_);
    return marks_;
  }

 private:
  static constexpr int kMost = 2000;

  void read(const std::stop_token& stop) {
    const auto reader = playback_.reader(
        {[](const log::Channel& channel) { return channel.topic.ends_with("/log"); },
         playback_.start_ns(), playback_.end_ns() + 1});
    int count = 0;
    foxglove::Log line;
    while (const Item* item = stop.stop_requested() || count == kMost ? nullptr : reader->next()) {
      if (item->schema == nullptr || item->schema->name != line.GetTypeName() ||
          !line.ParseFromArray(item->message->data.data(),
                               static_cast<int>(item->message->data.size())))
        continue;
      const std::lock_guard lock(mutex_);
      v1::PlayerMark& mark = *marks_.add_marks();
      mark.set_position_s(playback_.position_s(item->message->log_time));
      mark.set_level(static_cast<std::uint32_t>(line.level()));
      mark.set_node(line.name());
      mark.set_text(line.message());
      ++count;
    }
    const std::lock_guard lock(mutex_);
    marks_.set_whole(true);
  }

  const Playback& playback_;
  std::mutex mutex_;
  v1::PlayerMarks marks_;  ///< guarded by mutex_
  std::jthread reader_;    ///< ends before what it uses
};

}  // namespace mimesis::tool
