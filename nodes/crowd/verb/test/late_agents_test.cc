// Rules II and III with agents that report late, carried on at their rates, and do late what they
// are told, integrated as the equations are printed: nothing may be slower than
// `mimesis crowd certify` guarantees.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "common/testing/temporary_folder.h"

namespace {

using nlohmann::json;

/// A group whose last agents are from outside.
struct Late {
  static constexpr double kStep_s = 0.005;
  int n = 4, guests = 1, delay = 0;  // steps
  double omega = 6.0, mean = 0.2, swing = 0.0, k = 0.0, m = 0.0;
  bool ring = false;

  explicit Late(unsigned seed) {
    std::mt19937 random(seed);
    const auto in = [&](double a, double b) {
      return std::uniform_real_distribution<double>(a, b)(random);
    };
    n = std::uniform_int_distribution<int>(3, 12)(random);
    guests = std::uniform_int_distribution<int>(1, n - 1)(random);
    delay = static_cast<int>(in(0.01, 0.5) / kStep_s);
    omega = in(3.0, 7.0), mean = in(0.1, 0.3), ring = in(0.0, 1.0) < 0.3;
    const double fast = in(0.1, 1.5) / (ring ? 4.0 : n);
    k = fast;
    if (in(0.0, 1.0) < 0.5) m = in(0.1, 0.8) * fast / (omega * mean);
  }
  double most() const { return ring ? 4.0 : n; }
  std::string file() const {
    const char* graph = ring ? "ring" : "all_to_all";
    json outside = json::array();
    for (int i = 0; i < guests; ++i)
      outside.push_back({{"name", "g" + std::to_string(i)}, {"group", "g"}});
    json rules = {{"phase", {{"graph", graph}, {"gain_1_s", k}}},
                  {"heading", {{"kind", "lane"}, {"gain", 1.0}}}};
    if (m > 0.0) rules["length"] = {{"graph", graph}, {"gain_1_m", m}};
    return json{
        {"name", "late"},
        {"stale_s", delay * kStep_s},
        {"gaits", {{{"name", "walk"}, {"eigenfrequency_rad_s", omega}, {"mean_m_rad", mean}}}},
        {"groups",
         {{{"name", "g"},
           {"count", n - guests},
           {"gait", "walk"},
           {"formation", {{"shape", "line"}}},
           {"rules", rules}}}},
        {"externals", outside}}
        .dump();
  }

  /// Errors over time: of phases to their mean, of places to theirs.
  struct Run {
    std::vector<double> phases, places;
  };
  Run run(double until_s, unsigned seed) const {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> off(-1.0, 1.0);
    const auto size = static_cast<std::size_t>(n);
    const auto past = static_cast<std::size_t>(2 * delay + 1);
    using Row = std::vector<double>;
    Row phi(size), z(size), rate(size, omega), speed(size, omega * mean);
    for (double& p : phi) p = 0.2 * off(random);
    for (double& p : z) p = 0.05 * off(random);
    std::vector<Row> phis(past, phi), zs(past, z), rates(past, rate), speeds(past, speed),
        told(past, rate), lengths(past, Row(size, 0.0));
    for (std::size_t back = 1; back < past; ++back) {  // so far all went on evenly
      for (std::size_t i = 0; i < size; ++i) {
        phis[back][i] -= double(back) * kStep_s * omega,
            zs[back][i] -= double(back) * kStep_s * omega * mean;
      }
    }
    Run out;
    const auto late = static_cast<std::size_t>(delay);
    std::size_t now = 0;
    const auto at = [&](std::vector<Row>& rows, std::size_t back) -> Row& {
      return rows[(now + back) % past];
    };
    const auto apart = [](const Row& x) {
      double mean_x = 0.0, sum = 0.0;
      for (const double v : x) mean_x += v / static_cast<double>(x.size());
      for (const double v : x) sum += (v - mean_x) * (v - mean_x);
      return std::sqrt(sum);
    };
    for (double t = 0.0; t < until_s; t += kStep_s) {
      Row seen_phi = phi, seen_z = z;
      for (int g = n - guests; g < n; ++g) {
        const auto i = static_cast<std::size_t>(g);
        seen_phi[i] = at(phis, late)[i] + delay * kStep_s * at(rates, late)[i];
        seen_z[i] = at(zs, late)[i] + delay * kStep_s * at(speeds, late)[i];
      }
      for (int i = 0; i < n; ++i) {
        const auto a = static_cast<std::size_t>(i);
        double pull = 0.0, error = 0.0;
        for (int j = 0; j < n; ++j) {
          const int gap = std::abs(i - j);
          if (i == j || (ring && gap != 1 && gap != n - 1)) continue;
          pull += seen_phi[static_cast<std::size_t>(j)] - seen_phi[a];
          error += seen_z[a] - seen_z[static_cast<std::size_t>(j)];
        }
        at(told, 0)[a] = omega + k * pull;
        at(lengths, 0)[a] = -m * error;
        const bool guest = i >= n - guests;
        rate[a] = guest ? at(told, late)[a] : at(told, 0)[a];
        speed[a] = (1.0 + (guest ? at(lengths, late)[a] : at(lengths, 0)[a])) * rate[a] * mean;
      }
      at(rates, 0) = rate, at(speeds, 0) = speed, at(phis, 0) = phi, at(zs, 0) = z;
      out.phases.push_back(apart(phi)), out.places.push_back(apart(z));
      for (std::size_t i = 0; i < size; ++i)
        phi[i] += kStep_s * rate[i], z[i] += kStep_s * speed[i];
      now = (now + past - 1) % past;
    }
    return out;
  }
};

/// Rate of the fall to a millionth, from a tenth on. What waits for others may lag by e², where
/// both are as fast.
double measured(const std::vector<double>& e, bool waits) {
  std::size_t from = 0, to = 0;
  for (std::size_t i = 0; i < e.size(); ++i) {
    if (e[i] > 0.1 * e[0]) from = i;
    if (e[i] > 1e-6 * e[0]) to = i;
  }
  const double span_s = static_cast<double>(to - from) * Late::kStep_s;
  return to > from ? (std::log(e[from] / e[to]) + (waits ? 2.0 : 0.0)) / span_s : 1e9;
}

TEST(LateAgents, AreNoSlowerThanGuaranteed) {
  const mimesis::testing::TemporaryFolder folder;
  const std::string file = folder / "late.yaml", out = folder / "late.json";
  int promised = 0, refused = 0;
  double nearest = 1e9;
  const unsigned seeds = std::getenv("MIMESIS_CONFIGURATIONS") != nullptr ? 1500 : 60;
  for (unsigned seed = 1; seed <= seeds; ++seed) {
    const Late late(seed);
    std::ofstream(file) << late.file();
    (void)!std::system(
        (MIMESIS_BIN_DIR "/mimesis-crowd certify --json " + file + " >" + out).c_str());
    const json said = json::parse(std::ifstream(out), nullptr, false);
    ASSERT_FALSE(said.is_discarded()) << late.file();
    for (const json& rule : said["stages"][0]["rules"]) {
      const std::string name = rule["rule"];
      if (name != "III phase" && name != "II length") continue;
      if (rule["guarantee"] != "contracting") {
        ++refused;
        continue;
      }
      ++promised;
      const double rate = rule["guaranteed_1_s"];
      const Late::Run run = late.run(std::min(40.0 / rate, 600.0), seed);
      const double seen =
          name == "III phase" ? measured(run.phases, false) : measured(run.places, true);
      EXPECT_GT(seen, 0.98 * rate) << name << ", seed " << seed << '\n' << late.file();
      nearest = std::min(nearest, seen / rate);
    }
  }
  std::cout << promised << " rates promised, " << refused
            << " rules without, nearest measured/guaranteed " << nearest << '\n';
  EXPECT_GT(promised, 40);
  EXPECT_GT(refused, 5);
}

}  // namespace
