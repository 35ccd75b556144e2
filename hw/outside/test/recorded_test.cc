// Tests of the data that a recorded bus and hand give to a node, live and from a record.
#include "hw/outside/recorded.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "common/testing/loopback.h"
#include "common/testing/outside_tape.h"
#include "hw/can/testing/memory_wire.h"

namespace mimesis::hw::outside {
namespace {

using namespace std::chrono_literals;
using testing::Loopback;
using testing::OutsideTape;

can::Frame frame(std::uint32_t id, std::initializer_list<std::uint8_t> data) {
  can::Frame f;
  f.id = id;
  f.length = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), f.data.begin());
  return f;
}

class RecordedCan : public ::testing::Test {
 protected:
  std::unique_ptr<can::Bus> live() { return record_can(wire.join(), graph); }
  std::unique_ptr<can::Bus> replayed() {
    tape.rewind();
    return open_can("embedded:arm", graph);
  }
  static std::vector<can::Frame> receive(can::Bus& bus, std::size_t most = 8) {
    std::vector<can::Frame> frames(most);
    frames.resize(bus.receive(frames));
    return frames;
  }

  OutsideTape tape;
  Loopback graph{{.lockstep = true, .outside = &tape}};
  can::MemoryWire wire;
};

TEST_F(RecordedCan, HasTheDocumentedBytes) {
  auto peer = wire.join();
  auto bus = live();
  bus->send(std::vector{frame(0x201, {0xAB, 0xCD})});
  peer->send(std::vector{frame(0x80000005, {}), frame(0x181, {7})});
  receive(*bus);
  using namespace std::string_literals;
  const std::vector<OutsideTape::Entry> expected = {{"can",
                                                     "\x01\0\0\0"
                                                     "\x01\x02\0\0"
                                                     "\x02"
                                                     "\0"
                                                     "\xAB\xCD"s,
                                                     true},
                                                    {"can",
                                                     "\x01\0\0\0"
                                                     "\0\0\0\0"s,
                                                     false},
                                                    {"can",
                                                     "\0\0\0\0"
                                                     "\x02\0\0\0"
                                                     "\x05\0\0\x80"
                                                     "\0"
                                                     "\0"
                                                     "\x81\x01\0\0"
                                                     "\x01"
                                                     "\0"
                                                     "\x07"s,
                                                     false}};
  EXPECT_EQ(tape.entries().size(), 3u);
  EXPECT_EQ(tape.entries(), expected);
}

TEST_F(RecordedCan, GivesFramesAndCountersBack) {
  auto peer = wire.join();
  auto bus = live();
  can::Frame full = frame(0x123, {});
  full.length = 64;
  full.flags = 1;
  full.data.fill(0x5A);
  const std::vector<can::Frame> sent = {frame(0x181, {1, 2, 3}), full,
                                        frame(can::kErrorFlag | can::kBusOff, {0})};
  peer->send(sent);
  EXPECT_EQ(receive(*bus, 2), std::vector(sent.begin(), sent.begin() + 2));
  EXPECT_EQ(receive(*bus, 2), std::vector(sent.begin() + 2, sent.end()));
  bus->send(sent);
  peer.reset();
  bus->send(sent);  // no device is there
  const Traffic counted = bus->counters();
  EXPECT_EQ(counted.received, 2u);
  EXPECT_EQ(counted.sent, 3u);
  EXPECT_EQ(counted.errors, 4u);

  auto again = replayed();
  EXPECT_EQ(receive(*again, 2), std::vector(sent.begin(), sent.begin() + 2));
  EXPECT_EQ(receive(*again, 2), std::vector(sent.begin() + 2, sent.end()));
  again->send(sent);
  again->send(sent);
  EXPECT_TRUE(tape.at_end());
  EXPECT_EQ(tape.problem(), "");
  EXPECT_EQ(again->counters().received, counted.received);
  EXPECT_EQ(again->counters().sent, counted.sent);
  EXPECT_EQ(again->counters().errors, counted.errors);
  EXPECT_TRUE(std::filesystem::is_empty(graph.directory())) << "a replay opens no bus";
}

TEST_F(RecordedCan, GivesALiveNodeNothingThatTheRecordHasNot) {
  auto peer = wire.join();
  auto bus = live();
  can::Frame dirty = frame(0x181, {1});
  dirty.data[7] = 0xFF;
  dirty.reserved[0] = 0xFF;
  peer->send(std::vector{dirty});
  EXPECT_EQ(receive(*bus), std::vector{frame(0x181, {1})});
}

TEST_F(RecordedCan, TellsFromADamagedRecord) {
  auto peer = wire.join();
  auto bus = live();
  peer->send(std::vector{frame(0x181, {1, 2})});
  receive(*bus);
  const std::string good = tape.entries()[0].bytes;
  std::string longer = good;
  longer[8 + 4] = 65;  // the frame's length
  for (const std::string& bad :
       {good.substr(0, 3), good.substr(0, good.size() - 1), good + "x", longer}) {
    tape.entries()[0].bytes = bad;
    auto again = replayed();
    EXPECT_THROW(receive(*again), std::runtime_error) << bad.size();
  }
  tape.entries()[0].bytes = good;
  auto again = replayed();
  EXPECT_THROW(receive(*again, 0), std::runtime_error) << "more frames than fit";
}

TEST_F(RecordedCan, ARecordOfSomethingElseIsAProblemAndNoFrames) {
  auto peer = wire.join();
  auto bus = live();
  peer->send(std::vector{frame(0x181, {1, 2})});
  receive(*bus);
  tape.entries()[0].name = "hand";
  auto again = replayed();
  EXPECT_TRUE(receive(*again).empty());
  EXPECT_EQ(tape.problem(), "entry 0: the node has read 'can', the record read 'hand'");
  again->send(std::vector{frame(0x201, {})});
  EXPECT_EQ(again->counters().sent, 0u);
}

TEST(RecordedHand, HasTheDocumentedBytes) {
  using namespace std::string_literals;
  OutsideTape tape;
  Loopback graph({.lockstep = true, .outside = &tape});
  tape.entries() = {{"hand",
                     "\x01\x01"
                     "\0\0\0\0\0\0\xD0\x3F"
                     "\0\0\0\0\0\0\xE8\x3F"s,
                     true},
                    {"hand",
                     "\x05\x01"
                     "\0\0\0\0\0\0\xE0\x3F"
                     "\x07\x01\0\0\0\0\0\0"
                     "\x09\0\0\0\0\0\0\0"
                     "fault"s,
                     false}};
  tape.rewind();
  RecordedHand hand("unix:hand", {}, {}, graph);
  const modbus::HandReading& reading = hand.exchange(
      1s, {.move = true, .mode = modbus::HandMode::pinch, .closure = 0.25, .force = 0.75});
  EXPECT_EQ(tape.problem(), "");
  EXPECT_TRUE(reading.active);
  EXPECT_FALSE(reading.moving);
  EXPECT_TRUE(reading.object_detected);
  EXPECT_EQ(reading.mode, modbus::HandMode::pinch);
  EXPECT_EQ(reading.closure, 0.5);
  EXPECT_EQ(reading.transactions, 0x107U);
  EXPECT_EQ(reading.errors, 9U);
  EXPECT_EQ(reading.fault, "fault");
}

TEST(RecordedHand, GivesReadingsBackWithoutAThread) {
  OutsideTape tape;
  Loopback graph({.lockstep = false, .outside = &tape});
  const modbus::HandSetpoint setpoint{
      .move = true, .mode = modbus::HandMode::pinch, .closure = 0.25, .force = 0.75};
  modbus::HandReading live;
  {
    RecordedHand hand("unix:nobody", {}, {.threaded = false}, graph);
    live = hand.exchange(1s, setpoint);
    hand.stop();
  }
  EXPECT_FALSE(live.fault.empty());
  EXPECT_EQ(live.errors, 1u);
  ASSERT_EQ(tape.entries().size(), 3u);
  EXPECT_EQ(tape.entries()[0].bytes.size(), 18u);
  EXPECT_EQ(tape.entries()[2].bytes, std::string(18, '\0')) << "stands still";

  tape.rewind();
  RecordedHand again("unix:nobody", {}, {.threaded = true}, graph);
  const modbus::HandReading& replayed = again.exchange(1s, setpoint);
  EXPECT_EQ(replayed.fault, live.fault);
  EXPECT_EQ(replayed.errors, 1u);
  again.stop();
  EXPECT_TRUE(tape.at_end());
  EXPECT_EQ(tape.problem(), "");

  tape.rewind();
  tape.entries()[1].bytes.resize(25);
  RecordedHand damaged("unix:nobody", {}, {.threaded = true}, graph);
  EXPECT_THROW(damaged.exchange(1s, setpoint), std::runtime_error);

  tape.rewind();
  RecordedHand other("unix:nobody", {}, {.threaded = true}, graph);
  other.exchange(1s, {.move = true, .closure = 0.5});
  EXPECT_EQ(tape.problem(), "entry 0: other bytes written to 'hand'");
}

}  // namespace
}  // namespace mimesis::hw::outside
