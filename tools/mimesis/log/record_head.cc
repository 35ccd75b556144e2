#include "tools/mimesis/log/record_head.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/error.h"

namespace mimesis::tool {

RecordHead::RecordHead(const std::vector<std::string>& attach_paths, Provenance provenance,
                       Options options)
    : provenance_(std::move(provenance)), options_(std::move(options)) {
  for (const std::string& path : attach_paths) {
    if (!attach(path)) throw ConfigError("--attach: cannot read '" + path + "'");
  }
  const std::string& launch_file = provenance_.launch_file;
  const bool given = std::ranges::find(attach_paths, launch_file) != attach_paths.end();
  if (!launch_file.empty() && !given) attach(launch_file);
}

bool RecordHead::attach(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream content;
  content << in.rdbuf();
  if (!in || in.bad()) return false;
  attached_.push_back({std::filesystem::path(path).filename().string(), content.str()});
  return true;
}

tl::expected<std::unique_ptr<RecordFile>, Status> RecordHead::open(const std::string& path) const {
  auto sink = log::create_file(path);
  if (!sink) return tl::unexpected(sink.error());
  auto file = std::make_unique<RecordFile>(std::move(*sink), options_.writer, options_.descriptors,
                                           options_.sync);
  log::Writer& writer = file->writer();
  const std::uint64_t time = std::stoull(provenance_.run.metadata.at("started_ns"));
  log::Result done = writer.add_metadata(provenance_.run);
  if (done && provenance_.launch) done = writer.add_metadata(*provenance_.launch);
  for (const Attached& attached : attached_) {
    const bool yaml = attached.name.ends_with(".yaml");
    if (done) {
      done = writer.attach({.log_time = time,
                            .create_time = time,
                            .name = attached.name,
                            .media_type = yaml ? "application/yaml" : "application/octet-stream",
                            .data = attached.data});
    }
  }
  if (!done) return tl::unexpected(done.error());
  return file;
}

}  // namespace mimesis::tool
