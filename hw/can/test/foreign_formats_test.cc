// Wire formats of others: bytes that python-can 4.1 has packed, lines of Lawicel's manual, reports
// as in the kernel's drivers/net/can/slcan, an adapter on a pseudo terminal.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/can/error.h>
#include <poll.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>

#include "hw/can/bus.h"

namespace mimesis::hw::can {
namespace {

Frame frame_of(std::uint32_t id, std::initializer_list<std::uint8_t> data, std::uint8_t flags = 0) {
  Frame f{.id = id, .length = static_cast<std::uint8_t>(data.size()), .flags = flags};
  std::copy(data.begin(), data.end(), f.data.begin());
  return f;
}

std::string line(const Frame& f) {
  std::string out;
  return to_line(f, out) ? out : "refused";
}

TEST(Slcan, WritesAndReadsTheLinesOfTheManual) {
  EXPECT_EQ(line(frame_of(0x100, {0x11, 0x33})), "t10021133\r");
  EXPECT_EQ(line(frame_of(0x20, {})), "t0200\r");
  EXPECT_EQ(line(frame_of(0x100 | kExtendedFlag, {0x11, 0x33})), "T0000010021133\r");
  EXPECT_EQ(line({.id = 0x100 | kRemoteFlag, .length = 2}), "r1002\r");
  EXPECT_EQ(line(frame_of(1, {2}, kFd)), "refused");
  EXPECT_EQ(from_line("t10021133"), frame_of(0x100, {0x11, 0x33}));
  EXPECT_EQ(from_line("T0000010021133"), frame_of(0x100 | kExtendedFlag, {0x11, 0x33}));
  EXPECT_EQ(from_line("R000001002"),
            (Frame{.id = 0x100 | kRemoteFlag | kExtendedFlag, .length = 2}));
  EXPECT_EQ(from_line("t1002113313A4"), frame_of(0x100, {0x11, 0x33})) << "with the time";
  for (const char* bad :
       {"", "z", "Z", "V1013", "t1009", "t10021", "t8002aabb", "t100211333", "T3000000002aabb"})
    EXPECT_FALSE(from_line(bad)) << bad;
}

TEST(Slcan, ReadsTheStatesThatTheKernelsDriverKnows) {
  const Frame off = from_line("sb256255").value();
  EXPECT_STREQ(trouble(off), "bus-off");
  EXPECT_EQ(off.data[6], 255) << "transmit errors";
  const Frame passive = from_line("sp128000").value();
  EXPECT_STREQ(trouble(passive), "error-passive");
  EXPECT_EQ(passive.data[7], 128) << "receive errors";
  EXPECT_EQ(from_line("sw096096").value().data[1], 0x0C);
  EXPECT_EQ(trouble(from_line("sa000000").value()), nullptr);
  EXPECT_EQ(from_line("e1a").value().id, kErrorFlag | CAN_ERR_BUSERROR | CAN_ERR_ACK);
  EXPECT_EQ(from_line("e2bs").value().data[2], CAN_ERR_PROT_BIT0 | CAN_ERR_PROT_STUFF);
  for (const char* bad : {"s", "sx000000", "sw09609", "e", "e3ab"})
    EXPECT_FALSE(from_line(bad)) << bad;
}

/// Our end of a serial line.
class SerialLine : public ::testing::Test {
 protected:
  void SetUp() override {
    adapter = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    ASSERT_TRUE(adapter >= 0 && grantpt(adapter) == 0 && unlockpt(adapter) == 0);
    bus = open_slcan(std::string(ptsname(adapter)) + "@500000");
    EXPECT_EQ(heard(), "C\rS6\rO\r");
  }
  void TearDown() override { close(adapter); }
  std::string heard() {
    std::string text(100'000, '\0');
    pollfd waiting{.fd = adapter, .events = POLLIN, .revents = 0};
    poll(&waiting, 1, 1000);
    text.resize(
        static_cast<std::size_t>(std::max<ssize_t>(0, read(adapter, text.data(), text.size()))));
    return text;
  }
  void say(std::string_view text) {
    ASSERT_EQ(write(adapter, text.data(), text.size()), std::ssize(text));
  }
  int adapter = -1;
  std::unique_ptr<Bus> bus;
  std::array<Frame, 16> room{};
};

TEST_F(SerialLine, CarriesFramesBothWays) {
  const std::array both{frame_of(0x201, {0x0F, 0}), frame_of(0x80, {})};
  bus->send(both);
  EXPECT_EQ(heard(), "t20120F00\rt0800\r");
  EXPECT_EQ(bus->counters().sent, 2u);
  say("z\rt1811");  // a line may come in parts
  EXPECT_EQ(bus->receive(room), 0u);
  say("AB\rsb000000\r\a");
  ASSERT_EQ(bus->receive(room), 2u);
  EXPECT_EQ(room[0], frame_of(0x181, {0xAB}));
  EXPECT_STREQ(trouble(room[1]), "bus-off");
  EXPECT_EQ(bus->counters().errors, 2u) << "bus-off, and a complaint";
}

/// An adapter that does not read: what the line cannot take is lost, but no line is cut.
TEST_F(SerialLine, LosesWholeFramesWhenTheLineIsFull) {
  const Frame f = frame_of(0x123, {1, 2, 3, 4, 5, 6, 7, 8});
  for (int i = 0; i < 2000; ++i) bus->send(std::span(&f, 1));
  EXPECT_GT(bus->counters().errors, 0u);
  std::string all;
  do {
    all += heard();
    bus->send({});  // what has begun goes on
  } while (all.size() < bus->counters().sent * line(f).size());
  const std::string one = line(f);
  ASSERT_EQ(all.size(), bus->counters().sent * one.size());
  for (std::size_t at = 0; at < all.size(); at += one.size())
    ASSERT_EQ(all.substr(at, one.size()), one);
}

}  // namespace
}  // namespace mimesis::hw::can
