#include "common/task/symbols.h"

#include <gtest/gtest.h>

#include "common/model/messages.h"
#include "common/testing/refusal.h"

namespace mimesis::task {
namespace {

std::string refusal(std::string_view text) {
  return testing::refusal([&] { parse_demonstration(text, "teacher"); }, "none");
}

TEST(Demonstration, IsReadFromItsWords) {
  const Demonstration d = parse_demonstration("full,below,low");
  EXPECT_EQ(d.grip, Grip::full);
  EXPECT_EQ(d.transport, Transport::below);
  EXPECT_EQ(d.goal, Goal::low);
  EXPECT_EQ(d.color, Color::unknown);
  EXPECT_EQ(parse_demonstration(" precision, above,high,dark").color, Color::dark);
  EXPECT_EQ(word(parse_demonstration("precision,above,high").grip), "precision");
}

TEST(Demonstration, NamesTheWordThatItDoesNotKnow) {
  EXPECT_EQ(refusal("full,beside,low"),
            "teacher: 'full,beside,low': 'beside' is neither 'above' nor 'below'");
  EXPECT_EQ(refusal("unknown,above,high"),
            "teacher: 'unknown,above,high': 'unknown' is neither 'precision' nor 'full'");
  EXPECT_EQ(refusal("full,below,low,"),
            "teacher: 'full,below,low,': '' is neither 'light' nor 'dark'");
  for (const char* wrong : {"", "full", "full,below", "full,below,low,dark,dark"})
    EXPECT_NE(refusal(wrong).find("expected grip,transport,goal"), std::string::npos) << wrong;
}

TEST(Symbols, KeepTheirNumbersOnTheWire) {
  using model::from_proto, model::to_proto;
  for (const Grip g : {Grip::unknown, Grip::precision, Grip::full})
    EXPECT_EQ(from_proto(to_proto(g)), g);
  EXPECT_EQ(to_proto(Color::dark), v1::OBJECT_COLOR_DARK);
  EXPECT_EQ(from_proto(static_cast<v1::Goal>(7)), Goal::unknown) << "of a newer sender";
}

}  // namespace
}  // namespace mimesis::task
