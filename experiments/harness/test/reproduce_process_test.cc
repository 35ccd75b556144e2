// `mimesis reproduce` as people call it.
#include <gtest/gtest.h>

#include "common/testing/process.h"

namespace mimesis::tool {
namespace {

TEST(Reproduce, AnUnknownFigureIsNotFound) {
  testing::Process p("mimesis", {"reproduce", "fig-2.211"});
  EXPECT_EQ(p.wait(), 3);
  EXPECT_NE(p.errors().find("no figure 'fig-2.211'"), std::string::npos) << p.errors();
}

TEST(Reproduce, SaysWhoseNumberStandsBesideOurs) {
  testing::Process text("mimesis", {"reproduce", "fig-2.4"});
  EXPECT_EQ(text.wait(), 0);
  EXPECT_NE(text.output().find("prototype: fields.md"), std::string::npos) << text.output();
  testing::Process json("mimesis", {"reproduce", "fig-2.4", "--json"});
  EXPECT_EQ(json.wait(), 0);
  EXPECT_NE(json.output().find(R"("origin":"published","where":"M18 2.2.2")"), std::string::npos)
      << json.output();
  testing::Process list("mimesis", {"reproduce", "--list"});
  EXPECT_EQ(list.wait(), 0);
  EXPECT_NE(list.output().find("2 published, 3 prototype, 1 goal"), std::string::npos)
      << list.output();
  EXPECT_NE(list.output().find(" figures, rows: "), std::string::npos) << list.output();
}

}  // namespace
}  // namespace mimesis::tool
