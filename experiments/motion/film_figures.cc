// What stands in a film: figures made of limbs.
#include <algorithm>
#include <cmath>

#include "experiments/motion/film.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Vector3d;

// Radii of a person's limbs for legs of 0.835 m [m]
constexpr double kThigh = 0.062, kKnee = 0.046, kAnkle = 0.034, kSole = 0.024, kTrunk = 0.075,
                 kWaist = 0.06, kThroat = 0.036, kShoulder = 0.046, kElbow = 0.034, kWrist = 0.026,
                 kFinger = 0.018, kUsualLeg = 0.835;

double leg_length(const mocap::Body& body) {
  return body.offset_m[mocap::kLeftKnee].norm() + body.offset_m[mocap::kLeftAnkle].norm();
}

class Painter {
 public:
  Painter(FilmFrame& frame, double thick) : frame_(frame), thick_(thick) {}
  void limb(const Vector3d& a, const Vector3d& b, double ra, double rb, const Colour& colour) {
    frame_.limbs.push_back({a, b, thick_ * ra, thick_ * rb, colour});
  }
  double thick() const { return thick_; }

 private:
  FilmFrame& frame_;
  double thick_;
};

void paint_side(Painter& paint, const mocap::Body& body, const mocap::BodyPose& pose, int side,
                const Colour& colour) {
  using namespace mocap;
  const bool left = side == kLeft;
  const int hip = left ? kLeftHip : kRightHip, shoulder = left ? kLeftShoulder : kRightShoulder;
  const auto at = [&](int joint) { return pose.p_WJ[static_cast<std::size_t>(joint)]; };
  const auto s = static_cast<std::size_t>(side);
  paint.limb(at(hip), at(hip + 1), kThigh, kKnee, colour);
  paint.limb(at(hip + 1), at(hip + 2), kKnee, kAnkle, colour);
  // The sole's lower side, not its axis, goes through the ground points
  const Vector3d lift(0.0, 0.0, paint.thick() * kSole);
  const Vector3d heel = pose.point(hip + 2, body.heel_m[s] + lift);
  const Vector3d toe = pose.point(hip + 2, body.toe_m[s] + lift);
  paint.limb(heel, toe, kSole, kSole, colour);
  paint.limb(at(hip + 2), heel, kAnkle, kSole, colour);
  paint.limb(at(hip + 2), heel + 0.6 * (toe - heel), kAnkle, kSole, colour);
  paint.limb(at(shoulder), at(shoulder + 1), kShoulder, kElbow, colour);
  paint.limb(at(shoulder + 1), at(shoulder + 2), kElbow, kWrist, colour);
  paint.limb(at(shoulder + 2), pose.point(shoulder + 2, body.hand_m[s]), kWrist, kFinger, colour);
}

}  // namespace

Colour paler(const Colour& c, double amount) {
  const auto mix = [&](int v) { return static_cast<int>(std::lround(v + amount * (255 - v))); };
  return {mix(c.red), mix(c.green), mix(c.blue)};
}

void add_body(FilmFrame& to, const mocap::Body& body, const mocap::BodyPose& pose,
              const FilmPaint& p) {
  using namespace mocap;
  Painter paint(to, p.thick * leg_length(body) / kUsualLeg);
  const auto at = [&](int joint) { return pose.p_WJ[static_cast<std::size_t>(joint)]; };
  const Colour trunk = paler(p.trunk, p.pale);
  paint.limb(at(kLeftHip), at(kRightHip), kTrunk, kTrunk, trunk);
  paint.limb(0.5 * (at(kLeftHip) + at(kRightHip)), at(kSpine), kTrunk, kWaist, trunk);
  paint.limb(at(kSpine), at(kChest), kWaist, kTrunk, trunk);
  paint.limb(at(kChest), at(kNeck), kTrunk, kThroat, trunk);
  paint.limb(at(kLeftShoulder), at(kRightShoulder), kShoulder, kShoulder, trunk);
  paint.limb(at(kChest), 0.5 * (at(kLeftShoulder) + at(kRightShoulder)), kTrunk, kTrunk, trunk);
  paint.limb(at(kNeck), at(kHead), kThroat, kThroat, trunk);
  paint_side(paint, body, pose, kLeft, paler(p.left, p.pale));
  paint_side(paint, body, pose, kRight, paler(p.right, p.pale));
  const Vector3d top = pose.point(kHead, body.head_top_m);
  const double radius = std::max(0.085 * paint.thick(), 0.5 * (top - at(kHead)).norm());
  const Vector3d up = pose.R_WJ[kHead] * body.head_top_m.normalized();
  to.limbs.push_back({top - radius * up, top - radius * up, radius, radius, paler(p.skin, p.pale)});
}

void add_dot(FilmFrame& to, const Vector3d& p_W, double radius_m, const Colour& colour) {
  to.limbs.push_back({p_W, p_W, radius_m, radius_m, colour});
}

}  // namespace mimesis::synthesizer
