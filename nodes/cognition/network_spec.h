#pragma once
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "nodes/cognition/neural_field.h"

namespace mimesis::cognition {

/// One field, and the places on its axis that have a meaning.
struct FieldSpec {
  std::string name;
  FieldParams params{};
  std::vector<std::string> sites;
  /// Position of each site [1], in a 2-D field x and y in turn; empty: evenly spaced on a 1-D axis.
  std::vector<double> at{};
};

/// Synapses from one field to another [M18 fig. 2.5].
struct LinkSpec {
  std::string from, to;
  /// Peak input that a self-sustained pattern of `from` gives to its partner [1]. Above the
  /// threshold of ignition (2.2 for a field at rest) it drives the partner, below it preshapes it.
  double gain = 0.0;
  /// dense: a weight for each pair of neurons; low_rank: factors of eq. 2.4, which cannot learn;
  /// gaussian: falls with the distance of neurons along the axis that both fields have.
  std::string form = "dense";
  /// When it learns: never; babbling: by eq. 2.3 in the file's own episodes; success: by eq. 2.3
  /// when there is a reward; always: by eq. 2.8 in each demonstration. Then `gain` scales what it
  /// transmits, and `initial` is the weight of all its synapses at the start.
  std::string learns = "never";
  double initial = 0.02;             ///< [1]
  std::vector<std::string> pairs{};  ///< "SITE>SITE": links by eq. 2.4 from the start
  double width = 5.0;                ///< gaussian: σ [1]
  std::string along = "x";           ///< gaussian: the axis of the 2-D field

  std::string name() const { return from + "->" + to; }
};

/// A kind of Gaussian input: what it gives to one field.
struct InputSpec {
  std::string name;                  ///< "vision"; inputs of one name come together
  std::string into;                  ///< field
  double gain = 0.0;                 ///< amplitude at full confidence [1]
  std::vector<std::string> sites{};  ///< where it acts; empty: everywhere
};

/// Learning by eq. 2.3 and 2.8.
struct LearningSpec {
  double tau_s = 0.4;     ///< τ_s, much longer than the τ of the fields [s]
  double window_s = 2.0;  ///< duration of the reward of a success, and of an episode [s]
  /// Activity that makes a neuron part of a population: u_TH. Below it, what is merely preshaped
  /// would be linked as if it had been decided [1].
  double local_above = 0.0;
  ShuntedParams shunted{};  ///< of links that learn always
};

/// Coupled fields as a file describes them (network_file.h reads it). Names are resolved and
/// checked by FieldNetwork.
struct NetworkSpec {
  double dt_s = 0.001;          ///< Euler step [s]
  double input_width = 5.0;     ///< σ of all inputs [1]
  double input_window_s = 0.6;  ///< duration of a transient input [s]
  LearningSpec learning{};
  std::vector<FieldSpec> fields;
  std::vector<LinkSpec> links;
  std::vector<InputSpec> inputs;
  /// Episodes "FIELD=SITE FIELD=SITE ..." in which links that learn by babbling are acquired: the
  /// robot moves, sees itself, and its fields take part.
  std::vector<std::string> babbling;
  /// Where the value at a path ("links.2.gain") was written; empty: not in a file.
  std::function<std::string(const std::string& path)> place;

  std::size_t field_index(std::string_view name) const;  ///< fields.size() if there is none
  std::size_t link_index(std::string_view name) const;   ///< @throws ConfigError if there is none
  /// -1 if there is none.
  static int site_index(const FieldSpec& field, std::string_view site);
  /// The gains of all links between two fields, or of an input, by name: for studies.
  double& gain(std::string_view link) { return links[link_index(link)].gain; }
  double& input_gain(std::string_view name, std::string_view into);

  /// @throws ConfigError "file:line:col: links.2: what"
  [[noreturn]] void fail(const std::string& path, const std::string& what) const;
};

/// Where the sites of a field are.
struct SitePlace {
  double x = 0.0, y = 0.0;  ///< [1]
};
SitePlace site_place(const FieldSpec& field, int site);

}  // namespace mimesis::cognition
