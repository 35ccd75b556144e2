// The slave byte by byte, without the bridge's codec.
#include "hw/sim/cia402/slave.h"

#include <gtest/gtest.h>

#include <string>

#include "hw/can/testing/memory_wire.h"

namespace mimesis::hw::sim {
namespace {

using can::frame;
using namespace std::chrono_literals;

class Bytes : public ::testing::Test {
 protected:
  Bytes() {
    slave.objects.add(
        {{.address = 0x6040'00, .type = Type::u16, .access = Access::rw, .carried = Carried::rpdo},
         {.address = 0x6041'00, .type = Type::u16, .carried = Carried::tpdo, .value = 0x1234},
         {.address = 0x6064'00, .type = Type::i32, .carried = Carried::tpdo, .value = -2},
         {.address = 0x2000'00, .type = Type::text, .access = Access::rw}});
    slave.boot(out);
  }
  /// Frame "605#40081000": identifier and bytes as candump writes them.
  /// What it answers: its frames with a space between.
  std::string ask(const std::string& request) {
    out.clear();
    if (slave.handle(frame(request), out) == Event::sync) slave.send_synchronous(out);
    return said();
  }
  std::string wait(Time duration) {
    out.clear();
    for (const Time end = now + duration; now < end;) slave.advance(now += 1ms, out);
    return said();
  }
  std::string said() {
    std::string all;
    for (const can::Frame& f : out) all += (all.empty() ? "" : " ") + frame_text(f);
    return all;
  }

  Slave slave{5, "a name of 21 letters.", 0x00020192};
  std::vector<can::Frame> out;
  Time now = 0s;
};

TEST_F(Bytes, BootsUpAsNode5) { EXPECT_EQ(said(), "705#00"); }

TEST_F(Bytes, UploadsInSegments) {
  EXPECT_EQ(ask("605#4008100000000000"), "585#4108100015000000") << "21 bytes follow";
  EXPECT_EQ(ask("605#6000000000000000"), "585#0061206E616D6520");  // "a name "
  EXPECT_EQ(ask("605#7000000000000000"), "585#106F66203231206C");  // "of 21 l"
  EXPECT_EQ(ask("605#6000000000000000"), "585#016574746572732E");
  EXPECT_EQ(ask("605#7000000000000000"), "585#8000000001000405") << "nothing is left";
}

TEST_F(Bytes, AToggleThatDoesNotAlternateEndsTheTransfer) {
  ask("605#4008100000000000");
  EXPECT_EQ(ask("605#7000000000000000"), "585#8008100000000305");
  ask("605#2100200009000000");
  EXPECT_EQ(ask("605#0061626364656667"), "585#2000000000000000");
  EXPECT_EQ(ask("605#0061626364656667"), "585#8000200000000305");
}

TEST_F(Bytes, DownloadsInSegments) {
  EXPECT_EQ(ask("605#2100200009000000"), "585#6000200000000000");
  EXPECT_EQ(ask("605#0061626364656667"), "585#2000000000000000");
  EXPECT_EQ(ask("605#1B68690000000000"), "585#3000000000000000");  // last, 5 bytes unused
  EXPECT_EQ(slave.objects.find(0x2000'00)->text, "abcdefghi");
  // A number may come in a segment, too; of a wrong length it is refused at the end.
  ask("605#2117100002000000");
  EXPECT_EQ(ask("605#0B64000000000000"), "585#2000000000000000");
  EXPECT_EQ(slave.objects.value(0x1017'00), 100);
  ask("605#2117100003000000");
  EXPECT_EQ(ask("605#0964000000000000"), "585#8017100010000706");
}

TEST_F(Bytes, ASilentClientLosesItsTransfer) {
  ask("605#4008100000000000");
  EXPECT_EQ(wait(1000ms), "");
  EXPECT_EQ(wait(1ms), "585#8008100000000405");
}

TEST_F(Bytes, RefusesWithTheCodesOfTheStandard) {
  EXPECT_EQ(ask("605#4001200000000000"), "585#8001200000000206") << "no object";
  EXPECT_EQ(ask("605#4000100700000000"), "585#8000100711000906") << "no sub-index";
  EXPECT_EQ(ask("605#2300100001000000"), "585#8000100002000106") << "read-only";
  EXPECT_EQ(ask("605#2F29100103000000"), "585#8029100131000906") << "too high";
  EXPECT_EQ(ask("605#2F03100001000000"), "585#8003100031000906") << "only 0 clears the history";
  EXPECT_EQ(ask("605#A000100000000000"), "585#8000100001000405") << "block transfer";
}

TEST_F(Bytes, IdentifiersOfPdos) {
  EXPECT_EQ(ask("605#2300140106020000"), "585#8000140130000906") << "changes while valid";
  EXPECT_EQ(ask("605#2300140105020080"), "585#6000140100000000");
  EXPECT_EQ(ask("605#23001401FF060000"), "585#8000140130000906") << "restricted";
  EXPECT_EQ(ask("605#2300140106020000"), "585#6000140100000000");
}

TEST_F(Bytes, TwoConsumersDoNotWatchTheSameNode) {
  EXPECT_EQ(ask("605#23161001FA007F00"), "585#6016100100000000");
  EXPECT_EQ(ask("605#23161002FA007F00"), "585#8016100243000406");
}

/// Emergency 8130h after 250 ms; then pre-operational, unless 1029h:01 says 1.
TEST_F(Bytes, ALostMasterEndsOperational) {
  for (const bool stays : {false, true}) {
    ask("000#8205");
    ask("605#23161001FA007F00");
    ask(stays ? "605#2F29100101000000" : "605#2F29100100000000");
    ask("000#0105");
    EXPECT_EQ(wait(400ms), "") << "not watched before the first heartbeat";
    ask("77F#05");
    EXPECT_EQ(wait(250ms), "");
    EXPECT_EQ(wait(1ms), "085#3081110000000000");
    EXPECT_EQ(slave.operational(), stays);
    EXPECT_EQ(ask("605#4003100000000000"), "585#4F03100001000000") << "history";
    EXPECT_EQ(ask("605#4003100100000000"), "585#4303100130810000");
    EXPECT_EQ(ask("77F#05"), "085#0000000000000000") << "error reset";
  }
}

TEST_F(Bytes, TransmissionTypes) {
  const auto map = [&](const std::string& type) {
    for (const std::string& request :
         {std::string("2300180185010080"), std::string("2F001A0000000000"),
          std::string("23001A0110004160"), std::string("23001A0220006460"),
          std::string("2F001A0002000000"), "2F001802" + type + "000000",
          std::string("2300180185010000")}) {
      ASSERT_EQ(ask("605#" + request).substr(4, 2), "60") << request;
    }
  };
  ask("000#0105");
  map("03");
  EXPECT_EQ(ask("080#"), "");
  EXPECT_EQ(ask("080#"), "");
  EXPECT_EQ(ask("080#"), "185#3412FEFFFFFF") << "with every third SYNC";
  map("00");
  EXPECT_EQ(ask("080#"), "") << "unchanged";
  slave.objects.set(0x6064'00, 1);
  EXPECT_EQ(ask("080#"), "185#341201000000");
  map("FF");
  EXPECT_EQ(ask("605#2B00180514000000"), "585#6000180500000000");  // event timer 20 ms
  EXPECT_EQ(ask("080#"), "");
  EXPECT_EQ(wait(1ms), "185#341201000000");
  EXPECT_EQ(wait(20ms), "185#341201000000");
  slave.objects.set(0x6064'00, 2);
  EXPECT_EQ(wait(1ms), "185#341202000000") << "at a change";
}

TEST_F(Bytes, AnRpdoThatIsTooShortIsAnEmergency) {
  ask("605#2300140105020080");
  ask("605#2F00160000000000");
  ask("605#2300160110004060");
  ask("605#2F00160001000000");
  ask("605#2300140105020000");
  ask("000#0105");
  EXPECT_EQ(ask("205#0F"), "085#1082110000000000");
  EXPECT_EQ(slave.objects.value(0x6040'00), 0);
  ask("205#0F00AA");  // longer is allowed
  EXPECT_EQ(slave.objects.value(0x6040'00), 0) << "waits for SYNC";
  ask("080#");
  EXPECT_EQ(slave.objects.value(0x6040'00), 0x0F);
}

}  // namespace
}  // namespace mimesis::hw::sim
