#include "nodes/synthesizer/dynamics/character_batch.h"

#include <gtest/gtest.h>

#include <array>

#include "common/math/circle.h"
#include "common/math/so3.h"
#include "common/motion/demix/mixture.h"
#include "common/testing/refusal.h"
#include "nodes/synthesizer/dynamics/testing/synthetic_model.h"

namespace mimesis::synthesizer {
namespace {

using testing::random_model, testing::walking_model;

/// ξ at any phase: the mixture's sources as trigonometric interpolation of their samples.
Eigen::VectorXd mixture_at(const motion::MotionModel& model, const motion::Pattern& p,
                           double phase) {
  const Eigen::Index length = model.sources.cols();
  Eigen::VectorXd xi = p.mean_rad;
  for (Eigen::Index r = 0; r < xi.size(); ++r) {
    for (Eigen::Index k = 0; k < model.sources.rows(); ++k) {
      const double at = phase - p.delay_rad(r, k);
      if (k < model.fixed) {
        auto slow = [k](double x) {  // demix::non_periodic
          return k == 0 ? std::cos(x / 2.0) : k == 1 ? std::cos(x / 4.0) : std::sin(x / 4.0);
        };
        const double scale = model.sources(k, length / 4) / slow(math::kTwoPi / 4.0);
        xi[r] += p.weight_rad(r, k) * scale * slow(phase);
        continue;
      }
      for (Eigen::Index t = 0; t < length; ++t) {  // periodic sinc of an even count
        const double x = at - math::kTwoPi * double(t) / double(length);
        const double s =
            std::abs(std::sin(x / 2.0)) < 1e-12
                ? 1.0
                : std::sin(double(length) * x / 2.0) / std::tan(x / 2.0) / double(length);
        xi[r] += p.weight_rad(r, k) * model.sources(k, t) * s;
      }
    }
  }
  return xi;
}

Eigen::VectorXd angles_of(const CharacterBatch& batch, int i) {
  Eigen::VectorXd a(batch.rows());
  for (int r = 0; r < batch.rows(); ++r) {
    a[r] = static_cast<double>(batch.angles(i)[static_cast<std::size_t>(r)]);
  }
  return a;
}

TEST(CharacterBatch, AnglesAreTheMixtureAtThePhase) {
  for (const int fixed : {0, 1, 3}) {
    const motion::MotionModel model = random_model(5, 4, 3, fixed);
    CharacterBatch batch(model, 3, {.dt_s = 1.0 / 200.0});
    EXPECT_LE(batch.series().truncation_rad(), 1e-3);
    for (int i = 0; i < 3; ++i) batch.set_pattern(i, i);
    batch.set_phase(1, 2.0);
    batch.set_phase(2, 5.5);
    for (int n = 0; n < 130; ++n) batch.step();
    for (int i = 0; i < 3; ++i) {
      const Eigen::VectorXd expected =
          mixture_at(model, model.patterns[static_cast<std::size_t>(i)], batch.phase(i));
      EXPECT_LT((angles_of(batch, i) - expected).cwiseAbs().maxCoeff(), 1e-5) << fixed << " " << i;
    }
  }
}

TEST(CharacterBatch, OwnParametersAreTheMixtureWithinTheStatedError) {
  for (const int fixed : {0, 3}) {
    const motion::MotionModel model = random_model(6, 4, 2, fixed);
    CharacterBatch batch(model, 1, {.dt_s = 0.01, .tolerance_rad = 1e-4, .individual = true});
    EXPECT_LE(batch.series().truncation_rad(), 1e-4);
    const motion::Pattern& p = model.patterns[1];
    batch.set_parameters(0, p.mean_rad, p.weight_rad, p.delay_rad, std::array{0.0, 1.0});
    for (int n = 0; n < 100; ++n) {
      batch.step();
      ASSERT_LT((angles_of(batch, 0) - mixture_at(model, p, batch.phase(0))).cwiseAbs().maxCoeff(),
                1.1e-4)
          << fixed << " at " << batch.phase(0);
    }
  }
}

TEST(CharacterBatch, PhasesAdvanceByTheFrequency) {
  CharacterBatch batch(random_model(5), 2, {.dt_s = 1.0 / 60.0});
  batch.set_frequency(1, 9.0);
  for (int n = 0; n < 600; ++n) batch.step();  // 10 s
  EXPECT_NEAR(math::wrap_pi(batch.phase(0) - 10.0 * math::kTwoPi), 0.0, 1e-5);
  EXPECT_NEAR(math::wrap_pi(batch.phase(1) - 90.0), 0.0, 2e-4);
  EXPECT_NEAR(batch.state(1).norm(), 1.0, 1e-4);
}

TEST(CharacterBatch, FollowsAnExternalOscillator) {
  CharacterBatch batch(random_model(5), 2, {.dt_s = 1.0 / 60.0});
  batch.set_phase(0, 2.5);
  batch.set_phase(1, 2.5);
  for (int n = 0; n < 300; ++n) {  // the external oscillator runs at the own frequency
    batch.set_external(0, math::kTwoPi * n / 60.0, 2.0);
    batch.step();
  }
  // α (x_ext − x) with x_ext held for a step: behind by half a step
  EXPECT_NEAR(math::wrap_pi(batch.phase(0) - math::kTwoPi * 300.0 / 60.0), 0.0, 0.06);
  EXPECT_NEAR(math::wrap_pi(batch.phase(1) - 2.5), 0.0, 1e-4);
}

TEST(CharacterBatch, PosturesAreForwardKinematics) {
  const motion::MotionModel model = random_model(9);
  CharacterBatch batch(model, 40, {});
  for (int i = 0; i < 40; ++i) batch.set_phase(i, 0.1 * i);
  batch.set_root(33, {3.0, -2.0}, 0.7);
  batch.step();
  for (const int i : {0, 17, 33}) {
    const Eigen::VectorXd a = angles_of(batch, i);
    const RootPose root = batch.root(i);
    const mocap::BodyPose pose = mocap::forward_kinematics(
        model.body, std::span<const double, mocap::kBodyRows>(a.data(), mocap::kBodyRows),
        Eigen::Vector3d::Zero());
    const Eigen::Matrix3d R_WH = math::exp_so3({0, 0, root.heading_rad});
    const Eigen::Vector3d p_WH(root.position_W_m.x(), root.position_W_m.y(), root.height_m);
    for (int j = 0; j < mocap::kBodyJoints; ++j) {
      const Eigen::Vector3d p = R_WH * pose.p_WJ[static_cast<std::size_t>(j)] + p_WH;
      EXPECT_LT((batch.joint_W_m(i, j) - p).norm(), 5e-6) << i << " " << j;
    }
    for (const int side : {mocap::kLeft, mocap::kRight}) {
      const int ankle = side == mocap::kLeft ? mocap::kLeftAnkle : mocap::kRightAnkle;
      const auto s = static_cast<std::size_t>(side);
      const Eigen::Vector3d toe = R_WH * pose.point(ankle, model.body.toe_m[s]) + p_WH;
      EXPECT_LT((batch.toe_W_m(i, side) - toe).norm(), 5e-6);
    }
  }
  EXPECT_NEAR(batch.root(33).heading_rad, 0.7, 1e-12);
}

/// Everything a character shows, bit by bit.
std::vector<unsigned char> bits(const CharacterBatch& batch, int i) {
  std::vector<unsigned char> all;
  auto add = [&](const void* data, std::size_t size) {
    const auto* from = static_cast<const unsigned char*>(data);
    all.insert(all.end(), from, from + size);
  };
  add(batch.angles(i).data(), batch.angles(i).size_bytes());
  const RootPose root = batch.root(i);
  for (const double x : {root.position_W_m.x(), root.position_W_m.y(), root.height_m,
                         root.heading_rad, batch.state(i).x(), batch.state(i).y()}) {
    add(&x, sizeof x);
  }
  for (int j = 0; j < mocap::kBodyJoints; ++j) {
    const Eigen::Vector3d p = batch.joint_W_m(i, j);
    add(p.data(), 3 * sizeof(double));
  }
  return all;
}

TEST(CharacterBatch, ResultsDependNeitherOnPlaceNorOnCompany) {
  const motion::MotionModel model = random_model(3);
  const CharacterOptions options{.individual = true, .foot_lock = true};
  CharacterBatch alone(model, 1, options), many(model, 45, options);
  auto settle = [&](CharacterBatch& batch, int i, int like) {
    batch.set_phase(i, 0.3 * like);
    batch.set_frequency(i, 5.0 + 0.1 * like);
    batch.set_external(i, 0.2 * like, 1.5);
    batch.set_root(i, {1.0 * like, 2.0}, 0.1 * like);
    batch.set_blend(i, std::array{0.1 * like, 0.5, 0.2});
  };
  for (int i = 0; i < 45; ++i) settle(many, i, i);
  for (int n = 0; n < 100; ++n) many.step();
  for (const int i : {0, 15, 16, 30, 44}) {
    alone = CharacterBatch(model, 1, options);
    settle(alone, 0, i);
    for (int n = 0; n < 100; ++n) alone.step();
    EXPECT_EQ(bits(alone, 0), bits(many, i)) << i;
  }
}

TEST(CharacterBatch, BlendsAreLinearInTheParameters) {
  const motion::MotionModel model = random_model(11);
  CharacterBatch batch(model, 2, {.individual = true});
  const std::array beta{0.6, -0.1, 0.5};
  motion::Pattern sum = model.patterns[0];
  sum.mean_rad.setZero();
  sum.weight_rad.setZero();
  for (std::size_t p = 0; p < 3; ++p) {
    sum.mean_rad += beta[p] * model.patterns[p].mean_rad;
    sum.weight_rad += beta[p] * model.patterns[p].weight_rad;
  }
  batch.set_blend(0, beta);
  batch.set_parameters(1, sum.mean_rad, sum.weight_rad, sum.delay_rad, beta);
  for (int n = 0; n < 20; ++n) batch.step();
  EXPECT_LT((angles_of(batch, 0) - angles_of(batch, 1)).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(CharacterBatch, ModelsThatDoNotFitAreRefused) {
  auto refused = [](const motion::MotionModel& model, const char* what) {
    const std::string words =
        mimesis::testing::refusal([&] { const CharacterBatch batch(model, 1); });
    EXPECT_NE(words.find(what), std::string::npos) << words;
  };
  const motion::MotionModel good = random_model(1);
  motion::MotionModel bad = good;
  bad.patterns.clear();
  refused(bad, "no pattern");
  bad = good;
  bad.patterns[1].weight_rad.conservativeResize(50, 4);
  refused(bad, "pattern 1: sizes differ from 51 rows x 4 sources");
  bad = good;
  bad.patterns[2].mean_rad[3] = std::nan("");
  refused(bad, "pattern 2: a number is not finite");
}

}  // namespace
}  // namespace mimesis::synthesizer
