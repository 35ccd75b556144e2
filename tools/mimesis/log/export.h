#pragma once
#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/error.h"
#include "common/image/image.h"
#include "proto/foxglove/image.pb.h"
#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// How rows of several topics become one table.
/// previous: a row per message of the first topic, with the last of each other one at or before it.
/// nearest:  the same with the one nearest in time, the earlier of two.
/// outer:    a row per time at which any topic has a message, with empty cells for the others.
enum class Join { previous, nearest, outer };

using Cells = std::vector<std::string>;

/// Joins rows that come in the order of time. Holds the rows of one time; for nearest, those since
/// the last message of the rarest topic.
class RowJoin {
 public:
  using Out = std::function<void(std::uint64_t time_ns, const Cells& row)>;
  /// @param widths  cells of each topic
  /// @param out     takes the time and the cells of all topics side by side
  RowJoin(Join how, std::vector<std::size_t> widths, Out out)
      : how_(how), widths_(std::move(widths)), out_(std::move(out)), last_(widths_.size()) {}

  void add(std::size_t topic, std::uint64_t time_ns, Cells cells) {
    const Sample sample{time_ns, std::make_shared<const Cells>(std::move(cells))};
    while (!rows_.empty() && complete(rows_.front(), time_ns)) emit_first();
    if (how_ == Join::outer) return add_outer(topic, sample);
    for (Row& row : rows_) update(row, topic, sample);
    last_[topic] = sample;
    if (topic != 0) return;
    rows_.push_back({time_ns, last_, std::vector<bool>(widths_.size(), false)});
    rows_.back().settled[topic] = true;
  }
  /// The last call.
  void finish() {
    while (!rows_.empty()) emit_first();
  }

 private:
  struct Sample {
    std::uint64_t time_ns = 0;
    std::shared_ptr<const Cells> cells;  ///< null: none
  };
  struct Row {
    std::uint64_t time_ns = 0;
    std::vector<Sample> samples;  ///< per topic
    std::vector<bool> settled;    ///< per topic: no later message can be nearer
  };

  bool complete(const Row& row, std::uint64_t now_ns) const {
    if (how_ != Join::nearest) return now_ns > row.time_ns;
    return std::ranges::all_of(row.settled, [](bool settled) { return settled; });
  }

  void add_outer(std::size_t topic, const Sample& sample) {
    auto row = std::ranges::find_if(rows_, [&](const Row& r) { return !r.settled[topic]; });
    if (row == rows_.end()) {
      rows_.push_back({sample.time_ns, std::vector<Sample>(widths_.size()),
                       std::vector<bool>(widths_.size(), false)});
      row = std::prev(rows_.end());
    }
    row->samples[topic] = sample;
    row->settled[topic] = true;
  }

  void update(Row& row, std::size_t topic, const Sample& sample) const {
    if (row.settled[topic]) return;
    Sample& present = row.samples[topic];
    if (sample.time_ns == row.time_ns) {
      present = sample;
    } else if (how_ == Join::nearest) {
      const bool nearer =
          !present.cells || sample.time_ns - row.time_ns < row.time_ns - present.time_ns;
      if (nearer) present = sample;
      row.settled[topic] = true;
    }
  }

  void emit_first() {
    Cells all;
    for (std::size_t topic = 0; topic < widths_.size(); ++topic) {
      const auto& cells = rows_.front().samples[topic].cells;
      if (cells) {
        all.insert(all.end(), cells->begin(), cells->end());
      } else {
        all.resize(all.size() + widths_[topic]);
      }
    }
    out_(rows_.front().time_ns, all);
    rows_.pop_front();
  }

  Join how_;
  std::vector<std::size_t> widths_;
  Out out_;
  std::vector<Sample> last_;  ///< per topic
  std::deque<Row> rows_;      ///< not yet complete
};

/// Files written.
struct ExportResult {
  std::vector<std::string> files;
  std::uint64_t items = 0;  ///< rows, images or attachments
  /// messages that could not be decoded, and damages; each was reported
  std::uint64_t failures = 0;
};

struct ExportOptions {
  std::vector<std::string> files = {};
  std::vector<std::string> csv = {};  ///< "TOPIC.FIELD[,FIELD...]"
  std::string join = {};              ///< of several topics, as Join; empty: a file for each
  std::string time = "relative";      ///< to the start of the log, or absolute
  std::string images = {};            ///< a topic
  std::string format = "png";         ///< of raw images, or jpeg
  int quality = 90;                   ///< quality of JPEG, 1..100
  int every = 1;                      ///< only each so-manieth image
  std::string attachments = {};       ///< a folder
  std::string output = {};            ///< file or folder; CSV: "" or "-" is standard output
  TimeRange range = {};
  bool json = false;
};

/// Fields over time: columns log_time_s, publish_time_s, node (where a topic has several), then the
/// fields in the order given, elements by their index. Numbers read back as the same bits.
/// @throws ConfigError for a topic or field that is not there, or a file that cannot be written.
ExportResult export_csv(const std::vector<OpenLog>& logs, const ExportOptions& options);

/// foxglove.RawImage and CompressedImage as files SEQ_TIME.png; compressed ones as they are.
/// @throws ConfigError if there is no such topic, or no images on it.
ExportResult export_images(const std::vector<OpenLog>& logs, const ExportOptions& options);

/// A raw image in colour. Encodings: bgr8 8UC3 rgb8 bgra8 8UC4 rgba8 mono8 8UC1 and full-range
/// BT.601 uyvy yuv422 yuyv yuv422_yuy2 nv12. Data of another size is refused.
tl::expected<image::Image, Status> raw_image(const foxglove::RawImage& raw);

/// Attachments under their names, without folders. @throws ConfigError if one cannot be written.
ExportResult export_attachments(const std::vector<OpenLog>& logs, const std::string& folder);

}  // namespace mimesis::tool
