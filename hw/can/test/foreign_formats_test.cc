// Wire formats of others: bytes that python-can 4.1 has packed, lines of Lawicel's manual, reports
// as in the kernel's drivers/net/can/slcan, an adapter on a pseudo terminal.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/can/error.h>
#include <poll.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>

#include "hw/can/multicast.h"
#include "hw/can/slcan.h"

namespace mimesis::hw::can {
namespace {

Frame frame_of(std::uint32_t id, std::initializer_list<std::uint8_t> data, std::uint8_t flags = 0) {
  Frame f{.id = id, .length = static_cast<std::uint8_t>(data.size()), .flags = flags};
  std::copy(data.begin(), data.end(), f.data.begin());
  return f;
}

std::vector<std::uint8_t> bytes(std::string_view hex) {
  std::vector<std::uint8_t> out;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    out.push_back(static_cast<std::uint8_t>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16)));
  return out;
}

/// What stands between the values, the same in all messages.
std::string packed(std::string_view id, std::string_view extended, std::string_view remote,
                   std::string_view channel, std::string_view dlc, std::string_view data,
                   std::string_view fd) {
  std::string s = "8ba974696d657374616d70cb4000000000000000ae6172626974726174696f6e5f6964";
  s.append(id).append("ae69735f657874656e6465645f6964").append(extended);
  s.append("af69735f72656d6f74655f6672616d65").append(remote);
  s.append("ae69735f6572726f725f6672616d65c2a76368616e6e656c").append(channel);
  s.append("a3646c63").append(dlc).append("a464617461").append(data);
  s.append("a569735f6664").append(fd).append("ae626974726174655f737769746368").append(fd);
  return s + "b56572726f725f73746174655f696e64696361746f72c2";
}

TEST(Multicast, ReadsWhatPythonCanPacks) {
  const auto classic = unpack(bytes(packed("cd0183", "c2", "c2", "c0", "03", "c403370201", "c2")));
  EXPECT_EQ(classic, frame_of(0x183, {0x37, 2, 1}));
  const auto fd = unpack(
      bytes(packed("ce1abcdef0", "c3", "c2", "a178", "0c", "c40c000102030405060708090a0b", "c3")));
  EXPECT_EQ(fd,
            frame_of(0x1ABCDEF0 | kExtendedFlag, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}, kFd | 1));
  Frame remote{.id = 0x7F | kRemoteFlag, .length = 4};
  EXPECT_EQ(unpack(bytes(packed("7f", "c2", "c3", "c0", "04", "c400", "c2"))), remote);
}

TEST(Multicast, RefusesWhatIsNoFrame) {
  const std::string good = packed("cd0183", "c2", "c2", "c0", "03", "c403370201", "c2");
  for (std::size_t cut = 0; cut < good.size(); cut += 2)
    EXPECT_FALSE(unpack(bytes(good.substr(0, cut)))) << cut;
  EXPECT_FALSE(unpack(bytes(packed("cd0800", "c2", "c2", "c0", "01", "c401aa", "c2"))))
      << "11 bits";
  EXPECT_FALSE(unpack(bytes(packed("01", "c2", "c2", "c0", "02", "c401aa", "c2")))) << "dlc";
  EXPECT_FALSE(unpack(bytes(packed("01", "c2", "c2", "c0", "09", "c409000000000000000000", "c2"))))
      << "nine bytes without FD";
  EXPECT_FALSE(unpack(bytes(packed("01", "c2", "c2", "80", "01", "c401aa", "c2")))) << "a map";
}

TEST(Multicast, PacksWhatItReads) {
  for (const Frame& f : {frame_of(0, {}), frame_of(0x7FF, {1, 2, 3, 4, 5, 6, 7, 8}),
                         frame_of(0x12345 | kExtendedFlag, {9}), frame_of(5, {1, 2, 3}, kFd | 3),
                         Frame{.id = kErrorFlag | kBusOff, .length = 8}}) {
    std::string out;
    pack(f, 2.0, out);
    EXPECT_EQ(unpack({reinterpret_cast<const std::uint8_t*>(out.data()), out.size()}), f) << f.id;
    EXPECT_LE(out.size(), kMulticastBytes);
  }
  std::string longest;
  Frame f = frame_of(1, {}, kFd);
  f.length = 64;
  pack(f, 0.0, longest);
  EXPECT_LE(longest.size(), kMulticastBytes);
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
