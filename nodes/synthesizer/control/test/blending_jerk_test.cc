#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include "common/math/circle.h"
#include "nodes/synthesizer/control/rotation_branches.h"
#include "nodes/synthesizer/control/styles.h"
#include "nodes/synthesizer/control/test/gait_sets.h"
#include "nodes/synthesizer/control/transition.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kRate_hz = 60.0;

/// R angles at a phase.
Eigen::VectorXd posture(const MotionModel& model, const MotionParameters& p, double phase) {
  const Eigen::Index length = model.sources.cols();
  Eigen::VectorXd q = p.mean_rad;
  for (Eigen::Index r = 0; r < q.size(); ++r) {
    for (Eigen::Index k = 0; k < model.sources.rows(); ++k) {
      // cubic interpolation of the period: smoother than what is measured
      const double at =
          math::wrap_two_pi(phase - p.delay_rad(r, k)) / math::kTwoPi * static_cast<double>(length);
      const auto i = static_cast<Eigen::Index>(at);
      const double u = at - static_cast<double>(i);
      const auto s = [&](Eigen::Index j) { return model.sources(k, (i + j + length) % length); };
      const double value = s(0) + 0.5 * u *
                                      (s(1) - s(-1) +
                                       u * (2 * s(-1) - 5 * s(0) + 4 * s(1) - s(2) +
                                            u * (3 * (s(0) - s(1)) + s(2) - s(-1))));
      q[r] += p.weight_rad(r, k) * value;
    }
  }
  return q;
}

/// Postures at 60 Hz from one cycle before the transition to one after; `zero`: frame nearest to
/// it.
std::vector<Eigen::VectorXd> play(const MotionModel& model, const MotionParameters& from,
                                  const MotionParameters& to, double beta, std::size_t& zero) {
  Sequencer s(from, model.fixed, 0.0, beta);
  EXPECT_TRUE(s.announce(to));
  std::vector<Eigen::VectorXd> frames;
  double phase = 0.0;
  zero = 0;
  while (phase < 2.0 * math::kTwoPi) {
    const MotionParameters& p = s.at(phase);
    frames.push_back(posture(model, p, phase));
    if (phase < math::kTwoPi) zero = frames.size();
    phase += p.frequency_rad_s / kRate_hz;
  }
  return frames;
}

/// Root mean square over all rows and the frames [first, last) [rad/s³].
double rms_jerk(const std::vector<Eigen::VectorXd>& x, std::size_t first, std::size_t last) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = std::max<std::size_t>(first, 2); i < std::min(last, x.size() - 1); ++i) {
    const Eigen::VectorXd j =
        (x[i + 1] - 3.0 * x[i] + 3.0 * x[i - 1] - x[i - 2]) * std::pow(kRate_hz, 3);
    sum += j.squaredNorm();
    count += static_cast<std::size_t>(j.size());
  }
  return std::sqrt(sum / static_cast<double>(count));
}

/// Smallest rms jerk of any motion that is `x` outside the frames (first, last): the discrete
/// minimum jerk connection.
std::vector<Eigen::VectorXd> smoothest(std::vector<Eigen::VectorXd> x, std::size_t first,
                                       std::size_t last) {
  const auto unknown = static_cast<Eigen::Index>(last - first) - 1;
  constexpr std::array kThird = {-1.0, 3.0, -3.0, 1.0};
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(unknown + 3, unknown);
  Eigen::MatrixXd b = Eigen::MatrixXd::Zero(unknown + 3, x[0].size());
  for (Eigen::Index e = 0; e < a.rows(); ++e) {
    for (Eigen::Index k = 0; k < 4; ++k) {
      const Eigen::Index u = e + k - 3;
      const double c = kThird[static_cast<std::size_t>(k)];
      if (u >= 0 && u < unknown) {
        a(e, u) = c;
      } else {
        b.row(e) -= c * x[first + static_cast<std::size_t>(u + 1)].transpose();
      }
    }
  }
  const Eigen::MatrixXd solved = a.colPivHouseholderQr().solve(b);
  for (Eigen::Index u = 0; u < unknown; ++u) {
    x[first + 1 + static_cast<std::size_t>(u)] = solved.row(u).transpose();
  }
  return x;
}

/// Jerk within 0.2 s of the transition over all ordered pairs of styles, relative to the larger
/// steady one of the two.
struct Ratios {
  double mean = 0.0, worst = 0.0;
  double worst_bound = 0.0;  ///< the same of the smoothest motion with the same ends
};

Ratios ratios(const MotionModel& model, const Styles& styles, double beta) {
  const std::size_t n = styles.names.size();
  std::vector<double> steady(n);
  std::size_t zero = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const auto x = play(model, styles.parameters[i], styles.parameters[i], beta, zero);
    // as near to heel strike as the transition is, or over the cycle, whichever is more
    steady[i] = std::max(rms_jerk(x, 0, x.size()), rms_jerk(x, zero - 12, zero + 12));
  }
  Ratios r;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      if (i == j) continue;
      const auto& from = styles.parameters[i];
      const auto& to = styles.parameters[j];
      const auto x = play(model, from, to, beta, zero);
      const double reference = std::max(steady[i], steady[j]);
      const double jerk = rms_jerk(x, zero - 12, zero + 12) / reference;
      const double half = 0.5 * beta * kRate_hz;  // frames of βπ, at 1 rad per frame of ω/60
      const auto before = static_cast<std::size_t>(half * math::kTwoPi / from.frequency_rad_s);
      const auto after = static_cast<std::size_t>(half * math::kTwoPi / to.frequency_rad_s);
      const auto s = smoothest(x, zero - before - 1, zero + after + 1);
      r.mean += jerk / static_cast<double>(n * (n - 1));
      r.worst = std::max(r.worst, jerk);
      r.worst_bound = std::max(r.worst_bound, rms_jerk(s, zero - 12, zero + 12) / reference);
    }
  }
  return r;
}

void print(const char* what, double beta, const Ratios& r) {
  std::printf("%s beta %.1f: jerk ratio mean %.3f worst %.3f; worst of the smoothest %.3f\n", what,
              beta, r.mean, r.worst, r.worst_bound);
}

/// Sources without harmonics above `highest`.
void low_pass(MotionModel& model, int highest) {
  const auto length = static_cast<double>(model.sources.cols());
  Eigen::MatrixXd smooth = Eigen::MatrixXd::Zero(model.sources.rows(), model.sources.cols());
  for (int f = 1; f <= highest; ++f) {
    const Eigen::RowVectorXd angle =
        Eigen::RowVectorXd::LinSpaced(model.sources.cols(), 0.0, length - 1.0) * f * math::kTwoPi /
        length;
    for (const Eigen::RowVectorXd& basis :
         {Eigen::RowVectorXd(angle.array().cos()), Eigen::RowVectorXd(angle.array().sin())}) {
      smooth += 2.0 / length * (model.sources * basis.transpose()) * basis;
    }
  }
  model.sources = smooth;
}

/// Goal: 1.15 for every pair at β = 1/5. The set's cycles were resampled from 30 Hz by straight
/// lines; the kinks are in the sources and in the jerk of the steady styles. Without them (nothing
/// above the 8 Hz of the recordings in the slowest cycle, harmonic 13) the worst pair has 1.5, and
/// even the smoothest motion between the same ends has 1.14. A wider interval then helps.
TEST(BlendingJerk, EveryPairOfRecordedStyles) {
  if (testing::shared_folder().empty()) GTEST_SKIP() << "no shared folder";
  mocap::Trials set = testing::gait_set("B");
  // left hip and left shoulder of the Bandai skeleton rest near half a turn
  EXPECT_GT(align_rotation_branches(set), 10);
  MotionModel model = testing::tied_model(set, 5);
  const Styles styles = styles_of(model);
  ASSERT_EQ(styles.names.size(), 8u);
  const Ratios narrow = ratios(model, styles, 0.2), full = ratios(model, styles, 1.0);
  print("as recorded", 0.2, narrow);
  print("as recorded", 1.0, full);
  EXPECT_LT(narrow.worst, 1.15);
  EXPECT_LT(full.mean, 0.9);
  EXPECT_LT(full.worst, 1.0);
  low_pass(model, 13);
  const Ratios smooth = ratios(model, styles, 0.2), half = ratios(model, styles, 0.5);
  print("smooth", 0.2, smooth);
  print("smooth", 0.5, half);
  EXPECT_LT(smooth.worst, 1.75);
  EXPECT_GT(smooth.worst_bound, 1.1);
  EXPECT_LT(half.worst, 1.15);
}

TEST(BlendingJerk, WithoutAlignedBranchesItIsThreeTimesAsMuch) {
  if (testing::shared_folder().empty()) GTEST_SKIP() << "no shared folder";
  const MotionModel model = testing::tied_model(testing::gait_set("B"), 5);
  EXPECT_GT(ratios(model, styles_of(model), 0.2).worst, 2.5);
}

}  // namespace
}  // namespace mimesis::synthesizer
