#include "tools/mimesis/log/view.h"

#include <fmt/format.h>

#include <iostream>

#include "common/runtime/type_info.h"
#include "tools/mimesis/log/latched_repeats.h"
#include "tools/mimesis/log/rewriting.h"

namespace mimesis::tool {
namespace {

/// Puts drawings into a log beside the messages that they were made from.
class DrawingWriter {
 public:
  explicit DrawingWriter(NewLog& log) : log_(log) {}

  /// Log time of the drawings that follow.
  void set_time(std::uint64_t log_time) { log_time_ = log_time; }
  log::Result write(const std::string& topic, const google::protobuf::Message& message,
                    std::chrono::nanoseconds stamp) {
    auto channel = channels_.find(topic);
    if (channel == channels_.end()) {
      const auto id = add_channel(topic, *message.GetDescriptor());
      if (!id) return tl::unexpected(id.error());
      channel = channels_.emplace(topic, Channel{*id}).first;
    }
    message.SerializeToString(&payload_);
    return log_.write({channel->second.id, ++channel->second.sequence, log_time_,
                       static_cast<std::uint64_t>(stamp.count()), payload_});
  }
  /// Messages by topic.
  nlohmann::ordered_json counts() const {
    auto counts = nlohmann::ordered_json::object();
    for (const auto& [topic, channel] : channels_) counts[topic] = channel.sequence;
    return counts;
  }

 private:
  struct Channel {
    std::uint16_t id = 0;
    std::uint32_t sequence = 0;
  };
  /// Each message is whole: the last one is all that somebody who comes later needs.
  tl::expected<std::uint16_t, Status> add_channel(const std::string& topic,
                                                  const google::protobuf::Descriptor& type) {
    const log::Schema schema{0, type.full_name(), "protobuf", runtime::descriptor_set(type)};
    return log_.channel({0,
                         0,
                         topic,
                         "protobuf",
                         {{"node", "view"},
                          {"latched", "true"},
                          {"type_hash", fmt::format("{:016x}", runtime::type_hash(type))}}},
                        &schema);
  }

  NewLog& log_;
  std::uint64_t log_time_ = 0;
  std::string payload_;
  std::map<std::string, Channel> channels_;  ///< by topic
};

}  // namespace

int log_view(const ViewOptions& options) {
  const auto logs = open_logs(options.inputs);
  if (!logs) {
    std::cerr << logs.error().line << '\n';
    return logs.error().exit_code;
  }
  if (const auto missing = missing_topic(options.layers, *logs)) {
    std::cerr << *missing << '\n';
    return 3;
  }
  LayerPainter painter(options.layers, *logs);
  OutputOptions output = options.output;
  output.profile = common_profile(*logs);
  NewLog out(output, options.inputs);
  DrawingWriter drawings(out);
  log::Result drawn;
  const Draw draw = [&](const std::string& topic, const auto& message, auto stamp) {
    if (drawn) drawn = drawings.write(topic, message, stamp);
  };
  LatchedRepeats repeats;
  bool begun = false;
  Pass pass = each_message("view", *logs, {}, [&](const log::MergedReader::Item& item) {
    drawings.set_time(item.message->log_time);
    if (!begun) painter.begin(std::chrono::nanoseconds(item.message->log_time), draw);
    begun = true;
    if (repeats.repeated(item)) return log::Result{};
    if (auto copied = out.copy(item); !copied) return copied;
    painter.see(item, draw);
    return drawn;
  });
  copy_attachments(*logs, out, pass);
  copy_metadata(*logs, out, pass, read_losses(*logs));
  for (const std::string& line : painter.problems()) std::cerr << line << '\n';
  return conclude(out, pass, options.json, {{"drawn", drawings.counts()}});
}

}  // namespace mimesis::tool
