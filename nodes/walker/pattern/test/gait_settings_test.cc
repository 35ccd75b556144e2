#include <gtest/gtest.h>

#include "common/model/files.h"
#include "common/shared_data.h"
#include "nodes/walker/pattern/mpc_pattern.h"

namespace mimesis::walker {
namespace {

robot::Biped load(const std::string& name) {
  return model::load_biped(std::string(MIMESIS_SOURCE_DIR) + "/models/" + name);
}

TEST(GaitSettingsOfARobot, OurBipedHasTheDefaults) {
  const robot::Biped biped = load("biped.yaml");
  const GaitSettings s = gait_settings(biped), standard;
  EXPECT_NEAR(s.com_height_m, 0.807, 1e-3);
  EXPECT_NEAR(s.feet_distance_m, 0.19, 1e-9);
  EXPECT_NEAR(s.longest_step_m, standard.longest_step_m, 2e-3);
  EXPECT_NEAR(s.widest_step_m, standard.widest_step_m, 2e-3);
  EXPECT_NEAR(s.narrowest_step_m, standard.narrowest_step_m, 1e-6);
  EXPECT_NEAR(s.most_forward_m_s, standard.most_forward_m_s, 2e-3);
  EXPECT_NEAR(s.step_height_m, standard.step_height_m, 2e-3);
  EXPECT_LT((s.zmp_half_m - standard.zmp_half_m).norm(), 1e-6);
}

/// What must hold of any robot: the ZMP stays on the sole, feet do not touch each other, steps are
/// shorter than legs.
void expect_sane(const robot::Biped& biped) {
  const GaitSettings s = gait_settings(biped);
  EXPECT_NO_THROW(check(s));
  EXPECT_EQ(s.com_height_m, biped.com_height_m);
  for (const Side side : robot::kSides) {
    const robot::Biped::Leg& leg = biped.leg[side];
    EXPECT_LT(s.zmp_half_m.x(), std::min(-leg.min_S_m.x(), leg.max_S_m.x()));
    EXPECT_LT(s.zmp_half_m.y(), std::min(-leg.min_S_m.y(), leg.max_S_m.y()));
  }
  EXPECT_GT(s.zmp_half_m.minCoeff(), 0.02);
  const double inner = biped.leg[kRight].max_S_m.y() - biped.leg[kLeft].min_S_m.y();
  EXPECT_GT(s.narrowest_step_m, inner) << "soles side by side would overlap";
  EXPECT_LT(s.longest_step_m, 0.5 * biped.com_height_m);
  EXPECT_GT(s.longest_step_m, 0.2 * biped.com_height_m);
  EXPECT_GT(s.most_forward_m_s * s.step_s, 0.5 * s.longest_step_m);
}

TEST(GaitSettingsOfARobot, AreSaneForOurBiped) { expect_sane(load("biped.yaml")); }

TEST(GaitSettingsOfARobot, AreSaneForJvrc1) {
  if (!std::filesystem::exists(shared_data("data/robots/jvrc1.urdf"))) {
    GTEST_SKIP() << "needs data/robots/jvrc1.urdf of the shared folder";
  }
  const robot::Biped biped = load("jvrc1.yaml");
  expect_sane(biped);
  const GaitSettings s = gait_settings(biped);
  LinearMpc pattern(s);
  Wish wish;
  wish.velocity_m_s.x() = 0.8 * s.most_forward_m_s;
  for (int i = 0; i < 2000; ++i) {
    pattern.step(wish);
    ASSERT_EQ(pattern.trouble().failed_solves, 0) << i;
  }
  EXPECT_EQ(pattern.now().gait, Gait::kWalking);
  EXPECT_FALSE(pattern.trouble().clipped);
}

}  // namespace
}  // namespace mimesis::walker
