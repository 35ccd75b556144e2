#include "experiments/fields/situations.h"

#include <algorithm>
#include <map>

#include "experiments/harness/statistics.h"

namespace mimesis::cognition {
std::vector<std::vector<double*>> Constants::gains() {
  const auto links = [this](std::initializer_list<const char*> names) {
    std::vector<double*> all;
    for (const char* name : names) all.push_back(&network.gain(name));
    return all;
  };
  const auto input = [this](const char* name, std::initializer_list<const char*> fields) {
    std::vector<double*> all;
    for (const char* field : fields) all.push_back(&network.input_gain(name, field));
    return all;
  };
  return {links({"STSg->PF", "STSt->PF"}),
          links({"STSg->F5g", "STSt->F5t"}),
          links({"PF->F5g", "PF->F5t"}),
          links({"F5g->PF", "F5t->PF"}),
          links({"PF->PFC"}),
          links({"PFC->PF"}),
          links({"COL->PFC", "PFC->COL"}),
          input("vision", {"STSg", "STSt"}),
          input("vision", {"PFC"}),
          input("vision", {"COL"}),
          input("task", {"PF"}),
          input("task", {"PFC"}),
          input("plan", {"F5g", "F5t"}),
          {&weak}};
}

template <class Real>
FieldNetwork<Real> practised(const Constants& constants, Practice practice) {
  FieldNetwork<Real> network(constants.network);
  if (practice == Practice::none) return network;
  const bool colors = practice == Practice::colors;
  rehearse(network, task::parse_demonstration(colors ? "precision,above,high,light"
                                                     : "precision,above,high"));
  rehearse(network, task::parse_demonstration(colors ? "full,below,low,dark" : "full,below,low"));
  if (practice == Practice::both_means) {
    network.install("PFC->PF", 0, kFgBt, constants.weak);
  }
  if (practice == Practice::lesioned) network.cut("PFC->PF");
  return network;
}

Sites sites_of(const TrialResult& result) {
  Sites sites{};
  for (const Layer layer : kAllLayers) {
    const Peaks& peaks = result.peaks[index(layer)];
    sites[index(layer)] = peaks.count > 1 ? -2 : peaks.site;
  }
  return sites;
}

std::vector<Situation> situations() {
  constexpr TaskInput task, no_habit{.means = 0.0}, no_expectation{.goal = 0.0};
  const Demonstration full{.grip = Grip::full};
  const Demonstration full_above{.grip = Grip::full, .transport = Transport::above};
  const auto copied = [&](const char* sequence) {
    return Trial{.shown = task::parse_demonstration(sequence), .task = task};
  };
  constexpr Sites kSilent = {-1, -1, -1, -1, -1, -1, -1};
  using enum Practice;
  std::vector<Situation> all;
  const auto add = [&](std::string figure, std::string what, Practice practice, Trial trial,
                       const Sites& expected) {
    all.push_back({std::move(figure), std::move(what), practice, std::move(trial), expected});
  };
  for (const Practice practice : {none, familiar}) {
    const std::string who = practice == none ? "novice: " : "familiar: ";
    add("2.17", who + "PG, AT, high copied", practice, copied("precision,above,high"),
        {0, 0, kPgAt, 0, 0, 0, -1});
    add("2.18", who + "FG, BT, low copied", practice, copied("full,below,low"),
        {1, 1, kFgBt, 1, 1, 1, -1});
    add("2.17", who + "task input alone decides nothing", practice, {.task = task}, kSilent);
  }
  add("2.17", "novice: PG, AT, low copied", none, copied("precision,above,low"),
      {0, 0, kPgAt, 0, 0, 1, -1});
  add("2.19", "strong expectation: the preferred means", both_means, copied("full,below,high"),
      {1, 1, kPgAt, 0, 0, 0, -1});
  add("2.19", "no expectation: the means shown", both_means,
      {.shown = task::parse_demonstration("full,below,high"), .task = no_expectation},
      {1, 1, kFgBt, 1, 1, 0, -1});
  add("2.20", "FG alone: low inferred", familiar, {.shown = full, .task = task},
      {1, -1, kFgBt, 1, 1, 1, -1});
  add("2.20", "PG alone: high inferred", familiar,
      {.shown = {.grip = Grip::precision}, .task = task}, {0, -1, kPgAt, 0, 0, 0, -1});
  add("2.20", "FG alone, no expectation: nothing", familiar, {.shown = full, .task = kNoTask},
      {1, -1, -1, -1, -1, -1, -1});
  add("2.21", "FG, AT, high: PG instead", familiar, copied("full,above,high"),
      {1, 0, kPgAt, 0, 0, 0, -1});
  add("2.21", "lesion of PFC->PF: FG copied", lesioned,
      {.shown = task::parse_demonstration("full,above,high"), .task = no_habit},
      {1, 0, kFgAt, 1, 0, 0, -1});
  add("2.22", "no test plan: the preferred means", familiar, dialogue({}),
      {1, -1, kPgAt, 0, 0, 0, -1});
  add("2.22", "a test plan for FG, AT: the grip copied", familiar, dialogue(full_above),
      {1, -1, kFgAt, 1, 0, 0, -1});
  for (const int s : {0, 1}) {
    const int pf = s == 0 ? kPgAt : kFgBt;
    const Sites both = {-1, -1, pf, s, s, s, s};
    add("2.23", s == 0 ? "light: high" : "dark: low", colors,
        {.shown = {.color = static_cast<Color>(s + 1)}, .task = task}, both);
    add("2.24", s == 0 ? "high: light" : "low: dark", colors,
        {.shown = {.goal = static_cast<Goal>(s + 1)}, .task = task}, both);
  }
  return all;
}

Trial dialogue(const Demonstration& planned) {
  return {.shown = {.grip = Grip::full},
          .task = kNoTask,
          .duration_s = 2.8,
          .later = {{.at_s = kPlanned_s, .planned = planned},
                    {.at_s = kPlaced_s, .shown = {.goal = Goal::high}}}};
}

template <class Real>
std::vector<std::string> figures_that_hold(const Constants& constants) {
  std::map<Practice, FieldNetwork<Real>> networks;
  std::map<std::string, bool> held;
  bool all = true;
  for (const Situation& s : situations()) {
    if (!networks.contains(s.practice)) {
      networks.emplace(s.practice, practised<Real>(constants, s.practice));
    }
    const bool ok = sites_of(run_trial(networks.at(s.practice), s.trial)) == s.expected;
    held.try_emplace(s.figure, true).first->second &= ok;
    all = all && ok;
  }
  std::vector<std::string> names;
  for (const auto& [figure, ok] : held) {
    if (ok) names.push_back(figure);
  }
  if (all) names.emplace_back("all");
  return names;
}

Constants jittered(Constants constants, unsigned seed, double spread) {
  std::mt19937 random(seed);
  for (const auto& kind : constants.gains()) {
    const double factor = 1.0 + spread * reproduce::normal(random);
    for (double* gain : kind) *gain *= factor;
  }
  return constants;
}

template FieldNetwork<float> practised(const Constants&, Practice);
template FieldNetwork<double> practised(const Constants&, Practice);
template std::vector<std::string> figures_that_hold<float>(const Constants&);
template std::vector<std::string> figures_that_hold<double>(const Constants&);

}  // namespace mimesis::cognition
