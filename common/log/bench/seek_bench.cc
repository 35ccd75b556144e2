// A file of 2 GB on the disk (in the page cache): opening it by its summary, and from a random time
// to the first message there. The file is written once per codec, to /tmp.
#include <benchmark/benchmark.h>

#include <random>

#include "common/log/bench/bench_file.h"
#include "common/log/indexed_reader.h"

namespace mimesis::log {
namespace {

constexpr std::size_t kSize = 921'600;  // size of a message [bytes]

/// Log times 0 ... count - 1.
std::uint32_t message_count(Compression codec) {
  return codec == Compression::none ? 2200 : 4300;  // for 2 GB
}

/// The file of `codec`, null if it cannot be written.
const BenchFile* large_file(Compression codec) {
  static const BenchFile file("/tmp");
  static std::optional<Compression> has;
  if (has != codec && !file.write(payloads(kSize), message_count(codec), codec)) return nullptr;
  has = codec;
  return &file;
}

void open_case(benchmark::State& state) {
  const BenchFile* file = large_file(static_cast<Compression>(state.range(0)));
  if (file == nullptr) return state.SkipWithError("write failed");
  for (auto _ : state) {
    auto source = open_file(file->path);
    benchmark::DoNotOptimize(summarize(**source));
  }
  state.counters["GB"] = 1e-9 * static_cast<double>(file->size());
}

void seek_case(benchmark::State& state) {
  const auto codec = static_cast<Compression>(state.range(0));
  const BenchFile* file = large_file(codec);
  if (file == nullptr) return state.SkipWithError("write failed");
  const auto source = open_file(file->path);
  const auto summary = summarize(**source);
  std::mt19937 random(1);
  for (auto _ : state) {
    const std::uint64_t time = random() % message_count(codec);
    IndexedReader reader(**source, *summary, {.channel = nullptr, .start_time = time});
    const Message* message = reader.next();
    if (message == nullptr || message->log_time != time) state.SkipWithError("wrong message");
  }
}

void codecs(benchmark::internal::Benchmark* b) {
  b->ArgName("codec")->Unit(benchmark::kMillisecond)->UseRealTime();
}

BENCHMARK(open_case)->Name("open_2GB")->Apply(codecs)->Arg(0);
BENCHMARK(seek_case)->Name("seek_2GB")->Apply(codecs)->Arg(0);
BENCHMARK(open_case)->Name("open_2GB")->Apply(codecs)->Arg(2);
BENCHMARK(seek_case)->Name("seek_2GB")->Apply(codecs)->Arg(2);

}  // namespace
}  // namespace mimesis::log
