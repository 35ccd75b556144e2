#include "nodes/crowd/scenario/rule_faults.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

#include "common/error.h"

namespace mimesis::crowd {
namespace {

std::string text(double v) {
  std::ostringstream out;
  out << v;
  return out.str();
}

class RuleFaults {
 public:
  RuleFaults(std::string path, const Group& group, bool grows, std::vector<Fault>& faults)
      : path_(std::move(path)), group_(group), grows_(grows), faults_(faults) {}

  void check(const FrequencyRule& r) {
    gain("frequency.gain_rad_m_s", "m_d", r.gain_rad_m_s,
         "step frequencies drive the agents apart (4.28)");
    not_negative("frequency.saturation_m", "saturation", r.saturation_m);
    not_negative("frequency.low_pass_rad_s", "alpha of the low-pass", r.low_pass_rad_s);
    if (r.gain_rad_m_s != 0.0) {
      graph("frequency", r.graph, group_.count);
      distances("frequency");
    }
  }

  void check(const LengthRule& r) {
    gain("length.gain_1_m", "m_z", r.gain_1_m, "step lengths drive the agents apart (4.30)");
    if (!(r.limit > 0.0 && r.limit < 1.0)) {
      add("length.limit",
          "|mu| <= " + text(r.limit) + ": with |mu| in (0, 1) everybody walks forward, 1 + mu > 0");
    }
    if (r.gain_1_m != 0.0) {
      graph("length", r.graph, group_.count);
      distances("length");
    }
  }

  void check(const PhaseRule& r) {
    gain("phase.gain_1_s", "k", r.gain_1_s, "the coupling repels phases (4.31)");
    gain("phase.leader_gain_1_s", "alpha", r.leader_gain_1_s, "the leader repels (4.26)");
    if (r.leader_gain_1_s != 0.0) {
      if (group_.count == 1 && !grows_) add("phase.leader_gain_1_s", "a leader without followers");
      // Followers alone are coupled; the leader holds together whatever parts they fall into.
      if (r.graph.topology != Topology::none) made(r.graph, "phase", group_.count - 1);
    } else if (r.gain_1_s != 0.0) {
      graph("phase", r.graph, group_.count);
    }
  }

  void check(const HeadingRule& r) {
    if (r.kind == HeadingKind::keep) return;
    gain("heading.gain", "the gain", r.gain, "headings are repelled (4.32, 4.41)");
    if (r.gain == 0.0) add("heading.gain", "is 0: nothing turns; keep says that");
    not_negative("heading.low_pass_s", "the low-pass", r.low_pass_s);
    not_negative("heading.spread_rad", "sigma", r.spread_rad);
    if (r.kind == HeadingKind::lane && !(r.ahead_m > 0.0)) {
      add("heading.ahead_m", "the sliding goal is " + text(r.ahead_m) + " m ahead; it must be > 0");
    }
    if (r.kind == HeadingKind::coupled) graph("heading", r.graph, group_.count);
    if (r.kind == HeadingKind::goal && group_.goals.aim == Aim::none && group_.count > 0) {
      add("heading.kind", "goal, but the group has no goals");
    }
  }

 private:
  void add(const std::string& key, const std::string& what) {
    faults_.push_back({path_ + "." + key, what});
  }

  void not_negative(const std::string& key, const std::string& name, double value) {
    if (!std::isfinite(value) || value < 0.0) {
      add(key, name + " is " + text(value) + ", it must be finite and not negative");
    }
  }

  void gain(const std::string& key, const std::string& name, double value, const char* harm) {
    if (!std::isfinite(value)) {
      add(key, name + " is " + text(value) + ", not a number to couple with");
    } else if (value < 0.0) {
      add(key, name + " = " + text(value) + " < 0: " + harm +
                   "; the Jacobian is not negative definite, contraction needs " + name + " > 0");
    }
  }

  void distances(const std::string& rule) {
    if (group_.formation.shape == Shape::none) {
      add(rule, "controls distances d_ij, but the group has no formation");
    }
  }

  /// @returns whether it is connected; nothing if there is none
  std::optional<bool> made(const GraphSettings& settings, const std::string& rule, int n) {
    if (!settings.edges.empty() && settings.topology != Topology::weighted) {
      add(rule + ".edges", "the graph is " + std::string(to_string(settings.topology)) +
                               " already: expected one of graph and edges");
      return std::nullopt;
    }
    if (grows_ && settings.topology == Topology::weighted) {
      add(rule + ".edges", "agents may join this group: its graph needs a name, edges fix N");
      return std::nullopt;
    }
    try {
      return coupling(settings, std::max(n, 0)).connected();
    } catch (const ConfigError& e) {
      if (!grows_) add(rule + (settings.edges.empty() ? ".graph" : ".edges"), e.what());
      return std::nullopt;  // a group that grows may have too few agents for it so far
    }
  }

  void graph(const std::string& rule, const GraphSettings& settings, int n) {
    if (settings.topology == Topology::none) {
      add(rule, "has a gain, but graph none couples nobody: the rule would do nothing");
      return;
    }
    if (n == 1 && !grows_) {
      add(rule, "N = 1: the Laplacian of one agent is 0, there is nobody to agree with");
      return;
    }
    if (made(settings, rule, n).value_or(true)) return;
    add(rule + (settings.edges.empty() ? ".graph" : ".edges"),
        "the coupling graph of " + std::to_string(n) +
            " agents is not connected: its algebraic connectivity lambda_2 is 0, and parts that do "
            "not hear each other do not agree (A.1)");
  }

  std::string path_;
  const Group& group_;
  bool grows_;
  std::vector<Fault>& faults_;
};

}  // namespace

void add_rule_faults(const std::string& path, const Rules& rules, const Group& group, bool grows,
                     std::vector<Fault>& faults) {
  RuleFaults check(path, group, grows, faults);
  check.check(rules.frequency);
  check.check(rules.length);
  check.check(rules.phase);
  check.check(rules.heading);
}

}  // namespace mimesis::crowd
