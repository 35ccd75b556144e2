#include "nodes/cognition/imitator.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/error.h"
#include "nodes/cognition/trial.h"

namespace mimesis::cognition {

template <class Real>
Decision read_decision(const FieldNetwork<Real>& network) {
  constexpr double kAtRest_1_s = 1.0;
  const auto symbol = [&](Layer layer) {
    const Peaks peaks = read_peaks(network, layer);
    return peaks.count == 1 ? peaks.site + 1 : 0;
  };
  Decision d{static_cast<Grip>(symbol(Layer::f5_grip)),
             static_cast<Transport>(symbol(Layer::f5_transport)),
             static_cast<Goal>(symbol(Layer::pfc)), static_cast<Color>(symbol(Layer::color))};
  d.settled =
      d.grip != Grip::unknown && d.transport != Transport::unknown && d.goal != Goal::unknown;
  for (const Layer layer : kAllLayers) {
    // STS is slow and decides nothing: its peaks may still shrink to what they hold without input.
    const bool seen = layer == Layer::sts_grip || layer == Layer::sts_transport;
    d.settled = d.settled && (seen || network.field(layer).speed_1_s() < kAtRest_1_s);
  }
  return d;
}

template <class Real>
std::string indecision(const FieldNetwork<Real>& network) {
  for (const Layer layer : {Layer::pfc, Layer::f5_grip, Layer::f5_transport}) {
    const int count = read_peaks(network, layer).count;
    if (count == 1) continue;
    return std::string(layer_name(layer)) + " has " +
           (count == 0 ? std::string("no peak") : std::to_string(count) + " peaks");
  }
  return read_decision(network).settled ? "" : "the fields do not come to rest";
}

template Decision read_decision(const FieldNetwork<float>&);
template Decision read_decision(const FieldNetwork<double>&);
template std::string indecision(const FieldNetwork<float>&);
template std::string indecision(const FieldNetwork<double>&);

namespace {

constexpr double kInhibition = 6.0;  // more than all inputs of a site together

int pf_site(Grip grip, Transport transport) {
  const bool full = grip == Grip::full, below = transport == Transport::below;
  return full ? (below ? kFgBt : kFgAt) : (below ? kPgBt : kPgAt);
}

/// The field that names bundles of motions.
std::size_t bundle_field(const NetworkSpec& a) {
  const auto input = std::ranges::find(a.inputs, "bundle", &InputSpec::name);
  return input == a.inputs.end() ? a.fields.size() : a.field_index(input->into);
}

std::array<double, 2> goals_of(const ImitatorParams& params) {
  try {
    return expected_goals(parse_goals(params.goals));
  } catch (const ConfigError& e) {
    throw ConfigError(std::string("cognition.goals: ") + e.what());
  }
}

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

Imitator::Imitator(const ImitatorParams& params, const NetworkSpec& spec,
                   const std::function<void(FieldNetwork<float>&, Bundles&)>& recall)
    : params_(params),
      each_goal_(goals_of(params)),
      network_(imitating(spec)),
      reasons_(network_),
      task_(task_stimulus(spec, expectation())),
      shown_(task_),
      planned_(task_),
      with_bundle_(task_),
      bundle_field_(bundle_field(spec)),
      bundles_(bundle_field_ < spec.fields.size() ? spec.fields[bundle_field_].sites.size() : 0,
               params.bundle_rad) {
  if (recall) recall(network_, bundles_);
  for (std::size_t i = 0; !recall && i < params_.practice.size(); ++i) {
    const std::string& sequence = params_.practice[i];
    if (!rehearse(network_,
                  task::parse_demonstration(sequence, fmt::format("cognition.practice[{}]", i))))
      refused_.push_back(sequence);
  }
  network_.check_rest(task_);
  for (const Goal certain : {Goal::high, Goal::low}) {  // what a message may bring
    network_.check_rest(task_stimulus(spec, {.each_goal = expected_goals({{certain}})}));
  }
}

void Imitator::expect(const std::array<double, 2>& each_goal) {
  each_goal_ = each_goal;
  if (refusals_ == 0 && (stage_ == Stage::waiting || stage_ == Stage::watching)) {
    task_ = task_stimulus(network_.spec(), expectation());
  }
}

/// Vision that changes its mind again and again about a symbol knows nothing of it.
Demonstration Imitator::without_contradictions(Demonstration seen) {
  constexpr int kMostChanges = 3;
  const auto now = symbols(seen);
  for (std::size_t s = 0; s < kSymbols; ++s) {
    if (now[s] != 0 && known_[s] != 0 && now[s] != known_[s]) ++changes_[s];
    if (now[s] != 0) known_[s] = now[s];
    if (changes_[s] <= kMostChanges) continue;
    forget(seen, s);
    if (doubt_.empty()) doubt_ = kSymbolNames[s];
  }
  return seen;
}

void Imitator::observe(const Demonstration& observed, bool complete, double period_s) {
  if (!observed.action() && !complete) {
    if (stage_ == Stage::waiting) return;
    network_.reset();
    network_.recall(true);  // links that learn always do so in demonstrations alone
    stage_ = Stage::waiting;
    task_ = task_stimulus(network_.spec(), expectation());
    seen_ = {};
    rank_ = known_ = changes_ = {};
    events_ = 0;
    doubt_.clear();
    decision_ = {};
    deciding_s_ = unchanged_s_ = 0.0;
    plan_left_ = window_left_ = reward_left_ = 0;
    bundle_ = -1;
    refusals_ = 0;
    reason_.clear();
    return;
  }
  if (stage_ == Stage::considering || stage_ == Stage::deciding || stage_ == Stage::decided) return;
  const Demonstration seen = without_contradictions(observed);
  const auto now = symbols(seen), before = symbols(seen_);
  const bool new_symbol = now != before;
  if (stage_ == Stage::undecided && !new_symbol) return;
  stage_ = Stage::watching;
  reason_.clear();
  unchanged_s_ = new_symbol ? 0.0 : unchanged_s_ + period_s;
  events_ += new_symbol ? 1 : 0;
  for (std::size_t s = 0; s < kSymbols; ++s) {
    if (now[s] != before[s]) rank_[s] = events_;
  }
  seen_ = seen;
  network_.recall(!complete);
  if (!complete && unchanged_s_ < params_.patience_s) return;
  if (params_.rehearse && seen_.grip != Grip::unknown) return consider();
  present();
}

// The combinations with the grip that was seen, those with all that was seen first.
void Imitator::consider() {
  proposals_.clear();
  const auto either = [](auto seen, auto first, auto second) {
    return seen == second ? std::array{second, first} : std::array{first, second};
  };
  for (const Transport t : either(seen_.transport, Transport::above, Transport::below)) {
    for (const Goal g : either(seen_.goal, Goal::high, Goal::low)) {
      if (seen_.goal == Goal::unknown || g == seen_.goal) {
        proposals_.push_back({.grip = seen_.grip, .transport = t, .goal = g});
      }
    }
  }
  proposal_ = 0;
  considering_s_ = 0.0;
  task_ = task_stimulus(network_.spec(), kNoTask);
  begin_anew();
  drive_with({.grip = seen_.grip, .grip_confidence = seen_.grip_confidence});
  stage_ = Stage::considering;
}

void Imitator::answer(bool feasible) {
  constexpr double kPlan_s = 0.5;  // until PF has decided
  if (stage_ != Stage::considering) return;
  const Demonstration asked = proposals_[proposal_];
  if (!feasible) {
    double& failed = task_.at(Layer::pf, pf_site(asked.grip, asked.transport));
    // With an unknown goal a combination has failed when it fails for both.
    const bool again =
        proposal_ + 1 < proposals_.size() && proposals_[proposal_ + 1].transport == asked.transport;
    if (!again) failed -= kInhibition;
    considering_s_ = 0.0;
    if (++proposal_ < proposals_.size()) return;
  }
  planned_ = task_;
  if (feasible) add_plan(network_.spec(), asked, planned_);
  plan_left_ = steps(feasible ? kPlan_s : 0.0);
  drive_with(seen_);
  stage_ = Stage::deciding;
}

void Imitator::begin_anew() {
  network_.reset();
  reasons_.reset();
  onset_s_ = considered_s_ = 0.0;
}

void Imitator::present() {
  begin_anew();
  drive_with(seen_);
  stage_ = Stage::deciding;
}

void Imitator::drive_with(const Demonstration& seen) {
  driving_ = seen;
  const auto known = symbols(seen);
  long last = 0;
  for (std::size_t s = 0; s < kSymbols; ++s) {
    int earlier = 0;  // moments at which other symbols were seen before
    for (int rank = 1; rank < rank_[s]; ++rank) {
      bool used = false;
      for (std::size_t o = 0; o < kSymbols; ++o) used |= known[o] != 0 && rank_[o] == rank;
      earlier += used ? 1 : 0;
    }
    onset_[s] = earlier * steps(params_.order_s);
    if (known[s] != 0) last = std::max(last, onset_[s]);
  }
  window_ = window_left_ = last + steps(network_.spec().input_window_s);
  presented_ = ~0U;
  reward_left_ = 0;
  bundle_ = -1;
  deciding_s_ = 0.0;
  decision_ = {};
}

/// Each symbol for its own window.
void Imitator::present_at(long step) {
  const long window = steps(network_.spec().input_window_s);
  unsigned now = 0;
  for (std::size_t s = 0; s < kSymbols; ++s) {
    if (step >= onset_[s] && step < onset_[s] + window) now |= 1U << s;
  }
  if (now == presented_) return;
  presented_ = now;
  Demonstration part = driving_;
  for (std::size_t s = 0; s < kSymbols; ++s) {
    if ((now >> s & 1U) == 0) forget(part, s);
  }
  shown_ = task_;
  add_vision(network_.spec(), part, shown_);
}

long Imitator::steps(double duration_s) const {
  return std::lround(duration_s / network_.spec().dt_s);
}

void Imitator::refuse() {
  if (!decided()) return;
  const int means = read_peaks(network_, Layer::pf).site,
            goal = read_peaks(network_, Layer::pfc).site;
  if (++refusals_ > params_.alternatives) return give_up("no plan, and no alternative is left");
  // What is expected has failed: the habit [M18 2.2.2] no longer speaks for any means.
  task_ = task_stimulus(network_.spec(), expectation(refusals_ == 1 ? 0.0 : 1.0));
  if (refusals_ == 1 && means >= 0) task_.at(Layer::pf, means) -= kInhibition;
  if (refusals_ > 1 && goal >= 0) task_.at(Layer::pfc, goal) -= kInhibition;
  present();
}

bool Imitator::planned(const Eigen::MatrixXd& motion) {
  if (!decided() || bundles_.most() == 0) return true;
  bundle_ = bundles_.add(motion);
  if (bundle_ < 0) return false;
  with_bundle_ = task_;
  add_input(network_.spec(), "bundle", bundle_field_, bundle_, 1.0, with_bundle_);
  return true;
}

void Imitator::preselect() {
  preselected_.resize(0, 0);
  if (bundles_.most() == 0) return;
  const Peaks named = read_peaks(network_, bundle_field_);
  const auto site = static_cast<std::size_t>(std::max(0, named.site));
  if (named.count == 1 && site < bundles_.all().size()) preselected_ = bundles_.all()[site].mean;
}

void Imitator::give_up(std::string reason) {
  stage_ = Stage::undecided;
  reason_ = std::move(reason);
  decision_ = {};
}

void Imitator::advance(double period_s, bool success) {
  learning_ = false;
  const NetworkSpec& a = network_.spec();
  const long alone = steps(a.learning.window_s - a.input_window_s);  // of the reward, without input
  for (long i = steps(period_s); i > 0; --i) {
    const bool reward = decided() && success && reward_left_ > 0;
    if (plan_left_ == 0 && window_left_ > 0) present_at(window_ - window_left_);
    const Stimulus& stimulus = plan_left_ > 0                                   ? planned_
                               : window_left_ > 0                               ? shown_
                               : bundle_ >= 0 && reward && reward_left_ > alone ? with_bundle_
                                                                                : task_;
    network_.step(stimulus, reward);
    if (stage_ == Stage::considering || stage_ == Stage::deciding) {
      onset_s_ += a.dt_s;
      reasons_.observe(network_, task_, stimulus, plan_left_ > 0 ? "plan" : "vision", onset_s_);
    }
    (plan_left_ > 0 ? plan_left_ : window_left_) -= plan_left_ > 0 || window_left_ > 0 ? 1 : 0;
    reward_left_ -= reward ? 1 : 0;
    learning_ = learning_ || reward;
  }
  if (stage_ == Stage::considering) {
    considering_s_ += period_s;
    considered_s_ += period_s;
    if (considering_s_ >= params_.rehearsal_s) {  // no answer: as if it had not asked
      task_ = task_stimulus(network_.spec(), expectation());
      present();
    }
  }
  if (stage_ != Stage::deciding) return;
  deciding_s_ += period_s;
  decision_ = read_decision(network_);
  decision_.settled =  // held by the fields, not by the input
      decision_.settled && plan_left_ == 0 && window_left_ == 0;
  if (decision_.settled) {
    stage_ = Stage::decided;
    preselect();
    reward_left_ = steps(network_.spec().learning.window_s);
  } else if (deciding_s_ >= params_.indecision_s && window_left_ == 0) {
    give_up(indecision(network_) + (refusals_ > 0 ? "; what was decided first has no plan" : ""));
  }
}

int Bundles::add(const Eigen::MatrixXd& motion) {
  int nearest = -1;
  double least_rad = radius_rad_;
  for (std::size_t i = 0; i < all_.size(); ++i) {
    const Eigen::MatrixXd& mean = all_[i].mean;
    if (mean.rows() != motion.rows() || mean.cols() != motion.cols()) return -1;
    const double apart_rad = (mean - motion).colwise().norm().mean();
    if (apart_rad > least_rad) continue;
    least_rad = apart_rad;
    nearest = static_cast<int>(i);
  }
  if (nearest < 0 && all_.size() == most_) return -1;
  if (nearest < 0) {
    nearest = static_cast<int>(all_.size());
    all_.push_back({Eigen::MatrixXd::Zero(motion.rows(), motion.cols()), 0});
  }
  Bundle& bundle = all_[static_cast<std::size_t>(nearest)];
  bundle.mean += (motion - bundle.mean) / ++bundle.motions;
  return nearest;
}

}  // namespace mimesis::cognition
