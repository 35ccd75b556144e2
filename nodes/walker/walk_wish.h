#pragma once
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>

#include "common/math/circle.h"
#include "common/math/minimum_jerk.h"
#include "nodes/walker/walker.h"

namespace mimesis::walker {

/// A wished motion in terms of the robot, without limits.
struct MotionWish {
  /// velocity of the pelvis: forward, left
  Eigen::Vector2d velocity_m_s = Eigen::Vector2d::Zero();
  double yaw_rate_rad_s = 0.0;                           ///< + to the left
  Eigen::Vector2d pelvis_W_m = Eigen::Vector2d::Zero();  ///< place of the motion
  double heading_rad = 0.0;                              ///< heading of the pelvis in W
  bool stands = false;                                   ///< the motion asks to stand
  std::array<std::optional<Footprint>, 2> landing;       ///< next swing foot, the one after it
  /// [rad], [rad/s], in the order of Biped::upper_body; empty: no wish.
  Eigen::VectorXd upper_body, upper_body_rate;
  std::array<TaskGoals::Hand, 2> hand;  ///< left, right
};

/// Place of the robot on the ground: middle of its feet.
struct GroundPose {
  Eigen::Vector2d p_W_m = Eigen::Vector2d::Zero();
  double yaw_rad = 0.0;
};

struct WalkWishSettings {
  double least_m_s = 0.01, least_rad_s = 0.02;  ///< slower motions count as standing
  /// Velocity that is added to return to the motion's place: gain times distance, bounded. 0: none.
  double drift_gain_1_s = 0.3, drift_most_m_s = 0.04, drift_most_rad_s = 0.05;
  double fade_s = 1.0;  ///< transition of the upper body when a motion begins or ends
};

/// Turns a wished motion into a wish within the robot's limits, tick by tick:
/// - velocities plus clamp(k (p_motion − p_robot)) in the heading frame; a motion with footprints
///   gets no such correction. The pattern limits them to the robot's limits; here it is only
/// reported; - the upper body within the joints' limits. When a motion begins or ends, the
/// difference to the
///   posture before fades as 1 − (10 s³ − 15 s⁴ + 6 s⁵). Walker keeps the joints' speeds.
class WalkWish {
 public:
  WalkWish(const robot::Biped& biped, const GaitSettings& gait, const WalkWishSettings& settings)
      : gait_(gait),
        settings_(settings),
        lower_(biped.tree.lower()(biped.upper_body)),
        upper_(biped.tree.upper()(biped.upper_body)),
        rest_(biped.half_sitting(biped.upper_body)) {
    for (const int dof : biped.upper_body) joints_.push_back(biped.tree.moved(dof).joint);
    clipped_.reserve(200);
    reset();
  }

  /// half-sitting
  void reset() {
    wish_ = {};
    wish_.upper_body = target_ = rest_;
    wish_.upper_body_rate = difference_ = Eigen::VectorXd::Zero(rest_.size());
    faded_s_ = settings_.fade_s;
    follows_ = false;
    clipped_.clear();
  }
  /// `motion`: null if there is none; then the robot stops and its upper body returns to
  /// half-sitting. Does not allocate.
  const WalkerWish& step(const MotionWish* motion, const GroundPose& robot, double dt_s) {
    clipped_.clear();
    wish_.walk = {};
    wish_.walk.walk = false;
    wish_.hand = {};
    if (motion != nullptr) {
      walk(*motion, robot);
      wish_.hand = motion->hand;
      for (TaskGoals::Hand& hand : wish_.hand) hand.share = std::clamp(hand.share, 0.0, 1.0);
    }
    move_upper_body(motion, dt_s);
    return wish_;
  }
  /// One line about the first value that was cut in the last step; empty if none was.
  const std::string& clipped() const { return clipped_; }

 private:
  static double clamp(double x, double most) { return std::clamp(x, -most, most); }

  void walk(const MotionWish& motion, const GroundPose& robot) {
    Wish& walk = wish_.walk;
    walk.landing = motion.landing;
    const bool footprints = motion.landing[0] || motion.landing[1];
    const bool moves = motion.velocity_m_s.norm() > settings_.least_m_s ||
                       std::abs(motion.yaw_rate_rad_s) > settings_.least_rad_s;
    walk.walk = !motion.stands && (moves || footprints);
    if (!walk.walk) return;
    const Eigen::Vector2d most(gait_.most_forward_m_s, gait_.most_sideways_m_s);
    const std::array names = {"velocity forward [m/s]", "velocity to the left [m/s]"};
    walk.velocity_m_s = motion.velocity_m_s;
    walk.yaw_rate_rad_s = motion.yaw_rate_rad_s;
    for (const int i : {0, 1}) {
      if (std::abs(walk.velocity_m_s[i]) > most[i]) {
        cut(names[static_cast<std::size_t>(i)], walk.velocity_m_s[i], most[i]);
      }
    }
    if (std::abs(walk.yaw_rate_rad_s) > gait_.most_turn_rad_s) {
      cut("yaw rate [rad/s]", walk.yaw_rate_rad_s, gait_.most_turn_rad_s);
    }
    if (!footprints) {
      const Eigen::Rotation2Dd back(-robot.yaw_rad);
      const Eigen::Vector2d off_H = back * (motion.pelvis_W_m - robot.p_W_m);
      for (const int i : {0, 1}) {
        walk.velocity_m_s[i] +=
            clamp(settings_.drift_gain_1_s * off_H[i], settings_.drift_most_m_s);
      }
      walk.yaw_rate_rad_s +=
          clamp(settings_.drift_gain_1_s * math::wrap_pi(motion.heading_rad - robot.yaw_rad),
                settings_.drift_most_rad_s);
    }
  }
  void move_upper_body(const MotionWish* motion, double dt_s) {
    const bool follows = motion != nullptr && motion->upper_body.size() > 0;
    target_ = follows ? motion->upper_body : rest_;
    for (Eigen::Index i = 0; i < target_.size(); ++i) {
      const double within = std::clamp(target_[i], lower_[i], upper_[i]);
      if (within != target_[i]) {
        cut(joints_[static_cast<std::size_t>(i)].c_str(), target_[i], within);
      }
      target_[i] = within;
    }
    if (follows != follows_) {
      difference_ = wish_.upper_body - target_;
      faded_s_ = 0.0;
      follows_ = follows;
    }
    faded_s_ = std::min(faded_s_ + dt_s, settings_.fade_s);
    wish_.upper_body = target_;
    if (follows && motion->upper_body_rate.size() == target_.size()) {
      wish_.upper_body_rate = motion->upper_body_rate;
    } else {
      wish_.upper_body_rate.setZero();
    }
    if (faded_s_ >= settings_.fade_s) return;
    const double s = faded_s_ / settings_.fade_s;
    wish_.upper_body += (1.0 - math::minimum_jerk(s)) * difference_;
    wish_.upper_body_rate -= (math::minimum_jerk_rate(s) / settings_.fade_s) * difference_;
  }
  void cut(const char* what, double wished, double most) {
    if (!clipped_.empty()) return;  // the first one is reported
    // Into the string that is there: a tick does not allocate.
    fmt::format_to(std::back_inserter(clipped_), "{}: {:.4g} is wished, the robot can {:.4g}", what,
                   wished, most);
  }

  GaitSettings gait_;
  WalkWishSettings settings_;
  Eigen::VectorXd lower_, upper_, rest_;  ///< Biped::upper_body order
  std::vector<std::string> joints_;
  Eigen::VectorXd target_, difference_;
  double faded_s_ = 0.0;
  bool follows_ = false;  ///< a motion's upper body
  WalkerWish wish_;
  std::string clipped_;
};

}  // namespace mimesis::walker
