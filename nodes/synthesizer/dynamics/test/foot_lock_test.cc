#include <gtest/gtest.h>

#include "common/math/circle.h"
#include "nodes/synthesizer/dynamics/character_batch.h"
#include "nodes/synthesizer/dynamics/posture.h"
#include "nodes/synthesizer/dynamics/testing/synthetic_model.h"

namespace mimesis::synthesizer {
namespace {

using testing::walking_model, testing::WalkSettings;

struct Slide {
  double stance_m_s = 0.0;           ///< mean speed of the toes while they are to stand
  double fastest_change_m_s2 = 0.0;  ///< largest change of a toe's velocity, per s
  double farthest_rad = 0.0;         ///< largest change of a joint angle by the lock
};

/// A walker whose feet slide by 10 cm a stance, at 100 Hz.
Slide walk(bool lock) {
  const motion::MotionModel model = walking_model({.slide_m = 0.1});
  CharacterBatch batch(model, 1, {.dt_s = 0.01, .foot_lock = lock});
  CharacterBatch free(model, 1, {.dt_s = 0.01});
  Slide result;
  double sum = 0.0;
  int count = 0;
  Eigen::Vector3d before[2], velocity[2];
  for (int n = 0; n < 800; ++n) {
    batch.step();
    free.step();
    for (int side = 0; side < 2; ++side) {
      const double phase = batch.phase(0) - (side == mocap::kRight ? std::numbers::pi : 0.0);
      const double since = phase < 0.0 ? phase + 2.0 * std::numbers::pi : phase;
      const Eigen::Vector3d v = (batch.toe_W_m(0, side) - before[side]) / 0.01;
      if (n > 200 && since > 0.5 && since < 0.58 * 2.0 * std::numbers::pi) {
        sum += v.head<2>().norm();
        ++count;
      }
      if (n > 200) {
        result.fastest_change_m_s2 =
            std::max(result.fastest_change_m_s2, (v - velocity[side]).norm() / 0.01);
      }
      velocity[side] = v;
      before[side] = batch.toe_W_m(0, side);
    }
    for (int r = 0; r < batch.rows(); ++r) {
      const auto i = static_cast<std::size_t>(r);
      result.farthest_rad = std::max(
          result.farthest_rad, std::abs(double(batch.angles(0)[i]) - double(free.angles(0)[i])));
    }
  }
  result.stance_m_s = sum / count;
  return result;
}

TEST(FootLock, FeetThatSlideStand) {
  const Slide without = walk(false), with = walk(true);
  EXPECT_GT(without.stance_m_s, 0.03);
  EXPECT_LT(with.stance_m_s, 0.003);
  EXPECT_LT(with.farthest_rad, 0.3);
  EXPECT_LT(with.fastest_change_m_s2, 3.0 * without.fastest_change_m_s2);  // it clears the ground
}

TEST(FootLock, FeetStandInTurnsToo) {  // the displacement stays where it is in the world
  const motion::MotionModel model =
      walking_model({.speed_m_s = 0.8, .turn_rad_s = 1.5, .slide_m = 0.08});
  CharacterBatch batch(model, 1, {.dt_s = 0.01, .foot_lock = true});
  double path = 0.0;
  int count = 0;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (int n = 0; n < 800; ++n) {
    batch.step();
    const Eigen::Vector3d toe = batch.toe_W_m(0, mocap::kLeft),
                          heel = batch.heel_W_m(0, mocap::kLeft);
    const Eigen::Vector3d middle = 0.5 * (toe + heel);  // middle of the flat foot: the locked point
    if (n > 200 && batch.phase(0) > 0.8 && batch.phase(0) < 3.4) {
      path += (middle - before).head<2>().norm();
      ++count;
    }
    before = middle;
  }
  EXPECT_LT(path / count / 0.01, 0.005);
}

TEST(FootLock, FeetStandWhileThePelvisIsToldToTurn) {  // place and direction of the foot
  CharacterBatch batch(walking_model({.speed_m_s = 0.6}), 1, {.dt_s = 0.01, .foot_lock = true});
  batch.set_turn(0, 0.8);
  double path = 0.0, twist = 0.0;
  int count = 0;
  Eigen::Vector3d toe_before = Eigen::Vector3d::Zero(), heel_before = toe_before;
  for (int n = 0; n < 800; ++n) {
    batch.step();
    const Eigen::Vector3d toe = batch.toe_W_m(0, mocap::kLeft),
                          heel = batch.heel_W_m(0, mocap::kLeft);
    if (n > 200 && batch.phase(0) > 0.8 && batch.phase(0) < 3.0) {
      path += 0.5 * (toe - toe_before + heel - heel_before).head<2>().norm();
      twist += (toe - heel - toe_before + heel_before).head<2>().norm() / (toe - heel).norm();
      ++count;
    }
    toe_before = toe;
    heel_before = heel;
  }
  EXPECT_LT(path / count / 0.01, 0.005);  // m/s
  EXPECT_LT(twist / count / 0.01, 0.05);  // rad/s, of a pelvis that turns by 0.8
}

TEST(FootLock, SolesThatStandAreOnTheGroundAndNoneIsBelow) {
  for (const double turn : {0.0, 0.6}) {
    CharacterBatch batch(walking_model({.slide_m = 0.1}), 1, {.dt_s = 0.005, .foot_lock = true});
    batch.set_turn(0, turn);
    for (int n = 0; n < 1000; ++n) {
      batch.step();
      for (const int side : {mocap::kLeft, mocap::kRight}) {
        const double low = std::min(batch.heel_W_m(0, side).z(), batch.toe_W_m(0, side).z());
        const double since = math::wrap_two_pi(batch.phase(0) - side * std::numbers::pi);
        ASSERT_GT(low, -2e-3) << n;
        if (since > 0.3 && since < 3.3) {
          ASSERT_LT(low, 2e-3) << n << ' ' << side;
        }
      }
    }
  }
}

TEST(FootLock, FeetThatStandAreLeftAlone) {
  const motion::MotionModel model = walking_model();
  CharacterBatch locked(model, 1, {.dt_s = 0.01, .foot_lock = true}),
      free(model, 1, {.dt_s = 0.01});
  double most = 0.0;
  for (int n = 0; n < 500; ++n) {
    locked.step();
    free.step();
    for (int r = 0; r < locked.rows(); ++r) {
      const auto i = static_cast<std::size_t>(r);
      most = std::max(most, std::abs(double(locked.angles(0)[i]) - double(free.angles(0)[i])));
    }
  }
  EXPECT_LT(most, 0.12);  // the foot that leaves rests a little longer, and clears the ground
}

}  // namespace
}  // namespace mimesis::synthesizer
