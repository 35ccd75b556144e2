// `mimesis log export`: its options, and attachments.
#include "tools/mimesis/log/export.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>

#include "tools/mimesis/log/verb_options.h"

namespace mimesis::tool {
namespace {

struct ExportChoice {
  std::vector<std::string> files;
  CsvOptions csv;
  ImageOptions images;
  std::string attachments, join, output, time = "relative", format = "png";
  TimeRange range;
  bool json = false;
};

int run_export(ExportChoice& o) {
  const int kinds = (o.csv.fields.empty() ? 0 : 1) + (o.images.topic.empty() ? 0 : 1) +
                    (o.attachments.empty() ? 0 : 1);
  if (kinds != 1) {
    throw ConfigError(
        "say what to export: --csv TOPIC.FIELD, --images TOPIC or --attachments FOLDER (JSON "
        "lines: mimesis log cat)");
  }
  if (o.output.empty() && !o.images.topic.empty()) throw ConfigError("--images: say -o FOLDER");
  if (o.output.empty() && !o.csv.fields.empty() && o.json) {
    throw ConfigError("--json: standard output has the CSV; say -o FILE");
  }
  const auto logs = opened(o.files);
  ExportResult result;
  std::string what = "rows";
  if (!o.csv.fields.empty()) {
    static const std::map<std::string, Join> kJoins{
        {"previous", Join::previous}, {"nearest", Join::nearest}, {"outer", Join::outer}};
    if (!o.join.empty()) o.csv.join = kJoins.at(o.join);
    o.csv.absolute = o.time == "absolute";
    o.csv.output = o.output.empty() ? "-" : o.output;
    o.csv.range = o.range;
    result = export_csv(logs, o.csv);
  } else if (!o.images.topic.empty()) {
    what = "images";
    o.images.folder = o.output;
    o.images.jpeg = o.format == "jpeg";
    o.images.range = o.range;
    result = export_images(logs, o.images);
  } else {
    what = "attachments";
    result = export_attachments(logs, o.attachments);
  }
  if (o.json) {
    print_json({{"files", result.files}, {"items", result.items}, {"failures", result.failures}});
  } else {
    std::cerr << fmt::format(
        "{} {}{}\n", result.items, what,
        result.failures == 0 ? "" : fmt::format(", {} failures", result.failures));
  }
  return result.failures == 0 ? 0 : 1;
}

}  // namespace

std::string FileNames::unique(const std::string& name, const std::string& extension) {
  std::string stem;
  for (const char c : name) stem += c == '/' || c == '\\' || c == '\0' ? '_' : c;
  if (stem.empty() || stem.starts_with('.')) stem = "_" + stem;  // no hidden file, no ".."
  std::string file = stem + extension;
  for (int i = 2; !taken_.insert(file).second; ++i)
    file = fmt::format("{}_{}{}", stem, i, extension);
  return file;
}

void make_folder(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw ConfigError("cannot make folder '" + folder + "': " + error.message());
}

ExportResult export_attachments(const std::vector<OpenLog>& logs, const std::string& folder) {
  make_folder(folder);
  ExportResult result;
  FileNames names;
  for (const OpenLog& log : logs) {
    for (const log::AttachmentIndex& index : log.summary.attachments) {
      std::string data;
      const auto attachment = log::read_attachment(*log.source, index, data);
      if (!attachment) {
        ++result.failures;
        std::cerr << fmt::format("{}: attachment {}: {}\n", log.path, index.name,
                                 attachment.error().reason);
        continue;
      }
      const std::filesystem::path name = std::filesystem::path(index.name).filename();
      const auto path = std::filesystem::path(folder) /
                        names.unique(name.stem().string(), name.extension().string());
      errno = 0;
      std::ofstream file(path, std::ios::binary);
      file << data;
      file.close();
      if (!file) throw ConfigError("cannot write '" + path.string() + "': " + std::strerror(errno));
      ++result.items;
      result.files.push_back(path.string());
    }
  }
  return result;
}

void add_export(CLI::App& verb, int& exit_code) {
  CLI::App* sub = verb.add_subcommand(
      "export", "Fields as CSV (spreadsheets, pandas, PlotJuggler), images, attachments of a log");
  auto o = std::make_shared<ExportChoice>();
  sub->add_option("FILE", o->files, "MCAP files: bags, or the parts of one")->required();
  sub->add_option("--csv", o->csv.fields,
                  "TOPIC.FIELD[,FIELD...]: fields over time (repeatable); FIELD[2] is one element, "
                  "FIELD[*] a column for each, TOPIC alone all fields")
      ->allow_extra_args(false);
  sub->add_option("--join", o->join,
                  "Several topics in one table: the last value before each message of the first "
                  "topic, the nearest, or a row per time; without: a file per topic")
      ->check(CLI::IsMember({"previous", "nearest", "outer"}));
  sub->add_option("--time", o->time, "relative to the start of the log, or absolute")
      ->check(CLI::IsMember({"relative", "absolute"}))
      ->capture_default_str();
  sub->add_option("--images", o->images.topic, "Images of this topic as files SEQ_TIME.png");
  sub->add_option("--format", o->format, "Of raw images: png or jpeg")
      ->check(CLI::IsMember({"png", "jpeg"}))
      ->capture_default_str();
  sub->add_option("--quality", o->images.quality, "Of JPEG")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  sub->add_option("--every", o->images.every, "Only each so-manieth image")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  sub->add_option("--attachments", o->attachments, "Attachments into this folder");
  sub->add_option("-o,--output", o->output, "File or folder; CSV goes to standard output without");
  add_time_options(*sub, o->range);
  sub->add_flag("--json", o->json, "Print one JSON object at the end; needs -o for CSV");
  sub->footer(
      "Names of fields end in their unit; numbers read back as the same bits. JSON lines:\n"
      "mimesis log cat --json.\n"
      "Examples: mimesis log export run.mcap --csv bridge/arm.position_rad[*],velocity_rad_s -o "
      "arm.csv\n"
      "          mimesis log export run.mcap --images camera/image -o pictures --every 30");
  on_run(*sub, exit_code, [o] { return run_export(*o); });
}

}  // namespace mimesis::tool
