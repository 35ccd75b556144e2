#include "nodes/crowd/certificate/certificate.h"

#include <algorithm>
#include <array>

#include "common/math/circle.h"
#include "nodes/crowd/certificate/rule_certificates.h"
#include "nodes/crowd/certificate/say.h"

namespace mimesis::crowd {
namespace {

std::array<const RuleCertificate*, 5> rules_of(const Certificate& c) {
  return {&c.frequency, &c.length, &c.phase, &c.tracking, &c.heading};
}

double periodic_range_m(const SpeedFunction& g) {
  constexpr int kSamples = 360;
  double least = 0.0, most = 0.0;
  for (int i = 0; i < kSamples; ++i) {
    const double phi = math::kTwoPi * i / kSamples;
    const double part = g.integral(phi) - g.mean() * phi;
    least = std::min(least, part);
    most = std::max(most, part);
  }
  return most - least;
}

}  // namespace

const char* to_string(Guarantee guarantee) {
  switch (guarantee) {
    case Guarantee::off:
      return "off";
    case Guarantee::none:
      return "none";
    case Guarantee::contracting:
      return "contracting";
  }
  return "";
}

bool Certificate::holds() const {
  return std::ranges::none_of(
      rules_of(*this), [](const RuleCertificate* r) { return r->guarantee == Guarantee::none; });
}

std::optional<double> Certificate::rate_1_s() const {
  std::optional<double> least;
  for (const RuleCertificate* r : rules_of(*this)) {
    if (r->guarantee == Guarantee::off) continue;
    if (r->guarantee != Guarantee::contracting) return std::nullopt;
    least = std::min(least.value_or(r->guaranteed_1_s), r->guaranteed_1_s);
  }
  return least;
}

Certificate certify(const Rules& rules, int n, const GaitRange& gait) {
  Certificate c;
  c.agents = n;
  certify_phase(rules.phase, n, gait.beat_gain_1_s, c);
  const bool phases_agree = c.phase.guarantee == Guarantee::contracting && gait.spread_rad_s == 0.0;
  c.frequency = certify_frequency(rules.frequency, n, gait);
  c.length = certify_length(rules.length, n, gait, phases_agree);
  const double stretch = rules.length.gain_1_m != 0.0 ? 1.0 + rules.length.limit : 1.0;
  c.heading = certify_heading(rules.heading, n, gait, stretch);
  const bool distances =
      c.frequency.guarantee != Guarantee::off || c.length.guarantee != Guarantee::off;
  if (distances && c.phase.guarantee != Guarantee::contracting) {
    c.residual_m = periodic_range_m(gait.gait);
    c.notes.push_back(say("distances oscillate by up to ", c.residual_m,
                          " m where phases differ, as g(phi) does: rule III takes that away"));
  }
  if (c.frequency.guarantee != Guarantee::off && c.phase.guarantee != Guarantee::off &&
      c.length.guarantee == Guarantee::off) {
    c.notes.push_back(
        say("I and III both set the phase: distances and phases agree together only "
            "where distances are whole cycles of ",
            gait.gait.cycle_m(), " m; rule II frees them"));
  }
  if (gait.spread_rad_s > 0.0 && c.phase.guarantee == Guarantee::contracting) {
    c.notes.push_back(say("eigenfrequencies differ by ", 2.0 * gait.spread_rad_s,
                          " rad/s: phases lock, apart by about ",
                          2.0 * gait.spread_rad_s / c.phase.expected_1_s, " rad"));
  }
  return c;
}

}  // namespace mimesis::crowd
