#include "common/runtime/payload_memory.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <random>

#include "common/runtime/ports.h"
#include "common/runtime/raw.h"
#include "common/testing/process.h"
#include "proto/foxglove/image.pb.h"

namespace mimesis::runtime {
namespace {

using testing::TestGraph;
using testing::TestNode;
using namespace std::chrono_literals;
using foxglove::CompressedImage;

TEST(PayloadMemory, IsReadUntilItIsOverwritten) {
  PayloadMemory memory;
  const auto first = memory.write("first");
  ASSERT_TRUE(first);
  const auto reader = MappedPayloads::open(getpid(), first->fd);
  ASSERT_NE(reader, nullptr);
  std::string got;
  EXPECT_TRUE(reader->read(*first, got));
  EXPECT_EQ(got, "first");
  for (std::size_t i = 1; i < PayloadMemory::kSlots; ++i) ASSERT_TRUE(memory.write("later"));
  EXPECT_TRUE(reader->read(*first, got)) << "as many as there are slots are kept";
  ASSERT_TRUE(memory.write("one more"));
  EXPECT_FALSE(reader->read(*first, got));
}

TEST(PayloadMemory, GrowsUnderItsReaders) {
  PayloadMemory memory;
  const auto small = memory.write("small");
  const auto reader = MappedPayloads::open(getpid(), small->fd);
  const std::string large(3'000'000, 'x');
  const auto place = memory.write(large);
  ASSERT_TRUE(place);
  EXPECT_EQ(place->fd, small->fd);
  std::string got;
  EXPECT_FALSE(reader->read(*small, got)) << "its slot has moved";
  EXPECT_TRUE(reader->read(*place, got));
  EXPECT_EQ(got, large);
}

TEST(PayloadMemory, OpensNothingElse) {
  const int other = open("/dev/null", O_RDONLY | O_CLOEXEC);
  EXPECT_EQ(MappedPayloads::open(getpid(), static_cast<std::uint64_t>(other)), nullptr);
  EXPECT_NE(errno, ENOENT);
  close(other);
  EXPECT_EQ(MappedPayloads::open(getpid(), 9999), nullptr);
  EXPECT_EQ(errno, ENOENT);
  const pid_t ended = fork();
  if (ended == 0) _exit(0);
  waitpid(ended, nullptr, 0);
  EXPECT_EQ(MappedPayloads::open(ended, 3), nullptr);
  EXPECT_EQ(errno, ENOENT);
}

TEST(PayloadMemory, NoPlaceReadsBeyondIt) {
  PayloadMemory memory;
  const auto place = memory.write("here");
  const auto reader = MappedPayloads::open(getpid(), place->fd);
  std::mt19937_64 random(1);
  std::string got;
  for (int i = 0; i < 10'000; ++i) {
    PayloadPlace wild = *place;
    (i % 2 == 0 ? wild.offset : wild.size) = random() >> (random() % 64);
    if (reader->read(wild, got)) {
      EXPECT_LE(got.size(), std::size_t{1} << 20U);
    }
    std::string bytes = encode(*place);
    bytes[random() % bytes.size()] = static_cast<char>(random());
    if (const auto decoded = decode_place(bytes)) reader->read(*decoded, got);
  }
  EXPECT_FALSE(decode_place("short"));
}

/// One number, repeated, of a size that follows from it: half of another payload shows.
std::string payload_of(std::uint64_t n) {
  return std::string(100'000 + n % 7 * 40'000, static_cast<char>(n * 31));
}

// Torn payloads are noticed, whoever is killed and whenever. A writer that does nothing else
// overwrites each within microseconds.
TEST(PayloadMemory, NobodyReadsHalfAPayload) {
  int whole = 0;
  for (int round = 0; round < 20; ++round) {
    std::array<int, 2> pipe_fds{};
    ASSERT_EQ(pipe(pipe_fds.data()), 0);
    const pid_t writer = fork();
    if (writer == 0) {
      PayloadMemory memory;
      for (std::uint64_t n = 1;; ++n) {
        const auto place = memory.write(payload_of(n));
        const std::string told =
            encode(*place) + std::string(reinterpret_cast<char*>(&n), sizeof n);
        if (write(pipe_fds[1], told.data(), told.size()) < 0) _exit(1);
      }
    }
    close(pipe_fds[1]);
    std::shared_ptr<MappedPayloads> reader;
    std::string got, told(48, '\0');
    for (int i = 0; i < 500 && read(pipe_fds[0], told.data(), told.size()) == 48; ++i) {
      const auto place = decode_place(std::string_view(told).substr(0, 40));
      ASSERT_TRUE(place);
      if (!reader) reader = MappedPayloads::open(writer, place->fd);
      ASSERT_NE(reader, nullptr);
      std::uint64_t n = 0;
      std::memcpy(&n, told.data() + 40, sizeof n);
      if (reader->read(*place, got)) {
        ++whole;
        ASSERT_EQ(got, payload_of(n));
      }
      if (i == 100 + round) kill(writer, SIGKILL);
    }
    kill(writer, SIGKILL);
    waitpid(writer, nullptr, 0);
    close(pipe_fds[0]);
    const auto again = decode_place(std::string_view(told).substr(0, 40));
    reader->read(*again, got);  // the memory lives as long as it is mapped
  }
  EXPECT_GT(whole, 0);
}

std::size_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::size_t all = 0, resident = 0;
  statm >> all >> resident;
  return resident * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

struct Pictures {
  explicit Pictures(const TestNode::Wiring& wiring = {{"in", "t/x"}})
      : eye(graph, wiring, {}, "eye") {}

  TestGraph graph;
  TestNode camera{graph, {}, {{"out", "t/x"}}, "camera"};
  TestNode eye;
  Out<CompressedImage> out{camera.bus(), "out"};
  std::unique_ptr<InChannel> in =
      eye.bus().subscribe("in", CompressedImage::default_instance(), {});

  void send(char value, std::size_t bytes) {
    CompressedImage image;
    image.set_data(std::string(bytes, value));
    out.send(image, 1s);
    camera.until([] { return true; });
  }
  /// Serves both nodes until `done`.
  bool until(const std::function<bool()>& done) {
    return camera.until([&] {
      eye.until([] { return true; });
      return done();
    });
  }
};

TEST(MappedInput, OfOneThatDoesNotReadHoldsNoCopies) {
  Pictures p;
  p.camera.open();
  p.eye.open();
  ASSERT_TRUE(
      p.until([&] { return p.out.subscribers() > 0 && !p.camera.bus().known_nodes().empty(); }));
  constexpr std::size_t kBytes = std::size_t{20} << 20U;
  p.send('a', kBytes);
  const std::size_t before = resident_bytes();
  for (char c = 'b'; c <= 'z'; ++c) p.send(c, kBytes);
  // Of this process: three slots, the message, its frame, one to spare.
  EXPECT_LT(resident_bytes(), before + 6 * kBytes);
  ASSERT_TRUE(p.until([&] { return p.in->counters().received == 26; }));
  const auto got = p.in->pop();
  ASSERT_TRUE(got);
  CompressedImage image;
  ASSERT_TRUE(image.ParseFromString(got->payload));
  EXPECT_EQ(image.data(), std::string(kBytes, 'z'));
  EXPECT_EQ(got->seq, 26U);
  EXPECT_EQ(p.in->counters().dropped, 25U);
  EXPECT_EQ(p.in->counters().lost, 0U);
}

TEST(MappedInput, ReadsAfterThePublishersEnd) {
  Pictures p;
  p.camera.open();
  p.eye.open();
  ASSERT_TRUE(p.until([&] { return p.out.subscribers() > 0; }));
  p.send('x', 1'000'000);
  ASSERT_TRUE(p.until([&] { return p.in->counters().received == 1; }));
  const auto got = p.in->pop();
  ASSERT_TRUE(got);
  EXPECT_GT(got->payload.size(), 1'000'000U);
}

// A tap and an input that keeps several take copies, and so does everybody then.
TEST(MappedInput, OthersGetCopies) {
  Pictures p({{"in", "t/x"}, {"all", "t/x"}});
  auto all = p.eye.bus().subscribe("all", CompressedImage::default_instance(),
                                   {.policy = Policy::queue, .depth = 100});
  p.camera.open();
  p.eye.open();
  ASSERT_TRUE(p.until([&] { return p.out.subscribers() > 0; }));
  for (char c = 'a'; c <= 'j'; ++c) p.send(c, 100'000);
  ASSERT_TRUE(p.until([&] { return all->counters().received == 10; }));
  for (char c = 'a'; c <= 'j'; ++c) {
    const auto got = all->pop();
    ASSERT_TRUE(got);
    CompressedImage image;
    ASSERT_TRUE(image.ParseFromString(got->payload));
    EXPECT_EQ(image.data(), std::string(100'000, c));
  }
}

TEST(MappedInput, ATapThatComesGetsCopies) {
  Pictures p;
  p.camera.open();
  p.eye.open();
  ASSERT_TRUE(p.until([&] { return p.out.subscribers() > 0; }));
  p.send('a', 100'000);
  Tap tap(
      p.graph.name(), [](const std::string& topic) { return topic == "t/x"; }, Policy::latest);
  std::optional<Tapped> tapped;
  ASSERT_TRUE(p.until([&] {
    p.send('b', 100'000);
    tapped = tap.next(0ms);
    return tapped.has_value();
  }));
  EXPECT_GT(tapped->message.payload.size(), 100'000U);
  ASSERT_TRUE(p.until([&] { return p.in->pop().has_value(); }));
}

}  // namespace
}  // namespace mimesis::runtime
