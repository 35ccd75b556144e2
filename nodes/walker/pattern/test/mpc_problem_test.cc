// The MPC's program against its definition: jerks rolled out, squares summed, places measured.
#include "nodes/walker/pattern/mpc_problem.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "nodes/walker/pattern/preview_control.h"

namespace mimesis::walker {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;

constexpr double kSample_s = kSampleTicks * kTick_s;

/// A program at some tick of a walk with turns, from a state and a plan that fit nothing.
class Case {
 public:
  Case(unsigned seed, int ticks, bool walk, bool yaw_free)
      : random_(seed), steps_(gait_, Steps::Change::at_once), mpc_(gait_, yaw_free, weights_) {
    steps_.reset({Footprint{kLeft, {5.0, 0.1}, 0.05}, Footprint{kRight, {5.02, -0.09}, 0.0}});
    steps_.decide(true, kLeft, true);
    for (int i = 0; i < ticks; ++i) {
      steps_.decide(walk || i < ticks / 2, kLeft, false);
      plan_steps();
      steps_.advance(1);
    }
    plan_steps();
    in_.com = {.p_W_m = steps_.middle_W_m() + some(0.05), .v_W = some(0.3), .a_W = some(0.5)};
    in_.yaw_rad = 0.1;
    in_.wish = {.velocity_m_s = {0.2, -0.05}, .yaw_rate_rad_s = 0.15, .landing = {}, .walk = true};
    for (std::size_t i = 0; i < 2; ++i) {
      in_.foot[i] = {steps_.landing(static_cast<int>(i)), 0.12, {}, some(0.2)};
    }
    if (seed % 2 == 1) in_.foot[seed % 4 / 2].p_W_m = steps_.stance().p_W_m + some(0.2);
    for (int k = 0; k < mpc_.samples(); ++k) {
      in_.zmp_plan_W_m.emplace_back(steps_.middle_W_m() + some(0.05));
    }
  }
  qp::Problem build() { return mpc_.build(in_, steps_); }
  VectorXd any_x() {
    VectorXd x(mpc_.variables());
    for (double& v : x) v = uniform_(random_);
    return x;
  }

  /// States at the samples, of the jerks in x.
  std::vector<ComState> rolled_out(const VectorXd& x) const {
    std::vector<ComState> out;
    ComState com = in_.com;
    for (int k = 0; k < mpc_.samples(); ++k) {
      out.push_back(com = advance(com, mpc_.jerk(x, k), k == 0 ? first_s() : kSample_s));
    }
    return out;
  }
  double first_s() const { return steps_.ticks_to_sample() * kTick_s; }
  Support support(int k) const {
    return steps_.support_after(steps_.ticks_to_sample() + k * kSampleTicks);
  }
  Vector2d foot_W_m(const VectorXd& x, int i) const {
    return i == 0 ? steps_.stance().p_W_m : mpc_.landing_W_m(x, i - 1);
  }
  /// Centre that the ZMP of a sample is compared with.
  Vector2d centre_W_m(const VectorXd& x, int k) const {
    const Support s = support(k);
    if (s.both) return steps_.middle_W_m();
    return 0.5 * (foot_W_m(x, s.i) + foot_W_m(x, s.j));
  }
  const Footprint& planned(int foot) const {
    return foot == 0 ? steps_.stance() : in_.foot[static_cast<std::size_t>(foot) - 1].plan;
  }
  std::vector<HalfPlane> hull() const {
    std::vector<HalfPlane> out;
    support_polygon(steps_.ground()[0], steps_.ground()[1], gait_.zmp_half_m, out);
    return out;
  }

  GaitSettings gait_;
  MpcWeights weights_;
  std::mt19937 random_;
  std::uniform_real_distribution<double> uniform_{-1.0, 1.0};
  Steps steps_;
  MpcProblem mpc_;
  MpcInput in_;

 private:
  Vector2d some(double most) { return most * Vector2d(uniform_(random_), uniform_(random_)); }
  void plan_steps() {
    const Footprint stance = steps_.stance();
    const double side = robot::sign(steps_.swing());
    const Vector2d step(0.15, side * 0.2);
    const Footprint one{steps_.swing(), stance.p_W_m + step, stance.yaw_rad + 0.05};
    steps_.plan(0, one);
    steps_.plan(1, {stance.side, one.p_W_m + Vector2d(0.15, -side * 0.2), one.yaw_rad + 0.04});
    steps_.plan(2, {steps_.swing(), one.p_W_m + Vector2d(0.3, 0.0), one.yaw_rad});
  }
};

/// Ticks of the start, of steps and of settling.
template <class Check>
void at_many_ticks(const Check& check) {
  unsigned seed = 0;
  for (const int ticks : {0, 45, 130, 161, 167, 200, 250, 278, 291, 310, 319, 320, 333, 480}) {
    for (const bool walk : {true, false}) {
      for (const bool yaw_free : {false, true}) {
        SCOPED_TRACE(::testing::Message() << ticks << " walk " << walk << " yaw " << yaw_free);
        Case c(seed++, ticks, walk, yaw_free);
        check(c, yaw_free);
      }
    }
  }
}

double sum_of_squares(const Case& c, const VectorXd& x, bool yaw_free) {
  const MpcWeights& w = c.weights_;
  double sum = 0.0;
  const std::vector<ComState> states = c.rolled_out(x);
  for (int k = 0; k < c.mpc_.samples(); ++k) {
    const ComState& s = states[static_cast<std::size_t>(k)];
    const Support support = c.support(k);
    Vector2d wished = Vector2d::Zero();  // while it stands on both or changes feet
    if (!support.both && support.i == support.j) {
      const double turned = (c.first_s() + k * kSample_s) * c.in_.wish.yaw_rate_rad_s;
      wished = Eigen::Rotation2Dd(c.in_.yaw_rad + turned) * c.in_.wish.velocity_m_s;
    }
    sum += w.velocity * (s.v_W - wished).squaredNorm() +
           w.zmp * (zmp(s, c.gait_.com_height_m) - c.centre_W_m(x, k)).squaredNorm() +
           w.jerk * c.mpc_.jerk(x, k).squaredNorm();
  }
  for (int i = 0; i < 2; ++i) {
    const MpcInput::Landing& foot = c.in_.foot[static_cast<std::size_t>(i)];
    const Vector2d landing = c.mpc_.landing_W_m(x, i);
    sum += w.foot * (landing - foot.plan.p_W_m).squaredNorm();
    sum += foot.p_W_m ? w.landing * (landing - *foot.p_W_m).squaredNorm()
                      : w.spacing * (landing - c.foot_W_m(x, i) - foot.step_W_m).squaredNorm();
    const double turned = foot.plan.yaw_rad + c.mpc_.yaw_increment_rad(x, i);
    if (yaw_free) sum += w.yaw * std::pow(turned - foot.wished_yaw_rad, 2);
  }
  return 0.5 * sum;
}

TEST(MpcProblem, CostIsTheSumOfItsSquares) {
  at_many_ticks([](Case& c, bool yaw_free) {
    const VectorXd x = c.any_x(), y = c.any_x();
    const qp::Problem p = c.build();
    const auto cost = [&](const VectorXd& v) { return 0.5 * v.dot(p.H * v) + p.g.dot(v); };
    const double truth = sum_of_squares(c, x, yaw_free) - sum_of_squares(c, y, yaw_free);
    EXPECT_NEAR(cost(x) - cost(y), truth, 1e-9 * (sum_of_squares(c, x, yaw_free) + 1.0));
    EXPECT_LT((p.H - p.H.transpose()).norm(), 1e-9 * p.H.norm());
  });
}

/// Landings may go this far from their plan in one tick: 1.2 m/s² by 2 t_left, and nowhere when
/// 0.1 s is left.
double freedom_m(const Case& c) {
  const double left = c.steps_.free_time_s();
  return left <= 0.1 ? 0.0 : 1.2 * 2.0 * left * kTick_s;
}

TEST(MpcProblem, LandingsAreWithinTheStepPolygonAndNearTheirPlan) {
  at_many_ticks([](Case& c, bool yaw_free) {
    VectorXd x = c.any_x();
    const qp::Problem p = c.build();
    const Footsteps footsteps(c.gait_);
    const bool frozen = freedom_m(c) == 0.0;
    int row = 0;
    for (int i = frozen ? 1 : 0; i < 2; ++i) {
      const Side swing = i == 0 ? c.steps_.swing() : robot::other(c.steps_.swing());
      if (yaw_free) x.tail(2).setZero();
      for (const HalfPlane& side : footsteps.limits(swing)) {
        const auto beyond = [&](double yaw_rad, const Vector2d& step_W) {
          return side.normal.dot(Eigen::Rotation2Dd(-yaw_rad) * step_W) - side.offset;
        };
        const double yaw = c.planned(i).yaw_rad;
        EXPECT_NEAR(p.A.row(row).dot(x) - p.upper(row),
                    beyond(yaw, c.foot_W_m(x, i + 1) - c.foot_W_m(x, i)), 1e-12);
        if (yaw_free) {  // the polygon turns with its foot, about the planned step
          const Vector2d step = c.planned(i + 1).p_W_m - c.planned(i).p_W_m;
          const double slope =
              i == 0 ? 0.0 : (beyond(yaw + 1e-6, step) - beyond(yaw - 1e-6, step)) / 2e-6;
          EXPECT_NEAR(p.A(row, x.size() - 2), slope, 1e-8);
        }
        ++row;
      }
    }
    const Eigen::Index at = c.mpc_.samples(), axis = at + 2;
    for (int k = 0; k < 2; ++k) {
      const double plan = c.in_.foot[0].plan.p_W_m(k) - c.steps_.stance().p_W_m(k);
      EXPECT_NEAR(p.x_upper(k * axis + at), plan + freedom_m(c), 1e-12);
      EXPECT_NEAR(p.x_lower(k * axis + at), plan - freedom_m(c), 1e-12);
    }
    for (int i = frozen ? 1 : 0; yaw_free && i < 2; ++i, ++row) {
      const double between = c.planned(i + 1).yaw_rad - c.planned(i).yaw_rad;
      EXPECT_EQ(p.A(row, 2 * axis + i), 1.0);
      EXPECT_EQ(p.A(row, 2 * axis), i == 0 ? 1.0 : -1.0);
      EXPECT_NEAR(p.upper(row) + between, c.gait_.most_foot_yaw_rad, 1e-12);
      EXPECT_NEAR(p.lower(row) + between, -c.gait_.most_foot_yaw_rad, 1e-12);
    }
  });
}

int rows_of_landings(const Case& c, bool yaw_free) {
  return (freedom_m(c) == 0.0 ? 1 : 2) * (kStepSides + (yaw_free ? 1 : 0));
}

TEST(MpcProblem, ZmpIsInTheSolesThatStand) {
  at_many_ticks([](Case& c, bool yaw_free) {
    VectorXd x = c.any_x();
    if (yaw_free) x.tail(2).setZero();
    const qp::Problem p = c.build();
    const std::vector<ComState> states = c.rolled_out(x);
    int row = rows_of_landings(c, yaw_free);
    for (int k = 0; k < c.mpc_.samples(); ++k) {
      const Vector2d z = zmp(states[static_cast<std::size_t>(k)], c.gait_.com_height_m);
      const Support s = c.support(k);
      if (s.both) {
        for (const HalfPlane& side : c.hull()) {
          EXPECT_NEAR(p.A.row(row).dot(x) - p.upper(row), side.normal.dot(z) - side.offset, 1e-10);
          ++row;
        }
        continue;
      }
      const double yaw = c.planned(s.j).yaw_rad;
      const Vector2d off = z - c.centre_W_m(x, k);
      const Vector2d planned = c.in_.zmp_plan_W_m[static_cast<std::size_t>(k)] -
                               0.5 * (c.planned(s.i).p_W_m + c.planned(s.j).p_W_m);
      for (int side = 0; side < 2; ++side, ++row) {
        const auto seen = [&](double yaw_rad, const Vector2d& d) {
          return Vector2d(Eigen::Rotation2Dd(-yaw_rad) * d)(side);
        };
        EXPECT_NEAR(p.A.row(row).dot(x) - p.upper(row), seen(yaw, off) - c.gait_.zmp_half_m(side),
                    1e-10);
        EXPECT_NEAR(p.A.row(row).dot(x) - p.lower(row), seen(yaw, off) + c.gait_.zmp_half_m(side),
                    1e-10);
        if (!yaw_free || s.j == 0) continue;
        EXPECT_NEAR(p.A(row, x.size() - 3 + s.j),
                    (seen(yaw + 1e-6, planned) - seen(yaw - 1e-6, planned)) / 2e-6, 1e-8);
      }
    }
  });
}

/// The capture point a sample after the horizon, if the ZMP goes evenly to z' till then.
Vector2d capture_later(const Case& c, const ComState& last, const Vector2d& next_zmp) {
  const double w = std::sqrt(kGravity_m_s2 / c.gait_.com_height_m);
  const Vector2d z = zmp(last, c.gait_.com_height_m);
  constexpr int kParts = 2000;
  Vector2d xi = last.p_W_m + last.v_W / w;
  for (int i = 0; i < kParts; ++i) {  // ξ' = ω (ξ − z), exact for a ZMP that rests in each part
    const Vector2d here = z + (i + 0.5) / kParts * (next_zmp - z);
    xi = here + std::exp(w * kSample_s / kParts) * (xi - here);
  }
  return xi;
}

/// Rows say: pushed back from the edge, the capture point is still where it can be caught.
TEST(MpcProblem, AtTheEndTheCapturePointCanBeHeldASampleLonger) {
  int held = 0;
  at_many_ticks([&held](Case& c, bool yaw_free) {
    const Support s = c.support(c.mpc_.samples() - 1);
    if (!s.both && s.i == s.j) return;
    VectorXd x = c.any_x();
    if (yaw_free) x.tail(2).setZero();
    const qp::Problem p = c.build();
    const ComState last = c.rolled_out(x).back();
    std::vector<HalfPlane> edges;
    double kept = 1.0;
    const Vector2d centre = s.both ? Vector2d::Zero() : c.centre_W_m(x, c.mpc_.samples() - 1);
    if (s.both) {
      edges = c.hull();
    } else {
      kept = 0.98;
      for (int axis = 0; axis < 2; ++axis) {
        const Vector2d n = Eigen::Rotation2Dd(c.planned(s.j).yaw_rad).toRotationMatrix().col(axis);
        edges.push_back({-n, c.gait_.zmp_half_m(axis)});
        edges.push_back({n, c.gait_.zmp_half_m(axis)});
      }
    }
    const double wT = kSample_s * std::sqrt(kGravity_m_s2 / c.gait_.com_height_m);
    const double scale = wT / (std::exp(wT) - 1.0);  // scale of the rows
    int row = static_cast<int>(p.A.rows()) - static_cast<int>(edges.size());
    for (const HalfPlane& side : edges) {
      const Vector2d edge = centre + side.offset * side.normal;
      const double beyond =
          side.normal.dot(capture_later(c, last, edge) - centre) - kept * side.offset;
      const double said = p.A.row(row).dot(x) - p.upper(row);
      EXPECT_NEAR(said, scale * beyond, 1e-7);
      ++row;
    }
    ++held;
  });
  EXPECT_GT(held, 10);
}

}  // namespace
}  // namespace mimesis::walker
