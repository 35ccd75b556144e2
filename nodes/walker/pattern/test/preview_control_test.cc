#include "nodes/walker/pattern/preview_control.h"

#include <gtest/gtest.h>

#include <fstream>
#include <vector>

#include "common/error.h"
#include "common/shared_data.h"
#include "common/testing/no_malloc.h"

namespace mimesis::walker {
namespace {

std::vector<double> read_numbers(const std::string& file) {
  std::ifstream in(shared_data("data/walking/" + file));
  std::vector<double> numbers;
  for (double x; in >> x;) numbers.push_back(x);
  return numbers;
}

/// Half a unit of the sixth digit of a number as it is printed, and of the fifth.
double sixth_digit(double x) {
  return 0.51 * std::pow(10.0, std::floor(std::log10(std::abs(x))) - 5.0);
}
double fifth_digit(double x) { return 10.0 * sixth_digit(x); }

/// The regression data of the Riccati solver take g = 9.8 m/s², the robot's file 9.81: the gains
/// depend on h/g alone. The form with the position was sampled at 10 ms.
constexpr double kReferenceHeight_m = 0.814 * kGravity_m_s2 / 9.8;
constexpr PreviewSettings kWithPosition{
    .height_m = kReferenceHeight_m, .dt_s = 0.01, .samples = 160, .jerk_weight = 1e-5};
constexpr PreviewSettings kWithIntegral{
    .height_m = kReferenceHeight_m, .dt_s = 0.005, .samples = 320, .jerk_weight = 1e-6};

TEST(Riccati, FulfilsItsEquation) {
  const CartTableAxis axis(0.005, 0.807);
  const Eigen::MatrixXd Q = axis.c.transpose() * axis.c;
  const double R = 1e-5;
  const Eigen::MatrixXd P = riccati(axis.A, axis.b, Q, R);
  const Eigen::VectorXd PAb = axis.A.transpose() * P * axis.b;
  const Eigen::MatrixXd residual = axis.A.transpose() * P * axis.A + Q - P -
                                   PAb * PAb.transpose() / (R + axis.b.dot(P * axis.b));
  EXPECT_LT(residual.norm(), 1e-11 * P.norm());
}

TEST(Riccati, SaysThatASystemCannotBeStabilized) {
  Eigen::MatrixXd A = 2.0 * Eigen::MatrixXd::Identity(1, 1);
  EXPECT_THROW((void)riccati(A, Eigen::VectorXd::Zero(1), Eigen::MatrixXd::Identity(1, 1), 1.0),
               ConfigError);
}

TEST(PreviewGains, EqualTheReferenceWithInitialPosition) {
  const std::vector<double> reference =
      read_numbers("TestRiccatiEquationWeightsWithInitialPose.datref.cmake");
  if (reference.empty()) GTEST_SKIP() << "not here: no ../shared/data/walking";
  const PreviewGains gains = preview_gains(kWithPosition);
  ASSERT_EQ(reference.size(), 161u);
  EXPECT_NEAR(gains.K(0), reference[0], sixth_digit(reference[0]));
  for (int i = 0; i < 160; ++i) {
    const double expected = reference[static_cast<std::size_t>(i) + 1];
    EXPECT_NEAR(gains.F(i), expected, sixth_digit(expected)) << i;
  }
}

TEST(PreviewGains, EqualTheReferenceWithIntegralError) {
  const std::vector<double> reference =
      read_numbers("TestRiccatiEquationWeightsWithoutInitialPose.datref.cmake");
  if (reference.empty()) GTEST_SKIP() << "not here: no ../shared/data/walking";
  const PreviewGains gains = integral_gains(kWithIntegral);
  ASSERT_EQ(reference.size(), 321u);
  EXPECT_NEAR(gains.Ks, reference[0], sixth_digit(reference[0]));
  for (int i = 0; i < 320; ++i) {
    const double expected = reference[static_cast<std::size_t>(i) + 1];
    EXPECT_NEAR(gains.F(i), expected, sixth_digit(expected)) << i;
  }
}

TEST(PreviewGains, EqualTheParameterFileOfTheRobot) {
  const std::vector<double> reference = read_numbers("PreviewControlParameters.ini");
  if (reference.empty()) GTEST_SKIP() << "not here: no ../shared/data/walking";
  PreviewSettings settings = kWithIntegral;
  settings.height_m = reference[0];
  ASSERT_EQ(reference[1], settings.dt_s);
  const PreviewGains gains = integral_gains(settings);
  for (int i = 0; i < 3; ++i) {
    const double expected = reference[static_cast<std::size_t>(i) + 3];
    EXPECT_NEAR(gains.K(i), expected, fifth_digit(expected)) << i;
  }
  EXPECT_NEAR(gains.Ks, reference[6], fifth_digit(reference[6]));
  for (int i = 0; i < 320; ++i) {
    const double expected = reference[static_cast<std::size_t>(i) + 7];
    EXPECT_NEAR(gains.F(i), expected, fifth_digit(expected)) << i;
  }
}

TEST(PreviewControl, FollowsStepsThatItSeesComing) {
  PreviewSettings settings;
  settings.jerk_weight = 1e-6;
  PreviewControl control(settings);
  std::vector<Eigen::Vector2d> reference(2000);
  for (std::size_t i = 0; i < reference.size(); ++i) {  // 0.1 s from foot to foot, 0.7 s on it
    const double crossed = std::min(1.0, static_cast<double>(i % 160) / 20.0);
    const double y = i / 160 % 2 ? 0.095 : -0.095;
    reference[i] = {0.2 * (static_cast<double>(i / 160) + crossed), y * (2.0 * crossed - 1.0)};
  }
  control.reset({.p_W_m = reference[0]});
  double worst = 0.0;
  for (std::size_t i = 0; i < 1600; ++i) {
    const mimesis::testing::NoMalloc guard;
    control.step({&reference[i], 330});
    if (i > 640) worst = std::max(worst, (control.zmp_W_m() - reference[i + 1]).norm());
  }
  EXPECT_LT(worst, 0.03);  // rounded corners of the ramps
}

TEST(PreviewControl, RollsOutWhatStepsDo) {
  PreviewSettings settings;
  settings.samples = 1000;  // the gains in steps end there, those of the roll-out nowhere
  PreviewControl control(settings);
  std::vector<Eigen::Vector2d> reference(400);
  for (std::size_t i = 0; i < reference.size(); ++i)
    reference[i] = {i < 200 ? 0.0 : 0.2, i / 100 % 2 ? 0.09 : -0.05};
  control.reset({.p_W_m = {0.03, -0.02}, .v_W = {0.1, 0.0}, .a_W = {0.0, 0.2}});
  std::vector<ComState> coms(400);
  control.roll_out(reference, coms);
  for (std::size_t i = 0; i + 1 < reference.size(); ++i) {
    ASSERT_LT((control.com().p_W_m - coms[i].p_W_m).norm(), 1e-9) << i;
    ASSERT_LT((control.com().a_W - coms[i].a_W).norm(), 1e-7) << i;
    control.step(std::span(reference).subspan(i));
  }
  const mimesis::testing::NoMalloc guard;
  control.roll_out(reference, coms);
}

TEST(PreviewControl, GoOnFromAnyStateThatIsTakenOver) {
  PreviewSettings settings;
  PreviewControl control(settings), other(settings);
  std::vector<Eigen::Vector2d> reference(600, Eigen::Vector2d(0.1, -0.05));
  std::fill(reference.begin(), reference.begin() + 200, Eigen::Vector2d::Zero());
  control.reset({});
  for (std::size_t k = 0; k < 250; ++k) {
    const auto ahead = std::span(reference).subspan(k);
    const Eigen::Vector2d jerk = control.jerk(ahead);
    if (k > 180) other.step(ahead);
    control.step(ahead);
    if (k == 180) other.reset(control.com(), jerk);
    if (k >= 180) {
      ASSERT_LT((other.com().p_W_m - control.com().p_W_m).norm(), 1e-9) << k;
    }
  }
}

TEST(PreviewControl, StandsAnywhereAndTakesAShortReference) {
  PreviewSettings settings;
  PreviewControl control(settings);
  const std::vector<Eigen::Vector2d> here{{100.0, -50.0}};
  control.reset({.p_W_m = here[0]});
  for (int i = 0; i < 2000; ++i) control.step(here);
  EXPECT_LT((control.com().p_W_m - here[0]).norm(), 1e-6);
}

}  // namespace
}  // namespace mimesis::walker
