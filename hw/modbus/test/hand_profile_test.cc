// What profiles of hands make of registers, and of set-points.
#include "hw/modbus/hand_profile.h"

#include <gtest/gtest.h>

#include <fstream>

#include "common/error.h"
#include "common/testing/temporary_folder.h"

namespace mimesis::hw::modbus {
namespace {

HandRegisters at(int first, std::initializer_list<int> values) {
  HandRegisters registers;
  for (const int value : values) registers[first++] = static_cast<std::uint16_t>(value);
  return registers;
}

constexpr HandSetpoint kClose{.move = true, .mode = HandMode::pinch, .closure = 0.5, .force = 1.0};

/// The manual's bytes: rACT | pinch << 1 | rGTO << 3; gACT, gGTO, gIMC 3, gSTA 2 = 0xB9.
TEST(ThreeFingers, ByteByByte) {
  const HandProfile hand = load_hand_profile("hands/robotiq_3f.yaml");
  HandRegisters last = at(2000, {0x31C0, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(to_registers(hand, kClose, last), at(1000, {0x0B00, 128, 0xFFFF, 0, 0, 0, 0, 0}));
  EXPECT_EQ(to_registers(hand, kClose, {}).at(1000), 0x0300) << "not while it activates";
  EXPECT_EQ(to_registers(hand, {}, last).at(1000), 0x0100);

  last = at(2000, {0xB9EA, 0x00FF, 0x3300, 0xFF33, 0x00FF, 0x3300, 0, 0});
  HandReading reading = to_reading(hand, last, HandMode::pinch);
  EXPECT_TRUE(reading.active) << reading.fault;
  EXPECT_TRUE(reading.object_detected);
  EXPECT_FALSE(reading.moving);
  EXPECT_EQ(reading.mode, HandMode::basic) << "as it says, not as was asked";
  EXPECT_EQ(reading.closure, 0.2);
  last[2000] = 0xB9C8;  // finger B alone has stopped while closing
  EXPECT_TRUE(to_reading(hand, last, {}).object_detected);
  last[2000] = 0x39C0;  // gSTA 0
  EXPECT_TRUE(to_reading(hand, last, {}).moving);
  EXPECT_FALSE(to_reading(hand, last, {}).object_detected);
  last[2000] = 0xBDEA;  // mode wide
  EXPECT_EQ(to_reading(hand, last, {}).mode, HandMode::other);
  last[2001] = 0x0DFF;
  reading = to_reading(hand, last, {});
  EXPECT_FALSE(reading.active);
  EXPECT_EQ(reading.fault, "activation failed (0xD)");
  EXPECT_EQ(to_registers(hand, kClose, last).at(1000) & 0x0100, 0) << "a new activation";
  last[2001] = 0x03FF;
  EXPECT_EQ(to_reading(hand, last, {}).fault, "unknown fault (register 2001 is 0x03FF)");
  EXPECT_NE(to_registers(hand, kClose, last).at(1000) & 0x0100, 0);
}

/// As a 2F-85 has answered: 39 00 00 FF 0E 0A while closing, B9 00 00 FF BD 00 with an object.
TEST(TwoFingers, ByteByByte) {
  const HandProfile hand = load_hand_profile("hands/robotiq_2f.yaml");
  const HandRegisters closing = at(2000, {0x3900, 0x00FF, 0x0E0A}),
                      holding = at(2000, {0xB900, 0x00FF, 0xBD00});
  EXPECT_EQ(to_registers(hand, kClose, closing), at(1000, {0x0900, 128, 0xFFFF}));
  EXPECT_TRUE(to_reading(hand, closing, HandMode::pinch).moving);
  const HandReading reading = to_reading(hand, holding, HandMode::pinch);
  EXPECT_TRUE(reading.active && reading.object_detected && !reading.moving);
  EXPECT_EQ(reading.mode, HandMode::pinch) << "one grip serves for both";
  EXPECT_NEAR(reading.closure, 189 / 255.0, 1e-12);
  EXPECT_EQ(contradiction(hand, holding), "");
}

TEST(OnRobot, WidthsInTenths) {
  const HandProfile hand = load_hand_profile("hands/onrobot_rg2.yaml");
  EXPECT_EQ(to_registers(hand, kClose, {}), at(0, {400, 550, 1}));
  EXPECT_EQ(to_registers(hand, {}, {}).at(2), 8) << "stop";
  HandRegisters read = at(267, {275, 2});
  EXPECT_EQ(to_reading(hand, read, {}).closure, 0.75);
  EXPECT_TRUE(to_reading(hand, read, {}).object_detected);
  read[267] = 0xFFF0;  // -1.6 mm
  EXPECT_EQ(to_reading(hand, read, {}).closure, 1.0);
  read[267] = 5000;
  EXPECT_EQ(to_reading(hand, read, {}).fault,
            "register 267 is 5000, expected 1100 (open) to 0 (closed)");
  read[267] = 275;
  read[268] = 8;
  EXPECT_FALSE(to_reading(hand, read, {}).active);
}

TEST(Inspire, FiveFingersAndNoActionWhileItStands) {
  const HandProfile hand = load_hand_profile("hands/inspire_rh56.yaml");
  HandRegisters written = to_registers(hand, kClose, {});
  EXPECT_EQ(written.at(1486), 500);
  EXPECT_EQ(written.at(1491), 0xFFFF) << "the thumb's rotation";
  EXPECT_EQ(written.at(1498), 1000);
  EXPECT_EQ(to_registers(hand, {}, {}).at(1490), 0xFFFF);
  HandRegisters read = at(1546, {1000, 500, 500, 500, 500, 700});
  read.merge(at(1606, {0, 0, 0}));
  read.merge(at(1612, {0x0202, 0x0302, 0x0202}));
  const HandReading reading = to_reading(hand, read, {});
  EXPECT_NEAR(reading.closure, 0.4, 1e-12);
  EXPECT_TRUE(reading.object_detected && !reading.moving && reading.active);
  read[1607] = 1;
  EXPECT_FALSE(to_reading(hand, read, {}).active);
}

/// Two-finger answers at the three-finger one's addresses, and the other way round.
TEST(Identity, TellsHandsAtTheSameAddressesApart) {
  const HandProfile three = load_hand_profile("hands/robotiq_3f.yaml"),
                    two = load_hand_profile("hands/robotiq_2f.yaml");
  const HandRegisters of_two = at(2000, {0xB900, 0x00FF, 0x7805, 0, 0, 0, 0, 0}),
                      of_three = at(2000, {0xB9EA, 0x00FF, 0x7805, 0xFF78, 0x05FF, 0x7805, 0, 0});
  EXPECT_FALSE(proves(three, of_two));
  EXPECT_NE(contradiction(three, of_two), "");
  EXPECT_TRUE(proves(three, of_three));
  EXPECT_EQ(contradiction(three, of_three), "");
  EXPECT_NE(contradiction(two, of_three), "");
}

TEST(Profile, SaysWhatIsWrongWithIt) {
  const testing::TemporaryFolder dir;
  const auto refusal = [&](const std::string& text) -> std::string {
    const std::string file = dir / "hand.yaml";
    std::ofstream(file)
        << "name: a\nread: [{register: 5, count: 2}]\nwrite: [{register: 1, count: 1}]\n"
        << text;
    try {
      load_hand_profile(file);
    } catch (const ConfigError& e) {
      return std::string(e.what()).substr(file.size());
    }
    return "";
  };
  const std::string set = "set: {closure: [{register: 1, bits: nnnnnnnnnnnnnnnn}]}\n",
                    is = "is: {closure: [{register: 5, bits: nnnnnnnnnnnnnnnn}]}\n",
                    identity = "identity: {proves: [{register: 6, bits: 1...............}]}\n";
  EXPECT_EQ(refusal(set + is + identity), "");
  EXPECT_EQ(refusal(set + is),
            ": identity: expected tests that tell this hand from another device");
  EXPECT_EQ(refusal(is + identity), ": set.closure: expected where the closure is written");
  EXPECT_EQ(refusal(set + identity + "is: {closure: [{register: 7, bits: nnnnnnnnnnnnnnnn}]}\n"),
            ": is.closure[0].register: 7 is in no block of read");
  EXPECT_EQ(refusal(set + is + "identity: {proves: [{register: 6, bits: 1...}]}\n"),
            ": identity.proves[0].bits: 4 places, expected 16");
  EXPECT_EQ(refusal(set + is + "identity: {proves: [{register: 6, bits: n...............}]}\n"),
            ": identity.proves[0].bits: 'n', expected 0, 1 and . for any");
  EXPECT_EQ(refusal(set + identity + "is: {closure: [{register: 5, bits: nn.nnnnnnnnnnnnn}]}\n"),
            ": is.closure[0].bits: expected n in places beside each other");
  EXPECT_NE(refusal(set + is + identity + "speed: 3\n").find("unknown"), std::string::npos);
}

}  // namespace
}  // namespace mimesis::hw::modbus
