#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/error.h"
#include "common/image/image.h"
#include "proto/foxglove/image.pb.h"
#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// Files written.
struct ExportResult {
  std::vector<std::string> files;
  std::uint64_t items = 0;  ///< rows or images
  /// messages that could not be decoded, and damages; each was reported
  std::uint64_t failures = 0;
};

struct ExportOptions {
  std::vector<std::string> files = {};
  std::vector<std::string> csv = {};  ///< "TOPIC.FIELD[,FIELD...]"
  std::string images = {};            ///< a topic
  std::string output = {};            ///< file or folder; CSV: "" or "-" is standard output
  TimeRange range = {};
  bool json = false;
};

/// Fields over time, a file for each topic: columns log_time_s, publish_time_s, node (where a topic
/// has several), then the fields in the order given, elements by their index. Numbers read back as
/// the same bits.
/// @throws ConfigError for a topic or field that is not there, or a file that cannot be written.
ExportResult export_csv(const std::vector<OpenLog>& logs, const ExportOptions& options);

/// foxglove.RawImage and CompressedImage as files SEQ_TIME.png; compressed ones as they are.
/// @throws ConfigError if there is no such topic, or no images on it.
ExportResult export_images(const std::vector<OpenLog>& logs, const ExportOptions& options);

/// A raw image in colour. Encodings: bgr8 8UC3 rgb8 bgra8 8UC4 rgba8 mono8 8UC1 and full-range
/// BT.601 uyvy yuv422 yuyv yuv422_yuy2 nv12. Data of another size is refused.
tl::expected<image::Image, Status> raw_image(const foxglove::RawImage& raw);

}  // namespace mimesis::tool
