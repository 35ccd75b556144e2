#pragma once
#include <Eigen/Core>
#include <array>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "nodes/cognition/field_network.h"
#include "nodes/cognition/symbols.h"

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

/// Bundles of the robot's own motions, sorted without labels [M18 2.3.1]: a motion belongs to the
/// nearest bundle if that is near enough, else it begins a new one. Bundles keep their numbers.
class Bundles {
 public:
  struct Bundle {
    Eigen::MatrixXd mean;  ///< joints x postures, evenly along the motion [rad]
    int motions = 0;
  };

  /// @param most  number of bundles that are told apart
  /// @param radius_rad  farthest motion of a bundle from its mean, by mean distance of postures
  Bundles(std::size_t most, double radius_rad) : most_(most), radius_rad_(radius_rad) {}

  /// Sorts a motion in. Its bundle; -1 if it is like none and all are taken, or if it has another
  /// number of joints or postures than those known.
  int add(const Eigen::MatrixXd& motion);
  /// Bundles that were kept in a file; at most `most`.
  void restore(std::vector<Bundle> bundles) { all_ = std::move(bundles); }
  const std::vector<Bundle>& all() const { return all_; }
  std::size_t most() const { return most_; }

 private:
  std::size_t most_;
  double radius_rad_;
  std::vector<Bundle> all_;
};

/// Decisions of the network: means from F5, goal from PFC, colour from COL.
struct Decision {
  Grip grip = Grip::unknown;
  Transport transport = Transport::unknown;
  Goal goal = Goal::unknown;
  Color color = Color::unknown;
  /// Exactly one peak in each of F5g, F5t and PFC, and all fields but STS at rest: |u̇| < 1 per
  /// second.
  bool settled = false;

  bool operator==(const Decision&) const = default;
};

/// A layer without exactly one peak reads `unknown`. O(7 N), does not allocate.
template <class Real>
Decision read_decision(const FieldNetwork<Real>& network);

/// Why the present activity is no decision, as "PFC has no peak"; empty if it is one.
template <class Real>
std::string indecision(const FieldNetwork<Real>& network);

extern template Decision read_decision(const FieldNetwork<float>&);
extern template Decision read_decision(const FieldNetwork<double>&);
extern template std::string indecision(const FieldNetwork<float>&);
extern template std::string indecision(const FieldNetwork<double>&);

struct ImitatorParams {
  /// Sequences rehearsed with reward before the first demonstration (task::parse_demonstration):
  /// the robot "is familiar with the task" [M18 2.4.2]. Empty: it must learn from its own
  /// successes.
  std::vector<std::string> practice = {"precision,above,high", "full,below,low"};
  /// Goals of the task, as expected_goals() reads them.
  std::vector<std::string> goals = {"high", "low"};
  /// From one symbol's onset in the fields to that of the next, in the order in which they were
  /// seen; what was seen at once begins at once. 0: all begin together [s].
  double order_s = 0.0;
  /// A demonstration with hidden parts counts as over when nothing new was seen for this time [s].
  double patience_s = 5.0;
  /// Fields that have not settled by then will not: every reference trial does within 1 s [s].
  double indecision_s = 3.0;
  int alternatives = 2;   ///< decisions tried after one for which there is no plan
  bool rehearse = false;  ///< asks for a test plan with the grip that was seen before it decides
  double rehearsal_s = 20.0;  ///< longest wait for the answer to a test plan [s]
  /// Width of the bundles whose sites are those of a field with an input `bundle` (Bundles) [rad].
  double bundle_rad = 1.0;
};

/// Watches one demonstration after the other, lets the network decide, and learns from success.
///
///   waiting --an action seen--> watching --complete, or patience over--> deciding --stable-->
///   with `rehearse`: watching --action over--> considering --test plan answered--> deciding
///   decided --no plan--> deciding (inhibits what failed) --not stable for indecision_s-->
///   undecided --something new seen--> watching
///   any --no action seen any more: a new demonstration--> waiting (fields at rest, links stay)
///
/// A demonstration that is complete is learned by the links that learn always; one with hidden
/// parts lets them tell what follows. A colour alone is no action: an object that stands there
/// starts and ends nothing. While it considers, the grip that was seen is all that reaches the
/// fields, and nothing is expected: PF is undecided between the combinations with this grip. The
/// first for which there is a test plan gets input in F5, the others are inhibited; what else was
/// seen follows [M18 fig. 2.22]. Else what was seen drives the fields when the demonstration is
/// over, in the order in which it was seen, `order_s` apart: a hand takes seconds from grasp to
/// goal, and the means would always be decided before the goal can override them [M18 fig. 2.21].
class Imitator {
 public:
  enum class Stage { waiting, watching, considering, deciding, decided, undecided };

  /// Practises; some hundred milliseconds of computation. With `recall`, which brings links learned
  /// before, it does that instead. @throws ConfigError for impossible constants, or a network
  /// that does not begin with the fields of symbols.h.
  explicit Imitator(const ImitatorParams& params, const NetworkSpec& spec,
                    const std::function<void(FieldNetwork<float>&, Bundles&)>& recall = {});

  /// Replaces what the task holds (expected_goals()): for fields that wait at once, else from the
  /// next inputs on.
  void expect(const std::array<double, 2>& each_goal);

  /// Takes what vision holds now. Not calling it (no fresh image) stops the clock of `patience_s`.
  /// @param complete the teacher's action is over
  void observe(const Demonstration& observed, bool complete, double period_s);
  /// Advances the fields by `period_s`, a multiple of the spec's dt_s. Does not allocate.
  /// @param success the planner has a complete plan for this decision: rewards it, once, for the
  /// window
  void advance(double period_s, bool success);
  /// The planner has no plan for the decision. Other means for the goal are tried first, as the
  /// goal has the priority; if they fail too, the goal is given up and the means decide.
  void refuse();
  /// The motion that was planned for the decision, joints x postures [rad]: the bundle to which it
  /// belongs takes part in the reward that follows. False if it fits none, and none is left.
  bool planned(const Eigen::MatrixXd& motion);
  /// Mean of the bundle that the decision named when it fell; null: none, or more than one.
  const Eigen::MatrixXd* preselected() const {
    return decided() && preselected_.size() > 0 ? &preselected_ : nullptr;
  }
  const Bundles& bundles() const { return bundles_; }

  /// Means and goal to be planned as a test; null in other stages than `considering`.
  const Demonstration* proposal() const {
    return stage_ == Stage::considering ? &proposals_[proposal_] : nullptr;
  }
  /// The answer to the proposal, after which the next one may follow.
  void answer(bool feasible);

  Stage stage() const { return stage_; }
  /// Before Stage::decided: the present activity of the fields, not settled. After: the decision,
  /// which stays.
  const Decision& decision() const { return decision_; }
  const Demonstration& shown() const { return seen_; }
  bool learning() const { return learning_; }  ///< links changed in the last advance()
  /// a whole window, for this decision
  bool learned() const { return decided() && reward_left_ == 0; }
  bool decided() const { return stage_ == Stage::decided; }
  /// The inputs that drove the fields since their onset.
  const Reasons& reasons() const { return reasons_; }
  /// Since the onset of the inputs, with the time of test plans [s].
  double deciding_s() const { return considered_s_ + deciding_s_; }
  /// Why there is no decision; empty in other stages than `undecided`.
  const std::string& reason() const { return reason_; }
  /// Which symbol of this demonstration is not used, since it was seen with both values in turn;
  /// empty: none.
  const std::string& doubt() const { return doubt_; }
  /// Practice sequences that the robot would not do, because it had learned another before.
  const std::vector<std::string>& refused() const { return refused_; }
  const FieldNetwork<float>& network() const { return network_; }

 private:
  Demonstration without_contradictions(Demonstration seen);
  void consider();
  void begin_anew();
  TaskInput expectation(double means = 1.0) const {
    return {.means = means, .each_goal = each_goal_};
  }
  void present();
  void drive_with(const Demonstration& seen);
  void present_at(long step);
  long steps(double duration_s) const;
  void give_up(std::string reason);
  void preselect();

  ImitatorParams params_;
  std::array<double, 2> each_goal_;
  FieldNetwork<float> network_;
  Reasons reasons_;
  Stimulus task_, shown_;           // task input with what failed inhibited; with vision
  Stimulus planned_, with_bundle_;  // task_ with the means of a test plan; with bundle_
  std::size_t bundle_field_;        // of the spec's fields; past the last: there is none
  Bundles bundles_;
  int bundle_ = -1;  // of the plan for the decision
  Eigen::MatrixXd preselected_;
  std::vector<Demonstration> proposals_;
  std::size_t proposal_ = 0;
  double considering_s_ = 0.0;  // waiting for the answer to one proposal
  double considered_s_ = 0.0, onset_s_ = 0.0;
  Stage stage_ = Stage::waiting;
  Demonstration seen_, driving_;
  std::array<int, kSymbols> rank_{};  // when each symbol of seen_ appeared
  int events_ = 0;
  std::array<int, kSymbols> known_{},
      changes_{};                       // last value that was not unknown; how often another
  std::array<long, kSymbols> onset_{};  // of driving_, in network steps from the first
  long window_ = 0;                     // until the last of them is over
  unsigned presented_ = 0;              // bits of the symbols that are in shown_
  Decision decision_;
  double unchanged_s_ = 0.0, deciding_s_ = 0.0;
  long plan_left_ = 0, window_left_ = 0, reward_left_ = 0;  // network steps
  bool learning_ = false;
  int refusals_ = 0;
  std::string reason_, doubt_;
  std::vector<std::string> refused_;
};

}  // namespace mimesis::cognition
