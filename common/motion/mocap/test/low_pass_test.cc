#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/error.h"
#include "common/motion/mocap/resampling.h"

namespace mimesis::mocap {
namespace {

constexpr double kPi = std::numbers::pi;

Eigen::MatrixXd sine(double frequency_hz, double rate_hz, Eigen::Index frames) {
  return Eigen::RowVectorXd::NullaryExpr(frames, [&](Eigen::Index t) {
    return std::sin(2.0 * kPi * frequency_hz * static_cast<double>(t) / rate_hz + 0.3);
  });
}

TEST(LowPass, KeepsPhaseAndTheClosedFormShareOfASine) {
  constexpr double kRate = 120.0, kCutoff = 8.0;
  for (const int order : {2, 4}) {
    for (const double f : {1.0, 4.0, 8.0, 12.0, 30.0}) {
      const Eigen::MatrixXd x = sine(f, kRate, 1200);
      const Eigen::MatrixXd y = low_pass(x, kRate, kCutoff, order);
      const double w = std::tan(kPi * f / kRate) / std::tan(kPi * kCutoff / kRate);
      const double share = 1.0 / (1.0 + std::pow(w, 2.0 * order));
      // away from the ends, where the continuation is not a sine
      EXPECT_LT((y - share * x).middleCols(300, 600).cwiseAbs().maxCoeff(), 1e-9)
          << f << " Hz, order " << order;
    }
  }
}

TEST(LowPass, ARampStaysARampUpToItsEnds) {
  const Eigen::MatrixXd ramp = Eigen::RowVectorXd::LinSpaced(50, -1.0, 2.0);
  EXPECT_LT((low_pass(ramp, 120.0, 8.0) - ramp).cwiseAbs().maxCoeff(), 1e-3);
  const Eigen::MatrixXd constant = Eigen::MatrixXd::Constant(2, 5, 3.0);
  EXPECT_LT((low_pass(constant, 30.0, 8.0) - constant).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(LowPass, IsTheSameBackwards) {
  const Eigen::MatrixXd x = sine(3.0, 30.0, 61) + sine(11.0, 30.0, 61);
  const Eigen::MatrixXd y = low_pass(x, 30.0, 8.0);
  const Eigen::MatrixXd back = low_pass(x.rowwise().reverse().eval(), 30.0, 8.0);
  EXPECT_LT((y - back.rowwise().reverse()).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(LowPass, RefusesWhatItCannotFilter) {
  Eigen::MatrixXd x = sine(1.0, 30.0, 40);
  EXPECT_THROW(low_pass(x, 30.0, 15.0), ConfigError);
  EXPECT_THROW(low_pass(x, 0.0, 8.0), ConfigError);
  EXPECT_THROW(low_pass(x, 30.0, 8.0, 3), ConfigError);
  x(0, 7) = NAN;
  EXPECT_THROW(low_pass(x, 30.0, 8.0), ConfigError);
}

TEST(Spline, PassesItsKnotsAndIsExactForLines) {
  const std::vector<double> knots = {0.0, 1.0, 1.5, 4.0, 5.0};
  Eigen::MatrixXd values(2, 5);
  values << 1.0, -2.0, 0.5, 3.0, 3.0,  //
      0.0, 2.0, 3.0, 8.0, 10.0;
  const Spline spline(knots, values);
  for (std::size_t i = 0; i < knots.size(); ++i) {
    EXPECT_LT((spline.at(knots[i]) - values.col(static_cast<Eigen::Index>(i))).norm(), 1e-12);
  }
  for (const double x : {-0.5, 0.3, 2.7, 5.5}) EXPECT_NEAR(spline.at(x)[1], 2.0 * x, 1e-12);
}

TEST(Spline, IsSmoothToTheSecondDerivative) {
  const std::vector<double> knots = {0.0, 1.0, 1.5, 4.0};
  Eigen::MatrixXd values(1, 4);
  values << 1.0, -2.0, 0.5, 3.0;
  const Spline spline(knots, values);
  constexpr double kStep = 1e-3;
  auto second = [&](double x) {
    return (spline.at(x + kStep) - 2.0 * spline.at(x) + spline.at(x - kStep))[0] / (kStep * kStep);
  };
  for (const double knot : {1.0, 1.5}) {
    EXPECT_NEAR(second(knot - 2 * kStep), second(knot + 2 * kStep), 0.2);
  }
  EXPECT_NEAR(second(kStep), 0.0, 0.1);  // natural end
}

TEST(Spline, ResamplesASineToTheFourthOrder) {
  const Eigen::MatrixXd coarse = sine(1.0, 30.0, 91);
  const Eigen::MatrixXd fine = resample(coarse, 30.0, 60.0, 100);
  ASSERT_EQ(fine.cols(), 100);
  // one period from frame 30 to frame 60, of which the end is left out; error h⁴ω⁴/384
  const Eigen::MatrixXd expected = sine(1.0, 100.0, 200).middleCols(100, 100);
  EXPECT_LT((fine - expected).cwiseAbs().maxCoeff(), 2e-5);
}

}  // namespace
}  // namespace mimesis::mocap
