#pragma once
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "nodes/cognition/field_network.h"

namespace mimesis::cognition {

/// Inputs that drove one field over the threshold u = 0.
struct Reason {
  struct Part {
    std::size_t from;    ///< index into Reasons::names()
    double input = 0.0;  ///< at the most active neuron [1]
  };
  double onset_s = -1.0;    ///< after the onset of the inputs; negative: never [s]
  int site = -1;            ///< of the most active neuron
  double lead = 0.0;        ///< share of its input that the best other site lacks, 0..1 [1]
  std::vector<Part> parts;  ///< all inputs and links of the field, the largest first
};

/// Watches a network and notes, when a field ignites, which inputs and links carried it. After the
/// constructor it does not allocate. `names`: the links, then "task" and what is shown.
class Reasons {
 public:
  explicit Reasons(const FieldNetwork<float>& network);

  void reset();
  /// To be called after each step, with its stimulus; `constant` is the part of it that is always
  /// there. @param shown name of the other part
  void observe(const FieldNetwork<float>& network, const Stimulus& constant,
               const Stimulus& stimulus, std::string_view shown, double time_s);

  const std::vector<Reason>& fields() const { return fields_; }
  const std::vector<std::string>& names() const { return names_; }
  /// Least lead of PF, F5g, F5t and PFC: how clearly the decision won, 0..1 [1].
  double confidence() const;

 private:
  void note(const FieldNetwork<float>& network, std::size_t field, const Stimulus& constant,
            const Stimulus& stimulus);

  std::vector<std::string> names_;
  std::vector<Reason> fields_;
  std::size_t shown_;  // index of the name of what is shown now
};

}  // namespace mimesis::cognition
