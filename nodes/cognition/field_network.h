#pragma once
#include <string_view>
#include <vector>

#include "nodes/cognition/network_spec.h"
#include "nodes/cognition/neural_field.h"
#include "nodes/cognition/symbols.h"

namespace mimesis::cognition {

/// Amplitudes of the Gaussian inputs, per field and site [1].
class Stimulus {
 public:
  explicit Stimulus(const NetworkSpec& spec) {
    for (const FieldSpec& f : spec.fields) amplitude_.emplace_back(f.sites.size(), 0.0);
  }
  double& at(std::size_t field, int site) {
    return amplitude_[field][static_cast<std::size_t>(site)];
  }
  double at(std::size_t field, int site) const {
    return amplitude_[field][static_cast<std::size_t>(site)];
  }
  double& at(Layer layer, int site) { return at(index(layer), site); }

 private:
  std::vector<std::vector<double>> amplitude_;
};

/// Adds `share` of the inputs `name` into a field, at one of their sites, or at all (-1).
void add_input(const NetworkSpec& spec, std::string_view name, std::size_t field, int site,
               double share, Stimulus& to);

/// Coupled fields of a network; the shipped one matches observations with the robot's actions
/// and goals [M18 fig. 2.2]:
///
///   STSg ──┬──> F5g <─┐         COL      STS->PF, STS->F5, PF<->F5: the robot's own
///          └──> PF <──┼──<──> PFC <─┘    PF<->PFC, COL<->PFC: learned from success (eq. 2.3)
///   STSt ──┬──> PF    │
///          └──> F5t <─┘
///
/// Links that learn always follow eq. 2.8 while recall() is off, so that events that come one after
/// the other are linked in their order [M18 2.5], and transmit while it is on: a link that acts
/// while it learns brings its target too early, which links it backwards. A step is O(neurons ·
/// 8σ/dx + learned weights); it does not allocate, and the same inputs give the same bits.
template <class Real>
class FieldNetwork {
 public:
  /// Settles the pattern of each site, links pairs by eq. 2.4, lets the robot babble.
  /// @throws ConfigError "file:line:col: ..." for names and sizes that do not fit, constants that
  /// allow no self-sustained pattern, unstable gains.
  explicit FieldNetwork(NetworkSpec spec);
  /// A gain is unstable if fields ignite with nothing but the constant inputs, "task". To be
  /// checked again with learned links, or another constant input. Leaves the fields at rest.
  /// @throws ConfigError that names the gain
  void check_rest();
  void check_rest(const Stimulus& constant);

  /// Advances all fields by dt; with `reward` links that learn from success follow eq. 2.3.
  void step(const Stimulus& stimulus, bool reward = false);
  void recall(bool on) { recalling_ = on; }  ///< on at the start
  /// Activity back to rest. Links stay.
  void reset();

  const NetworkSpec& spec() const { return spec_; }
  const NeuralField<Real>& field(std::size_t i) const { return fields_[i]; }
  const NeuralField<Real>& field(Layer layer) const { return fields_[index(layer)]; }
  /// Links by name, "PF->PFC"; @throws ConfigError if there is none. Gaussian ones are between the
  /// axes.
  const Link<Real>& link(std::string_view name) const { return find(name).weights; }
  /// Present input of one neuron of a field from one link (by index) or stimulus [1].
  double input_at(std::size_t link, std::size_t field, std::size_t neuron) const;
  double input_at(const Stimulus& stimulus, std::size_t field, std::size_t neuron) const;

  /// Adds `factor` times the link that a full reward window would leave between two patterns
  /// [eq. 2.4].
  void install(std::string_view name, int source_site, int target_site, double factor = 1.0);
  /// A lesion: the link transmits nothing until it is learned again.
  void cut(std::string_view name) { find(name).weights.clear(); }
  /// One synapse as it was learned before.
  void set_weight(std::string_view name, std::size_t target, std::size_t source, Real weight) {
    find(name).weights.set_weight(target, source, weight);
  }
  /// η of eq. 2.3 for one link.
  double eta(std::string_view name) const { return find(name).eta; }

 private:
  enum class Learns { never, babbling, success, always };
  struct Connection {
    std::size_t source, target;
    Learns learns;
    double eta;
    Link<Real> weights;
    std::vector<Real> source_axis{},
        target_axis{};  // gaussian, of a 2-D field: sums along the axis
    bool along_y = false;
  };
  struct Pairing {
    int source, target;
  };

  void add_field(std::size_t i);
  void settle_pattern(std::size_t field, std::size_t site);
  void add_link(std::size_t i);
  void add_gaussian(std::size_t i, Connection& c);
  void check_input(std::size_t i) const;
  Pairing pairing(std::size_t link, std::size_t pair) const;
  void babble(std::size_t episode);
  void advance(const Stimulus& stimulus);
  std::size_t known_field(const std::string& path, const std::string& name) const;

  void transmit(Connection& c);
  void learn(Connection& c, Real fraction);
  typename Link<Real>::Above above(const Connection& c) const;
  Real above(std::size_t field) const;
  Connection& find(std::string_view name) { return links_[spec_.link_index(name)]; }
  const Connection& find(std::string_view name) const { return links_[spec_.link_index(name)]; }

  NetworkSpec spec_;
  bool recalling_ = true;
  std::vector<NeuralField<Real>> fields_;
  std::vector<Connection> links_;
  std::vector<std::vector<std::vector<Real>>> bumps_;     // field, site: unit Gaussian of inputs
  std::vector<std::vector<std::vector<Real>>> patterns_;  // f₂(ū) of a self-sustained pattern
};

extern template class FieldNetwork<float>;
extern template class FieldNetwork<double>;

/// Suprathreshold activity of one field. A peak is a run of neighbours with u > 0 = u_TH
/// [M18 2.2.2].
struct Peaks {
  int count = 0;
  int site = -1;       ///< nearest to the most active neuron; -1 without a peak
  double max_u = 0.0;  ///< maximum of the whole field [1]
};

/// Does not allocate. Of a 2-D field the peaks are not counted: 1 if there is any.
template <class Real>
Peaks read_peaks(const FieldNetwork<Real>& network, std::size_t field);
template <class Real>
Peaks read_peaks(const FieldNetwork<Real>& network, Layer layer) {
  return read_peaks(network, index(layer));
}

extern template Peaks read_peaks(const FieldNetwork<float>&, std::size_t);
extern template Peaks read_peaks(const FieldNetwork<double>&, std::size_t);

}  // namespace mimesis::cognition
