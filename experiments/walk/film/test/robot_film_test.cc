#include "experiments/walk/film/robot_film.h"

#include <gtest/gtest.h>

#include "common/error.h"
#include "common/model/files.h"

namespace mimesis::film {
namespace {

const std::string kBiped = std::string(MIMESIS_SOURCE_DIR) + "/models/biped.yaml";

TEST(RobotFigure, HalfSittingBipedStandsOnTheGround) {
  const robot::Biped biped = model::load_biped(kBiped);
  const RobotFigure figure(biped, model::urdf_of_biped(kBiped));
  FilmFrame frame;
  figure.add_to(frame, biped.X_WB_half_sitting, biped.half_sitting);
  ASSERT_GT(frame.boxes.size(), 8u);
  double lowest = 1.0, highest = 0.0, leftmost = 0.0;
  for (const synthesizer::FilmBox& box : frame.boxes) {
    const Eigen::Vector3d reach = (box.tilt.toRotationMatrix().cwiseAbs() * box.half_extent).eval();
    lowest = std::min(lowest, box.center.z() - reach.z());
    highest = std::max(highest, box.center.z() + reach.z());
    leftmost = std::max(leftmost, box.center.y());
  }
  EXPECT_NEAR(lowest, 0.0, 1e-9);
  EXPECT_NEAR(highest, 1.539, 0.06);  // 1.54 m when its legs are straight
  EXPECT_GT(leftmost, 0.2);
}

TEST(RobotFigure, SidesHaveColoursOfTheirOwn) {
  const robot::Biped biped = model::load_biped(kBiped);
  FilmFrame frame;
  RobotFigure(biped, model::urdf_of_biped(kBiped))
      .add_to(frame, biped.X_WB_half_sitting, biped.half_sitting);
  for (const synthesizer::FilmBox& box : frame.boxes) {
    const double y = box.center.y();
    if (std::abs(y) < 0.02) continue;
    EXPECT_EQ(box.colour.blue > box.colour.red, y > 0.0) << y;
  }
}

TEST(FilmDrawer, HandleIsOnTheFrontAsFarAsItIsOpen) {
  FilmFrame closed, open;
  FilmDrawer drawer{.front_W_m = {1.0, 0.0, 0.0},
                    .handle_W_m = {1.0, 0.14, 0.92},
                    .object_W_m = {1.25, 0.0, 0.9}};
  add_drawer(closed, drawer);
  drawer.handle_W_m.x() -= 0.2;
  add_drawer(open, drawer);
  ASSERT_EQ(closed.boxes.size(), open.boxes.size());
  EXPECT_EQ(closed.boxes[0].center, open.boxes[0].center);  // the furniture stays
  for (std::size_t i = 1; i < open.boxes.size(); ++i) {
    EXPECT_NEAR(closed.boxes[i].center.x() - open.boxes[i].center.x(), 0.2, 1e-12);
  }
}

TEST(RobotFigure, DamagedUrdfIsRefused) {
  const robot::Biped biped = model::load_biped(kBiped);
  EXPECT_THROW(RobotFigure(biped, "/nowhere.urdf"), ConfigError);
}

}  // namespace
}  // namespace mimesis::film
