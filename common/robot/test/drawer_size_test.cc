#include "common/robot/drawer_size.h"

#include <gtest/gtest.h>

#include "common/robot/test/test_bipeds.h"
#include "common/testing/refusal.h"

namespace mimesis::robot {
namespace {

/// biped.urdf with the offsets of some links times `factor`.
Biped stretched(double factor, const std::function<bool(const Link&)>& which) {
  const Biped biped = hrp2_like();
  std::vector<Link> links = biped.tree.links();
  for (Link& link : links) {
    if (which(link)) link.X_PJ.translation() *= factor;
  }
  BipedNames names = hrp2_names();
  return make_biped({"stretched", links}, names);
}

TEST(DrawerSize, IsThePublishedOneForTheBipedInItsProportions) {
  const DrawerSize size = drawer_size(hrp2_like()), published;
  EXPECT_EQ(size.handle_height_m, published.handle_height_m);
  EXPECT_EQ(size.handle_left_m, published.handle_left_m);
  EXPECT_EQ(size.object_height_m, published.object_height_m);
  EXPECT_EQ(size.pull_m, published.pull_m);
  EXPECT_EQ(size.least_depth_m, published.least_depth_m);
  EXPECT_EQ(size.most_depth_m, published.most_depth_m);
  EXPECT_EQ(size.least_reach_m, published.least_reach_m);
  EXPECT_EQ(size.most_reach_m, published.most_reach_m);
  EXPECT_DOUBLE_EQ(size.reach_m(0.124), 0.663);
  EXPECT_DOUBLE_EQ(size.reach_m(0.273), 0.755);
}

TEST(DrawerSize, GrowsWithTheRobot) {
  for (const double factor : {0.5, 1.7}) {
    const DrawerSize size = drawer_size(stretched(factor, [](const Link&) { return true; }));
    const DrawerSize one;
    const auto near = [&](double length, double published) {
      EXPECT_NEAR(length, factor * published, 0.6e-3) << factor;
    };
    near(size.handle_height_m, one.handle_height_m);
    near(size.handle_left_m, one.handle_left_m);
    near(size.object_height_m, one.object_height_m);
    near(size.pull_m, one.pull_m);
    near(size.least_depth_m, one.least_depth_m);
    near(size.most_depth_m, one.most_depth_m);
    near(size.least_reach_m, one.least_reach_m);
    near(size.most_reach_m, one.most_reach_m);
  }
}

/// A longer lower arm reaches deeper down and farther ahead from the same shoulders.
TEST(DrawerSize, LongerArmsWantItLowerAndFartherAway) {
  const DrawerSize size =
      drawer_size(stretched(1.5, [](const Link& l) { return l.joint.ends_with("wrist_yaw"); }));
  const double arms = (0.63 + 0.125) / 0.63;
  EXPECT_NEAR(size.handle_height_m, 1.178702 - arms * 0.258702, 0.6e-3);
  EXPECT_NEAR(size.object_height_m, 1.178702 - arms * 0.278702, 0.6e-3);
  EXPECT_NEAR(size.least_reach_m, 0.03 + arms * 0.633, 0.6e-3);
  EXPECT_EQ(size.handle_left_m, 0.14);
}

std::string refusal(const Biped& biped) {
  return testing::refusal([&] { (void)drawer_size(biped); });
}

TEST(DrawerSize, SaysWhichRobotsHaveNone) {
  Biped biped = hrp2_like();
  biped.hand[kLeft] = -1;
  EXPECT_NE(refusal(biped).find("no left hand"), std::string::npos);
  biped.hand[kLeft] = biped.tree.require_link("left_forearm");
  EXPECT_NE(refusal(biped).find("4 joints"), std::string::npos);
  const Biped apish = stretched(20.0, [](const Link& l) { return l.joint.ends_with("wrist_yaw"); });
  EXPECT_NE(refusal(apish).find("above the ground"), std::string::npos);
}

TEST(MovedLinks, AreThoseBetween) {
  const Biped biped = hrp2_like();
  const auto names = [&](int above, int link) {
    std::string out;
    for (const int l : moved_links(biped.tree, above, link)) out += biped.tree.link(l).name + " ";
    return out;
  };
  EXPECT_EQ(names(0, biped.trunk), "waist chest ");
  EXPECT_EQ(names(biped.trunk, biped.hand[kRight]),
            "right_shoulder right_shoulder_bow right_upper_arm right_forearm right_wrist "
            "right_hand ");
  EXPECT_EQ(names(biped.trunk, biped.trunk), "");
  const Arm arm = arm_of(biped, kRight);
  EXPECT_EQ(biped.tree.link(arm.shoulder).name, "right_upper_arm");
  EXPECT_EQ(biped.tree.link(arm.elbow).name, "right_forearm");
  EXPECT_EQ(biped.tree.link(arm.wrist).name, "right_hand");
}

}  // namespace
}  // namespace mimesis::robot
