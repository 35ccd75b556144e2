#include "nodes/cognition/ladder.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"

namespace mimesis::cognition {
namespace {

struct Ends {
  Layer source, target;
};

constexpr std::array<Ends, kConnections> kEnds = {{{Layer::sts_grip, Layer::pf},
                                                   {Layer::sts_transport, Layer::pf},
                                                   {Layer::sts_grip, Layer::f5_grip},
                                                   {Layer::sts_transport, Layer::f5_transport},
                                                   {Layer::pf, Layer::f5_grip},
                                                   {Layer::pf, Layer::f5_transport},
                                                   {Layer::f5_grip, Layer::pf},
                                                   {Layer::f5_transport, Layer::pf},
                                                   {Layer::pf, Layer::pfc},
                                                   {Layer::pfc, Layer::pf},
                                                   {Layer::color, Layer::pfc},
                                                   {Layer::pfc, Layer::color}}};

constexpr Ends ends(Connection c) { return kEnds[static_cast<std::size_t>(c)]; }

double gain(const LinkGains& g, Connection c) {
  switch (c) {
    case Connection::sts_grip_pf:
    case Connection::sts_transport_pf:
      return g.sts_to_pf;
    case Connection::sts_grip_f5:
    case Connection::sts_transport_f5:
      return g.sts_to_f5;
    case Connection::pf_f5_grip:
    case Connection::pf_f5_transport:
      return g.pf_to_f5;
    case Connection::f5_grip_pf:
    case Connection::f5_transport_pf:
      return g.f5_to_pf;
    case Connection::pf_pfc:
      return g.pf_to_pfc;
    case Connection::pfc_pf:
      return g.pfc_to_pf;
    case Connection::color_pfc:
    case Connection::pfc_color:
      return g.color;
  }
  return 0.0;
}

/// Site of a symbol in its layer, or -1 if unknown.
template <class Symbol>
int site(Symbol s) {
  return static_cast<int>(s) - 1;
}

}  // namespace

Stimulus task_stimulus(const TaskInput& task) {
  Stimulus s;
  s.at(Layer::pf, kPgAt) = s.at(Layer::pf, kFgBt) = task.pf;
  s.at(Layer::pfc, 0) = s.at(Layer::pfc, 1) = task.pfc;
  return s;
}

void add_vision(const VisionInput& vision, const Demonstration& shown, Stimulus& to) {
  const auto add = [&to](Layer layer, int at, double amplitude) {
    if (at >= 0) to.at(layer, at) += amplitude;
  };
  add(Layer::sts_grip, site(shown.grip), vision.sts * shown.grip_confidence);
  add(Layer::sts_transport, site(shown.transport), vision.sts * shown.transport_confidence);
  add(Layer::pfc, site(shown.goal), vision.pfc * shown.goal_confidence);
  add(Layer::color, site(shown.color), vision.color * shown.color_confidence);
}

void add_plan(double amplitude, const Demonstration& planned, Stimulus& to) {
  if (const int grip = site(planned.grip); grip >= 0) to.at(Layer::f5_grip, grip) += amplitude;
  if (const int transport = site(planned.transport); transport >= 0) {
    to.at(Layer::f5_transport, transport) += amplitude;
  }
}

template <class Real>
Ladder<Real>::Ladder(const LadderParams& params) : params_(params) {
  const double dx = params.field.dx, length = params.field.neurons * dx;
  for (const Layer layer : kAllLayers) {
    FieldParams p = params.field;
    if (layer == Layer::sts_grip || layer == Layer::sts_transport) p.tau_s = params.sts_tau_s;
    if (layer == Layer::pf) p.tau_s = params.pf_tau_s;
    if (layer == Layer::pfc) p.tau_s = params.pfc_tau_s;
    fields_.emplace_back(p, params.dt_s);
    for (int s = 0; s < sites(layer); ++s) {
      auto& bump = bump_[index(layer)][static_cast<std::size_t>(s)];
      for (int i = 0; i < p.neurons; ++i) {
        const double d = (i * dx - site_fraction(layer, s) * length) / params.vision.width;
        bump.push_back(static_cast<Real>(std::exp(-0.5 * d * d)));
      }
    }
  }
  local_above_rate_ = static_cast<Real>(fields_[0].f2(params.learning.local_above));
  settle_patterns();
  for (std::size_t c = 0; c < kConnections; ++c) {
    const auto n = static_cast<std::size_t>(params.field.neurons);
    links_.emplace_back(n, n, dx);
    double m = 0.0;  // ∫ f₂² of the source's pattern: input of the target per unit of η
    for (const Real r : pattern(kEnds[c].source, 0)) m += static_cast<double>(r * r) * dx;
    eta_[c] = gain(params.gain, static_cast<Connection>(c)) / m;
  }
  install_innate();
}

// Ignites each site alone and lets it relax: ū of eq. 2.4 is the pattern that a field holds by
// itself.
template <class Real>
void Ladder<Real>::settle_patterns() {
  constexpr double kPulse = 6.0, kPulse_s = 0.2, kRelax_s = 1.0;
  for (const Layer layer : kAllLayers) {
    NeuralField<Real> field(params_.field, params_.dt_s);
    for (int s = 0; s < sites(layer); ++s) {
      const auto& bump = bump_[index(layer)][static_cast<std::size_t>(s)];
      field.reset();
      for (double t = 0.0; t < kPulse_s + kRelax_s; t += params_.dt_s) {
        for (std::size_t i = 0; t < kPulse_s && i < bump.size(); ++i) {
          field.input()[i] = static_cast<Real>(kPulse) * bump[i];
        }
        field.step();
      }
      if (!(std::ranges::max(field.activity()) > 0)) {
        throw ConfigError(
            "cognition.field: excitation, inhibition and resting_level allow no "
            "self-sustained pattern; a field could not keep a decision");
      }
      auto& kept = patterns_[index(layer)][static_cast<std::size_t>(s)];
      kept.assign(field.rate().begin(), field.rate().end());
      for (Real& r : kept) r = r < local_above_rate_ ? Real(0) : r;
    }
  }
}

// The robot knows its primitives and their combinations; which goal they reach it must learn.
template <class Real>
void Ladder<Real>::install_innate() {
  struct Combination {
    int pf, grip, transport;
  };
  constexpr std::array<Combination, 4> kCombinations = {
      {{kPgAt, 0, 0}, {kFgBt, 1, 1}, {kFgAt, 1, 0}, {kPgBt, 0, 1}}};
  for (const auto& c : kCombinations) {
    install(Connection::sts_grip_pf, c.grip, c.pf);
    install(Connection::sts_transport_pf, c.transport, c.pf);
    install(Connection::pf_f5_grip, c.pf, c.grip);
    install(Connection::pf_f5_transport, c.pf, c.transport);
    install(Connection::f5_grip_pf, c.grip, c.pf);
    install(Connection::f5_transport_pf, c.transport, c.pf);
  }
  for (int s = 0; s < 2; ++s) {
    install(Connection::sts_grip_f5, s, s);
    install(Connection::sts_transport_f5, s, s);
  }
}

template <class Real>
void Ladder<Real>::install(Connection c, int source_site, int target_site, double factor) {
  links_[static_cast<std::size_t>(c)].install(
      pattern(ends(c).target, target_site), pattern(ends(c).source, source_site),
      static_cast<Real>(factor * eta(c)), local_above_rate_);
}

template <class Real>
void Ladder<Real>::step(const Stimulus& stimulus, bool reward) {
  for (std::size_t c = 0; c < kConnections; ++c) {
    links_[c].transmit(fields_[index(kEnds[c].source)].rate(),
                       fields_[index(kEnds[c].target)].input());
  }
  for (const Layer layer : kAllLayers) {
    Real* __restrict input = fields_[index(layer)].input().data();
    for (int s = 0; s < sites(layer); ++s) {
      const auto amplitude = static_cast<Real>(stimulus.at(layer, s));
      if (amplitude == 0) continue;
      const auto& bump = bump_[index(layer)][static_cast<std::size_t>(s)];
      for (std::size_t i = 0; i < bump.size(); ++i) input[i] += amplitude * bump[i];
    }
  }
  if (reward) {
    const auto fraction = static_cast<Real>(params_.dt_s / params_.learning.tau_s);
    learn(Connection::pf_pfc, fraction);
    learn(Connection::pfc_pf, fraction);
    learn(Connection::color_pfc, fraction);
    learn(Connection::pfc_color, fraction);
  }
  for (auto& field : fields_) field.step();
}

template <class Real>
void Ladder<Real>::learn(Connection c, Real fraction) {
  links_[static_cast<std::size_t>(c)].learn(field(ends(c).target).rate(),
                                            field(ends(c).source).rate(), static_cast<Real>(eta(c)),
                                            fraction, local_above_rate_);
}

template <class Real>
void Ladder<Real>::reset() {
  for (auto& field : fields_) field.reset();
}

template class Ladder<float>;
template class Ladder<double>;

}  // namespace mimesis::cognition
