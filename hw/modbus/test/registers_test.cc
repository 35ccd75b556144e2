#include "hw/modbus/registers.h"

#include <gtest/gtest.h>

#include "hw/modbus/hand.h"

namespace mimesis::hw::modbus {
namespace {

TEST(Registers, OutputByteByByte) {
  const Registers r = encode(HandOutput{.activate = true,
                                        .mode = HandMode::pinch,
                                        .go = true,
                                        .position = 0xC8,
                                        .speed = 0xFF,
                                        .force = 0x40});
  EXPECT_EQ(r, (Registers{0x0B00, 0x00C8, 0xFF40, 0, 0, 0, 0, 0}));  // rACT | pinch<<1 | rGTO<<3
  EXPECT_EQ(encode(HandOutput{}), Registers{});
}

TEST(Registers, InputByteByByte) {
  // gACT, mode basic, gGTO, gIMC 3, gSTA 2 = 0xB9; all fingers stopped while closing, scissor at
  // request = 0xEA.
  const Registers r = {0xB9EA, 0x00FF, 0x7F12, 0xFF80, 0x0AFF, 0x8109, 0x0000, 0x0000};
  const HandInput i = decode_input(r);
  EXPECT_TRUE(i.activated);
  EXPECT_EQ(i.mode, HandMode::basic);
  EXPECT_TRUE(i.go);
  EXPECT_EQ(i.initialisation, Initialisation::done);
  EXPECT_EQ(i.motion, Motion::all_stopped);
  EXPECT_EQ(i.contact, Contact::while_closing);
  EXPECT_EQ(i.fault, 0);
  EXPECT_EQ(i.requested, 255);
  EXPECT_EQ(i.position, 0x80);
  EXPECT_EQ(i.current, 0x12);
}

TEST(Registers, OneFingerInContactIsEnough) {
  Registers r{};
  r[0] = 0x0008;  // finger B stopped while closing
  EXPECT_EQ(decode_input(r).contact, Contact::while_closing);
  r[0] = 0x0080;  // the scissor axis does not count
  EXPECT_EQ(decode_input(r).contact, Contact::none);
}

TEST(Registers, ComeBackAsSent) {
  for (const HandMode mode :
       {HandMode::basic, HandMode::pinch, HandMode::wide, HandMode::scissor}) {
    const HandOutput o{
        .activate = true, .mode = mode, .go = true, .position = 1, .speed = 2, .force = 3};
    EXPECT_EQ(decode_output(encode(o)), o);
    const HandInput i{.activated = true,
                      .mode = mode,
                      .go = true,
                      .initialisation = Initialisation::changing_mode,
                      .motion = Motion::some_stopped,
                      .contact = Contact::while_opening,
                      .fault = 0x6,
                      .requested = 9,
                      .position = 8,
                      .current = 7};
    EXPECT_EQ(decode_input(encode(i)), i);
  }
}

TEST(Output, ActivatesFirstAndAgainAfterAHardFault) {
  const HandSetpoint close{.move = true, .mode = HandMode::pinch, .closure = 0.5, .force = 1.0};
  HandInput hand;
  EXPECT_TRUE(to_output(close, hand).activate);
  EXPECT_FALSE(to_output(close, hand).go) << "not while it activates";
  hand.initialisation = Initialisation::done;
  EXPECT_TRUE(to_output(close, hand).go);
  EXPECT_EQ(to_output(close, hand).position, 128);
  hand.fault = 0xE;
  EXPECT_FALSE(to_output(close, hand).activate);
  hand.fault = 0x5;
  EXPECT_TRUE(to_output(close, hand).activate);
}

TEST(Reading, SaysWhatTheHandMeans) {
  HandInput hand{.activated = true, .go = true, .initialisation = Initialisation::done};
  EXPECT_TRUE(to_reading(hand).active);
  EXPECT_TRUE(to_reading(hand).moving);
  hand.motion = Motion::all_stopped;
  hand.contact = Contact::while_closing;
  hand.position = 51;
  EXPECT_FALSE(to_reading(hand).moving);
  EXPECT_TRUE(to_reading(hand).object_detected);
  EXPECT_DOUBLE_EQ(to_reading(hand).closure, 0.2);
  hand.fault = 0xD;
  EXPECT_FALSE(to_reading(hand).active);
  EXPECT_EQ(to_reading(hand).fault, "activation failed (0xD)");
}

}  // namespace
}  // namespace mimesis::hw::modbus
