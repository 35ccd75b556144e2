#include "common/robot/arm_chain.h"

#include <gtest/gtest.h>

#include "common/error.h"

namespace mimesis::robot {
namespace {

/// Links one by one, each on its parent by a joint of its name.
class Growing {
 public:
  Growing() { links_.emplace_back().name = "base"; }
  int add(int parent, const std::string& name, JointType type = JointType::revolute,
          const std::string& mimics = {}) {
    Link& link = links_.emplace_back();
    link.name = name;
    link.joint = "to_" + name;
    link.parent = parent;
    link.type = type;
    link.lower = -1.0;
    link.upper = 2.0;
    link.mimics = mimics;
    return static_cast<int>(links_.size()) - 1;
  }
  int chain(int parent, const std::string& name, int joints) {
    for (int i = 1; i <= joints; ++i) parent = add(parent, name + std::to_string(i));
    return parent;
  }
  ArmChain find(const std::string& base = {}, const std::string& tip = {}) const {
    return find_arm_chain(RobotTree("robot", links_), base, tip);
  }
  std::string refusal(const std::string& base = {}, const std::string& tip = {}) const {
    try {
      find(base, tip);
    } catch (const ConfigError& e) {
      return e.what();
    }
    return "found";
  }
  Link& link(int index) { return links_[static_cast<std::size_t>(index)]; }

 private:
  std::vector<Link> links_;
};

TEST(ArmChain, EndsAtTheHandThatCarriesFingers) {
  Growing robot;
  const int hand = robot.add(robot.chain(0, "l", 7), "hand", JointType::fixed);
  const int left = robot.add(hand, "left", JointType::prismatic);
  robot.link(left).lower = 0.01;
  robot.add(hand, "right", JointType::prismatic, "to_left");
  const ArmChain chain = robot.find();
  EXPECT_EQ(chain.base, "base");
  EXPECT_EQ(chain.tip, "hand");
  EXPECT_EQ(chain.joints, (std::vector<int>{1, 2, 3, 4, 5, 6, 7}));
  ASSERT_EQ(chain.fixed.size(), 1u) << "the other finger follows";
  EXPECT_EQ(chain.fixed[0].first, "to_left");
  EXPECT_EQ(chain.fixed[0].second, 0.01) << "the limit nearest to 0";
}

TEST(ArmChain, TakesNoSingleJawForAJoint) {
  Growing robot;
  robot.add(robot.chain(0, "l", 5), "Moving_Jaw");
  const ArmChain chain = robot.find();
  EXPECT_EQ(chain.tip, "l5");
  EXPECT_EQ(chain.joints.size(), 5u);
  EXPECT_EQ(robot.find("", "Moving_Jaw").joints.size(), 6u) << "if it is asked for";
}

/// TheRobotStudio/SO-ARM100's SO100, Interbotix's ViperX.
TEST(ArmChain, APalmIsNoFinger) {
  Growing robot;
  const int palm = robot.add(robot.chain(0, "l", 4), "gripper");
  robot.add(palm, "jaw");
  EXPECT_EQ(robot.find().tip, "gripper");
  EXPECT_EQ(robot.find().joints.size(), 5u);
  Growing other;
  other.add(other.chain(0, "l", 5), "gripper");
  EXPECT_EQ(other.find().tip, "l5");
}

TEST(ArmChain, EndsAtTheToolThatIsFixedToTheFlange) {
  Growing robot;
  const int flange = robot.chain(0, "l", 6);
  robot.add(flange, "camera", JointType::fixed);
  robot.add(flange, "tool0", JointType::fixed);
  EXPECT_EQ(robot.find().tip, "tool0");
}

TEST(ArmChain, OfTwoArmsOnATrunkOneIsAskedFor) {
  Growing robot;
  const int trunk = robot.add(0, "trunk", JointType::prismatic);
  robot.chain(trunk, "left", 7);
  robot.chain(trunk, "right", 7);
  robot.chain(trunk, "head", 2);
  robot.chain(0, "leg", 6);
  EXPECT_EQ(robot.refusal(),
            "robot: 2 chains of 8 joints, expected as tip (--tip) one of 'left7', 'right7'");
  const ArmChain chain = robot.find("", "right7");
  EXPECT_EQ(chain.joints.size(), 8u);
  EXPECT_EQ(chain.fixed.size(), 7u + 2u + 6u);
  EXPECT_EQ(robot.find("trunk", "right7").fixed.size(), 7u + 2u) << "the trunk carries no leg";
}

TEST(ArmChain, RefusesWhatIsNone) {
  Growing robot;
  robot.chain(0, "l", 3);
  robot.add(0, "pole", JointType::fixed);
  EXPECT_EQ(robot.refusal("pole"), "robot: no joint moves beyond link 'pole'");
  EXPECT_EQ(robot.refusal("pole", "l3"), "robot: link 'pole' does not carry 'l3'");
  EXPECT_NE(robot.refusal("", "l4").find("l4"), std::string::npos);
}

}  // namespace
}  // namespace mimesis::robot
