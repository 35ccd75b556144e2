#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>

#include "common/testing/loopback.h"
#include "common/testing/refusal.h"
#include "hw/can/testing/memory_wire.h"

namespace mimesis::hw::can {
namespace {

Frame frame(std::uint32_t id, std::initializer_list<std::uint8_t> data = {}) {
  Frame f{.id = id, .length = static_cast<std::uint8_t>(data.size())};
  std::copy(data.begin(), data.end(), f.data.begin());
  return f;
}

std::vector<Frame> receive_all(Bus& bus) {
  std::vector<Frame> frames(10'000);  // systemd makes queues of 512 (net.unix.max_dgram_qlen)
  frames.resize(bus.receive(frames));
  return frames;
}

TEST(Frame, HasTheKernelsLayout) {
  const Frame f = frame(0x185, {1, 2, 3});
  canfd_frame kernel{};
  std::memcpy(&kernel, &f, sizeof(kernel));
  EXPECT_EQ(kernel.can_id, 0x185u);
  EXPECT_EQ(kernel.len, 3);
  EXPECT_EQ(kernel.data[2], 3);
  EXPECT_EQ(kExtendedFlag, CAN_EFF_FLAG);
  EXPECT_EQ(kRemoteFlag, CAN_RTR_FLAG);
  EXPECT_EQ(kErrorFlag, CAN_ERR_FLAG);
}

/// Both twins keep the same promises.
struct Wire {
  virtual ~Wire() = default;
  virtual std::unique_ptr<Bus> join() = 0;
};
struct InMemory final : Wire {
  MemoryWire wire;
  std::unique_ptr<Bus> join() override { return wire.join(); }
};
struct Embedded final : Wire {
  testing::Loopback graph;  // for its temporary directory
  std::unique_ptr<Bus> join() override { return open("embedded:test", graph.directory()); }
};

template <class W>
class AnyWire : public ::testing::Test {
 protected:
  W wire;
};
using Wires = ::testing::Types<InMemory, Embedded>;
TYPED_TEST_SUITE(AnyWire, Wires);

TYPED_TEST(AnyWire, BringsEveryFrameToAllOthersInOrder) {
  auto a = this->wire.join(), b = this->wire.join(), c = this->wire.join();
  const std::vector<Frame> sent = {frame(0x80), frame(0x201, {0x0F, 0}), frame(0x77F, {5})};
  a->send(sent);
  EXPECT_EQ(receive_all(*b), sent);
  EXPECT_EQ(receive_all(*c), sent);
  EXPECT_TRUE(receive_all(*a).empty());
  EXPECT_EQ(a->counters().sent, 3u);
  EXPECT_EQ(b->counters().received, 3u);
}

TYPED_TEST(AnyWire, CountsFramesThatNobodyHears) {
  auto alone = this->wire.join();
  const std::vector<Frame> sent = {frame(0x80), frame(0x81)};
  alone->send(sent);
  EXPECT_EQ(alone->counters().sent, 0u);
  EXPECT_EQ(alone->counters().errors, 2u);
}

TYPED_TEST(AnyWire, HandsOutInSmallPortions) {
  auto a = this->wire.join(), b = this->wire.join();
  std::vector<Frame> sent;
  for (std::uint32_t i = 0; i < 100; ++i) sent.push_back(frame(i));
  a->send(sent);
  std::vector<Frame> got;
  std::array<Frame, 7> portion;
  while (const std::size_t n = b->receive(portion)) got.insert(got.end(), &portion[0], &portion[n]);
  EXPECT_EQ(got, sent);
}

TEST(EmbeddedBus, KeepsBusesOfDifferentNamesApart) {
  testing::Loopback graph;
  auto arm = open("embedded:arm", graph.directory()),
       legs = open("embedded:legs", graph.directory());
  arm->send(std::array{frame(1)});
  EXPECT_TRUE(receive_all(*legs).empty());
}

TEST(EmbeddedBus, NeverBlocksOnAFullReceiverAndCounts) {
  testing::Loopback graph;
  auto a = open("embedded:x", graph.directory()), deaf = open("embedded:x", graph.directory());
  for (int i = 0; i < 10'000; ++i) a->send(std::array{frame(1)});
  EXPECT_GT(a->counters().sent, 0u);
  EXPECT_EQ(a->counters().sent + a->counters().errors, 10'000u);
  EXPECT_EQ(receive_all(*deaf).size(), a->counters().sent);
  a->send(std::array{frame(2)});  // the bus recovers
  EXPECT_EQ(receive_all(*deaf).size(), 1u);
}

TEST(EmbeddedBus, TheLastParticipantRemovesTheFolder) {
  testing::Loopback graph;
  const auto folder = std::filesystem::path(graph.directory()) / "can-x";
  auto a = open("embedded:x", graph.directory()), b = open("embedded:x", graph.directory());
  a.reset();
  EXPECT_TRUE(std::filesystem::exists(folder));
  b.reset();
  EXPECT_FALSE(std::filesystem::exists(folder));
  // Joining while others remove it.
  const auto come_and_go = [&] {
    for (int i = 0; i < 1000; ++i) open("embedded:x", graph.directory());
  };
  std::thread other(come_and_go);
  EXPECT_NO_THROW(come_and_go());
  other.join();
  EXPECT_FALSE(std::filesystem::exists(folder));
}

TEST(EmbeddedBus, RemovesTheSocketOfAKilledParticipant) {
  testing::Loopback graph;
  const auto folder = std::filesystem::path(graph.directory()) / "can-x";
  auto a = open("embedded:x", graph.directory());
  int joined[2];
  ASSERT_EQ(pipe(joined), 0);
  const pid_t child = fork();
  if (child == 0) {
    auto doomed = open("embedded:x", graph.directory());
    if (write(joined[1], "j", 1) != 1) _exit(1);
    pause();
    _exit(0);
  }
  char byte;
  ASSERT_EQ(read(joined[0], &byte, 1), 1);
  a->send(std::array{frame(1)});
  EXPECT_EQ(a->counters().sent, 1u);
  kill(child, SIGKILL);
  ASSERT_EQ(waitpid(child, nullptr, 0), child);

  auto b = open("embedded:x", graph.directory());
  a->send(std::array{frame(2)});
  EXPECT_EQ(receive_all(*b).size(), 1u);  // the living one got it
  EXPECT_EQ(a->counters().errors, 0u);
  const auto sockets = std::distance(std::filesystem::directory_iterator(folder), {});
  EXPECT_EQ(sockets, 2);
}

TEST(EmbeddedBus, SkipsWhatIsNoParticipant) {
  testing::Loopback graph;
  auto a = open("embedded:x", graph.directory()), b = open("embedded:x", graph.directory());
  const auto folder = std::filesystem::path(graph.directory()) / "can-x";
  std::ofstream(folder / std::string(120, 'n')).close();
  std::ofstream(folder / "file").close();
  std::filesystem::create_directory(folder / "folder");
  ASSERT_EQ(mkfifo((folder / "fifo").c_str(), 0600), 0);
  ::testing::internal::CaptureStderr();
  for (int k = 0; k < 3; ++k) {
    std::ofstream(folder / ("more" + std::to_string(k))).close();
    a->send(std::array{frame(1)});
  }
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("entries of " + folder.string() + " are skipped"), std::string::npos) << said;
  EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
  EXPECT_EQ(receive_all(*b).size(), 3U);
  EXPECT_EQ(a->counters().sent, 3U);
  EXPECT_TRUE(std::filesystem::exists(folder / "file"));
}

TEST(EmbeddedBus, RejectsForeignDatagrams) {
  testing::Loopback graph;
  auto a = open("embedded:x", graph.directory());
  const auto folder = std::filesystem::path(graph.directory()) / "can-x";
  const std::string path = std::filesystem::directory_iterator(folder)->path();
  const int s = socket(AF_UNIX, SOCK_DGRAM, 0);
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  std::copy(path.begin(), path.end(), address.sun_path);
  sendto(s, "noise", 5, 0, reinterpret_cast<sockaddr*>(&address), sizeof(address));
  Frame too_long{.id = 1, .length = 65};
  sendto(s, &too_long, sizeof(too_long), 0, reinterpret_cast<sockaddr*>(&address), sizeof(address));
  close(s);
  EXPECT_TRUE(receive_all(*a).empty());
  EXPECT_EQ(a->counters().errors, 2u);
}

/// On the kernel's CAN: can_socketcan_test runs this in a guest.
TEST(SocketCan, BringsWhatIsWantedWithItsTimeOfArrival) {
  const char* address = std::getenv("MIMESIS_TEST_CAN");
  if (address == nullptr) GTEST_SKIP() << "no such case: MIMESIS_TEST_CAN names no interface";
  auto a = open(address, ""), b = open(address, ""), all = open(address, "");
  b->want(std::array{Wanted{5, 0x7F}, Wanted{0x0A3, 0x7FF}});
  std::vector<Frame> sent;
  for (std::uint32_t id = 0; id < 0x800; ++id) sent.push_back(frame(id, {1}));
  sent.push_back(frame(5 | kExtendedFlag));
  const auto before = std::chrono::system_clock::now().time_since_epoch();
  std::vector<Frame> got, heard;
  for (std::span<const Frame> rest(sent); !rest.empty();) {
    const auto some = rest.first(std::min<std::size_t>(rest.size(), 64));
    a->send(some);
    rest = rest.subspan(some.size());
    for (const Frame& f : receive_all(*b)) got.push_back(f);
    for (const auto stamp : b->stamps()) EXPECT_GE(stamp, before);
    for (const Frame& f : receive_all(*all)) heard.push_back(f);
  }
  EXPECT_EQ(heard, sent);
  std::vector<Frame> wanted;
  std::ranges::copy_if(sent, std::back_inserter(wanted), [](const Frame& f) {
    return (f.id & kExtendedFlag) == 0 && ((f.id & 0x7F) == 5 || f.id == 0x0A3);
  });
  EXPECT_EQ(got, wanted);
  a->send(std::array{sent[5]});
  ASSERT_EQ(receive_all(*b).size(), 1u);
  ASSERT_EQ(b->stamps().size(), 1u);
  EXPECT_GE(b->stamps()[0], before);
  EXPECT_LE(b->stamps()[0], std::chrono::system_clock::now().time_since_epoch());
}

TEST(Trouble, IsWhatKeepsTheControllerFromTheBus) {
  Frame f{.id = kErrorFlag | CAN_ERR_BUSOFF, .length = 8};
  EXPECT_STREQ(trouble(f), "bus-off");
  f.id = CAN_ERR_BUSOFF;
  EXPECT_EQ(trouble(f), nullptr) << "a frame with that identifier";
  f.id = kErrorFlag | CAN_ERR_CRTL;
  for (const int bit : {CAN_ERR_CRTL_RX_OVERFLOW, CAN_ERR_CRTL_TX_WARNING, CAN_ERR_CRTL_ACTIVE}) {
    f.data[1] = static_cast<std::uint8_t>(bit);
    EXPECT_EQ(trouble(f), nullptr);
  }
  for (const int bit : {CAN_ERR_CRTL_RX_PASSIVE, CAN_ERR_CRTL_TX_PASSIVE}) {
    f.data[1] = static_cast<std::uint8_t>(bit);
    EXPECT_STREQ(trouble(f), "error-passive");
  }
}

std::string refusal(const std::string& address) {
  return testing::refusal([&] { open(address, "/tmp"); }, "accepted");
}

TEST(Open, SaysWhatIsWrongInOneLine) {
  EXPECT_EQ(refusal("usb:0"),
            "CAN bus 'usb:0': expected embedded:NAME, socketcan:INTERFACE or "
            "slcan:/dev/NAME");
  EXPECT_EQ(refusal("embedded:"),
            "CAN bus 'embedded:': expected embedded:NAME, socketcan:INTERFACE "
            "or slcan:/dev/NAME");
  const std::string missing = refusal("socketcan:nonesuch0");
  EXPECT_TRUE(missing == "CAN interface 'nonesuch0': no such interface" ||
              missing.find("no SocketCAN") != std::string::npos)
      << missing;
}

}  // namespace
}  // namespace mimesis::hw::can
