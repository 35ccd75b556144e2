// `mimesis reproduce` as people call it.
#include <gtest/gtest.h>

#include <filesystem>

#include "common/testing/process.h"

namespace mimesis::tool {
namespace {

TEST(Reproduce, AFilmOfAFigureWithoutMotionIsAUsersMistake) {
  const auto folder = std::filesystem::path(::testing::TempDir()) / "no_film";
  testing::Process p("mimesis", {"reproduce", "fig-2.21", "--film", folder.string()});
  EXPECT_EQ(p.wait(), 2);
  EXPECT_EQ(p.errors(), "reproduce: fig-2.21 has no film, expected a figure of a motion\n");
  EXPECT_EQ(p.output(), "");  // nothing was computed
  EXPECT_FALSE(std::filesystem::exists(folder));
}

TEST(Reproduce, AnUnknownFigureIsNotFound) {
  testing::Process p("mimesis", {"reproduce", "fig-2.211", "--film", "x"});
  EXPECT_EQ(p.wait(), 3);
  EXPECT_NE(p.errors().find("no figure 'fig-2.211'"), std::string::npos) << p.errors();
}

}  // namespace
}  // namespace mimesis::tool
