#include "nodes/walker/stabilizer/polygon.h"

#include <gtest/gtest.h>

namespace mimesis::walker {
namespace {

using Points = std::vector<Eigen::Vector2d>;

TEST(Polygon, HullOfTwoSquaresLeavesOutWhatIsInside) {
  const Points points{{0, 0}, {1, 0}, {1, 1}, {0, 1}, {3, 0}, {4, 0}, {4, 1}, {3, 1}};
  const Polygon hull(points);
  ASSERT_EQ(hull.corners().size(), 4u);
  double area = 0.0;  // shoelace, positive counter-clockwise
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d a = hull.corners()[i], b = hull.corners()[(i + 1) % 4];
    area += 0.5 * (a.x() * b.y() - a.y() * b.x());
  }
  EXPECT_NEAR(area, 4.0, 1e-12);
  EXPECT_TRUE(hull.contains({2.0, 0.5}));
  EXPECT_FALSE(hull.contains({2.0, 1.01}));
}

TEST(Polygon, NearestPointIsInsideItselfOnAnEdgeOrACorner) {
  const Polygon square(Points{{1, 1}, {0, 0}, {0, 1}, {1, 0}});
  EXPECT_EQ(square.nearest({0.3, 0.4}), Eigen::Vector2d(0.3, 0.4));
  EXPECT_LT((square.nearest({0.3, 2.0}) - Eigen::Vector2d(0.3, 1.0)).norm(), 1e-12);
  EXPECT_EQ(square.nearest({-2.0, -1.0}), Eigen::Vector2d(0.0, 0.0));
}

TEST(Polygon, OnePointAndALine) {
  EXPECT_EQ(Polygon(Points{{1, 2}}).nearest({5, 5}), Eigen::Vector2d(1, 2));
  EXPECT_EQ(Polygon(Points{{0, 0}, {1, 0}, {2, 0}}).nearest({1.5, 5}), Eigen::Vector2d(1.5, 0));
}

}  // namespace
}  // namespace mimesis::walker
