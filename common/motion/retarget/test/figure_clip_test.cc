#include <gtest/gtest.h>

#include "common/model/files.h"
#include "common/motion/retarget/test/walk.h"
#include "common/motion/retarget/to_robot.h"

namespace mimesis::retarget {
namespace {

TEST(FigureClip, ItsFeetAreTheRobots) {
  const robot::Biped biped = model::load_biped("biped.yaml");
  const robot::RobotTree& tree = biped.tree;
  const RobotFigure names = figure_of(biped);
  mocap::BodyClip recorded = made_up_walk();
  recorded.first_frame = 7;
  const RobotClip motion = retarget(recorded, tree, names, 1);
  const FigureClip figure = figure_clip(motion, recorded, tree, names);
  EXPECT_EQ(figure.clip.name, "made-up");
  EXPECT_EQ(figure.clip.first_frame, 7);
  EXPECT_EQ(figure.clip.frames(), motion.frames());
  EXPECT_LT(figure.ankle_m.max, 1e-6);
  EXPECT_LT(figure.wrist_m.max, 0.01);
  robot::Kinematics k(tree);
  for (const Eigen::Index t : {Eigen::Index{0}, Eigen::Index{60}, motion.frames() - 1}) {
    k.update(motion.posture(t).X_WB, motion.q.col(t));
    const mocap::BodyPose pose = figure.clip.pose(t);
    const auto toe = pose.point(mocap::kRightAnkle, figure.clip.body.toe_m[mocap::kRight]);
    const Eigen::Isometry3d& X_WL = k.X_WL(tree.require_link(names.ankle[1]));
    EXPECT_LT((toe - X_WL * names.toe_m[1]).norm(), 1e-6) << t;
    EXPECT_LT((pose.R_WJ[mocap::kHead] - k.X_WL(tree.require_link(names.head)).linear()).norm(),
              1e-9);
  }
  // no jumps by 2 pi
  const auto steps = figure.clip.angles_rad.rightCols(motion.frames() - 1) -
                     figure.clip.angles_rad.leftCols(motion.frames() - 1);
  EXPECT_LT(steps.cwiseAbs().maxCoeff(), 0.5);
}

}  // namespace
}  // namespace mimesis::retarget
