#include <gtest/gtest.h>

#include <numbers>

#include "nodes/vision/blob_tracker.h"
#include "nodes/vision/regions.h"
#include "nodes/vision/solids.h"
#include "nodes/vision/table_watcher.h"

namespace mimesis::vision {
namespace {

using Eigen::Vector2d;

/// A region that fills a rectangle.
Region rectangle(Kind kind, int left, int top, int width, int height) {
  Region region{kind, {}};
  for (int v = top; v < top + height; ++v) region.moments.add({v, left, left + width, kind, 0});
  return region;
}

TEST(BlobTracker, JoinsWhatAPostHasSplitAndLeavesWhatIsFarAway) {
  BlobTracker tracker(TrackerLimits{});
  const std::vector<Region> regions{
      rectangle(Kind::hand, 100, 100, 40, 20), rectangle(Kind::hand, 150, 102, 30, 20),
      rectangle(Kind::hand, 400, 100, 20, 20), rectangle(Kind::object, 185, 100, 20, 40),
      rectangle(Kind::object, 300, 300, 3, 3)};
  tracker.update(regions);
  EXPECT_EQ(tracker.blob(Kind::hand).regions, (std::vector<int>{0, 1}));
  EXPECT_EQ(tracker.blob(Kind::hand).moments.area, 40 * 20 + 30 * 20);
  EXPECT_EQ(tracker.blob(Kind::object).moments.area, 800);
  EXPECT_FALSE(tracker.blob(Kind::bar).found());
}

TEST(BlobTracker, StaysWithItsBlobWhenASlightlyLargerOneAppearsFarAway) {
  BlobTracker tracker(TrackerLimits{});
  tracker.update(std::vector<Region>{rectangle(Kind::object, 100, 100, 20, 20)});
  tracker.update(std::vector<Region>{rectangle(Kind::object, 104, 100, 20, 20),
                                     rectangle(Kind::object, 500, 300, 24, 24)});
  EXPECT_NEAR(tracker.blob(Kind::object).moments.mean_u(), 113.5, 1e-9);
  tracker.update(std::vector<Region>{rectangle(Kind::object, 500, 300, 24, 24)});
  EXPECT_FALSE(tracker.blob(Kind::object).found());  // none moves that fast
  for (int k = 0; k < 20; ++k)
    tracker.update(std::vector<Region>{rectangle(Kind::object, 500, 300, 24, 24)});
  EXPECT_NEAR(tracker.blob(Kind::object).moments.mean_u(), 511.5, 1e-9);  // the old one is gone
}

TEST(BlobTracker, TakesNoSleeveForAHiddenObject) {
  BlobTracker tracker(TrackerLimits{});
  tracker.update(std::vector<Region>{rectangle(Kind::object, 100, 100, 40, 40)});
  const Region sleeve = rectangle(Kind::object, 20, 80, 70, 70),
               seam = rectangle(Kind::object, 60, 100, 8, 8),
               part = rectangle(Kind::object, 110, 100, 15, 40);
  tracker.update(std::vector<Region>{sleeve, part});
  EXPECT_NEAR(tracker.blob(Kind::object).moments.mean_u(), 117.0, 1e-9);
  tracker.update(std::vector<Region>{sleeve, seam});
  EXPECT_FALSE(tracker.blob(Kind::object).found());
  for (int k = 0; k < 31; ++k) tracker.update(std::vector<Region>{sleeve});
  EXPECT_NEAR(tracker.blob(Kind::object).moments.mean_u(), 54.5,
              1e-9);  // nothing else for a second
}

TEST(BlobTracker, LeavesADotForTheWholeObject) {
  BlobTracker tracker(TrackerLimits{});
  const Region dot = rectangle(Kind::object, 150, 150, 11, 11);
  tracker.update(std::vector<Region>{rectangle(Kind::object, 100, 100, 40, 40)});
  tracker.update(std::vector<Region>{dot});  // the object is hidden, and appears elsewhere
  for (int k = 0; k < 20; ++k)
    tracker.update(std::vector<Region>{dot, rectangle(Kind::object, 400, 100, 40, 40)});
  EXPECT_NEAR(tracker.blob(Kind::object).moments.mean_u(), 419.5, 1e-9);
}

TEST(BlobTracker, KnowsTheWholeObjectAfterAHandHasHeldItForLong) {
  BlobTracker tracker(TrackerLimits{});
  const Region whole = rectangle(Kind::object, 100, 100, 40, 40),
               part = rectangle(Kind::object, 100, 100, 10, 40),
               dot = rectangle(Kind::object, 150, 150, 11, 11);
  tracker.update(std::vector<Region>{whole});
  for (int k = 0; k < 200; ++k) tracker.update(std::vector<Region>{part, dot});
  for (int k = 0; k < 20; ++k) tracker.update(std::vector<Region>{whole, dot});
  EXPECT_GT(tracker.blob(Kind::object).moments.area, 1599.0);
}

TEST(BlobTracker, LeavesAPatchForAHandThatComesIn) {
  BlobTracker tracker(TrackerLimits{});
  const Region patch = rectangle(Kind::hand, 500, 400, 30, 30);
  tracker.update(std::vector<Region>{patch});
  tracker.update(std::vector<Region>{patch, rectangle(Kind::hand, 0, 50, 100, 60)});
  EXPECT_NEAR(tracker.blob(Kind::hand).moments.mean_u(), 49.5, 1e-9);
}

TEST(BlobTracker, TakesNoSmallPatchForAHand) {
  BlobTracker tracker(TrackerLimits{});
  tracker.update(std::vector<Region>{rectangle(Kind::hand, 10, 10, 12, 12)});
  EXPECT_FALSE(tracker.blob(Kind::hand).found());
}

TEST(Palm, IsTheForemostPartOfAnArm) {
  std::vector<vision::Run> runs;
  Blob arm;
  arm.regions = {3};
  for (int v = 50; v < 70; ++v) {
    runs.push_back({v, 0, 200, Kind::hand, 3});
    runs.push_back({v, 300, 600, Kind::hand, 4});  // another region
    arm.moments.add(runs[runs.size() - 2]);
  }
  const auto right = find_palm(runs, arm, {1.0, 0.0}, 60.0);
  ASSERT_TRUE(right);
  EXPECT_NEAR(right->center.x(), 0.5 * (139 + 199), 1.0);
  EXPECT_NEAR(right->center.y(), 59.5, 1e-9);
  EXPECT_EQ(right->tip.x(), 199);
  const auto left = find_palm(runs, arm, {-1.0, 0.0}, 60.0);
  ASSERT_TRUE(left);
  EXPECT_NEAR(left->center.x(), 30.0, 1.0);
  EXPECT_FALSE(find_palm(runs, Blob{}, {1.0, 0.0}, 60.0));
}

TEST(Palm, AngleIsZeroFromAboveAndRightFromTheSide) {
  constexpr double kRight = std::numbers::pi / 2.0;
  EXPECT_NEAR(palm_angle({0.0, 0.1}, {0.0, 0.0}, 0.05), 0.0, 1e-12);
  EXPECT_NEAR(palm_angle({-0.1, 0.0}, {0.0, 0.0}, 0.05), kRight, 1e-12);
  EXPECT_NEAR(palm_angle({0.1, 0.1}, {0.0, 0.0}, 0.05), kRight / 2.0, 1e-12);
  // In front of the object: the palm is beside it along the line of sight.
  EXPECT_NEAR(palm_angle({0.0, 0.0}, {0.0, 0.0}, 0.05), kRight, 1e-12);
  EXPECT_NEAR(palm_angle({0.0, 0.03}, {0.0, 0.0}, 0.05), std::acos(0.6), 1e-12);
}

TEST(Silhouette, OfASmallBodyIsCentredOnItsCentre) {
  const image::Camera camera{image::View{}};
  const Vector2d at(0.1, 0.2);
  const Vector2d seen = outline(camera, box(1e-3, 1e-3, 1e-3), {at.x(), at.y(), 0.0}).mean;
  EXPECT_NEAR((seen - camera.project({0.1, 0.2, 0.0})).norm(), 0.0, 0.01);
}

TEST(Silhouette, OfALongBodyLeansTowardsItsNearEnd) {
  const image::Camera camera{image::View{}};
  const Vector2d seen = outline(camera, box(0.03, 0.03, 0.26), {0.0, 0.2, 0.0}).mean;
  const Vector2d middle = camera.project({0.0, 0.2, 0.0}), near = camera.project({0.0, 0.2, 0.13});
  EXPECT_GT((seen - middle).dot(near - middle), 0.0);
  EXPECT_GT((seen - middle).norm(), 1.0);
}

TEST(Silhouette, IsInvertedByLocate) {
  const image::Camera camera{image::View{}};
  for (const Body& body : {cylinder(0.024, 0.085), box(0.035, 0.03, 0.26), cylinder(0.046, 0.02)}) {
    for (const double x : {-0.3, 0.0, 0.35}) {
      for (const double y : {0.02, 0.3}) {
        const auto found = locate(camera, body, outline(camera, body, {x, y, 0.0}).mean);
        ASSERT_TRUE(found);
        EXPECT_NEAR((*found - Vector2d(x, y)).norm(), 0.0, 2e-5);
      }
    }
  }
}

TEST(SteadyPlace, OneInflatedAreaFreezesNothing) {
  SteadyPlace place;
  const Vector2d before(0.2, 0.1), after(0.208, 0.1);  // a knock by less than what counts as moved
  for (int i = 0; i < 100; ++i) place.update(before, 1000.0 + 5.0 * (i % 3));
  place.update(before + Vector2d(0.0, 0.006), 1400.0);  // grown together with a patch of its colour
  ASSERT_TRUE(place.get());
  EXPECT_LT((*place.get() - before).norm(), 1e-12);  // which does not move it
  for (int i = 0; i < 300; ++i) place.update(after, 1000.0 + 5.0 * (i % 3));
  EXPECT_LT((*place.get() - after).norm(), 1e-3);
}

TEST(SteadyPlace, AnInflatedFirstAreaIsForgotten) {
  SteadyPlace place;
  place.update(Vector2d(0.21, 0.1), 1500.0);
  for (int i = 0; i < 200; ++i) place.update(Vector2d(0.2, 0.1), 1000.0);
  EXPECT_LT((*place.get() - Vector2d(0.2, 0.1)).norm(), 1e-3);
}

TEST(SteadyPlace, StaysWhileHalfHiddenAndGoesWhenTakenAway) {
  SteadyPlace place;
  const Vector2d at(0.2, 0.1);
  for (int i = 0; i < 100; ++i) place.update(at, 1000.0);
  for (int i = 0; i < 40; ++i) place.update(at + Vector2d(0.01, 0.0), 500.0);
  EXPECT_LT((*place.get() - at).norm(), 1e-12);
  for (int i = 0; i < 15; ++i) place.update(at + Vector2d(0.05, 0.0), 1000.0);
  EXPECT_NEAR(place.get()->x(), 0.25, 1e-12);  // it was moved
  for (int i = 0; i < 15; ++i) place.update(std::nullopt, 0.0);
  EXPECT_FALSE(place.get());
}

}  // namespace
}  // namespace mimesis::vision
