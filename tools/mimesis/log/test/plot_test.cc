// Curves of a log, and their pictures.
#include "tools/mimesis/log/plot.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/error.h"
#include "proto/bridge.pb.h"
#include "tools/mimesis/log/test/log_builder.h"

namespace mimesis::tool {
namespace {

TEST(Plot, UnitsOfTheClosedList) {
  const auto text = [](const std::string& field) {
    const Quantity q = quantity_of(field);
    return q.name + " [" + q.unit + "]";
  };
  EXPECT_EQ(text("position_rad"), "position [rad]");
  EXPECT_EQ(text("velocity_rad_s"), "velocity [rad/s]");
  EXPECT_EQ(text("acceleration_m_s2"), "acceleration [m/s²]");
  EXPECT_EQ(text("torque_n_m"), "torque [N·m]");
  EXPECT_EQ(text("speed_m_s"), "speed [m/s]");
  EXPECT_EQ(text("force_ground_on_foot_in_world_n"), "force ground on foot in world [N]");
  EXPECT_EQ(text("gain_1_s"), "gain [1/s]");
  EXPECT_EQ(text("stamp_ns"), "stamp [ns]");
  EXPECT_EQ(text("closure"), "closure []");
  EXPECT_EQ(text("x_m"), "x [m]");
  EXPECT_EQ(text("_m"), " m []");
}

TEST(Plot, ThinningKeepsEverySpikeAndTheGaps) {
  CurveThinning thin(0.0, 100.0, 50);
  for (int i = 0; i <= 100'000; ++i) {
    double value = std::sin(i * 1e-3);
    if (i == 33'333) value = 9.0;
    if (i == 33'334) value = -9.0;
    if (i == 70'001) value = NAN;
    thin.add({i * 1e-3, value});
  }
  const auto points = thin.points();
  EXPECT_LE(points.size(), 50u * 5);
  EXPECT_EQ(points.front().time_s, 0.0);
  EXPECT_EQ(points.back().time_s, 100.0);
  int spikes = 0, gaps = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    EXPECT_GE(points[i].time_s, points[i - 1].time_s);
    if (points[i].value == 9.0) ++spikes;
    if (points[i].value == -9.0) {
      ++spikes;
      EXPECT_EQ(points[i - 1].value, 9.0);  // in their order
    }
    if (std::isnan(points[i].value)) ++gaps;
  }
  EXPECT_EQ(spikes, 2);
  EXPECT_EQ(gaps, 1);
}

TEST(Plot, FewPointsAreAllKept) {
  CurveThinning thin(0.0, 10.0, 1000);
  for (int i = 0; i < 10; ++i) thin.add({static_cast<double>(i), 1.0});
  EXPECT_EQ(thin.points().size(), 10u);
  CurveThinning single(5.0, 5.0, 10);
  single.add({5.0, 1.0});
  EXPECT_EQ(single.points().size(), 1u);
}

class PlotTest : public ::testing::Test {
 protected:
  std::vector<OpenLog> log() {
    for (std::uint64_t i = 0; i < 5; ++i) {
      v1::JointState m;
      m.add_position_rad(static_cast<double>(i * i));
      m.add_position_rad(1.0);
      m.add_velocity_rad_s(i == 2 ? INFINITY : 0.5);
      m.add_drives(i < 2 ? v1::DRIVE_STATE_FAULT : v1::DRIVE_STATE_OPERATION_ENABLED);
      m.set_operational(i > 2);
      m.set_fault("it's \"quoted\"");
      builder_.add("x/arm", 1'000'000'000 + i * 500'000'000, m);
    }
    std::vector<OpenLog> logs;
    logs.push_back(builder_.open());
    return logs;
  }
  std::vector<Curve> curves(PlotOptions options) {
    std::uint64_t failures = 0;
    auto all = read_curves(log(), options, failures);
    EXPECT_EQ(failures, 0u);
    return all;
  }
  LogBuilder builder_;
};

TEST_F(PlotTest, ACurveForEachElementWithItsTimesAndBounds) {
  const auto all = curves({.fields = {"x/arm.position_rad[*]", "x/arm.velocity_rad_s[0]"}});
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].label, "x/arm.position_rad[0]");
  EXPECT_EQ(all[0].quantity.unit, "rad");
  EXPECT_EQ(all[0].samples, 5u);
  EXPECT_EQ(all[0].greatest, 16.0);
  const auto points = all[0].thinning.points();
  ASSERT_EQ(points.size(), 5u);
  EXPECT_EQ(points[3].time_s, 1.5);
  EXPECT_EQ(points[3].value, 9.0);
  EXPECT_EQ(all[2].greatest, 0.5);  // infinity is a gap
}

TEST_F(PlotTest, EnumsAndBooleansHaveWords) {
  const auto all = curves({.fields = {"x/arm.drives[0]", "x/arm.operational"}});
  ASSERT_EQ(all.size(), 2u);
  EXPECT_TRUE(all[0].discrete);
  EXPECT_EQ(all[0].words.at(v1::DRIVE_STATE_OPERATION_ENABLED), "operation_enabled");
  EXPECT_EQ(all[1].words.at(0), "false");
  EXPECT_THROW(curves({.fields = {"x/arm.fault"}}), ConfigError);
  EXPECT_THROW(curves({.fields = {"x/arm.faults"}}), ConfigError);
}

TEST_F(PlotTest, PicturesOfEverythingThatCanBeInALog) {
  const TestFolder folder;
  PlotOptions options{.fields = {"x/arm"}};
  auto all = curves(options);
  all.push_back(all.front());
  all.back().label = "other/topic.with 'quotes'";
  all.back().thinning = CurveThinning(0.0, 1.0, 1);  // without a point
  for (const std::string name : {"a.svg", "b.svg", "a.png"}) {
    options.output = folder.file(name);
    options.style = name == "a.png" ? "dots" : "lines";
    try {
      draw_curves(all, options);
    } catch (const std::runtime_error& error) {
      if (std::string(error.what()).find("is not installed") != std::string::npos) {
        GTEST_SKIP() << error.what();
      }
      throw;
    }
  }
  const std::string svg = folder.read("a.svg");
  EXPECT_NE(svg.find("position_rad[0]"), std::string::npos);
  EXPECT_NE(svg.find("operation_enabled"), std::string::npos);
  EXPECT_NE(svg.find("[rad]"), std::string::npos);
  EXPECT_EQ(svg, folder.read("b.svg"));
  EXPECT_TRUE(folder.read("a.png").starts_with("\x89PNG"));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 3);
}

}  // namespace
}  // namespace mimesis::tool
