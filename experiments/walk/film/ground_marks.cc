#include "experiments/walk/film/ground_marks.h"

#include <cmath>

#include "common/math/so3.h"

namespace mimesis::walk {
namespace {

constexpr synthesizer::Colour kPrint[] = {{150, 184, 220}, {234, 176, 152}};  // left, right
constexpr synthesizer::Colour kZmp{20, 150, 60};
constexpr double kThick_m = 0.002, kCross_m = 0.17, kBar_m = 0.012;

}  // namespace

void GroundMarks::see(const TrialTick& tick) {
  zmp_W_m_ = tick.truth.zmp_W_m;
  for (const robot::Side s : robot::kSides) {
    const bool stands = tick.out.pattern.contact[s];
    if (stands && !stands_[s]) {
      now_[s] = prints_.size();
      prints_.push_back({.center = Eigen::Vector3d::Zero(),
                         .half_extent = Eigen::Vector3d::Zero(),
                         .colour = kPrint[s]});
    }
    stands_[s] = stands;
    if (!stands) continue;
    const robot::Biped::Leg& leg = biped_.leg[s];
    const Eigen::Isometry3d& X_WS = tick.truth.X_WS[s];
    Eigen::Vector3d middle_S_m = Eigen::Vector3d::Zero();
    middle_S_m.head<2>() = 0.5 * (leg.min_S_m + leg.max_S_m);
    synthesizer::FilmBox& print = prints_[now_[s]];
    print.center = X_WS * middle_S_m;
    print.center.z() = kThick_m;
    print.half_extent << 0.5 * (leg.max_S_m - leg.min_S_m), kThick_m;
    print.yaw_rad = math::yaw_of(X_WS.linear());
  }
}

void GroundMarks::add_to(synthesizer::FilmFrame& frame) const {
  frame.boxes.insert(frame.boxes.end(), prints_.begin(), prints_.end());
  for (const Eigen::Vector2d& half : {Eigen::Vector2d(kCross_m, kBar_m), {kBar_m, kCross_m}}) {
    frame.boxes.push_back({.center = {zmp_W_m_.x(), zmp_W_m_.y(), 2.0 * kThick_m},
                           .half_extent = {half.x(), half.y(), 2.0 * kThick_m},
                           .colour = kZmp});
  }
}

}  // namespace mimesis::walk
