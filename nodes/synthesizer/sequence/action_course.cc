#include "nodes/synthesizer/sequence/action_course.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/math/circle.h"

namespace mimesis::synthesizer {
namespace {

double linear(const motion::MotionModel& model, Eigen::Index k, double phase_rad) {
  const Eigen::Index n = model.sources.cols();
  double at = phase_rad / math::kTwoPi * static_cast<double>(n);
  at -= std::floor(at / static_cast<double>(n)) * static_cast<double>(n);
  const Eigen::Index i = std::min(static_cast<Eigen::Index>(at), n - 1);
  const double u = at - static_cast<double>(i);
  return (1.0 - u) * model.sources(k, i) + u * model.sources(k, (i + 1) % n);
}

double cubic(const motion::MotionModel& model, Eigen::Index k, double phase_rad) {
  const Eigen::Index n = model.sources.cols();
  const double at = math::wrap_two_pi(phase_rad) / math::kTwoPi * static_cast<double>(n);
  const Eigen::Index i = std::min(static_cast<Eigen::Index>(at), n - 1);
  const double u = at - static_cast<double>(i);
  const auto s = [&](Eigen::Index j) { return model.sources(k, (i + j + n) % n); };
  const double before = s(-1), p = s(0), q = s(1), after = s(2);
  return p + 0.5 * u *
                 (q - before +
                  u * (2.0 * before - 5.0 * p + 4.0 * q - after +
                       u * (3.0 * (p - q) + after - before)));
}

}  // namespace

void mixture_at(const motion::MotionModel& model, const MotionParameters& p, double phase_rad,
                Between between, Eigen::Ref<Eigen::VectorXd> rows) {
  rows = p.mean_rad;
  for (Eigen::Index k = 0; k < p.weight_rad.cols(); ++k) {
    for (Eigen::Index r = 0; r < rows.size(); ++r) {
      if (p.weight_rad(r, k) == 0.0) continue;
      const double phase = phase_rad - p.delay_rad(r, k);
      const double source = k < model.fixed              ? std::cos(0.5 * phase)
                            : between == Between::linear ? linear(model, k, phase)
                                                         : cubic(model, k, phase);
      rows[r] += p.weight_rad(r, k) * source;
    }
  }
}

Eigen::MatrixXd mixture_rows(const motion::MotionModel& model, const MotionParameters& p) {
  Eigen::MatrixXd rows(p.mean_rad.size(), model.sources.cols());
  for (Eigen::Index t = 0; t < rows.cols(); ++t) {
    const double share = static_cast<double>(t) / static_cast<double>(rows.cols());
    mixture_at(model, p, math::kTwoPi * share, Between::cubic, rows.col(t));
  }
  return rows;
}

ActionCourse::ActionCourse(double beta, double settle_s, double dt_s)
    : beta_(beta), settling_(1.0 - std::exp(-dt_s / settle_s)) {}

void ActionCourse::restart() {
  current_ = wanted_;
  has_previous_ = false;
}

bool ActionCourse::near_end(double phase_rad) const {
  return phase_rad > math::kTwoPi - beta_ * std::numbers::pi;
}

void ActionCourse::set_next(MotionParameters next) {
  next_ = std::move(next);
  has_next_ = true;
}

void ActionCourse::cross() {
  previous_ = current_;
  has_previous_ = has_next_;
  current_ = has_next_ ? next_ : wanted_;
  has_next_ = false;
}

void ActionCourse::settle() {
  current_.mean_rad += settling_ * (wanted_.mean_rad - current_.mean_rad);
  current_.weight_rad += settling_ * (wanted_.weight_rad - current_.weight_rad);
  current_.frequency_rad_s += settling_ * (wanted_.frequency_rad_s - current_.frequency_rad_s);
}

const MotionParameters& ActionCourse::at(double phase_rad) {
  if (has_next_) {
    transition(current_, next_, 1, phase_rad - math::kTwoPi, beta_, mixed_);
  } else if (has_previous_ && phase_rad < beta_ * std::numbers::pi) {
    transition(previous_, current_, 1, phase_rad, beta_, mixed_);
  } else {
    has_previous_ = false;
    mixed_ = current_;
  }
  return mixed_;
}

}  // namespace mimesis::synthesizer
