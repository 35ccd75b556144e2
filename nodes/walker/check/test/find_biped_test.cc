#include "nodes/walker/check/find_biped.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "common/robot/leg_ik.h"
#include "nodes/walker/check/feasible_gait.h"

namespace mimesis::walker {
namespace {

using Eigen::Vector3d;
using robot::Link;

constexpr double kKnee_rad = 0.87;

std::vector<Link> links_of_biped() {
  return robot::read_urdf(std::string(MIMESIS_SOURCE_DIR) + "/models/biped.urdf").links();
}

Link& link(std::vector<Link>& links, const std::string& name) {
  return *std::ranges::find(links, name, &Link::name);
}
Link& joint(std::vector<Link>& links, const std::string& name) {
  return *std::ranges::find(links, name, &Link::joint);
}

/// Corners of the published soles, of the feet's upper sides, and a raised tip of the toes.
ContactPoints contacts() {
  ContactPoints out;
  for (const std::string side : {"left", "right"}) {
    const double outer = side == "left" ? 0.075 : -0.075, inner = side == "left" ? -0.056 : 0.056;
    for (const double z : {-0.105, -0.05}) {
      for (const double x : {-0.1, 0.13})
        for (const double y : {outer, inner}) out[side + "_foot"].push_back({x, y, z});
    }
    out[side + "_foot"].push_back({0.2, 0.0, -0.085});
  }
  return out;
}

FoundBiped found(const std::function<void(std::vector<Link>&)>& change = {},
                 const ContactPoints& points = contacts(), double knee_rad = kKnee_rad) {
  std::vector<Link> links = links_of_biped();
  if (change) change(links);
  return find_biped(robot::RobotTree("robot", links), points, knee_rad);
}

std::string text(const FoundBiped& biped, Finding::Kind kind) {
  std::string all;
  for (const Finding& f : biped.findings)
    if (f.kind == kind) all += f.part + ": " + f.text + "\n";
  return all;
}
std::string missing(const FoundBiped& biped) { return text(biped, Finding::Kind::missing); }

TEST(FindBiped, FindsThePublishedRobotByItsShape) {
  const FoundBiped biped = found();
  EXPECT_EQ(missing(biped), "");
  ASSERT_TRUE(biped.biped.has_value());
  const robot::BipedNames& n = biped.names;
  EXPECT_NEAR(n.sole_front_m - n.sole_back_m, 0.23, 1e-9);
  EXPECT_NEAR(-n.sole_back_m, n.sole_front_m, 1e-9) << "it stands on the middle of its soles";
  EXPECT_NEAR(n.sole_inner_m, 0.056, 1e-9);
  EXPECT_NEAR(n.sole_outer_m, 0.075, 1e-9);
  EXPECT_EQ(n.trunk, "chest");
  EXPECT_EQ(n.head, "head");
  EXPECT_EQ(n.imu, "pelvis");
  EXPECT_NEAR(biped.biped->feet_distance_m, 0.19, 1e-9);
  robot::Kinematics kinematics(biped.biped->tree);
  kinematics.update(biped.biped->X_WB_half_sitting, biped.biped->half_sitting);
  EXPECT_NEAR(kinematics.com().x(), 0.0, 1e-4) << "the CoM is above the soles' origins";
  for (const Side side : robot::kSides) {
    const robot::LegIk ik(*biped.biped, side);
    const auto leg = ik.solve(biped.biped->X_WB_half_sitting.inverse() *
                              kinematics.X_WL(biped.biped->leg[side].sole));
    EXPECT_NEAR(leg.bend_rad, kKnee_rad, 1e-2);
  }
}

/// As Atlas's: thighs that lean back, knees that stand at their limit beyond straight, hips askew.
TEST(FindBiped, BendsKneesThatStandBeyondStraight) {
  const FoundBiped biped = found([](std::vector<Link>& links) {
    for (const std::string side : {"left", "right"}) {
      joint(links, side + "_hip_pitch").X_PJ.translation().x() += 0.05;
      joint(links, side + "_knee").X_PJ.translation().x() -= 0.05;
      joint(links, side + "_knee").lower = 0.0;
    }
  });
  EXPECT_EQ(missing(biped), "");
  ASSERT_TRUE(biped.biped.has_value());
  EXPECT_FALSE(robot::LegIk(*biped.biped, kLeft).closed_form());
}

TEST(FindBiped, HoldsWhatCannotBeDriven) {
  const FoundBiped biped = found([](std::vector<Link>& links) {
    joint(links, "left_gripper").mimics = "neck_yaw";
    joint(links, "right_gripper").type = robot::JointType::prismatic;
    link(links, "head").inertia = {};
  });
  EXPECT_EQ(missing(biped), "");
  ASSERT_TRUE(biped.biped.has_value());
  for (const char* held : {"left_gripper", "right_gripper", "neck_pitch"})
    EXPECT_EQ(biped.biped->tree.find_joint(held), -1) << held;
  const std::string assumed = text(biped, Finding::Kind::assumed);
  EXPECT_NE(assumed.find("left_gripper: they follow others"), std::string::npos) << assumed;
  EXPECT_NE(assumed.find("right_gripper: they slide"), std::string::npos) << assumed;
}

TEST(FindBiped, HoldsFingersBeyondAHandsFirstBranch) {
  const FoundBiped biped = found([](std::vector<Link>& links) {
    const Link hand = joint(links, "left_gripper");
    for (const char* name : {"thumb", "index"}) {
      Link finger = hand;
      finger.name = finger.joint = name;
      links.push_back(finger);
    }
  });
  EXPECT_EQ(missing(biped), "");
  ASSERT_TRUE(biped.biped.has_value());
  for (const char* held : {"left_gripper", "thumb", "index"})
    EXPECT_EQ(biped.biped->tree.find_joint(held), -1) << held;
  EXPECT_GE(biped.biped->tree.find_joint("left_wrist_pitch"), 0);
}

TEST(FindBiped, AFixedLinkNeedsNoInertiaAndAMovingOneIsNamed) {
  const FoundBiped point =
      found([](std::vector<Link>& links) { link(links, "left_sole").inertia.mass_kg = 0.1; });
  EXPECT_EQ(missing(point), "");
  const FoundBiped none = found(
      [](std::vector<Link>& links) { link(links, "left_foot").inertia.about_com_kg_m2.setZero(); });
  EXPECT_NE(missing(none).find("link 'left_foot': inertia"), std::string::npos) << missing(none);
  EXPECT_FALSE(none.biped.has_value());

  const FoundBiped thin = found([](std::vector<Link>& links) {
    link(links, "left_foot").inertia.about_com_kg_m2 = Vector3d(1e-3, 1e-3, 5e-3).asDiagonal();
  });
  EXPECT_EQ(missing(thin), "");
  EXPECT_TRUE(thin.balance_inertias);
  EXPECT_NE(text(thin, Finding::Kind::assumed).find("left_foot: a moment"), std::string::npos);
}

TEST(FindBiped, NamesWhatIsMissing) {
  const auto says = [](const std::function<void(std::vector<Link>&)>& change) {
    const FoundBiped biped = found(change);
    EXPECT_FALSE(biped.biped.has_value());
    const std::string why = missing(biped);
    EXPECT_NE(why, "");
    return why;
  };
  EXPECT_NE(says([](std::vector<Link>& links) {
              joint(links, "left_ankle_roll").type = robot::JointType::fixed;
            }).find("left leg: 5 joints"),
            std::string::npos);
  EXPECT_NE(says([](std::vector<Link>& links) {
              joint(links, "left_knee").upper = 0.5;
            }).find("no posture with knees bent by 0.87 rad"),
            std::string::npos);
  EXPECT_NE(says([](std::vector<Link>& links) {
              joint(links, "left_knee").max_speed = 0.0;
            }).find("'left_knee' of a leg has no velocity"),
            std::string::npos);
  EXPECT_NE(says([](std::vector<Link>& links) {  // a pelvis that lies on its back
              for (Link& l : links)
                if (l.parent == 0) l.X_PJ = Eigen::AngleAxisd(1.57, Vector3d::UnitY()) * l.X_PJ;
            })
                .find("expected below: x forward, z up"),
            std::string::npos);
  EXPECT_NE(says([](std::vector<Link>& links) {  // and one that looks back
              for (Link& l : links)
                if (l.parent == 0)
                  l.X_PJ = Eigen::AngleAxisd(3.14159265, Vector3d::UnitZ()) * l.X_PJ;
            })
                .find("expected its x to point forward"),
            std::string::npos);
  EXPECT_NE(missing(found({}, {})).find("left sole: link 'left_foot' has no geometry"),
            std::string::npos);
}

TEST(FeasibleGait, IsThatOfTheLegsWhereTheJointsAllowIt) {
  const robot::Biped biped = *found().biped;
  const FeasibleGait gait = feasible_gait(biped);
  EXPECT_TRUE(gait.possible);
  EXPECT_FALSE(gait.slowed);
  EXPECT_EQ(gait.gait.step_s, 0.8);
  EXPECT_EQ(gait.gait.most_forward_m_s, gait_settings(biped).most_forward_m_s);
  EXPECT_LT(gait.load.speed_share, 0.9);
  EXPECT_LT(gait.load.torque_share, 0.9);
  // One leg bears 569 N; its knee is about 0.13 m behind that, its thigh's and shank's weight less.
  const GaitLoad in_place = load_of_gait(biped, gait_settings(biped), Wish{}, false);
  EXPECT_NE(in_place.torque_joint.find("knee"), std::string::npos) << in_place.torque_joint;
  EXPECT_GT(in_place.torque_n_m, 60.0);
  EXPECT_LT(in_place.torque_n_m, 110.0);
  EXPECT_EQ(in_place.short_ticks, 0);
}

TEST(FeasibleGait, SlowsTheWalkOfSlowJointsAndRefusesThatOfSlowerOnes) {
  const auto with_speed = [](double speed_rad_s) {
    return feasible_gait(*found([&](std::vector<Link>& links) {
                            for (const std::string side : {"left_", "right_"})
                              for (const char* j : {"hip_pitch", "knee", "ankle_pitch"})
                                joint(links, side + j).max_speed = speed_rad_s;
                          }).biped);
  };
  const FeasibleGait slow = with_speed(2.5), slower = with_speed(0.3);
  EXPECT_TRUE(slow.possible);
  EXPECT_TRUE(slow.slowed);
  EXPECT_LT(slow.gait.most_forward_m_s, 0.3);
  EXPECT_LE(slow.load.speed_share, 0.9);
  EXPECT_GT(slow.beyond.speed_share, 0.9);
  EXPECT_FALSE(slower.possible);
  EXPECT_GT(slower.load.speed_share, 0.9);
}

}  // namespace
}  // namespace mimesis::walker
