#include <gtest/gtest.h>

#include "nodes/synthesizer/sequence/trials.h"

namespace mimesis::synthesizer {
namespace {

/// Largest violations of a body's limits over all samples.
struct Feasibility {
  /// sliding of a point that stays on the ground, over its whole stand
  double stance_slide_m = 0.0;
  double penetration_m = 0.0;  ///< depth of heels and toes below the ground
  double short_by_m = 0.0;     ///< missing distance of foot and hand to their targets
  double least_knee_rad = 0.0, most_knee_rad = 0.0;
  double most_elbow_rad = 0.0, most_hip_rad = 0.0, most_ankle_rad = 0.0, most_trunk_rad = 0.0;
  double joint_speed_rad_s = 0.0;  ///< norm of a joint's axis-angle velocity
  double pelvis_speed_m_s = 0.0;
  double backwards_m_s = 0.0;  ///< speed of the pelvis against the way; 0 if it never goes back
  double hand_error_m = 0.0;   ///< error left at the handle and right at the object

  /// Within the ranges of a healthy adult. A rocking foot point counts as still below 1 mm.
  bool feasible() const;
};

mocap::BodyPose pose_of(const mocap::Body& body, const RenderedTrial& trial, Eigen::Index i) {
  return forward_kinematics(
      body,
      std::span<const double, mocap::kBodyRows>(trial.angle_rad.col(i).data(), mocap::kBodyRows),
      trial.pelvis_W_m.col(i));
}

// Follows the ground points of one foot through their stands.
class GroundPoint {
 public:
  void sample(bool on_ground, const Eigen::Vector3d& p_W, Feasibility* f) {
    f->penetration_m = std::max(f->penetration_m, -p_W.z());
    if (on_ground && !stands_) since_ = p_W;
    if (on_ground) f->stance_slide_m = std::max(f->stance_slide_m, (p_W - since_).norm());
    stands_ = on_ground;
  }

 private:
  bool stands_ = false;
  Eigen::Vector3d since_ = Eigen::Vector3d::Zero();
};

void joints(const RenderedTrial& trial, Eigen::Index i, Feasibility* f) {
  auto angle = [&](int joint) { return trial.angle_rad.block<3, 1>(3 * joint, i); };
  auto more = [](double* most, double x) { *most = std::max(*most, x); };
  for (const int knee : {mocap::kLeftKnee, mocap::kRightKnee}) {
    f->least_knee_rad = std::min(f->least_knee_rad, angle(knee).y());
    more(&f->most_knee_rad, angle(knee).y());
  }
  for (const int j : {mocap::kLeftElbow, mocap::kRightElbow})
    more(&f->most_elbow_rad, angle(j).norm());
  for (const int j : {mocap::kLeftHip, mocap::kRightHip}) more(&f->most_hip_rad, angle(j).norm());
  for (const int j : {mocap::kLeftAnkle, mocap::kRightAnkle})
    more(&f->most_ankle_rad, angle(j).norm());
  for (const int j : {mocap::kSpine, mocap::kChest, mocap::kNeck, mocap::kHead})
    more(&f->most_trunk_rad, angle(j).norm());
  if (i == 0) return;
  const double dt = trial.time_s(i) - trial.time_s(i - 1);
  for (int j = 0; j < mocap::kBodyJoints; ++j)
    more(&f->joint_speed_rad_s, (angle(j) - trial.angle_rad.block<3, 1>(3 * j, i - 1)).norm() / dt);
  const Eigen::Vector3d v = (trial.pelvis_W_m.col(i) - trial.pelvis_W_m.col(i - 1)) / dt;
  more(&f->pelvis_speed_m_s, v.norm());
  more(&f->backwards_m_s, -v.x());
}

Feasibility assess(const mocap::Body& body, const RenderedTrial& trial) {
  Feasibility f;
  f.short_by_m = trial.short_by_m;
  f.least_knee_rad = 3.0;
  std::array<GroundPoint, 2> heel, toe;
  const auto n = trial.time_s.size(), samples = n / 5;
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto pose = pose_of(body, trial, i);
    for (const auto side : {mocap::kLeft, mocap::kRight}) {
      const bool left = side == mocap::kLeft;
      const int ankle = left ? mocap::kLeftAnkle : mocap::kRightAnkle,
                wrist = left ? mocap::kLeftWrist : mocap::kRightWrist;
      const Contact c = trial.contact[static_cast<std::size_t>(i)][side];
      heel[side].sample(c == Contact::heel || c == Contact::flat,
                        pose.point(ankle, body.heel_m[side]), &f);
      toe[side].sample(c == Contact::toe || c == Contact::flat, pose.point(ankle, body.toe_m[side]),
                       &f);
      // the left hand holds the handle from the end of action 2 on, the right one the object at
      // last
      const auto holds_from = (left ? 3 : 4) * samples;
      const Eigen::Vector3d target = left ? trial.handle_W_m.col(i) : trial.object_W_m.col(i);
      if (i >= holds_from)
        f.hand_error_m =
            std::max(f.hand_error_m, (pose.point(wrist, body.hand_m[side]) - target).norm());
    }
    joints(trial, i, &f);
  }
  return f;
}

bool Feasibility::feasible() const {
  return stance_slide_m < 1e-3 && penetration_m < 5e-3 && short_by_m < 1e-3 &&
         least_knee_rad >= 0.0 && most_knee_rad < 2.3 && most_elbow_rad < 2.5 &&
         most_hip_rad < 1.6 && most_ankle_rad < 1.0 && most_trunk_rad < 0.7 &&
         joint_speed_rad_s < 12.0 && pelvis_speed_m_s < 2.5 && backwards_m_s < 0.05 &&
         hand_error_m < 1e-3;
}

double r_squared(const std::vector<double>& x, const std::vector<double>& y) {
  const Eigen::Map<const Eigen::ArrayXd> a(x.data(), static_cast<Eigen::Index>(x.size())),
      b(y.data(), static_cast<Eigen::Index>(y.size()));
  const double ab = ((a - a.mean()) * (b - b.mean())).sum();
  return ab * ab / ((a - a.mean()).square().sum() * (b - b.mean()).square().sum());
}

// fig. 3.7: the first action does not depend on the distance, the second makes up for it, people
// stand farther off where the object is deep in the drawer
TEST(DrawerTrials, DistributeTheWayAsThePublishedOnes) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 5U}) {
    std::vector<double> initial, first, second, last, depth;
    for (const auto& p : draw_plans({.seed = seed, .paces = {}})) {
      initial.push_back(p.initial_distance_m());
      first.push_back(p.normal_length_m);
      second.push_back(p.reaching_length_m);
      last.push_back(p.final_distance_m);
      depth.push_back(p.object_depth_m);
      EXPECT_NEAR(p.final_distance_m, 0.60, 0.03);
    }
    ASSERT_EQ(initial.size(), 10U);
    EXPECT_NEAR(initial.front(), 2.34, 1e-9);
    EXPECT_NEAR(initial.back(), 2.94, 1e-9);
    EXPECT_NEAR(r_squared(initial, first), 0.08, 1e-9);
    EXPECT_GT(r_squared(initial, second), 0.88);
    EXPECT_GT(r_squared(depth, last), 0.3);
    EXPECT_LT(r_squared(initial, depth), 0.2);
  }
}

TEST(DrawerTrials, AreFeasibleForManySeeds) {
  const auto body = mocap::standard_body();
  for (std::uint64_t seed = 1; seed <= 6; ++seed)
    for (const auto& plan : draw_plans({.seed = seed})) {
      const Feasibility f = assess(body, render(body, plan, {}, 100));
      EXPECT_TRUE(f.feasible()) << "seed " << seed << " recording " << plan.recording << " pace "
                                << plan.pace << ": slide " << f.stance_slide_m << " below ground "
                                << f.penetration_m << " short by " << f.short_by_m << " knee "
                                << f.least_knee_rad << ".." << f.most_knee_rad << " ankle "
                                << f.most_ankle_rad << " trunk " << f.most_trunk_rad << " speed "
                                << f.joint_speed_rad_s << " back " << f.backwards_m_s << " elbow "
                                << f.most_elbow_rad << " hip " << f.most_hip_rad << " pelvis "
                                << f.pelvis_speed_m_s << " hand " << f.hand_error_m;
    }
}

TEST(DrawerTrials, AreTheSameForTheSameSeed) {
  const auto body = mocap::standard_body();
  const auto a = generate_drawer_data(body, {}, {.seed = 7, .trials = 4, .paces = {}});
  const auto b = generate_drawer_data(body, {}, {.seed = 7, .trials = 4, .paces = {}});
  const auto c = generate_drawer_data(body, {}, {.seed = 8, .trials = 4, .paces = {}});
  for (std::size_t i = 0; i < kActions; ++i) {
    EXPECT_EQ(a.action[i].samples, b.action[i].samples);
    EXPECT_NE(a.action[i].samples, c.action[i].samples);
  }
}

// Training data must agree with the walk: rows of the pelvis and the step length agree with the way
// of the standing foot in the pelvis' frame.
TEST(DrawerTrials, LegsWalkTheLengthThatTheTrialStates) {
  const auto data = generate_drawer_data(mocap::standard_body(), {}, {.trials = 4, .paces = {0.8}});
  ASSERT_EQ(data.action[0].trials.size(), 8U);
  for (const Action a : {kNormalStep, kReachingStep})
    for (std::size_t i = 0; i < 8; ++i) {
      const auto& set = data.action[a];
      const auto block =
          set.samples.middleRows(static_cast<Eigen::Index>(i) * kDrawerRows, kDrawerRows);
      EXPECT_NEAR(block(mocap::kBodyRows, 0), 0.0, 1e-12);
      // the points that touch the ground go back by as much as the pelvis goes forward
      double travelled = 0.0;
      std::vector<Eigen::Vector3d> before;
      for (Eigen::Index k = 0; k < block.cols(); ++k) {
        const Eigen::VectorXd angles = block.col(k).head(mocap::kBodyRows);
        const auto pose = forward_kinematics(
            data.body, std::span<const double, mocap::kBodyRows>(angles.data(), mocap::kBodyRows),
            {0.0, 0.0, block(mocap::kBodyRows + 2, k)});
        std::vector<Eigen::Vector3d> points;
        for (const auto side : {mocap::kLeft, mocap::kRight}) {
          const int ankle = side == mocap::kLeft ? mocap::kLeftAnkle : mocap::kRightAnkle;
          points.push_back(pose.point(ankle, data.body.heel_m[side]));
          points.push_back(pose.point(ankle, data.body.toe_m[side]));
        }
        std::size_t lowest = 0;
        for (std::size_t p = 1; p < points.size(); ++p) {
          const double now = points[p].z() + (before.empty() ? 0.0 : before[p].z());
          const double best = points[lowest].z() + (before.empty() ? 0.0 : before[lowest].z());
          if (now < best) lowest = p;
        }
        EXPECT_NEAR(points[lowest].z(), 0.0, 5e-3);
        if (!before.empty()) travelled += before[lowest].x() - points[lowest].x();
        before = points;
      }
      travelled *= 100.0 / 99.0;  // 99 of 100 intervals
      EXPECT_NEAR(travelled, set.trials[i].step_length_m, 0.03) << a << " " << i;
    }
}

}  // namespace
}  // namespace mimesis::synthesizer
