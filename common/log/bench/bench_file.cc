#include "common/log/bench/bench_file.h"

#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <random>

#include "common/log/writer.h"

namespace mimesis::log {

std::vector<std::string> payloads(std::size_t size) {
  std::mt19937 random(1);
  std::vector<std::string> all(size > 100'000 ? 16 : 64, std::string(size, 'a'));
  for (std::string& p : all) {
    for (std::size_t i = 0; i < size; ++i) {
      if (size == 4096 ? i < 32 : i / 16 % 2 == 0) p[i] = static_cast<char>(random());
    }
  }
  return all;
}

BenchFile::BenchFile(const std::string& folder)
    : path(folder + "/mimesis-bench-" + std::to_string(getpid()) + ".mcap") {}

BenchFile::~BenchFile() {
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
}

bool BenchFile::write(const std::vector<std::string>& all, std::uint32_t count,
                      Compression codec) const {
  constexpr std::uint32_t kChannels = 20;
  auto sink = create_file(path);
  if (!sink) return false;
  Writer writer(**sink, {.compression = codec});
  for (std::uint32_t c = 0; c < kChannels; ++c) {
    if (!writer.add_channel(0, "topic" + std::to_string(c), "", {})) return false;
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto channel = static_cast<std::uint16_t>(1 + i % kChannels);
    if (!writer.write({channel, i, i, i, all[i % all.size()]})) return false;
  }
  return writer.finish().has_value();
}

std::uint64_t BenchFile::size() const { return std::filesystem::file_size(path); }

double cpu_s() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

}  // namespace mimesis::log
