#include "nodes/cognition/field_network.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "common/error.h"

namespace mimesis::cognition {
namespace {

std::string at(const char* list, std::size_t i) { return fmt::format("{}.{}", list, i); }

bool flat(const FieldSpec& f) { return f.params.rows > 1; }

}  // namespace

void add_input(const NetworkSpec& a, std::string_view name, std::size_t field, int site,
               double share, Stimulus& to) {
  const FieldSpec& spec = a.fields[field];
  for (const InputSpec& input : a.inputs) {
    if (input.name != name || input.into != spec.name) continue;
    for (int s = 0; s < static_cast<int>(spec.sites.size()); ++s) {
      const bool acts =
          input.sites.empty() ||
          std::ranges::count(input.sites, spec.sites[static_cast<std::size_t>(s)]) > 0;
      if (acts && (site < 0 || site == s)) to.at(field, s) += input.gain * share;
    }
  }
}

template <class Real>
FieldNetwork<Real>::FieldNetwork(NetworkSpec spec) : spec_(std::move(spec)) {
  if (spec_.fields.empty()) spec_.fail("fields", "there is none");
  for (std::size_t i = 0; i < spec_.fields.size(); ++i) add_field(i);
  for (std::size_t i = 0; i < spec_.links.size(); ++i) add_link(i);
  for (std::size_t i = 0; i < spec_.inputs.size(); ++i) check_input(i);
  for (std::size_t i = 0; i < spec_.babbling.size(); ++i) babble(i);
  check_rest();
}

template <class Real>
void FieldNetwork<Real>::add_field(std::size_t i) {
  const FieldSpec& spec = spec_.fields[i];
  const FieldParams& p = spec.params;
  const std::string path = at("fields", i);
  if (spec.name.empty()) spec_.fail(path, "it has no name");
  if (spec_.field_index(spec.name) < i) {
    spec_.fail(path, "'" + spec.name + "' is the name of another field");
  }
  const std::size_t places = spec.sites.size() * (flat(spec) ? 2 : 1);
  if (spec.at.size() != places && (flat(spec) || !spec.at.empty())) {
    spec_.fail(path + ".at", fmt::format("has {} numbers, expected {} for {} sites", spec.at.size(),
                                         places, spec.sites.size()));
  }
  try {
    fields_.emplace_back(p, spec_.dt_s);
  } catch (const ConfigError& e) {
    spec_.fail(path, spec.name + ": " + e.what());
  }
  bumps_.emplace_back();
  patterns_.emplace_back();
  for (std::size_t s = 0; s < spec.sites.size(); ++s) {
    const SitePlace place = site_place(spec, static_cast<int>(s));
    if (place.x < 0.0 || place.x >= p.neurons * p.dx || place.y < 0.0 || place.y >= p.rows * p.dx) {
      spec_.fail(path + ".at", spec.sites[s] + " is outside of the field");
    }
    const double width = spec_.input_width;
    std::vector<Real> bump;
    for (int y = 0; y < p.rows; ++y) {
      const double e = (y * p.dx - place.y) / width;
      const double across = flat(spec) ? std::exp(-0.5 * e * e) : 1.0;
      for (int x = 0; x < p.neurons; ++x) {
        const double d = std::abs(x * p.dx - place.x) / width;
        bump.push_back(static_cast<Real>(std::exp(-0.5 * d * d) * across));
      }
    }
    bumps_[i].push_back(std::move(bump));
    settle_pattern(i, s);
  }
}

// Ignites the site alone and lets it relax: ū of eq. 2.4 is the pattern that a field holds by
// itself. It does not depend on τ, so that a τ of twenty steps serves all. A transient field holds
// none: its pattern is that of its highest activity.
template <class Real>
void FieldNetwork<Real>::settle_pattern(std::size_t field, std::size_t site) {
  constexpr int kPulse = 200, kEnd = 1200;
  constexpr Real kAmplitude = 6;
  const FieldSpec& spec = spec_.fields[field];
  const bool transient = spec.params.decay > 0.0;
  FieldParams p = spec.params;
  const double scale = 20.0 * spec_.dt_s / p.tau_s;
  p.tau_s *= scale;
  p.decay_tau_s *= scale;
  NeuralField<Real> alone(p, spec_.dt_s);
  const auto& bump = bumps_[field][site];
  std::vector<Real> kept(bump.size());
  Real highest = 0;
  for (int t = 0; t < kEnd; ++t) {
    for (std::size_t i = 0; t < kPulse && i < bump.size(); ++i) {
      alone.input()[i] = kAmplitude * bump[i];
    }
    alone.step();
    const Real top = std::ranges::max(alone.activity());
    if (transient ? top <= highest : t + 1 < kEnd) continue;
    highest = std::max(top, highest);
    kept.assign(alone.rate().begin(), alone.rate().end());
  }
  const bool held = std::ranges::max(alone.activity()) > 0;
  if (transient && highest > 0 && held) {
    spec_.fail(at("fields", field), spec.name + ": its activity does not end, expected more decay");
  }
  if (!(transient ? highest > 0 : held)) {
    spec_.fail(at("fields", field),
               spec.name + ": excitation, inhibition and resting_level allow no " +
                   (transient ? "answer to an input"
                              : "self-sustained pattern; it could not keep a decision"));
  }
  for (Real& r : kept) r = r < above(field) ? Real(0) : r;
  patterns_[field].push_back(std::move(kept));
}

template <class Real>
std::size_t FieldNetwork<Real>::known_field(const std::string& path,
                                            const std::string& name) const {
  const std::size_t i = spec_.field_index(name);
  if (i < spec_.fields.size()) return i;
  std::vector<std::string> names;
  for (const FieldSpec& f : spec_.fields) names.push_back(f.name);
  spec_.fail(path, fmt::format("'{}' is no field; there are {}", name, fmt::join(names, ", ")));
}

template <class Real>
void FieldNetwork<Real>::add_link(std::size_t i) {
  const LinkSpec& spec = spec_.links[i];
  const std::string path = at("links", i);
  const std::size_t source = known_field(path + ".from", spec.from);
  const std::size_t target = known_field(path + ".to", spec.to);
  if (spec_.link_index(spec.name()) < i) {
    spec_.fail(path, "there is another link " + spec.name());
  }
  const Learns learns = spec.learns == "success"    ? Learns::success
                        : spec.learns == "babbling" ? Learns::babbling
                        : spec.learns == "always"   ? Learns::always
                                                    : Learns::never;
  if (spec.form != "dense" && learns != Learns::never) {
    spec_.fail(path + ".learns", "a link of form " + spec.form + " cannot learn");
  }
  const auto& from = fields_[source];
  const double dx = from.params().dx, area = flat(spec_.fields[source]) ? dx * dx : dx;
  const std::size_t targets = fields_[target].rate().size(), sources = from.rate().size();
  constexpr std::size_t kMost = std::size_t{1} << 24;
  if (spec.form == "dense" && targets * sources > kMost) {
    spec_.fail(path + ".form",
               fmt::format("dense needs {} weights, more than {}; expected low_rank or "
                           "gaussian",
                           targets * sources, kMost));
  }
  if (spec.form == "gaussian") {
    Connection c{source, target, learns, 0.0, Link<Real>(1, 1, 1.0)};
    add_gaussian(i, c);
    links_.push_back(std::move(c));
    return;
  }
  if (learns == Learns::always) {
    const ShuntedParams& rule = spec_.learning.shunted;
    if (rule.beta >= rule.alpha || rule.tau_s < spec_.dt_s) {
      spec_.fail("learning.shunted", "expected beta < alpha and tau_s >= dt_s [M18 eq. 2.8]");
    }
    if (!spec.pairs.empty()) {
      spec_.fail(path + ".pairs", "a link that learns always begins with `initial`");
    }
    links_.push_back(
        {source, target, learns, rule.alpha, Link<Real>(targets, sources, spec.gain * area)});
    links_.back().weights.fill(static_cast<Real>(spec.initial));
    return;
  }
  if (patterns_[source].empty()) {
    spec_.fail(path + ".from", spec.from + " has no sites whose patterns could be linked");
  }
  double m = 0.0;  // ∫ f₂² of the source's pattern: input of the target per unit of η
  for (const Real r : patterns_[source][0]) m += static_cast<double>(r * r) * area;
  if (m == 0.0) {
    spec_.fail(path + ".from", spec.from + " keeps no pattern that could be linked");
  }
  links_.push_back({source, target, learns, spec.gain / m,
                    Link<Real>(targets, sources, area, spec.form == "low_rank")});
  for (std::size_t k = 0; k < spec.pairs.size(); ++k) {
    const Pairing p = pairing(i, k);
    install(spec.name(), p.source, p.target);
  }
}

template <class Real>
void FieldNetwork<Real>::add_gaussian(std::size_t i, Connection& c) {
  const LinkSpec& spec = spec_.links[i];
  const FieldSpec &from = spec_.fields[c.source], &to = spec_.fields[c.target];
  if (flat(from) && flat(to)) {
    spec_.fail(at("links", i), "a gaussian link needs a 1-D field at one end at least");
  }
  if (!spec.pairs.empty()) {
    spec_.fail(at("links", i) + ".pairs", "a gaussian link links places, not pairs");
  }
  c.along_y = spec.along == "y";
  const auto axis = [&](const FieldSpec& f) {
    return static_cast<std::size_t>(flat(f) && c.along_y ? f.params.rows : f.params.neurons);
  };
  const std::size_t targets = axis(to), sources = axis(from);
  if (std::abs(static_cast<double>(targets) * to.params.dx -
               static_cast<double>(sources) * from.params.dx) > 1e-9) {
    spec_.fail(at("links", i),
               fmt::format("the axes of {} and {} differ in length, expected the same", spec.from,
                           spec.to));
  }
  c.weights = Link<Real>(targets, sources, from.params.dx);
  if (flat(from)) c.source_axis.resize(sources);
  if (flat(to)) c.target_axis.resize(targets);
  // Normalised so that a wide enough pattern of full rate gives `gain` at its middle.
  const double full = spec.gain / (spec.width * std::sqrt(2.0 * 3.14159265358979323846));
  for (std::size_t y = 0; y < sources; ++y) {
    for (std::size_t x = 0; x < targets; ++x) {
      const double d = std::abs(static_cast<double>(x) * to.params.dx -
                                static_cast<double>(y) * from.params.dx) /
                       spec.width;
      if (d > kCutoff) continue;
      c.weights.set_weight(x, y, static_cast<Real>(full * std::exp(-0.5 * d * d)));
    }
  }
}

template <class Real>
typename FieldNetwork<Real>::Pairing FieldNetwork<Real>::pairing(std::size_t link,
                                                                 std::size_t pair) const {
  const LinkSpec& spec = spec_.links[link];
  const std::string& text = spec.pairs[pair];
  const std::size_t split = text.find('>');
  Pairing p{-1, -1};
  if (split != std::string::npos) {
    p.source = NetworkSpec::site_index(spec_.fields[links_[link].source],
                                       std::string_view(text).substr(0, split));
    p.target = NetworkSpec::site_index(spec_.fields[links_[link].target],
                                       std::string_view(text).substr(split + 1));
  }
  if (p.source < 0 || p.target < 0) {
    spec_.fail(at("links", link) + ".pairs",
               fmt::format("'{}', expected SITE>SITE with {} of {} and {} of {}", text,
                           fmt::join(spec_.fields[links_[link].source].sites, ", "), spec.from,
                           fmt::join(spec_.fields[links_[link].target].sites, ", "), spec.to));
  }
  return p;
}

template <class Real>
void FieldNetwork<Real>::check_input(std::size_t i) const {
  const InputSpec& spec = spec_.inputs[i];
  const std::string path = at("inputs", i);
  const FieldSpec& field = spec_.fields[known_field(path + ".into", spec.into)];
  for (const std::string& site : spec.sites) {
    if (NetworkSpec::site_index(field, site) >= 0) continue;
    spec_.fail(path + ".sites", fmt::format("'{}' is no site of {}; there are {}", site, spec.into,
                                            fmt::join(field.sites, ", ")));
  }
}

// The robot moves and sees itself: what is active together is linked by eq. 2.3, as it is later by
// success. Links take effect when all are acquired: a movement whose links are still missing would
// lose its field to those that are linked already.
template <class Real>
void FieldNetwork<Real>::babble(std::size_t episode) {
  constexpr double kPulse_s = 0.2, kRelax_s = 1.0, kAmplitude = 6.0;
  const std::string path = at("babbling", episode);
  Stimulus stimulus(spec_), none(spec_);
  std::istringstream words(spec_.babbling[episode]);
  for (std::string word; words >> word;) {
    const std::size_t split = std::min(word.find('='), word.size());
    const std::size_t field = known_field(path, word.substr(0, split));
    const int site = NetworkSpec::site_index(
        spec_.fields[field],
        std::string_view(word).substr(split).substr(split < word.size() ? 1 : 0));
    if (site < 0) {
      spec_.fail(path, fmt::format("'{}', expected FIELD=SITE with {}", word,
                                   fmt::join(spec_.fields[field].sites, ", ")));
    }
    stimulus.at(field, site) = kAmplitude;
  }
  const auto steps = [&](double s) { return std::lround(s / spec_.dt_s); };
  reset();
  for (long t = steps(kPulse_s); t > 0; --t) advance(stimulus);
  for (long t = steps(kRelax_s); t > 0; --t) advance(none);
  const auto fraction = static_cast<Real>(spec_.dt_s / spec_.learning.tau_s);
  for (long t = steps(spec_.learning.window_s); t > 0; --t) {
    for (Connection& c : links_) {
      if (c.learns == Learns::babbling) learn(c, fraction);
    }
    advance(none);
  }
  reset();
}

template <class Real>
void FieldNetwork<Real>::check_rest() {
  Stimulus constant(spec_);
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    add_input(spec_, "task", i, -1, 1.0, constant);
  }
  check_rest(constant);
}

template <class Real>
void FieldNetwork<Real>::check_rest(const Stimulus& constant) {
  constexpr double kWatched_s = 1.0;
  reset();
  for (long t = std::lround(kWatched_s / spec_.dt_s); t > 0; --t) {
    step(constant);
    for (std::size_t i = 0; i < fields_.size(); ++i) {
      if (std::ranges::max(fields_[i].activity()) < 0) continue;
      const std::string what = spec_.fields[i].name + " ignites without anything shown: unstable";
      const LinkSpec* strongest = nullptr;
      for (const LinkSpec& l : spec_.links) {
        const bool stronger = strongest == nullptr || l.gain > strongest->gain;
        if (l.to == spec_.fields[i].name && stronger) strongest = &l;
      }
      if (strongest == nullptr) spec_.fail(at("fields", i), what);
      spec_.fail(at("links", static_cast<std::size_t>(strongest - spec_.links.data())) + ".gain",
                 what + ", expected a smaller gain");
    }
  }
  reset();
}

template <class Real>
void FieldNetwork<Real>::install(std::string_view name, int source_site, int target_site,
                                 double factor) {
  Connection& c = find(name);
  c.weights.install(patterns_[c.target][static_cast<std::size_t>(target_site)],
                    patterns_[c.source][static_cast<std::size_t>(source_site)],
                    static_cast<Real>(factor * c.eta), above(c));
}

template <class Real>
void FieldNetwork<Real>::step(const Stimulus& stimulus, bool reward) {
  for (Connection& c : links_) {
    if (c.learns != Learns::always || recalling_) transmit(c);
  }
  for (Connection& c : links_) {
    if (c.learns != Learns::always || recalling_) continue;
    const auto& target = fields_[c.target];
    c.weights.learn_shunted(target.activity(), target.rate(), fields_[c.source].rate(),
                            spec_.learning.shunted, spec_.dt_s);
  }
  if (reward) {
    const auto fraction = static_cast<Real>(spec_.dt_s / spec_.learning.tau_s);
    for (Connection& c : links_) {
      if (c.learns == Learns::success) learn(c, fraction);
    }
  }
  advance(stimulus);
}

template <class Real>
void FieldNetwork<Real>::advance(const Stimulus& stimulus) {
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    Real* __restrict input = fields_[f].input().data();
    for (std::size_t s = 0; s < bumps_[f].size(); ++s) {
      const auto amplitude = static_cast<Real>(stimulus.at(f, static_cast<int>(s)));
      if (amplitude == 0) continue;
      const auto& bump = bumps_[f][s];
      for (std::size_t i = 0; i < bump.size(); ++i) input[i] += amplitude * bump[i];
    }
  }
  for (auto& field : fields_) field.step();
}

template <class Real>
void FieldNetwork<Real>::transmit(Connection& c) {
  std::span<const Real> rate = fields_[c.source].rate();
  std::span<Real> input = fields_[c.target].input();
  if (!c.source_axis.empty()) {
    const auto n = static_cast<std::size_t>(fields_[c.source].params().neurons);
    const auto dx = static_cast<Real>(fields_[c.source].params().dx);
    std::ranges::fill(c.source_axis, Real(0));
    for (std::size_t i = 0; i < rate.size(); ++i) {
      c.source_axis[c.along_y ? i / n : i % n] += rate[i] * dx;
    }
    rate = c.source_axis;
  }
  if (c.target_axis.empty()) return c.weights.transmit(rate, input);
  const auto n = static_cast<std::size_t>(fields_[c.target].params().neurons);
  std::ranges::fill(c.target_axis, Real(0));
  c.weights.transmit(rate, c.target_axis);
  for (std::size_t i = 0; i < input.size(); ++i) {
    input[i] += c.target_axis[c.along_y ? i / n : i % n];
  }
}

template <class Real>
double FieldNetwork<Real>::input_at(std::size_t link, std::size_t field, std::size_t neuron) const {
  const Connection& c = links_[link];
  if (c.target != field || (c.learns == Learns::always && !recalling_)) return 0.0;
  const auto n = static_cast<std::size_t>(fields_[field].params().neurons);
  if (!c.target_axis.empty()) neuron = c.along_y ? neuron / n : neuron % n;
  if (c.source_axis.empty()) return c.weights.input_at(fields_[c.source].rate(), neuron);
  return c.weights.input_at(c.source_axis, neuron);
}

template <class Real>
double FieldNetwork<Real>::input_at(const Stimulus& stimulus, std::size_t field,
                                    std::size_t neuron) const {
  double sum = 0.0;
  for (std::size_t s = 0; s < bumps_[field].size(); ++s) {
    sum += stimulus.at(field, static_cast<int>(s)) * static_cast<double>(bumps_[field][s][neuron]);
  }
  return sum;
}

template <class Real>
void FieldNetwork<Real>::learn(Connection& c, Real fraction) {
  c.weights.learn(fields_[c.target].rate(), fields_[c.source].rate(), static_cast<Real>(c.eta),
                  fraction, above(c));
}

template <class Real>
Real FieldNetwork<Real>::above(std::size_t field) const {
  return static_cast<Real>(fields_[field].f2(spec_.learning.local_above));
}

template <class Real>
typename Link<Real>::Above FieldNetwork<Real>::above(const Connection& c) const {
  return {above(c.target), above(c.source)};
}

template <class Real>
void FieldNetwork<Real>::reset() {
  for (auto& field : fields_) field.reset();
}

template class FieldNetwork<float>;
template class FieldNetwork<double>;

template <class Real>
Peaks read_peaks(const FieldNetwork<Real>& network, std::size_t field) {
  const FieldSpec& spec = network.spec().fields[field];
  const auto u = network.field(field).activity();
  Peaks peaks;
  bool inside = false;
  std::size_t top = 0;
  for (std::size_t i = 0; i < u.size(); ++i) {
    if (u[i] > 0 && !inside) ++peaks.count;
    inside = u[i] > 0;
    if (u[i] > u[top]) top = i;
  }
  peaks.max_u = static_cast<double>(u[top]);
  if (peaks.count == 0) return peaks;
  if (spec.params.rows > 1) peaks.count = 1;
  const auto n = static_cast<std::size_t>(spec.params.neurons);
  double nearest = std::numeric_limits<double>::infinity();
  for (int s = 0; s < static_cast<int>(spec.sites.size()); ++s) {
    const SitePlace place = site_place(spec, s);
    const double distance = std::hypot(static_cast<double>(top % n) * spec.params.dx - place.x,
                                       static_cast<double>(top / n) * spec.params.dx - place.y);
    if (distance > nearest) continue;
    nearest = distance;
    peaks.site = s;
  }
  return peaks;
}

template Peaks read_peaks(const FieldNetwork<float>&, std::size_t);
template Peaks read_peaks(const FieldNetwork<double>&, std::size_t);

}  // namespace mimesis::cognition
