// Tests of the values behind rows and bars of the study's figures.
#include <gtest/gtest.h>

#include <cmath>

#include "experiments/harness/figure.h"
#include "experiments/walk/study/drawer_rows.h"

namespace mimesis::walk {
namespace {

TEST(Spread, IsOfAllValuesAndOfNoneIfOneIsMissing) {
  const Spread s = spread_of({1.0, 3.0, 1.0, 3.0});
  EXPECT_DOUBLE_EQ(s.mean, 2.0);
  EXPECT_DOUBLE_EQ(s.std, 1.0);
  EXPECT_EQ(s.least, 1.0);
  EXPECT_EQ(s.most, 3.0);
  EXPECT_TRUE(std::isnan(spread_of({1.0, std::nan(""), 3.0}).mean));
  EXPECT_TRUE(std::isnan(spread_of({1.0, std::nan(""), 3.0}).most));
}

std::vector<Outcome> thirty() {
  std::vector<Outcome> out(30);
  for (std::size_t i = 0; i < out.size(); ++i) out[i].ankle_n_m = static_cast<double>(i);
  return out;
}

TEST(StudyRows, SpeedClassesAreTens) {
  const auto middle = speed_class(thirty(), 1);
  ASSERT_EQ(middle.size(), 10U);
  EXPECT_EQ(middle.front().ankle_n_m, 10.0);
  EXPECT_EQ(middle.back().ankle_n_m, 19.0);
  EXPECT_EQ(speed_class(thirty(), 2).back().ankle_n_m, 29.0);
}

TEST(StudyRows, EveryFallCounts) {
  auto all = thirty();
  EXPECT_EQ(falls(all), 0);
  all[0].fell = all[29].fell = true;
  EXPECT_EQ(falls(all), 2);
}

TEST(StudyRows, LargestIsASizeAndNoneIfAWalkDidNotComeToIt) {
  std::vector<Outcome> two(2);
  two[0].normal_error_m = -0.02;
  two[1].normal_error_m = 0.01;
  EXPECT_EQ(largest(two, normal_error), 0.02);
  EXPECT_TRUE(std::isnan(largest(two, reach_error)));
  EXPECT_FALSE(reproduce::at_most("reach", largest(two, reach_error), 1.0, "m", "").passed)
      << "a robot that never reached did not reach well";
}

TEST(Bars, AreCutAtTheAxisAndTheInfeasibleIsShaded) {
  std::vector<plot::Data> data;
  const std::string script =
      bars_panel({{"a", {10.0, 2.0, 7.0, 12.0}, 1}, {"b", {90.0, 20.0, 50.0, 200.0}, 5}}, "n",
                 100.0, 30.0, data);
  ASSERT_EQ(data.size(), 2U);
  EXPECT_EQ(data[0].rows[0], (std::vector<double>{0.0, 10.0, 8.0, 12.0, 7.0, 12.0}));
  EXPECT_EQ(data[1].rows[0], (std::vector<double>{1.0, 90.0, 70.0, 100.0, 50.0, 100.0}));
  EXPECT_NE(script.find("first 30"), std::string::npos);
  EXPECT_NE(script.find("[0:100"), std::string::npos);
  EXPECT_EQ(bars_panel({{"a", {10.0, 2.0, 7.0, 12.0}, 1}}, "m", 0.0, 0.0, data).find("rectangle"),
            std::string::npos);
  EXPECT_EQ(data.back().rows[0][5], 12.0) << "nothing is cut at an axis that grows";
}

}  // namespace
}  // namespace mimesis::walk
