#include "nodes/cognition/field_network.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "common/error.h"
#include "common/testing/no_malloc.h"
#include "common/testing/refusal.h"
#include "nodes/cognition/network_file.h"
#include "nodes/cognition/test/files.h"
#include "nodes/cognition/test/wired.h"
#include "nodes/cognition/trial.h"

namespace mimesis::cognition {
namespace {

/// Two features that are seen, their combination in a plane, and what it stands for.
constexpr const char* kPlane = R"(
version: 1
fields:
  - {name: shape, neurons: 64, sites: [round, long]}
  - {name: hue, neurons: 64, sites: [red, blue]}
  - {name: object, neurons: 64, rows: 64, sites: [apple, plum, pepper],
     at: [16, 16, 16, 48, 48, 16], excitation: 0.5, inhibition: 0.15}
  - {name: word, neurons: 192, sites: [apple, plum, pepper]}
links:
  - {from: shape, to: object, gain: 3.5, form: gaussian}
  - {from: hue, to: object, gain: 3.5, form: gaussian, along: y}
  - {from: object, to: word, gain: 4, form: low_rank, pairs: [apple>apple, plum>plum, pepper>pepper]}
)";

template <class Real>
std::vector<int> named(const std::string& file, int shape, int hue) {
  FieldNetwork<Real> network(load_network(file));
  Stimulus seen(network.spec());
  const Stimulus none = seen;
  if (shape >= 0) seen.at(std::size_t{0}, shape) = 5.0;
  if (hue >= 0) seen.at(std::size_t{1}, hue) = 5.0;
  for (int t = 0; t < 600; ++t) {
    const testing::NoMalloc guard;
    network.step(t < 300 ? seen : none);
  }
  return {read_peaks(network, std::size_t{2}).site, read_peaks(network, std::size_t{3}).site};
}

TEST(FieldNetwork, AnotherOneIsAFile) {
  const PassingFile file("plane.yaml");
  file.write(kPlane);
  EXPECT_EQ(named<double>(file.path, 0, 0), (std::vector{0, 0}));
  EXPECT_EQ(named<double>(file.path, 0, 1), (std::vector{1, 1}));
  EXPECT_EQ(named<float>(file.path, 1, 0), (std::vector{2, 2}));
  EXPECT_EQ(named<double>(file.path, 0, -1), (std::vector{-1, -1}));  // a stripe is no peak
}

TEST(FieldNetwork, GaussianLinksFallWithTheDistanceAlongTheirAxis) {
  const PassingFile file("plane.yaml");
  file.write(kPlane);
  const FieldNetwork<double> network(load_network(file.path));
  const auto& link = network.link("hue->object");
  EXPECT_NEAR(link.weight(15, 10) / link.weight(10, 10), std::exp(-0.5), 1e-12);
  EXPECT_EQ(link.weight(31, 10), 0.0);
  double sum = 0.0;
  for (std::size_t y = 0; y < 64; ++y) sum += link.weight(32, y);
  EXPECT_NEAR(sum, 3.5, 0.01);  // gain: a whole field of full rate
}

/// w * f₂ − w_inhib ∫ f₂ at one neuron of a 1-D field.
double bracket(const NeuralField<double>& field, std::size_t x) {
  const FieldParams& p = field.params();
  double sum = 0.0;
  for (std::size_t y = 0; y < field.rate().size(); ++y) {
    const double d = (static_cast<double>(x) - static_cast<double>(y)) * p.dx / p.width;
    const double w = std::abs(d) > 4.0 ? 0.0 : p.excitation * std::exp(-0.5 * d * d);
    sum += (w - p.inhibition) * field.rate()[y] * p.dx;
  }
  return sum;
}

// ū = ∫ w f + h + S with S = ∫ A f of the other fields, where the gate f₁ is open; eq. 2.5 leaves
// the inhibition away.
TEST(FieldNetwork, PatternsAreTheEquilibriumOfEquation25) {
  FieldNetwork<double> network(load_network());
  ASSERT_TRUE(rehearse(network, task::parse_demonstration("precision,above,high")));
  run_trial(network,
            {.shown = task::parse_demonstration("precision,above,high"), .duration_s = 4.0});
  const NetworkSpec& a = network.spec();
  const Stimulus task = task_stimulus(a);
  int open = 0;
  for (const Layer layer : {Layer::pf, Layer::f5_grip, Layer::pfc}) {
    const auto& field = network.field(layer);
    const FieldSpec& spec = a.fields[index(layer)];
    for (std::size_t x = 0; x < field.activity().size(); ++x) {
      double s = 0.0;
      for (const LinkSpec& link : a.links) {
        if (link.to != spec.name) continue;
        const auto rate = network.field(a.field_index(link.from)).rate();
        for (std::size_t y = 0; y < rate.size(); ++y) {
          s += network.link(link.name()).weight(x, y) * rate[y];
        }
      }
      double told = network.input_at(task, index(layer), x);
      for (std::size_t l = 0; l < a.links.size(); ++l) told += network.input_at(l, index(layer), x);
      for (int site = 0; site < sites(layer); ++site) {
        const double d = (static_cast<double>(x) - site_place(spec, site).x) / a.input_width;
        s += task.at(index(layer), site) * std::exp(-0.5 * d * d);
      }
      EXPECT_NEAR(told, s, 1e-9) << spec.name << x;
      const double u = field.activity()[x], lateral = bracket(field, x);
      const double gate = 1.0 / (1.0 + std::exp(-2.0 * (u - spec.params.threshold1)));
      EXPECT_NEAR(u, spec.params.resting_level + s + gate * lateral, 1e-3) << spec.name << x;
      if (gate < 0.999) continue;
      EXPECT_NEAR(u, spec.params.resting_level + s + lateral, 0.02) << spec.name << x;
      ++open;
    }
  }
  EXPECT_GT(open, 10);
}

TEST(FieldNetwork,
     BabblingEndsInEquation24) {  // of the fields alone, as if its pairs had been wired
  const FieldNetwork<double> closed(wired(load_network())), babbled(load_network());
  double worst = 0.0, largest = 0.0;
  for (std::size_t y = 0; y < 128; ++y) {
    for (std::size_t x = 0; x < 128; ++x) {
      const double exact = closed.link("STSg->PF").weight(x, y);
      worst = std::max(worst, std::abs(babbled.link("STSg->PF").weight(x, y) - exact));
      largest = std::max(largest, exact);
    }
  }
  EXPECT_NEAR(worst / largest, std::exp(-5.0), 1e-3);  // 2 s at τ_s = 0.4 s
}

/// Time at which each field of models/sequence_fields.yaml is first active [s], negative: never.
template <class Real>
std::vector<double> events(FieldNetwork<Real>& network, const std::vector<double>& onsets_s,
                           double end_s) {
  const NetworkSpec& a = network.spec();
  std::vector<double> active(a.fields.size(), -1.0);
  network.reset();
  Stimulus stimulus(a);
  const Stimulus none = stimulus;
  for (long k = 0; k < std::lround(end_s / a.dt_s); ++k) {
    const double t = static_cast<double>(k) * a.dt_s;
    stimulus = none;
    for (std::size_t f = 0; f < onsets_s.size(); ++f) {
      const bool shown = onsets_s[f] >= 0.0 && t >= onsets_s[f] - 1e-9;
      if (shown && t < onsets_s[f] + a.input_window_s - 1e-9) {
        add_input(a, "event", f, -1, 1.0, stimulus);
      }
    }
    {
      const testing::NoMalloc guard;
      network.step(stimulus);
    }
    for (std::size_t f = 0; f < active.size(); ++f) {
      if (active[f] < 0.0 && std::ranges::max(network.field(f).activity()) > 0) active[f] = t;
    }
  }
  return active;
}

// Eq. 2.6 to 2.8 from a file: after A, B, C ten times, A alone brings B and C, C alone nothing.
template <class Real>
void learns_a_chain(double dt_s) {
  NetworkSpec a = load_network("sequence_fields.yaml");
  a.dt_s = dt_s;
  FieldNetwork<Real> network(a);
  const auto naive = events(network, {0.0}, 1.0);
  EXPECT_GT(naive[0], 0.0);
  EXPECT_LT(naive[1], 0.0) << "nothing is learned yet";
  network.recall(false);
  for (int trial = 0; trial < 10; ++trial) events(network, {0.0, 0.16, 0.32}, 1.0);
  network.recall(true);
  const auto replay = events(network, {0.0}, 1.0);
  EXPECT_GT(replay[1], replay[0]);
  EXPECT_GT(replay[2], replay[1]);
  for (const std::size_t f : {0, 1, 2}) EXPECT_LT(std::ranges::max(network.field(f).activity()), 0);
  const auto backwards = events(network, {-1.0, -1.0, 0.0}, 1.0);
  EXPECT_LT(backwards[0], 0.0);
  EXPECT_LT(backwards[1], 0.0);
}

TEST(FieldNetwork, TransientFieldsOfAFileLearnASequence) {
  for (const double dt_s : {0.001, 0.002, 0.005}) {
    learns_a_chain<double>(dt_s);
    learns_a_chain<float>(dt_s);
  }
}

// Eq. 2.8 learns without a reward: what was saved on the way goes on as if it had never stopped.
TEST(FieldNetwork, SavedLinksThatLearnAlwaysGoOnWithTheSameBits) {
  const PassingFile file("links.json");
  const NetworkSpec a = load_network("sequence_fields.yaml");
  const auto train = [](FieldNetwork<float>& network) {
    network.recall(false);
    for (int trial = 0; trial < 5; ++trial) events(network, {0.0, 0.16, 0.32}, 1.0);
    network.recall(true);
    return links_text(network);
  };
  FieldNetwork<float> whole(a), resumed(a);
  const std::string learned = train(whole);
  ASSERT_EQ(save_links(file.path, learned), "");
  load_links(file.path, resumed);
  EXPECT_EQ(links_text(resumed), learned);
  const std::string more = train(whole);
  EXPECT_NE(more, learned);
  EXPECT_EQ(train(resumed), more);
  const auto replay = events(whole, {0.0}, 1.0);
  EXPECT_GT(replay[2], replay[1]);
  EXPECT_EQ(events(resumed, {0.0}, 1.0), replay);
}

TEST(FieldNetwork, AFileExtendsAnother) {
  const NetworkSpec base = load_network(), more = load_network("bundle_fields.yaml");
  ASSERT_EQ(more.fields.size(), base.fields.size() + 1);
  EXPECT_EQ(more.fields[2].params.tau_s, base.fields[2].params.tau_s);
  EXPECT_EQ(more.links[8].name(), base.links[8].name());
  EXPECT_EQ(more.babbling, base.babbling);
  const PassingFile file("more.yaml");
  const auto refused = [&](const std::string& text, const std::string& why) {
    file.write("version: 1\nextends: " + text);
    const std::string words =
        testing::refusal([&] { const FieldNetwork<float> network(load_network(file.path)); });
    EXPECT_NE(words.find(why), std::string::npos) << words;
  };
  refused("bar_fields.yaml\nlinks:\n  - {from: PFC, to: PFX, gain: 1}\n",
          file.path + ":4:21: links.12.to: 'PFX' is no field");
  refused("bar_fields.yaml\nfield: {excitation: 0.5}\nfields:\n  - {name: NEW, sites: [a]}\n",
          file.path + ":5:5: fields.7: NEW: ");
  refused("bar_fields.yaml\ndt_s: 0.02\n", "bar_fields.yaml:");
  refused(file.path + "\n", "extends itself");
}

TEST(FieldNetwork, RefusesWhatCannotWorkWithItsLine) {
  const auto refused = [](const std::string& from, const std::string& to, const std::string& why) {
    const NetworkFile file(from, to);
    try {
      FieldNetwork<float> network(load_network(file.path));
      ASSERT_TRUE(rehearse(network, task::parse_demonstration("full,below,low")));
      network.check_rest();
      ADD_FAILURE() << "accepted: " << to;
    } catch (const ConfigError& e) {
      const std::string line = e.what();
      EXPECT_NE(line.find(why), std::string::npos) << line;
      EXPECT_TRUE(line.starts_with(file.path + ":")) << line;
    }
  };
  refused("to: PFC, gain: 1.9", "to: PFX, gain: 1.9",
          "links.8.to: 'PFX' is no field; there are STSg, STSt, PF, F5g, F5t, PFC, COL");
  refused("from: COL, to: PFC", "from: PF, to: PFC", "there is another link PF->PFC");
  refused("neurons: 128", "neurons: 5", "field.neurons");
  refused("sites: [high, low], ", "sites: [high, low], at: [32], ",
          "fields.5.at: has 1 numbers, expected 2 for 2 sites");
  refused("sites: [high, low], ", "sites: [high, low], at: [32, 128], ", "low is outside");
  refused("sites: [PG-AT, FG-BT]", "sites: [PG-AT, FGBT]", "'FGBT' is no site of PF");
  refused("STSg=FG STSt=BT", "STSg=FG STSt=B", "babbling.1: 'STSt=B', expected FIELD=SITE");
  refused("gain: 1.9, learns: success", "gain: 1.9, form: low_rank, learns: success",
          "cannot learn");
  refused("excitation: 2.4", "excitation: 0.5", "self-sustained");
  refused("to: PFC, gain: 1.9", "to: PFC, gain: 19", "links.8.gain: PFC ignites without anything");
  refused("tau_s: 0.011", "tau_s: 0.0009", "fields.2.tau_s");
  refused("name: COL,", "name: COL, rows: 2, at: [1, 1, 9, 1], neurons: 40,", "multiple of 16");
  refused("into: PF,", "in: PF,", "inputs.4.in: unknown parameter");
}

}  // namespace
}  // namespace mimesis::cognition
