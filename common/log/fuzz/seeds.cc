// log_fuzz_seeds FOLDER: small logs of all codecs to begin with. In half of them no sums are given,
// so that changed records reach the code behind the sums.
#include <filesystem>
#include <fstream>
#include <iostream>

#include "common/log/summary.h"
#include "common/log/writer.h"

namespace {

using namespace mimesis::log;

std::string log_of(Compression codec, std::size_t chunk_size, bool summary) {
  std::string out;
  MemorySink sink(out);
  Writer writer(sink, {.library = "",
                       .compression = codec,
                       .chunk_size = chunk_size,
                       .background = false,
                       .chunk_index = summary,
                       .statistics = summary});
  bool done = writer.add_schema("a.A", "protobuf", "descriptors").has_value();
  done &= writer.add_channel(1, "a/out", "protobuf", {{"node", "a"}}).has_value();
  done &= writer.add_channel(0, "b", "", {}).has_value();
  for (std::uint32_t i = 0; i < 8; ++i) {
    const std::string data(i * i, 'x');
    done &= writer.write({static_cast<std::uint16_t>(1 + i % 2), i, 10 - i, i, data}).has_value();
  }
  Attachment attachment;
  attachment.name = "n";
  attachment.data = "data";
  done &= writer.attach(attachment).has_value();
  done &= writer.add_metadata({"m", {{"k", "v"}}}).has_value();
  done &= writer.finish().has_value();
  return done ? out : "";
}

std::string without_sums(std::string file) {
  const MemorySource source(file);
  const auto summary = scan(source);
  for (const Segment& s : summary->segments) {
    if (!s.bare) file.replace(s.index.chunk_start_offset + kRecordHead + 24, 4, 4, '\0');
  }
  file.replace(file.size() - kMagic.size() - 4, 4, 4, '\0');
  return file;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: log_fuzz_seeds FOLDER\n";
    return 2;
  }
  const std::filesystem::path folder(argv[1]);
  std::filesystem::create_directories(folder);
  int n = 0;
  const auto put = [&](const std::string& file) {
    std::ofstream(folder / ("seed" + std::to_string(n++)), std::ios::binary) << file;
  };
  for (const Compression codec : {Compression::none, Compression::lz4, Compression::zstd}) {
    for (const std::size_t chunk_size : {0u, 100u, 10'000u}) {
      for (const bool summary : {false, true}) {
        const std::string file = log_of(codec, chunk_size, summary), open = without_sums(file);
        put(file);
        put(open);
        put(open.substr(0, open.size() * 2 / 3));
        put(open.substr(0, open.size() / 3));
      }
    }
  }
  return 0;
}
