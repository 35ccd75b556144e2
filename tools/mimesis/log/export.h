#pragma once
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/error.h"
#include "common/image/image.h"
#include "proto/foxglove/image.pb.h"
#include "tools/mimesis/log/export_join.h"
#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// One thing was written, or why not.
struct ExportResult {
  std::vector<std::string> files;
  std::uint64_t items = 0;     ///< rows, images or attachments
  std::uint64_t failures = 0;  ///< messages that could not be decoded, and damages; each was said
};

struct CsvOptions {
  std::vector<std::string> fields = {};  ///< "TOPIC.FIELD[,FIELD...]"
  std::optional<Join> join = {};         ///< of several topics; without: a file for each
  bool absolute = false;                 ///< times as they are; else from the start of the log
  std::string output = {};  ///< file, folder for several files, or "-": standard output
  TimeRange range = {};
};

/// Fields over time: columns log_time_s, publish_time_s, node (where a topic has several), then the
/// fields in the order given, elements by their index. Numbers read back as the same bits.
/// @throws ConfigError for a topic or field that is not there, or a file that cannot be written.
ExportResult export_csv(const std::vector<OpenLog>& logs, const CsvOptions& options);

struct ImageOptions {
  std::string topic = {};
  std::string folder = {};
  bool jpeg = false;  ///< instead of PNG, for raw images
  int quality = 90;   ///< of JPEG, 1..100
  int every = 1;      ///< only each so-manieth image
  TimeRange range = {};
};

/// foxglove.RawImage and CompressedImage as files SEQ_TIME.png; compressed ones as they are.
/// @throws ConfigError if there is no such topic, or no images on it.
ExportResult export_images(const std::vector<OpenLog>& logs, const ImageOptions& options);

/// A raw image in colour. Encodings: bgr8 8UC3 rgb8 bgra8 8UC4 rgba8 mono8 8UC1 and full-range
/// BT.601 uyvy yuv422 yuyv yuv422_yuy2 nv12. What the size does not agree with is refused.
tl::expected<image::Image, Status> raw_image(const foxglove::RawImage& raw);

/// Attachments under their names, without folders. @throws ConfigError if one cannot be written.
ExportResult export_attachments(const std::vector<OpenLog>& logs, const std::string& folder);

/// Names of files in one folder, whatever a log calls things.
class FileNames {
 public:
  /// "bridge/arm" -> "bridge_arm.csv", and "bridge_arm_2.csv" the next time.
  std::string unique(const std::string& name, const std::string& extension);

 private:
  std::set<std::string> taken_;
};

/// @throws ConfigError
void make_folder(const std::string& folder);

}  // namespace mimesis::tool
