#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>

#include "common/plot/gnuplot.h"
#include "experiments/fields/figures.h"
#include "experiments/harness/statistics.h"
#include "nodes/cognition/field_network.h"
#include "nodes/cognition/network_file.h"

namespace mimesis::cognition {
namespace {

using plot::Data;
using namespace reproduce;

constexpr double kFieldStep_s = 0.002, kInput_s = 0.06, kMiddle = 32.0;
constexpr std::size_t kN = 64;

using Field = NeuralField<double>;

long steps_of(double s) { return std::lround(s / kFieldStep_s); }

/// models/sequence_fields.yaml: a transient field for each event, with shunted links from every one
/// to every other (a working set of constants: M18 prints none).
class Chain {
 public:
  /// @param gain of the links when they act
  Chain(std::size_t events, double threshold, double gain = 1.0, double decay = 0.6)
      : network_(spec(events, threshold, gain, decay)) {}

  /// Shows the events in order, one after the other by `delay_s`. Links learn, but do not act yet.
  void train(double delay_s, int trials) {
    std::vector<double> onsets_s;
    for (std::size_t e = 0; e < events(); ++e) onsets_s.push_back(delay_s * static_cast<double>(e));
    network_.recall(false);
    for (int trial = 0; trial < trials; ++trial) show(onsets_s, onsets_s.back() + 0.6);
    network_.recall(true);
  }

  /// Starts from one event alone: max u of each field over time.
  std::vector<std::vector<double>> replay(std::size_t first, double duration_s) {
    std::vector<double> onsets_s(events(), duration_s);
    onsets_s[first] = 0.0;
    return show(onsets_s, duration_s);
  }

  /// The largest synaptic weight.
  double strength(std::size_t from, std::size_t to) const {
    const auto& fields = network_.spec().fields;
    const Link<double>& link = network_.link(fields[from].name + "->" + fields[to].name);
    double largest = 0.0;
    for (std::size_t i = 0; i < kN; ++i) {
      for (std::size_t j = 0; j < kN; ++j) largest = std::max(largest, link.weight(i, j));
    }
    return largest;
  }

 private:
  static NetworkSpec spec(std::size_t events, double threshold, double gain, double decay) {
    NetworkSpec a = load_network("sequence_fields.yaml");
    a.fields.resize(events);
    std::erase_if(a.links, [&](const LinkSpec& l) {
      return a.field_index(l.from) >= events || a.field_index(l.to) >= events;
    });
    a.inputs.resize(events);
    for (LinkSpec& link : a.links) link.gain = gain;
    for (FieldSpec& field : a.fields) {
      field.params.decay = decay;
      if (decay == 0.0)
        field.params.threshold1 = field.params.inhibition = 1e-9;  // eq. 2.1 wants it
    }
    a.learning.shunted.threshold = threshold;
    return a;
  }

  std::size_t events() const { return network_.spec().fields.size(); }

  /// max u of each field over time.
  std::vector<std::vector<double>> show(const std::vector<double>& onsets_s, double duration_s) {
    std::vector<std::vector<double>> courses(events());
    network_.reset();
    for (long k = 0; k < steps_of(duration_s); ++k) {
      Stimulus shown(network_.spec());
      for (std::size_t e = 0; e < events(); ++e) {
        const long onset = steps_of(onsets_s[e]);
        if (k < onset || k >= onset + steps_of(kInput_s)) continue;
        add_input(network_.spec(), "event", e, 0, 1.0, shown);
      }
      network_.step(shown);
      for (std::size_t e = 0; e < events(); ++e) {
        courses[e].push_back(std::ranges::max(network_.field(e).activity()));
      }
    }
    return courses;
  }

  FieldNetwork<double> network_;
};

/// Time of the first u > 0, NaN if never [ms].
double onset_ms(const std::vector<double>& course) {
  const auto at = std::ranges::find_if(course, [](double u) { return u > 0.0; });
  return at == course.end() ? std::numeric_limits<double>::quiet_NaN()
                            : 1000.0 * kFieldStep_s * static_cast<double>(at - course.begin() + 1);
}

std::vector<double> response(double decay) {
  return Chain(1, 7.0, 1.0, decay).replay(0, 0.7).front();
}

Data rows_of(const std::string& name, const std::vector<double>& course) {
  Data d{name, {}};
  for (std::size_t k = 0; k < course.size(); ++k) {
    d.rows.push_back({1000.0 * kFieldStep_s * static_cast<double>(k + 1), course[k]});
  }
  return d;
}

/// Fig. 2.25: three fields linked to a chain answer one after the other.
Report chain(const PlotDir& dir) {
  constexpr double kDelay_s = 0.16, kGain = 0.6;
  Report report;
  const auto alone = response(0.6);
  const auto top = std::ranges::max_element(alone);
  const double rise = 1000.0 * kFieldStep_s * static_cast<double>(top - alone.begin() + 1);
  const auto low = std::find_if(top, alone.end(), [&](double u) { return u < 0.1 * *top; });
  report.near("from firing to the peak", rise - onset_ms(alone),
              published(50.0, "M18 2.5: 40-60 ms"), 10.0, "ms");
  report.near("from the peak to a tenth of it",
              1000.0 * kFieldStep_s * static_cast<double>(low - top),
              published(250.0, "M18 2.5: 200-300 ms"), 50.0, "ms");
  report.near("control, no inhibition: activity after 500 ms", response(0.0)[249],
              prototype(7.5, "fields.md"), 0.1, "1");

  Chain trained(3, 7.0, kGain), naive(3, 7.0, kGain);
  trained.train(kDelay_s, 10);
  const auto replay = trained.replay(0, 1.0);
  report.holds(
      "from A alone: A, then B, then C",
      onset_ms(replay[0]) < onset_ms(replay[1]) && onset_ms(replay[1]) < onset_ms(replay[2]),
      published("M18 fig. 2.25"));
  report.holds("each answer is transient: all below 0 in the end",
               std::ranges::all_of(replay, [](const auto& course) { return course.back() < 0.0; }),
               published("M18 2.5"));
  const auto backwards = trained.replay(2, 1.0), before = naive.replay(0, 1.0);
  report.holds("control, from C alone: nothing else answers",
               std::isnan(onset_ms(backwards[0])) && std::isnan(onset_ms(backwards[1])), goal());
  report.holds("control, before learning: nothing but A answers",
               std::isnan(onset_ms(before[1])) && std::isnan(onset_ms(before[2])), goal());
  if (!dir) return report;
  plot::plot_png(report.picture(*dir / "fig-2.25.png"), 760, 420,
                 {rows_of("A", replay[0]), rows_of("B", replay[1]), rows_of("C", replay[2])},
                 "set title 'Fig. 2.25: a learned chain of three fields, started by A alone' font "
                 "'sans,13'\nset xlabel 'time [ms]'\nset ylabel 'max u'\nset xrange [0:700]\n"
                 "plot 0 lt 7 dt 2 notitle, $A using 1:2 with lines lt 1 title 'A', $B using 1:2 "
                 "with lines lt 2 title 'B', $C using 1:2 with lines lt 3 title 'C'");
  return report;
}

/// Two input neurons on one field: their weights, and how they develop.
class TwoInputs {
 public:
  TwoInputs()
      : field_(load_network("sequence_fields.yaml").fields[0].params, kFieldStep_s),
        link_(kN, 2, kGain) {
    for (std::size_t i = 0; i < kN; ++i) {
      for (std::size_t s = 0; s < 2; ++s) {
        const double d = (static_cast<double>(i) - kMiddle + (s == 0 ? 3.0 : -3.0)) / 7.0;
        link_.set_weight(i, s, 0.8 * std::exp(-0.5 * d * d));
      }
    }
  }

  /// @param together both at once, or one of them at random
  void train(bool together, int trials) {
    for (int t = 0; t < trials; ++t) {
      const bool first = (random_() & 1U) != 0U;
      present(together || first ? 1.0 : 0.0, together || !first ? 1.0 : 0.0, true);
    }
  }
  /// Where the field answers to one input alone, centre of the activity.
  double answer(std::size_t s) {
    const auto best = present(s == 0 ? 1.0 : 0.0, s == 0 ? 0.0 : 1.0, false);
    double sum = 0.0, moment = 0.0;
    for (std::size_t i = 0; i < kN; ++i) {
      sum += std::max(best[i], 0.0);
      moment += static_cast<double>(i) * std::max(best[i], 0.0);
    }
    return moment / sum;
  }
  double overlap() {
    double common = 0.0, all = 0.0;
    for (std::size_t i = 0; i < kN; ++i) {
      common += std::min(link_.weight(i, 0), link_.weight(i, 1));
      all += std::max(link_.weight(i, 0), link_.weight(i, 1));
    }
    return common / all;
  }
  Data profile(const std::string& name, std::size_t s) {
    Data d{name, {}};
    for (std::size_t i = 0; i < kN; ++i) {
      d.rows.push_back({static_cast<double>(i), link_.weight(i, s)});
    }
    return d;
  }

 private:
  static ShuntedParams rule() {
    ShuntedParams p;
    p.tau_s = 0.5;
    p.threshold = 3.0;
    return p;
  }
  /// Inputs drive the field for 60 ms and are remembered for 250 ms. The highest u of each neuron.
  std::vector<double> present(double a, double b, bool learn) {
    constexpr double kNoise = 0.4, kTrace_s = 0.25, kTrial_s = 0.5;
    const std::array<double, 2> shown{a, b}, none{};
    std::vector<double> best(kN, -10.0);
    field_.reset();
    for (long k = 0; k < steps_of(kTrial_s); ++k) {
      for (double& s : field_.input()) s += learn ? kNoise * normal(random_) : 0.0;
      if (k < steps_of(kInput_s)) link_.transmit(shown, field_.input());
      field_.step();
      if (learn) {
        link_.learn_shunted(field_.activity(), field_.rate(), k < steps_of(kTrace_s) ? shown : none,
                            rule(), kFieldStep_s);
      }
      for (std::size_t i = 0; i < kN; ++i) best[i] = std::max(best[i], field_.activity()[i]);
    }
    return best;
  }

  static constexpr double kGain = 4.0;
  Field field_;
  Link<double> link_;
  std::mt19937 random_{1};
};

/// Fig. 2.26: inputs that come together merge, inputs that never do separate.
Report separation(const PlotDir& dir) {
  constexpr int kTrials = 200;
  Report report;
  TwoInputs before, merged, separate;
  report.near("overlap of the weights before", before.overlap(), prototype(0.502, "fields.md"),
              0.002, "1");
  merged.train(true, kTrials);
  separate.train(false, kTrials);
  report.at_least("overlap after 200 synchronous trials", merged.overlap(), 0.9, "1",
                  "merged into one representation (M18 2.5)");
  report.at_most("overlap after 200 asynchronous trials", separate.overlap(), 0.05, "1",
                 "nearly complete separation (M18 fig. 2.26)");
  report.at_most("merged: distance of the answers to A and B alone",
                 std::abs(merged.answer(0) - merged.answer(1)), 1.5, "neurons",
                 "at the same place (M18 2.5)");
  report.at_least("separated: distance of the answers", separate.answer(1) - separate.answer(0),
                  12.0, "neurons", "twice the distance of the inputs");
  if (!dir) return report;
  report.plots.push_back(*dir / "fig-2.26.png");
  std::ostringstream script;
  script
      << "set multiplot layout 1,3\nset yrange [0:1.1]\nset xlabel 'neuron'\nset key top right\n";
  for (const auto& [title, a, b] : {std::tuple{"before", "a0", "b0"},
                                    {"after synchronous trials", "a1", "b1"},
                                    {"after asynchronous trials", "a2", "b2"}}) {
    script << "set title '" << title << "'\nplot $" << a
           << " using 1:2 with lines lt 1 title 'A', $" << b
           << " using 1:2 with lines lt 2 title 'B'\n";
  }
  script << "unset multiplot";
  plot::plot_png(report.plots.back(), 1100, 360,
                 {before.profile("a0", 0), before.profile("b0", 1), merged.profile("a1", 0),
                  merged.profile("b1", 1), separate.profile("a2", 0), separate.profile("b2", 1)},
                 script.str());
  return report;
}

/// Weights after ten presentations of B, `delay_ms` after A.
struct Asymmetry {
  double threshold, delay_ms, forward, backward;  // of the prototype
};
constexpr std::array<Asymmetry, 14> kAsymmetries = {{{7, 0, 0.94, 0.94},
                                                     {7, 40, 0.94, 0.75},
                                                     {7, 80, 0.94, 0.19},
                                                     {7, 120, 0.94, 0.024},
                                                     {7, 160, 0.94, 0.019},
                                                     {7, 200, 0.92, 0.019},
                                                     {7, 260, 0.30, 0.019},
                                                     {5, 80, 0.99, 0.68},
                                                     {5, 120, 0.98, 0.42},
                                                     {5, 160, 0.93, 0.14},
                                                     {5, 200, 0.83, 0.03},
                                                     {0, 80, 0.84, 0.84},
                                                     {0, 120, 0.62, 0.75},
                                                     {0, 200, 0.25, 0.51}}};

double correlation(const std::vector<double>& x, const std::vector<double>& y) {
  const double mx = mean(x), my = mean(y);
  double xy = 0.0, xx = 0.0, yy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xy += (x[i] - mx) * (y[i] - my);
    xx += (x[i] - mx) * (x[i] - mx);
    yy += (y[i] - my) * (y[i] - my);
  }
  return xy / std::sqrt(xx * yy);
}

/// Fig. 2.27: the threshold of the shunting decides in which direction an order in time is learned.
Report asymmetry(const PlotDir& dir) {
  Report report;
  std::vector<Data> data = {{"high", {}}, {"low", {}}};
  std::array<double, 3> ratio{};  // forward / backward after 120 ms, thresholds 7, 5, 0
  for (const Asymmetry& a : kAsymmetries) {
    Chain two(2, a.threshold);
    two.train(a.delay_ms / 1000.0, 10);
    const double forward = two.strength(0, 1), backward = two.strength(1, 0);
    if (a.threshold != 5.0) {
      data[a.threshold == 7.0 ? 0 : 1].rows.push_back({a.delay_ms, forward, backward});
    }
    std::ostringstream what;
    what << "threshold " << a.threshold << ", " << a.delay_ms << " ms: ";
    report.near(what.str() + "A->B", forward, prototype(a.forward, "fields.md"), 0.01, "1");
    report.near(what.str() + "B->A", backward, prototype(a.backward, "fields.md"), 0.01, "1");
    if (a.delay_ms == 120.0)
      ratio[a.threshold == 7.0 ? 0 : a.threshold == 5.0 ? 1 : 2] = forward / backward;
  }
  report.holds("high threshold: only the forward link grows", ratio[0] > 10.0,
               published("M18 fig. 2.27.A"));
  report.holds("a lower threshold acts as a shorter delay: learning and forgetting balance",
               ratio[0] > ratio[1] && ratio[1] > 1.5 && ratio[2] < 1.5,
               published("M18 fig. 2.27.B"));
  if (!dir) return report;
  plot::plot_png(report.picture(*dir / "fig-2.27.png"), 900, 420, data,
                 "set multiplot layout 1,2\nset xlabel 'delay of B after A [ms]'\nset ylabel "
                 "'largest weight'\nset yrange [0:1]\nset xrange [0:260]\nset key bottom left\n"
                 "set title 'A   threshold 7'\nplot $high using 1:2 with linespoints lt 1 title "
                 "'A to B', $high using 1:3 with linespoints lt 2 title 'B to A'\n"
                 "set title 'B   threshold 0'\nplot $low using 1:2 with linespoints lt 1 title "
                 "'A to B', $low using 1:3 with linespoints lt 2 title 'B to A'\nunset multiplot");
  return report;
}

/// Intervals of the replay against those of the training.
Report intervals(const PlotDir&) {
  Report report;
  for (const auto& [threshold, gain] : {std::pair{0.0, 2.0}, {7.0, 1.0}}) {
    std::vector<double> trained, replayed;
    for (double delay_ms = 100.0; delay_ms <= 250.0; delay_ms += 10.0) {
      Chain two(2, threshold, gain);
      two.train(delay_ms / 1000.0, 10);
      const auto courses = two.replay(0, 0.6);
      trained.push_back(delay_ms);
      replayed.push_back(onset_ms(courses[1]) - onset_ms(courses[0]));
    }
    const std::string what = threshold > 0.0 ? "high threshold: " : "low threshold: ";
    const double slope = (replayed.back() - replayed.front()) / 150.0;
    if (threshold == 0.0) {
      report.at_least(what + "correlation of the intervals, 100 to 250 ms",
                      correlation(trained, replayed), 0.9, "1",
                      "the interval follows the delay (M18 2.5)");
    } else {
      report.at_most(what + "correlation of the intervals", correlation(trained, replayed), 0.9,
                     "1", "strengths are equal up to 200 ms: nothing could tell the delays apart");
    }
    report.at_most(what + "growth of the interval per trained ms", slope, 0.3, "1",
                   "not the delay itself: an input above threshold ignites a field "
                   "within some τ_u, however weak");
    report.holds(what + "a longer delay is never replayed faster", std::ranges::is_sorted(replayed),
                 published("M18 2.5"));
  }
  return report;
}

}  // namespace

void add_sequence_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("fig-2.25", "A learned chain of three transient fields replays its order", "M18",
                  Declared{.published = 4, .prototype = 1, .goal = 2}, chain);
  to.emplace_back("fig-2.26",
                  "Shunted learning merges what comes together, and separates what does not", "M18",
                  Declared{.prototype = 1, .goal = 4}, separation);
  to.emplace_back("fig-2.27", "The shunting threshold decides how an order in time is learned",
                  "M18", Declared{.published = 2, .prototype = 28}, asymmetry);
  to.emplace_back("sequence-intervals", "Intervals in the replay of a learned sequence", "own",
                  Declared{.published = 2, .goal = 4}, intervals);
}

}  // namespace mimesis::cognition
