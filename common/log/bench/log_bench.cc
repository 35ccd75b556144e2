// Writing to and reading from a file in memory (/dev/shm): 64 B, 4 kB and 921 kB messages, three
// codecs; bytes_per_second is payload. Reading checks every sum. Counters: size of the file per
// payload, CPU time of all threads per message.
#include <benchmark/benchmark.h>

#include "common/log/bench/bench_file.h"
#include "common/log/stream_reader.h"

namespace mimesis::log {
namespace {

constexpr std::int64_t kTotal = 256 << 20;  // payload per iteration [bytes]

struct Case {
  explicit Case(const benchmark::State& state)
      : size(state.range(0)),
        count(static_cast<std::uint32_t>((size == 64 ? kTotal / 4 : kTotal) / size)),
        codec(static_cast<Compression>(state.range(1))) {}

  bool write() const { return file.write(all, count, codec); }
  void report(benchmark::State& state) const {
    const double messages = static_cast<double>(state.iterations()) * count;
    state.SetBytesProcessed(state.iterations() * count * size);
    state.counters["file_per_payload"] =
        static_cast<double>(file.size()) / static_cast<double>(count * size);
    state.counters["cpu_us_per_message"] = 1e6 * (cpu_s() - before_s) / messages;
  }

  std::int64_t size;
  std::uint32_t count;
  Compression codec;
  BenchFile file{"/dev/shm"};
  std::vector<std::string> all = payloads(static_cast<std::size_t>(size));
  double before_s = cpu_s();
};

void write_case(benchmark::State& state) {
  const Case c(state);
  for (auto _ : state) {
    if (!c.write()) state.SkipWithError("write failed");
  }
  c.report(state);
}

void read_case(benchmark::State& state) {
  Case c(state);
  if (!c.write()) state.SkipWithError("write failed");
  c.before_s = cpu_s();
  for (auto _ : state) {
    auto source = open_file(c.file.path);
    StreamReader reader(**source);
    std::uint64_t bytes = 0;
    while (const Record* record = reader.next()) {
      if (const auto* m = std::get_if<Message>(record)) bytes += m->data.size();
    }
    benchmark::DoNotOptimize(bytes);
    if (reader.damage_count() > 0) state.SkipWithError("damaged");
  }
  c.report(state);
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
