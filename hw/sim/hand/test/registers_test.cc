#include "hw/sim/hand/registers.h"

#include <gtest/gtest.h>

namespace mimesis::hw::sim {
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
  const Registers r = encode(HandInput{.activated = true,
                                       .go = true,
                                       .initialisation = Initialisation::done,
                                       .motion = Motion::all_stopped,
                                       .contact = Contact::while_closing,
                                       .requested = 0xFF,
                                       .position = 0x80,
                                       .current = 0x12});
  EXPECT_EQ(r, (Registers{0xB9EA, 0x00FF, 0x8012, 0xFF80, 0x12FF, 0x8012, 0x0000, 0x0000}));
}

TEST(Registers, ComeBackAsSent) {
  for (const HandMode mode :
       {HandMode::basic, HandMode::pinch, HandMode::wide, HandMode::scissor}) {
    const HandOutput o{
        .activate = true, .mode = mode, .go = true, .position = 1, .speed = 2, .force = 3};
    EXPECT_EQ(decode_output(encode(o)), o);
  }
}

}  // namespace
}  // namespace mimesis::hw::sim
