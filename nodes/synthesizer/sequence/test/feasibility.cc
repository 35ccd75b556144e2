#include "nodes/synthesizer/sequence/test/feasibility.h"

#include <cmath>

namespace mimesis::synthesizer {
namespace {

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

}  // namespace

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

Feasibility worst(const Feasibility& a, const Feasibility& b) {
  auto most = [&](auto member) { return std::max(a.*member, b.*member); };
  return {.stance_slide_m = most(&Feasibility::stance_slide_m),
          .penetration_m = most(&Feasibility::penetration_m),
          .short_by_m = most(&Feasibility::short_by_m),
          .least_knee_rad = std::min(a.least_knee_rad, b.least_knee_rad),
          .most_knee_rad = most(&Feasibility::most_knee_rad),
          .most_elbow_rad = most(&Feasibility::most_elbow_rad),
          .most_hip_rad = most(&Feasibility::most_hip_rad),
          .most_ankle_rad = most(&Feasibility::most_ankle_rad),
          .most_trunk_rad = most(&Feasibility::most_trunk_rad),
          .joint_speed_rad_s = most(&Feasibility::joint_speed_rad_s),
          .pelvis_speed_m_s = most(&Feasibility::pelvis_speed_m_s),
          .backwards_m_s = most(&Feasibility::backwards_m_s),
          .hand_error_m = most(&Feasibility::hand_error_m)};
}

bool Feasibility::feasible() const {
  return stance_slide_m < 1e-3 && penetration_m < 5e-3 && short_by_m < 1e-3 &&
         least_knee_rad >= 0.0 && most_knee_rad < 2.3 && most_elbow_rad < 2.5 &&
         most_hip_rad < 1.6 && most_ankle_rad < 1.0 && most_trunk_rad < 0.7 &&
         joint_speed_rad_s < 12.0 && pelvis_speed_m_s < 2.5 && backwards_m_s < 0.05 &&
         hand_error_m < 1e-3;
}

}  // namespace mimesis::synthesizer
