// Curves of a log's fields: a pyramid of least and largest values.
#include "tools/mimesis/log/play_curves.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mimesis::tool {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

TEST(MinMaxPyramid, IsAsLookingAtEachValue) {
  MinMaxPyramid series;
  std::uint32_t state = 1;
  for (int i = 0; i < 70'000; ++i) {  // more than 16^4
    state = state * 1664525u + 1013904223u;
    series.add(i % 50 == 7 ? kNone : static_cast<double>(state >> 8) - 5e6);
  }
  const auto values = series.values();
  for (const auto& [begin, end] : std::vector<std::pair<std::size_t, std::size_t>>{{0, 70'000},
                                                                                   {1, 69'999},
                                                                                   {15, 17},
                                                                                   {16, 32},
                                                                                   {255, 4097},
                                                                                   {4096, 65'536},
                                                                                   {65'535, 65'537},
                                                                                   {7, 8},
                                                                                   {3, 3}}) {
    double least = kNone, largest = kNone;
    for (std::size_t i = begin; i < end; ++i)
      least = std::fmin(least, values[i]), largest = std::fmax(largest, values[i]);
    const auto range = series.range(begin, end);
    EXPECT_TRUE(range.least == least || (std::isnan(range.least) && std::isnan(least))) << begin;
    EXPECT_TRUE(range.largest == largest || (std::isnan(largest) && std::isnan(range.largest)));
  }
}

struct Series {
  std::vector<double> at_s;
  MinMaxPyramid values;
  v1::PlayerCurve draw(double from_s, double to_s, std::uint32_t columns) const {
    v1::PlayerCurve out;
    draw_curve(at_s, values, from_s, to_s, columns, out);
    return out;
  }
};

TEST(DrawCurve, ASpikeOfOneSampleInAnHourIsSeen) {
  Series hour;  // 1 kHz
  for (int i = 0; i < 3'600'000; ++i) {
    hour.at_s.push_back(i * 1e-3);
    hour.values.add(i == 1'234'567 ? 9.0 : std::sin(i * 1e-3));
  }
  const v1::PlayerCurve whole = hour.draw(0.0, 3600.0, 1000);
  EXPECT_LE(whole.value_size(), 2002);
  EXPECT_EQ(*std::ranges::max_element(whole.value()), 9.0);
  EXPECT_NEAR(*std::ranges::min_element(whole.value()), -1.0, 1e-6);
  EXPECT_TRUE(std::ranges::is_sorted(whole.position_s()));
  EXPECT_EQ(whole.position_s(0), 0.0);
  EXPECT_NEAR(whole.position_s().rbegin()[0], 3599.999, 1e-9);
  // Nearer: every sample, and one on each side, so that nothing is missing at the edges.
  const v1::PlayerCurve near = hour.draw(1234.5605, 1234.5695, 1000);
  ASSERT_EQ(near.value_size(), 11);
  EXPECT_EQ(near.position_s(0), 1234.560);
  EXPECT_EQ(near.position_s(10), 1234.570);
  EXPECT_EQ(near.value(7), 9.0);
}

TEST(DrawCurve, NoWindowCostsMoreThanAnother) {  // rerun#5827: slower the nearer
  Series series;
  for (int i = 0; i < 1'000'000; ++i) series.at_s.push_back(i * 1e-3), series.values.add(i % 7);
  for (double width_s = 1000.0; width_s > 1e-4; width_s /= 3.0)
    EXPECT_LE(series.draw(321.0, 321.0 + width_s, 600).value_size(), 1202) << width_s;
}

TEST(DrawCurve, ALineThroughAWindowBetweenTwoSamplesIsThere) {
  Series rare;
  for (int i = 0; i < 10; ++i) rare.at_s.push_back(10.0 * i), rare.values.add(i);
  const v1::PlayerCurve curve = rare.draw(12.0, 13.0, 100);
  ASSERT_EQ(curve.value_size(), 2);
  EXPECT_EQ(curve.value(0), 1.0);
  EXPECT_EQ(curve.value(1), 2.0);
  EXPECT_EQ(rare.draw(200.0, 300.0, 100).value_size(), 1);  // beside it lies the last
  EXPECT_EQ(Series().draw(0.0, 1.0, 100).value_size(), 0);
}

}  // namespace
}  // namespace mimesis::tool
