#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "common/math/circle.h"
#include "common/math/so3.h"
#include "nodes/synthesizer/character/characters.h"

// What a body keeps wherever it is sent: knees, joints, soles, pelvis. Judged by forward kinematics
// in double of the angles that are published; tests/motion/judge.py does the same from logs.
namespace mimesis::synthesizer {
namespace {

using Eigen::Vector3d;
constexpr double kBodyDt = 1.0 / 200.0;
constexpr int kJoints[6] = {mocap::kLeftHip,  mocap::kLeftKnee,  mocap::kLeftAnkle,
                            mocap::kRightHip, mocap::kRightKnee, mocap::kRightAnkle};

/// Of the learned cycles and the recordings of models/walk.motion.json (tests/motion/judge.py).
struct Recorded {
  const char* style;
  double acceleration_m_s2, slide_m_s;
};
constexpr Recorded kRecorded[] = {
    {"walk", 6.3, 0.109}, {"slow", 4.5, 0.102}, {"stride", 7.1, 0.111}, {"brisk", 7.4, 0.173}};

Vector3d vector(std::span<const float> angles, int joint) {
  const auto j = static_cast<std::size_t>(3 * joint);
  return {double(angles[j]), double(angles[j + 1]), double(angles[j + 2])};
}

/// Largest speed of each leg joint in the learned cycle of a style, left and right alike [rad/s].
std::array<double, 6> learned_speeds(const motion::MotionModel& model, const std::string& style) {
  std::array<double, 6> most{};
  for (std::size_t p = 0; p < model.patterns.size(); ++p) {
    const motion::Pattern& pattern = model.patterns[p];
    if (pattern.trial.style != style) continue;
    constexpr double kFine = 1e-3;
    CharacterBatch batch(model, 1, {.dt_s = kFine});
    batch.set_pattern(0, static_cast<int>(p));
    batch.set_frequency(0, math::kTwoPi / pattern.trial.duration_s);
    std::array<Eigen::Matrix3d, 6> before;
    for (int k = 0; k * kFine <= pattern.trial.duration_s; ++k) {
      batch.step();
      for (std::size_t j = 0; j < 6; ++j) {
        const Eigen::Matrix3d R = math::exp_so3(vector(batch.angles(0), kJoints[j]));
        if (k > 0) {
          most[j] = std::max(most[j], math::log_so3(before[j].transpose() * R).norm() / kFine);
        }
        before[j] = R;
      }
    }
  }
  for (std::size_t j = 0; j < 3; ++j) most[j] = most[j + 3] = std::max(most[j], most[j + 3]);
  return most;
}

/// What one character has done, step by step.
class Judge {
 public:
  Judge(const mocap::Body& body, const std::array<double, 6>& learned)
      : body_(&body), learned_(learned) {}

  void see(const RootPose& root, std::span<const float> angles) {
    std::array<double, mocap::kBodyRows> rows;
    std::copy(angles.begin(), angles.end(), rows.begin());
    const Eigen::Matrix3d R_WH = math::exp_so3({0.0, 0.0, root.heading_rad});
    const auto pose = mocap::forward_kinematics(
        *body_, std::span<const double, mocap::kBodyRows>(rows), Vector3d::Zero());
    const Vector3d pelvis(root.position_W_m.x(), root.position_W_m.y(), root.height_m);
    std::array<std::array<Vector3d, 2>, 2> feet;
    for (std::size_t s = 0; s < 2; ++s) {
      const int ankle = s == 0 ? mocap::kLeftAnkle : mocap::kRightAnkle;
      feet[s] = {pelvis + R_WH * pose.point(ankle, body_->heel_m[s]),
                 pelvis + R_WH * pose.point(ankle, body_->toe_m[s])};
      const auto knee = static_cast<std::size_t>(ankle - 1);
      const Vector3d shank = pose.R_WJ[knee - 1].transpose() *
                             (pose.p_WJ[knee + 1] - pose.p_WJ[knee]);  // in the thigh's frame
      flexion_deg = std::min(flexion_deg, std::atan2(-shank.x(), -shank.z()) * 180.0 / M_PI);
    }
    std::array<Eigen::Matrix3d, 6> now;
    for (std::size_t j = 0; j < 6; ++j) {
      now[j] = math::exp_so3(vector(angles, kJoints[j]));
      if (count_ == 0) continue;
      const double speed = math::log_so3(before_[j].transpose() * now[j]).norm() / kBodyDt;
      speed_ratio = std::max(speed_ratio, speed / learned_[j]);
    }
    before_ = now;
    for (std::size_t s = 0; s < 2; ++s) see_foot(s, feet[s], pelvis);
    feet_ = feet;
    pelvis_ = pelvis;
    see_pelvis(pelvis);
    ++count_;
  }
  double slide_m_s() const { return weight_ > 0.0 ? path_ / weight_ : 0.0; }

  double flexion_deg = 90.0, speed_ratio = 0.0, sole_m = 0.0, acceleration_m_s2 = 0.0;

 private:
  /// A foot whose lower end moves by less than 0.1 m/s for 0.1 s stands.
  void see_foot(std::size_t s, const std::array<Vector3d, 2>& foot, const Vector3d& pelvis) {
    const std::size_t low = foot[0].z() <= foot[1].z() ? 0 : 1;
    sole_m = std::max(sole_m, -foot[low].z());
    if (count_ == 0) return;
    const bool rests = (foot[low] - feet_[s][low]).norm() < 0.1 * kBodyDt;
    rest_[s] = rests ? rest_[s] + 1 : 0;
    highest_[s] = rests ? std::max(highest_[s], std::abs(foot[low].z())) : 0.0;
    if (rest_[s] * kBodyDt >= 0.1) sole_m = std::max(sole_m, highest_[s]);
    const double h = std::max(0.0, foot[1].z()), share = 2.0 - std::exp2(h / 0.025);
    if (share <= 0.0 || (pelvis - pelvis_).norm() < 0.1 * kBodyDt) return;
    path_ += share * (foot[1] - feet_[s][1]).head<2>().norm();
    weight_ += share * kBodyDt;
  }
  /// Second difference every 1/30 s.
  void see_pelvis(const Vector3d& p) {
    const double at = count_ * kBodyDt * 30.0 - samples_;
    if (at < 0.0) return;
    const Vector3d now = count_ == 0 ? p : Vector3d(p - at / (kBodyDt * 30.0) * (p - last_p_));
    if (samples_ >= 2) {
      acceleration_m_s2 = std::max(acceleration_m_s2, (now - 2.0 * one_ + two_).norm() * 900.0);
    }
    two_ = one_;
    one_ = now;
    ++samples_;
  }

 public:
  void next(const Vector3d& p) { last_p_ = p; }

 private:
  const mocap::Body* body_;
  std::array<double, 6> learned_;
  std::array<Eigen::Matrix3d, 6> before_{};
  std::array<std::array<Vector3d, 2>, 2> feet_{mocap::points_at_origin<2>(),
                                               mocap::points_at_origin<2>()};
  Vector3d pelvis_ = Vector3d::Zero(), last_p_ = pelvis_, one_ = pelvis_, two_ = pelvis_;
  std::array<int, 2> rest_{};
  std::array<double, 2> highest_{};
  double path_ = 0.0, weight_ = 0.0;
  int count_ = 0, samples_ = 0;
};

struct Figures {
  double flexion_deg = 90.0, speed_ratio = 0.0, sole_m = 0.0, acceleration_m_s2 = 0.0,
         slide_m_s = 0.0;
  int reached = 0, missed = 0;  ///< goals
};

/// Goals all around, 0.2 to 6 m away; by a low-discrepancy sequence.
Figures walks(const motion::MotionModel& model, const Recorded& recorded, int goals) {
  const std::string style = recorded.style;
  const std::vector<CharacterStart> starts(static_cast<std::size_t>(goals));
  Characters characters(model, starts, {.walk = {.dt_s = kBodyDt}, .style = style});
  const std::array<double, 6> learned = learned_speeds(model, style);
  std::vector<Judge> judges(starts.size(), Judge(model.body, learned));
  for (int i = 0; i < goals; ++i) {
    const double far = 0.2 + 5.8 * std::fmod(0.5 + 0.7548776662 * i, 1.0);
    const double angle = math::kTwoPi * std::fmod(0.5 + 0.5698402910 * i, 1.0);
    characters.walk(i).walk_to({far * std::cos(angle), far * std::sin(angle)});
  }
  for (int k = 0; k < 3000; ++k) {
    characters.step();
    for (int i = 0; i < goals; ++i) {
      const RootPose& root = characters.state(i).root;
      Judge& judge = judges[static_cast<std::size_t>(i)];
      judge.see(root, characters.angles(i));
      judge.next({root.position_W_m.x(), root.position_W_m.y(), root.height_m});
    }
  }
  Figures worst;
  for (int i = 0; i < goals; ++i) {
    const Judge& j = judges[static_cast<std::size_t>(i)];
    worst.flexion_deg = std::min(worst.flexion_deg, j.flexion_deg);
    worst.speed_ratio = std::max(worst.speed_ratio, j.speed_ratio);
    worst.sole_m = std::max(worst.sole_m, j.sole_m);
    worst.acceleration_m_s2 = std::max(worst.acceleration_m_s2, j.acceleration_m_s2);
    worst.slide_m_s = std::max(worst.slide_m_s, j.slide_m_s());
    worst.missed += j.flexion_deg < -2.0 || j.speed_ratio > 1.3 || j.sole_m > 0.002 ||
                            j.acceleration_m_s2 > 1.3 * recorded.acceleration_m_s2 ||
                            j.slide_m_s() > recorded.slide_m_s
                        ? 1
                        : 0;
    worst.reached += characters.walk(i).reached() ? 1 : 0;
  }
  return worst;
}

TEST(Body, KeepsItsKneesJointsSolesAndPelvisOnEveryWay) {
  const motion::MotionModel model =
      motion::load_motion_model(MIMESIS_SOURCE_DIR "/models/walk.motion.json");
  const char* many = std::getenv("MIMESIS_GOALS");
  const int goals = many != nullptr ? std::atoi(many) : 24;
  for (const Recorded& recorded : kRecorded) {
    const Figures is = walks(model, recorded, goals);
    std::printf(
        "%s, %d goals: flexion %.1f deg, joints %.2f times the learned speed, soles %.1f mm, "
        "pelvis %.1f m/s2, toes %.1f cm/s; %d miss one of these\n",
        recorded.style, goals, is.flexion_deg, is.speed_ratio, 1e3 * is.sole_m,
        is.acceleration_m_s2, 1e2 * is.slide_m_s, is.missed);
    EXPECT_EQ(is.reached, goals) << recorded.style;
    EXPECT_GT(is.flexion_deg, -2.0) << recorded.style;
    EXPECT_LT(is.speed_ratio, 1.3) << recorded.style;
    EXPECT_LE(is.missed, goals / 50) << recorded.style;  // of many goals, by little
    EXPECT_LT(is.sole_m, 0.003) << recorded.style;
    EXPECT_LT(is.acceleration_m_s2, 1.3 * recorded.acceleration_m_s2) << recorded.style;
    EXPECT_LT(is.slide_m_s, 1.2 * recorded.slide_m_s) << recorded.style;
  }
}

}  // namespace
}  // namespace mimesis::synthesizer
