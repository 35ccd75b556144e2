#include "tools/mimesis/log/export.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <deque>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <optional>
#include <set>

#include "common/image/image.h"
#include "tools/mimesis/field_text.h"
#include "tools/mimesis/log/elided_payload.h"
#include "tools/mimesis/log/field_columns.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;

// --- Files

/// Names of files in one folder, for any names in a log.
class FileNames {
 public:
  /// Makes the folder. @throws ConfigError if it cannot; with `lazy` the files report it.
  explicit FileNames(const std::string& folder, bool lazy = false) : folder_(folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error && !lazy) {
      throw ConfigError("cannot make folder '" + folder + "': " + error.message());
    }
  }
  /// "bridge/joint_states" -> "FOLDER/bridge_joint_states.csv", and
  /// "FOLDER/bridge_joint_states_2.csv" the next time. A name that is too long for a file is cut.
  std::string unique(const std::string& name, const std::string& extension) {
    constexpr std::size_t kLongest = 200;  // a file's name has 255 bytes
    std::string stem;
    for (const char c : name) stem += c == '/' || c == '\\' || c == '\0' ? '_' : c;
    cut(stem, kLongest);
    if (stem.empty() || stem.starts_with('.')) stem = "_" + stem;  // no hidden file, no ".."
    std::string file = stem + extension;
    for (int i = 2; !taken_.insert(file).second; ++i)
      file = fmt::format("{}_{}{}", stem, i, extension);
    return (folder_ / file).string();
  }

 private:
  /// Between two characters of UTF-8.
  static void cut(std::string& text, std::size_t longest) {
    if (text.size() <= longest) return;
    while (longest > 0 && (static_cast<unsigned char>(text[longest]) & 0xC0) == 0x80) --longest;
    text.resize(longest);
  }

  fs::path folder_;
  std::set<std::string> taken_;
};

tl::unexpected<Status> no_image(std::string reason) {
  return tl::unexpected(Status{std::move(reason)});
}

tl::expected<void, Status> write_file(const std::string& path, std::string_view bytes) {
  errno = 0;
  std::ofstream file(path, std::ios::binary);
  file << bytes;
  file.close();
  if (!file) return tl::unexpected(Status{std::strerror(errno)});
  return {};
}

// --- CSV

using Cells = std::vector<std::string>;

/// A cell as RFC 4180 wants it: quoted if it has commas, quotes or line ends.
std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) {
    out += c;
    if (c == '"') out += c;
  }
  return out + '"';
}

/// The columns of one topic.
struct TopicTable {
  std::string topic;
  std::vector<FieldColumns> queries;
  std::map<std::pair<std::size_t, FieldColumns::Key>, std::size_t> columns;  ///< by query and key
  bool several_nodes = false;

  std::size_t width() const { return 1 + (several_nodes ? 1 : 0) + columns.size(); }
};

/// "bridge/joint_states.position_rad,velocity_rad_s" -> both with their topic.
std::vector<FieldQuery> csv_fields(const std::string& text,
                                   const std::vector<std::string>& topics) {
  std::vector<FieldQuery> queries;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t comma = std::min(text.find(',', from), text.size());
    const std::string part = text.substr(from, comma - from);
    from = comma + 1;
    const bool has_topic = std::ranges::any_of(topics, [&](const std::string& topic) {
      return part == topic || part.starts_with(topic + ".");
    });
    if (!queries.empty() && !has_topic) {
      if (part.empty()) throw ConfigError("--csv " + text + ": expected a field behind the comma");
      queries.push_back({queries.back().topic, part});
    } else {
      queries.push_back(parse_field_query(part, topics));
    }
  }
  return queries;
}

/// A file, or standard output.
class CsvFile {
 public:
  explicit CsvFile(const std::string& path) : path_(path) {
    if (path == "-") return;
    errno = 0;
    file_.open(path, std::ios::binary);
    if (!file_) throw ConfigError("cannot write '" + path + "': " + std::strerror(errno));
  }
  void row(std::string line, const Cells& cells) {
    for (const std::string& cell : cells) line += "," + cell;
    (path_ == "-" ? std::cout : file_) << line << '\n';
  }
  void close() {
    errno = 0;
    std::ostream& out = path_ == "-" ? std::cout : file_;
    out.flush();
    if (!out) throw ConfigError("cannot write '" + path_ + "': " + std::strerror(errno));
  }

 private:
  std::string path_;
  std::ofstream file_;
};

class CsvWriter {
 public:
  CsvWriter(const std::vector<OpenLog>& logs, const ExportOptions& options)
      : logs_(logs),
        options_(options),
        times_(resolve(options.range, span_of(logs))),
        origin_ns_(span_of(logs).start_ns) {
    const auto topics = topics_of(logs);
    for (const std::string& text : options.csv) {
      for (FieldQuery& query : csv_fields(text, topics)) {
        auto table = std::ranges::find(tables_, query.topic, &TopicTable::topic);
        if (table == tables_.end()) {
          tables_.push_back({query.topic, {}, {}, false});
          table = std::prev(tables_.end());
        }
        table->queries.emplace_back(std::move(query));
      }
    }
    for (TopicTable& table : tables_) check(table);
  }

  ExportResult run() {
    find_columns();
    const std::string output = options_.output.empty() ? "-" : options_.output;
    if (tables_.size() > 1 && output == "-") throw ConfigError("several topics: say -o FOLDER");
    std::deque<CsvFile> sheets;
    std::optional<FileNames> names;
    if (tables_.size() > 1) names.emplace(output, /*lazy=*/true);
    for (const TopicTable& table : tables_) {
      const std::string path = names ? names->unique(table.topic, ".csv") : output;
      sheets.emplace_back(path).row("log_time_s", heading(table));
      if (path != "-") result_.files.push_back(path);
    }
    scan("export", true, [&](const Item& item) {
      const std::size_t index = index_of(item);
      const auto* message = decoder_.decode(item);
      if (message == nullptr) return;
      sheets[index].row(seconds_text(item.message->log_time, origin_ns_),
                        cells(tables_[index], item, *message));
      ++result_.items;
    });
    for (CsvFile& sheet : sheets) sheet.close();
    return std::move(result_);
  }

 private:
  /// Reports errors in the fields before anything is read.
  void check(TopicTable& table) {
    std::set<std::string> nodes;
    for (const OpenChannel& c : channels_of(logs_)) {
      if (c.channel->topic != table.topic) continue;
      nodes.insert(sender_of(*c.channel));
      for (FieldColumns& query : table.queries) query.check(decoder_.type(c));
    }
    table.several_nodes = nodes.size() > 1;
  }

  template <class Take>
  std::uint64_t scan(const std::string& what, bool silent, const Take& take) {
    const auto wanted = [this](const log::Channel& c) {
      return std::ranges::find(tables_, c.topic, &TopicTable::topic) != tables_.end();
    };
    return scan_logs(logs_, {wanted, times_.start, times_.end}, what, take, silent);
  }

  std::size_t index_of(const Item& item) const {
    return static_cast<std::size_t>(
        std::ranges::find(tables_, item.channel->topic, &TopicTable::topic) - tables_.begin());
  }

  /// How many elements the repeated fields have is known when all messages were read.
  void find_columns() {
    result_.failures += scan("columns", false, [&](const Item& item) {
      TopicTable& table = tables_[index_of(item)];
      const auto* message = decoder_.decode_or_tell(item);
      result_.failures += message == nullptr ? 1 : 0;
      if (message == nullptr) return;
      for (std::size_t q = 0; q < table.queries.size(); ++q) {
        table.queries[q].visit(*message, [&](const FieldColumns::Key& key, const auto&) {
          table.columns.try_emplace({q, key});
        });
      }
    });
    for (TopicTable& table : tables_) {
      std::size_t next = table.several_nodes ? 2 : 1;
      for (auto& [key, column] : table.columns) column = next++;
    }
  }

  static Cells heading(const TopicTable& table) {
    Cells cells{"publish_time_s"};
    if (table.several_nodes) cells.push_back("node");
    for (const auto& [key, column] : table.columns) {
      cells.push_back(csv_cell(table.queries[key.first].name(key.second)));
    }
    return cells;
  }

  Cells cells(TopicTable& table, const Item& item, const google::protobuf::Message& message) const {
    Cells out(table.width());
    out[0] = seconds_text(item.message->publish_time, origin_ns_);
    if (table.several_nodes) out[1] = csv_cell(sender_of(*item.channel));
    for (std::size_t q = 0; q < table.queries.size(); ++q) {
      table.queries[q].visit(message, [&](const FieldColumns::Key& key, const auto& v) {
        out[table.columns.at({q, key})] = csv_cell(field_text(v.message, v.field, v.index));
      });
    }
    return out;
  }

  const std::vector<OpenLog>& logs_;
  const ExportOptions& options_;
  LogTimes times_;
  std::uint64_t origin_ns_;
  LogDecoder decoder_;
  std::vector<TopicTable> tables_;
  ExportResult result_;
};

// --- Images

constexpr std::uint32_t kLargestSide = 16384;

/// Pixels in groups: their places of blue, green and red, or of the first luminance, U, the second
/// luminance and V.
struct PixelLayout {
  std::string_view name;
  std::uint32_t bytes;  ///< bytes of a group
  int at[4];
  std::uint32_t pixels = 1;  ///< pixels of a group; 2: YUV
};
constexpr PixelLayout kLayouts[] = {
    {"bgr8", 3, {0, 1, 2}},       {"8UC3", 3, {0, 1, 2}},
    {"rgb8", 3, {2, 1, 0}},       {"bgra8", 4, {0, 1, 2}},
    {"8UC4", 4, {0, 1, 2}},       {"rgba8", 4, {2, 1, 0}},
    {"mono8", 1, {0, 0, 0}},      {"8UC1", 1, {0, 0, 0}},
    {"uyvy", 4, {1, 0, 3, 2}, 2}, {"yuv422", 4, {1, 0, 3, 2}, 2},
    {"yuyv", 4, {0, 1, 2, 3}, 2}, {"yuv422_yuy2", 4, {0, 1, 2, 3}, 2}};

void put_yuv(double y, double u, double v, std::uint8_t* bgr) {
  const auto clamped = [](double value) {
    return static_cast<std::uint8_t>(std::clamp(std::lround(value), 0l, 255l));
  };
  bgr[0] = clamped(y + 1.772 * (u - 128.0));
  bgr[1] = clamped(y - 0.344136 * (u - 128.0) - 0.714136 * (v - 128.0));
  bgr[2] = clamped(y + 1.402 * (v - 128.0));
}

/// A file NAME.png or the like of the image in a message.
tl::expected<void, Status> write_image(const Item& item, const std::string& name,
                                       FileNames& names) {
  if (item.schema->name == "foxglove.CompressedImage") {
    foxglove::CompressedImage image;
    if (!parse(item, image)) return no_image("no valid message");
    const std::string& format = image.format();
    const bool plain = !format.empty() && format.size() < 8 &&
                       std::ranges::all_of(format, [](unsigned char c) { return std::isalnum(c); });
    if (!plain) return no_image("format '" + format + "': expected jpeg, png or the like");
    return write_file(names.unique(name, format == "jpeg" ? ".jpg" : "." + format), image.data());
  }
  foxglove::RawImage raw;
  if (!parse(item, raw)) return no_image("no valid message");
  const auto image = raw_image(raw);
  if (!image) return tl::unexpected(image.error());
  return image::write_png(names.unique(name, ".png"), *image);
}

int run_export(const ExportOptions& o) {
  if (o.csv.empty() == o.images.empty()) {
    throw ConfigError(
        "say what to export: --csv TOPIC.FIELD or --images TOPIC (JSON lines, attachments: mimesis "
        "log cat)");
  }
  if (o.output.empty() && !o.images.empty()) throw ConfigError("--images: say -o FOLDER");
  if (o.output.empty() && !o.csv.empty() && o.json) {
    throw ConfigError("--json: standard output has the CSV; say -o FILE");
  }
  const auto logs = open_logs(o.files);
  const ExportResult result = o.csv.empty() ? export_images(logs, o) : export_csv(logs, o);
  if (o.json) {
    print_json({{"files", result.files}, {"items", result.items}, {"failures", result.failures}});
  } else {
    std::cerr << fmt::format(
        "{} {}{}\n", result.items, o.csv.empty() ? "images" : "rows",
        result.failures == 0 ? "" : fmt::format(", {} failures", result.failures));
  }
  return result.failures == 0 ? 0 : 1;
}

}  // namespace

ExportResult export_csv(const std::vector<OpenLog>& logs, const ExportOptions& options) {
  return CsvWriter(logs, options).run();
}

tl::expected<image::Image, Status> raw_image(const foxglove::RawImage& raw) {
  const auto* layout = std::ranges::find(kLayouts, raw.encoding(), &PixelLayout::name);
  // A plane of luminance, then one of U and V by turns with half as many rows.
  const bool nv12 = raw.encoding() == "nv12";
  if (!nv12 && layout == std::end(kLayouts)) {
    return no_image(
        "encoding '" + raw.encoding() +
        "': expected one of bgr8, rgb8, bgra8, rgba8, mono8, 8UC1, 8UC3, 8UC4, uyvy, yuyv, "
        "yuv422, yuv422_yuy2, nv12");
  }
  const std::uint64_t width = raw.width(), height = raw.height();
  if (nv12 && (width % 2 != 0 || height % 2 != 0)) return no_image("nv12: an odd side");
  const std::uint64_t group = nv12 ? 1 : layout->pixels;
  if (width % group != 0) return no_image(raw.encoding() + ": the width is odd");
  if (width == 0 || height == 0 || width > kLargestSide || height > kLargestSide) {
    return no_image(fmt::format("{} x {} px is no size of an image", width, height));
  }
  const std::uint64_t row_bytes = nv12 ? width : width / group * layout->bytes;
  const std::uint64_t rows = nv12 ? height * 3 / 2 : height;
  const std::uint64_t step = raw.step() != 0 ? raw.step() : row_bytes;
  if (step < row_bytes || raw.data().size() < step * (rows - 1) + row_bytes) {
    return no_image(fmt::format("{} x {} px {} need {} bytes in rows of {}, found {} in rows of {}",
                                width, height, raw.encoding(), row_bytes * rows, row_bytes,
                                raw.data().size(), step));
  }
  image::Image out(static_cast<int>(width), static_cast<int>(height));
  const auto* data = reinterpret_cast<const std::uint8_t*>(raw.data().data());
  for (std::uint64_t v = 0; v < height; ++v) {
    const std::uint8_t* row = data + step * v;
    const std::uint8_t* uv = data + step * (height + v / 2);  // plane of nv12
    for (std::uint64_t u = 0; u < width; ++u) {
      std::uint8_t* to = out.at(static_cast<int>(u), static_cast<int>(v));
      if (nv12) {
        put_yuv(row[u], uv[u / 2 * 2], uv[u / 2 * 2 + 1], to);
        continue;
      }
      const std::uint8_t* from = row + u / group * layout->bytes;
      if (group == 2) {
        put_yuv(from[layout->at[u % 2 * 2]], from[layout->at[1]], from[layout->at[3]], to);
      } else {
        for (int i = 0; i < 3; ++i) to[i] = from[layout->at[i]];
      }
    }
  }
  return out;
}

ExportResult export_images(const std::vector<OpenLog>& logs, const ExportOptions& options) {
  require_topic(logs, options.images);
  for (const OpenChannel& c : channels_of(logs)) {
    const bool images = c.type() == "foxglove.RawImage" || c.type() == "foxglove.CompressedImage";
    if (c.channel->topic != options.images || images) continue;
    throw ConfigError(options.images + ": expected foxglove.RawImage or foxglove.CompressedImage" +
                      ", found '" + c.type() + "'");
  }
  FileNames names(options.output);
  const Span span = span_of(logs);
  const LogTimes times = resolve(options.range, span);
  for (const OpenChannel& c : channels_of(logs)) {
    if (c.channel->topic == options.images && is_elided(*c.channel)) {
      throw VerbEnd{options.images + " has elided payloads in the log: mimesis log restore " +
                        c.log->path + " WHOLE.mcap writes the images, then export from there",
                    1};
    }
  }
  const auto wanted = [&](const log::Channel& c) { return c.topic == options.images; };
  ExportResult result{.files = {options.output}};
  std::uint64_t count = 0;
  const auto take = [&](const Item& item) {
    ++count;
    const log::Message& m = *item.message;
    const std::string name = fmt::format("{:06}_{}", m.sequence != 0 ? m.sequence : count,
                                         seconds_text(m.log_time, span.start_ns));
    if (const auto written = write_image(item, name, names)) {
      ++result.items;
    } else {
      ++result.failures;
      std::cerr << fmt::format("{}: seq {}: {}\n", options.images, m.sequence,
                               written.error().reason);
    }
  };
  result.failures += scan_logs(logs, {wanted, times.start, times.end}, "images", take);
  return result;
}

void add_export(CLI::App& verb, int& exit_code) {
  CLI::App* sub = verb.add_subcommand(
      "export", "Fields as CSV (spreadsheets, pandas, PlotJuggler), images of a log");
  auto o = std::make_shared<ExportOptions>();
  sub->add_option("FILE", o->files, "MCAP files: bags, or the parts of one")->required();
  sub->add_option(
         "--csv", o->csv,
         "TOPIC.FIELD[,FIELD...]: fields over time (repeatable); FIELD[2] is one element, "
         "FIELD[*] a column for each, TOPIC alone all fields; several topics: a file for each")
      ->allow_extra_args(false);
  sub->add_option("--images", o->images, "Images of this topic as files SEQ_TIME.png");
  sub->add_option("-o,--output", o->output, "File or folder; default for CSV: standard output");
  add_time_options(*sub, o->range);
  sub->add_flag("--json", o->json, "Print one JSON object at the end; needs -o for CSV");
  sub->footer(
      "Names of fields end in their unit; numbers read back as the same bits. JSON lines:\n"
      "mimesis log cat --json.\n"
      "Examples: mimesis log export run.mcap --csv "
      "bridge/joint_states.position_rad[*],velocity_rad_s -o "
      "arm.csv\n"
      "          mimesis log export run.mcap --images camera/image -o pictures");
  on_run(*sub, exit_code, [o] { return run_export(*o); });
}

}  // namespace mimesis::tool
