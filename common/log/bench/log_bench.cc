// Writing to and reading from a file in memory (/dev/shm): 64 B, 4 kB and 921 kB messages, three
// codecs. Half of each payload is random, half repeats. Reading checks every sum.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <filesystem>
#include <random>

#include "common/log/stream_reader.h"
#include "common/log/writer.h"

namespace mimesis::log {
namespace {

constexpr std::int64_t kTotal = 64 << 20;  // payload per iteration [bytes]
constexpr int kPayloads = 16;              // different ones, in turn
constexpr int kChannels = 20;

std::string path() { return "/dev/shm/mimesis-bench-" + std::to_string(getpid()) + ".mcap"; }

std::vector<std::string> payloads(std::size_t size) {
  std::mt19937 random(1);
  std::vector<std::string> all(kPayloads, std::string(size, 'a'));
  for (std::string& p : all) {
    for (std::size_t i = 0; i < size; ++i) {
      if (i / 16 % 2 == 0) p[i] = static_cast<char>(random());
    }
  }
  return all;
}

/// False if anything went wrong.
bool write_log(const std::vector<std::string>& all, Compression codec) {
  auto sink = create_file(path());
  if (!sink) return false;
  Writer writer(**sink, {.compression = codec});
  for (int c = 0; c < kChannels; ++c) {
    if (!writer.add_channel(0, "topic" + std::to_string(c), "", {})) return false;
  }
  const auto count = static_cast<std::uint32_t>(kTotal) / static_cast<std::uint32_t>(all[0].size());
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto channel = static_cast<std::uint16_t>(1 + i % kChannels);
    if (!writer.write({channel, i, i, i, all[i % kPayloads]})) return false;
  }
  return writer.finish().has_value();
}

void report(benchmark::State& state, std::size_t size) {
  state.SetBytesProcessed(state.iterations() * (kTotal / static_cast<std::int64_t>(size)) *
                          static_cast<std::int64_t>(size));
  state.SetItemsProcessed(state.iterations() * (kTotal / static_cast<std::int64_t>(size)));
  state.counters["file_per_payload"] =
      static_cast<double>(std::filesystem::file_size(path())) / static_cast<double>(kTotal);
  std::filesystem::remove(path());
}

void write_case(benchmark::State& state) {
  const auto size = static_cast<std::size_t>(state.range(0));
  const auto all = payloads(size);
  for (auto _ : state) {
    if (!write_log(all, static_cast<Compression>(state.range(1))))
      state.SkipWithError("write failed");
  }
  report(state, size);
}

void read_case(benchmark::State& state) {
  const auto size = static_cast<std::size_t>(state.range(0));
  if (!write_log(payloads(size), static_cast<Compression>(state.range(1)))) {
    state.SkipWithError("write failed");
  }
  for (auto _ : state) {
    auto source = open_file(path());
    StreamReader reader(**source);
    std::uint64_t bytes = 0;
    while (const Record* record = reader.next()) {
      if (const auto* m = std::get_if<Message>(record)) bytes += m->data.size();
    }
    benchmark::DoNotOptimize(bytes);
    if (reader.damage_count() > 0) state.SkipWithError("damaged");
  }
  report(state, size);
}

/// Codec: 0 none, 1 lz4, 2 zstd.
void cases(benchmark::internal::Benchmark* b) {
  b->ArgNames({"bytes", "codec"})->Unit(benchmark::kMillisecond)->UseRealTime();
  for (const int size : {64, 4096, 921'600}) {
    for (const int codec : {0, 1, 2}) b->Args({size, codec});
  }
}

BENCHMARK(write_case)->Name("write")->Apply(cases);
BENCHMARK(read_case)->Name("read")->Apply(cases);

}  // namespace
}  // namespace mimesis::log
