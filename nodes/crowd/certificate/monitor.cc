#include "nodes/crowd/certificate/monitor.h"

#include <utility>

namespace mimesis::crowd {
namespace {

// Bands in which errors decay exponentially: linear above rounding and single precision states.
constexpr double kLeastR = 1e-6, kMostR = 3e-2;
constexpr double kLeast_rad = 1e-5, kMost_rad = 0.1;
constexpr double kLeast_m = 1e-3, kMost_m = 1.0;
constexpr double kLeastTurn = 1e-3, kMostTurn = 1.5;

RuleReport beside(const RuleCertificate& c, const RateFit& fit) {
  return {c.guarantee, c.guaranteed_1_s, c.expected_1_s, fit.rate_1_s()};
}

bool same_rates(const RuleCertificate& a, const RuleCertificate& b) {
  return a.guaranteed_1_s == b.guaranteed_1_s && a.expected_1_s == b.expected_1_s;
}

}  // namespace

Monitor::Monitor()
    : phase_(kLeastR, kMostR),
      tracking_(kLeast_rad, kMost_rad),
      spacing_(kLeast_m, kMost_m),
      heading_(kLeast_rad, kMost_rad),
      turns_(kLeastTurn, kMostTurn),
      tracks_(kLeastTurn, kMostTurn) {}

void Monitor::certify(Certificate certificate) {
  if (!same_rates(certificate.heading, certificate_.heading)) {
    turns_.restart();
    by_turns_ = false;
  }
  if (!same_rates(certificate.tracking, certificate_.tracking)) {
    tracks_.restart();
    by_tracks_ = false;
  }
  certificate_ = std::move(certificate);
  valid_ = true;
  for (RateFit* fit : {&phase_, &tracking_, &spacing_, &heading_}) fit->restart();
}

void Monitor::step(double t_s, const GroupErrors& errors) {
  phase_.add(t_s, errors.dispersion);
  tracking_.add(t_s, errors.tracking_rad);
  spacing_.add(t_s, errors.spacing_m);
  heading_.add(t_s, errors.heading_rad);
}

void Monitor::turn(std::uint64_t agent, double t_s, double error) {
  by_turns_ = true;
  turns_.add(agent, t_s, error);
}

void Monitor::track(std::uint64_t agent, double t_s, double error_rad) {
  by_tracks_ = true;
  tracks_.add(agent, t_s, error_rad);
}

MonitorReport Monitor::report() const {
  MonitorReport r;
  r.valid = valid_;
  r.agents = certificate_.agents;
  r.phase = beside(certificate_.phase, phase_);
  r.tracking = beside(certificate_.tracking, tracking_);
  const bool by_length = certificate_.length.guarantee != Guarantee::off;
  r.spacing = beside(by_length ? certificate_.length : certificate_.frequency, spacing_);
  r.heading = beside(certificate_.heading, heading_);
  if (by_tracks_) r.tracking.measured_1_s = tracks_.rate_1_s();
  if (by_turns_) r.heading.measured_1_s = turns_.rate_1_s();
  return r;
}

}  // namespace mimesis::crowd
