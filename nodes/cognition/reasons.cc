#include "nodes/cognition/reasons.h"

#include <algorithm>

#include "common/error.h"

namespace mimesis::cognition {
namespace {

constexpr std::array<std::string_view, 3> kInputs = {"task", "vision", "plan"};

}  // namespace

Reasons::Reasons(const FieldNetwork<float>& network) : fields_(network.spec().fields.size()) {
  for (const LinkSpec& link : network.spec().links) names_.push_back(link.name());
  names_.insert(names_.end(), kInputs.begin(), kInputs.end());
  for (Reason& field : fields_) field.parts.reserve(names_.size());
  shown_ = names_.size();
}

void Reasons::reset() {
  for (Reason& field : fields_) {
    field.onset_s = -1.0;
    field.site = -1;
    field.lead = 0.0;
    field.parts.clear();
  }
}

void Reasons::observe(const FieldNetwork<float>& network, const Stimulus& constant,
                      const Stimulus& stimulus, std::string_view shown, double time_s) {
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    if (fields_[f].onset_s >= 0.0 || std::ranges::max(network.field(f).activity()) <= 0) continue;
    fields_[f].onset_s = time_s;
    shown_ = static_cast<std::size_t>(std::ranges::find(names_, shown) - names_.begin());
    MIMESIS_ASSERT(shown_ < names_.size());
    note(network, f, constant, stimulus);
  }
}

void Reasons::note(const FieldNetwork<float>& network, std::size_t field, const Stimulus& constant,
                   const Stimulus& stimulus) {
  Reason& reason = fields_[field];
  const FieldSpec& spec = network.spec().fields[field];
  const auto u = network.field(field).activity();
  const auto top = static_cast<std::size_t>(std::ranges::max_element(u) - u.begin());
  reason.site = read_peaks(network, field).site;
  const std::size_t links = network.spec().links.size();
  const auto total = [&](std::size_t neuron) {
    double sum = network.input_at(stimulus, field, neuron);
    for (std::size_t l = 0; l < links; ++l) sum += network.input_at(l, field, neuron);
    return sum;
  };
  for (std::size_t l = 0; l < links; ++l) {
    const double input = network.input_at(l, field, top);
    if (input != 0.0) reason.parts.push_back({l, input});
  }
  const double always = network.input_at(constant, field, top);
  const double now = network.input_at(stimulus, field, top) - always;
  if (always != 0.0) reason.parts.push_back({links, always});
  if (now != 0.0) reason.parts.push_back({shown_, now});
  std::ranges::sort(reason.parts, std::greater(), &Reason::Part::input);

  const double winner = total(top);
  double best = 0.0;
  for (int s = 0; s < static_cast<int>(spec.sites.size()); ++s) {
    const SitePlace place = site_place(spec, s);
    const auto x = static_cast<std::size_t>(place.x / spec.params.dx),
               y = static_cast<std::size_t>(place.y / spec.params.dx);
    const std::size_t neuron = y * static_cast<std::size_t>(spec.params.neurons) + x;
    if (s != reason.site) best = std::max(best, total(neuron));
  }
  reason.lead = winner > 0.0 ? std::clamp(1.0 - best / winner, 0.0, 1.0) : 0.0;
}

double Reasons::confidence() const {
  double least = 1.0;
  for (const Layer layer : {Layer::pf, Layer::f5_grip, Layer::f5_transport, Layer::pfc}) {
    least = std::min(least, fields_[index(layer)].lead);
  }
  return least;
}

}  // namespace mimesis::cognition
