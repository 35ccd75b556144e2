// Limits of the figures of log_bench: the system's write() and pread(), the codecs alone on the
// records of a chunk of 1 MiB, the sum, and copying in memory. One thread each.
#include <benchmark/benchmark.h>
#include <fcntl.h>
#include <unistd.h>

#include <cstring>

#include "common/log/bench/bench_file.h"
#include "common/log/crc32.h"
#include "common/log/records.h"

namespace mimesis::log {
namespace {

constexpr std::size_t kBlock = 1 << 20;
constexpr std::int64_t kBlocks = 256;

void bytes(benchmark::State& state, std::int64_t per_iteration) {
  state.SetBytesProcessed(state.iterations() * per_iteration);
}

/// The records of a chunk with payloads of `size`.
std::string chunk(std::size_t size) {
  const auto all = payloads(size);
  std::string records;
  for (std::uint32_t i = 0; records.size() < kBlock; ++i) {
    append(records, Message{static_cast<std::uint16_t>(1 + i % 20), i, i, i, all[i % all.size()]});
  }
  return records;
}

void raw_write(benchmark::State& state) {
  const BenchFile file("/dev/shm");
  const std::string block(kBlock, 'x');
  for (auto _ : state) {
    const int fd = ::open(file.path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    for (std::int64_t i = 0; i < kBlocks; ++i) {
      if (::write(fd, block.data(), kBlock) < 0) state.SkipWithError("write failed");
    }
    ::close(fd);
  }
  bytes(state, kBlocks * static_cast<std::int64_t>(kBlock));
}

void raw_read(benchmark::State& state) {
  const BenchFile file("/dev/shm");
  std::string block(kBlock, 'x');
  const int fd = ::open(file.path.c_str(), O_RDWR | O_CREAT | O_TRUNC, 0600);
  for (std::int64_t i = 0; i < kBlocks; ++i) {
    if (::write(fd, block.data(), kBlock) < 0) state.SkipWithError("write failed");
  }
  for (auto _ : state) {
    for (std::int64_t i = 0; i < kBlocks; ++i) {
      if (::pread(fd, block.data(), kBlock, i << 20) < 0) state.SkipWithError("read failed");
    }
  }
  ::close(fd);
  bytes(state, kBlocks * static_cast<std::int64_t>(kBlock));
}

void compress(benchmark::State& state) {
  const std::string records = chunk(static_cast<std::size_t>(state.range(0)));
  Compressor compressor(static_cast<Compression>(state.range(1)));
  for (auto _ : state) benchmark::DoNotOptimize(compressor.run(records));
  bytes(state, static_cast<std::int64_t>(records.size()));
}

void decompress(benchmark::State& state) {
  const std::string records = chunk(static_cast<std::size_t>(state.range(0)));
  const auto codec = static_cast<Compression>(state.range(1));
  Compressor compressor(codec);
  const std::string packed(*compressor.run(records));
  Decompressor decompressor;
  for (auto _ : state) {
    benchmark::DoNotOptimize(decompressor.run(codec, packed, records.size()));
  }
  bytes(state, static_cast<std::int64_t>(records.size()));
}

void sum(benchmark::State& state) {
  const std::string block(kBlock, 'x');
  for (auto _ : state) benchmark::DoNotOptimize(crc32(0, block));
  bytes(state, kBlock);
}

void copy(benchmark::State& state) {
  const std::string from(static_cast<std::size_t>(state.range(0)), 'x');
  std::string to(from.size(), 'y');
  for (auto _ : state) {
    std::memcpy(to.data(), from.data(), from.size());
    benchmark::ClobberMemory();
  }
  bytes(state, state.range(0));
}

/// Codec: 1 lz4, 2 zstd.
void compression_cases(benchmark::internal::Benchmark* b) {
  b->ArgNames({"bytes", "codec"})->Unit(benchmark::kMicrosecond);
  for (const int size : {64, 4096, 921'600}) {
    for (const int codec : {1, 2}) b->Args({size, codec});
  }
}

BENCHMARK(raw_write)->Name("limit_write")->Unit(benchmark::kMillisecond);
BENCHMARK(raw_read)->Name("limit_pread")->Unit(benchmark::kMillisecond);
BENCHMARK(compress)->Name("limit_compress")->Apply(compression_cases);
BENCHMARK(decompress)->Name("limit_decompress")->Apply(compression_cases);
BENCHMARK(sum)->Name("limit_crc32")->Unit(benchmark::kMicrosecond);
BENCHMARK(copy)->Name("limit_memcpy")->Arg(1 << 20)->Arg(256 << 20)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace mimesis::log
