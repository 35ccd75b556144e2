#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "nodes/crowd/certificate/certificate.h"
#include "nodes/crowd/rules/spacing.h"
#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {
namespace {

constexpr double kPi = std::numbers::pi;

/// √(xᵀLx/2) of where agents begin, or the most that agents within `error` of each other have.
double begin_of(const RuleCertificate& c, const LengthRule& rule, int n, double error,
                std::span<const double> ahead) {
  const double most = std::sqrt(c.extremes.most * n / 8.0) * error;
  if (static_cast<int>(ahead.size()) != n) return most;
  const std::vector<double> nowhere(ahead.size(), 0.0);
  std::vector<double> summed(ahead.size());
  spacing_errors(coupling(rule.graph, n), ahead, nowhere, summed);
  return std::min(most, std::sqrt(0.5 * std::max(0.0, std::inner_product(ahead.begin(), ahead.end(),
                                                                         summed.begin(), 0.0))));
}

/// Longest way along the path [m] until x = z − d, that begins with max − min = `error` and is
/// moved by `shift` on the way, has ‖x‖ √2 <= tolerance, with dx/ds = −clamp(m L x, ±limit): speeds
/// agree, s is the way walked.
double way_m(const RuleCertificate& c, const LengthRule& rule, int n, double error, double shift,
             std::span<const double> ahead, double tolerance) {
  const double m = rule.gain_1_m, limit = rule.limit;
  if (rule.graph.topology == Topology::all_to_all) {
    // max − min shrinks by min(m N (max − min), limit) per way at least.
    const double apart = error + shift;
    const double linear = std::min(apart, limit / (m * n));
    return (apart - linear) / limit + std::log(std::max(1.0, linear / tolerance)) / (m * n);
  }
  // V = xᵀLx/2, √V a norm, so at most that of the start and that of the shift. With e = L x,
  // dV/ds = −Σ |eᵢ| min(m |eᵢ|, limit) <= −‖e‖ min(m ‖e‖, limit): where somebody is clamped,
  // E = √(Σ eᵢ²) of those who are is limit/m or more, and E limit + m r² >= limit √(E² + r²) with r
  // that of the others. As ‖e‖² >= 2 λ⁺ V, √V falls by limit √(λ⁺/2) per way at least, and once
  // √(2 λ⁺ V) <= limit/m as exp(−m λ⁺ s). Then ‖x‖ <= √(2 V/λ⁺).
  const double begin =
      begin_of(c, rule, n, error, ahead) + std::sqrt(c.extremes.most * n / 8.0) * shift;
  const double linear = std::min(begin, limit / m / std::sqrt(2.0 * c.extremes.least));
  const double end = tolerance * 0.5 * std::sqrt(c.extremes.least);
  return (begin - linear) / (limit * std::sqrt(0.5 * c.extremes.least)) +
         std::log(std::max(1.0, linear / end)) / (m * c.extremes.least);
}

}  // namespace

std::optional<double> formation_time_s(const Certificate& certificate, const Rules& rules,
                                       const GaitRange& gait, double error_m, double lane_m,
                                       double tolerance_m, std::span<const double> ahead_m) {
  const bool certified = certificate.length.guarantee == Guarantee::contracting &&
                         certificate.phase.guarantee == Guarantee::contracting &&
                         certificate.frequency.guarantee == Guarantee::off;
  const HeadingKind kind = rules.heading.kind;
  const bool lanes = kind == HeadingKind::lane && !rules.heading.avoid;
  if (!certified || !(tolerance_m > 0.0) || gait.spread_rad_s != 0.0 ||
      (!lanes && kind != HeadingKind::keep) || (kind == HeadingKind::keep && lane_m != 0.0)) {
    return std::nullopt;
  }
  const SpeedFunction& g = gait.gait;
  const double stretch = 1.0 + rules.length.limit;  // of the longest steps
  // First phases, until what they are off moves nobody by a quarter of the tolerance; on the way
  // two agents part by one longest cycle at most.
  const double rate =
      certificate.tracking.guarantee == Guarantee::contracting
          ? std::min(certificate.tracking.guaranteed_1_s, certificate.phase.guaranteed_1_s)
          : certificate.phase.guaranteed_1_s;
  const double in_phase_rad = 0.25 * tolerance_m / (stretch * g.most());
  const double phases_s =
      std::log(2.0 * kPi * std::sqrt(static_cast<double>(certificate.agents)) / in_phase_rad) /
      rate;
  double shift_m = stretch * 2.0 * kPi * g.most();
  double lanes_s = 0.0;
  if (lanes) {
    // A way at the angle ψ loses 1 − cos ψ: ∫ tan(ψ/2) dξ to the lane, and while turning from ±π/2
    // (⟨g⟩/m_ψ) ln 2.
    const double slope = std::atan(lane_m / rules.heading.ahead_m);
    shift_m +=
        std::tan(0.5 * slope) * lane_m + stretch * g.mean() / rules.heading.gain * std::log(2.0);
    const double off_m = std::max(lane_m, g.mean() / rules.heading.gain);
    lanes_s =
        std::log(std::max(1.0, 2.0 * kPi * off_m / tolerance_m)) / certificate.heading.expected_1_s;
  }
  const double way = way_m(certificate.length, rules.length, certificate.agents, error_m, shift_m,
                           ahead_m, 0.5 * tolerance_m) +
                     2.0 * kPi * g.mean();  // a cycle may begin at its slow end
  return std::max(phases_s, lanes_s) + way / (gait.eigenfrequency_rad_s * g.mean());
}

}  // namespace mimesis::crowd
