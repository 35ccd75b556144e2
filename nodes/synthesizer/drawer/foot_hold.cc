#include "nodes/synthesizer/drawer/foot_hold.h"

#include <algorithm>
#include <cmath>

#include "common/math/so3.h"
#include "nodes/synthesizer/drawer/limb_ik.h"

namespace mimesis::synthesizer {
namespace {
// A swinging foot passes the ground at 3 cm but with 2 m/s and more; a standing one slides with
// less than 0.4 m/s [reference/motion.md, skating of few sources].
constexpr double kNear = 0.045, kFar = 0.060;   // m
constexpr double kSlow = 0.70, kFast = 1.00;    // m/s
constexpr double kSwitch = 0.004;               // m: the other end is lower by so much
constexpr double kPull = 0.985;                 // of the leg: the foot has to go along
constexpr double kSoft = 0.978, kMost = 0.999;  // of the leg: a straight knee would snap
constexpr double kFade = 0.10, kSettle = 0.04;  // s

double softly_limited(double stretch) {
  if (stretch <= kSoft) return stretch;
  return kSoft + (kMost - kSoft) * (1.0 - std::exp(-(stretch - kSoft) / (kMost - kSoft)));
}

}  // namespace

void FootHold::hold(Foot& foot, const std::array<Eigen::Vector3d, 2>& ends_W_m, double dt_s) const {
  if (!foot.seen) foot.before_W_m = ends_W_m;
  foot.seen = true;
  auto height = [&](int end) { return ends_W_m[static_cast<std::size_t>(end)].z(); };
  const int low = height(0) <= height(1) ? 0 : 1;
  const auto l = static_cast<std::size_t>(low);
  const double speed = (ends_W_m[l] - foot.before_W_m[l]).head<2>().norm() / dt_s;
  const Eigen::Vector3d was = foot.before_W_m[l] + foot.offset_m;  // corrected
  foot.before_W_m = ends_W_m;
  const bool stands =
      foot.stands ? height(low) < kFar && speed < kFast : height(low) < kNear && speed < kSlow;
  const bool begins = stands && !foot.stands;
  if (begins || (stands && low != foot.end && height(low) < height(foot.end) - kSwitch)) {
    foot.end = low;
    foot.held_W_m = was;
  }
  foot.stands = stands;
  if (stands) {
    foot.held_W_m.z() *= std::exp(-dt_s / kSettle);
    foot.offset_m = foot.held_W_m - ends_W_m[static_cast<std::size_t>(foot.end)];
  } else {
    foot.offset_m *= std::exp(-dt_s / kFade);
  }
  foot.offset_m.z() = std::max(foot.offset_m.z(), -height(low));
}

void FootHold::apply(const mocap::Body& body, const Eigen::Vector3d& p_W_pelvis, double dt_s,
                     Eigen::Ref<Eigen::VectorXd> angles_rad) {
  const auto pose = forward_kinematics(
      body, std::span<const double, mocap::kBodyRows>(angles_rad.data(), mocap::kBodyRows),
      p_W_pelvis);
  correction_m_ = short_by_m_ = 0.0;
  for (const auto side : {mocap::kLeft, mocap::kRight}) {
    const int hip = side == mocap::kLeft ? mocap::kLeftHip : mocap::kRightHip;
    const auto ankle = static_cast<std::size_t>(hip + 2);
    Foot& foot = foot_[side];
    hold(foot, {pose.point(hip + 2, body.heel_m[side]), pose.point(hip + 2, body.toe_m[side])},
         dt_s);
    const Eigen::Vector3d hip_W = pose.p_WJ[static_cast<std::size_t>(hip)];
    const double leg_m = body.offset_m[ankle].norm() + body.offset_m[ankle - 1].norm();
    const Eigen::Vector3d wanted = pose.p_WJ[ankle] + foot.offset_m - hip_W;
    const double stretch = wanted.norm() / leg_m;
    if (stretch > kPull) foot.stands = false;  // pulled off the ground
    const LimbAngles leg =
        leg_angles(body, side, pose.R_WJ[mocap::kRoot], p_W_pelvis,
                   hip_W + wanted * (softly_limited(stretch) / stretch), pose.R_WJ[ankle]);
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d before = angles_rad.segment<3>(3 * (hip + i));
      angles_rad.segment<3>(3 * (hip + i)) =
          math::nearest_axis_angle(leg.axis_angle_rad[static_cast<std::size_t>(i)], before);
    }
    correction_m_ = std::max(correction_m_, foot.offset_m.norm());
    short_by_m_ = std::max(short_by_m_, leg.short_by_m);
  }
}

}  // namespace mimesis::synthesizer
