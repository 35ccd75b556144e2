#pragma once
#include <string>

#include "common/runtime/job.h"
#include "common/runtime/log.h"
#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "nodes/cognition/imitator.h"
#include "nodes/cognition/network_file.h"
#include "proto/cognition.pb.h"
#include "proto/planner.pb.h"
#include "proto/vision.pb.h"
#include "proto/world.pb.h"

namespace mimesis::cognition {

struct CognitionParams {
  double rate_hz = 100.0;   ///< step rate; its period is a multiple of dt_s [Hz]
  double fields_hz = 25.0;  ///< rate of port `fields`; 0: never [Hz]
  double stale_s = 0.5;     ///< an older observation is not used [s]
  double sight_s = 0.07;    ///< sight is lost with an older observation; 0: never [s]
  double task_stale_s =
      2.5;  ///< an older task status rewards nothing (the planner repeats it at 1 Hz) [s]
  std::string network = kBarFields;  ///< file of fields, links and inputs
  std::string links{};       ///< file of links learned before, instead of practice; empty: none
  std::string save_links{};  ///< file for the links after every learning; empty: none
  ImitatorParams imitator{};

  void visit(runtime::ParamVisitor& v) {
    v("rate_hz", rate_hz, 1.0, 1000.0);
    v("fields_hz", fields_hz, 0.0, 1000.0);
    v.changeable([&] {
      v("stale_s", stale_s, 0.01, 60.0);
      v("sight_s", sight_s, 0.0, 60.0);
      v("task_stale_s", task_stale_s, 0.01, 60.0);
    });
    v.file("network", network, "neural fields");
    v("practice", imitator.practice);
    v("goals", imitator.goals);
    v("order_s", imitator.order_s, 0.0, 10.0);
    v.file("links", links, "learned links", false);
    v("save_links", save_links);
    v("patience_s", imitator.patience_s, 0.1, 600.0);
    v("rehearse", imitator.rehearse);
    v("rehearsal_s", imitator.rehearsal_s, 0.1, 600.0);
  }
};

/// Decides goal and means of an observed action, and learns what led to a feasible plan.
class CognitionNode {
 public:
  using Params = CognitionParams;
  /// @throws ConfigError if the spec cannot work, the period is no multiple of its dt_s, a
  /// practice sequence has an unknown word, or the file of links does not fit.
  CognitionNode(const Params& params, runtime::Bus& bus);
  void step(runtime::Time now);
  void change(const Params& params) { params_ = params; }

 private:
  void watch(runtime::Time now);
  void hear_goals();
  bool succeeded(runtime::Time now);
  void ask_for_a_test_plan(runtime::Time now);
  void report_indecision(runtime::Time now);
  void sort_in(const v1::TaskStatus& task);
  void tell_changes(runtime::Time now);
  void save_what_was_learned();
  v1::Decision decision_message() const;
  void publish_decision(runtime::Time now);
  void explain(runtime::Time now);
  void publish_fields(runtime::Time now);
  double dt_s() const { return imitator_.network().spec().dt_s; }

  Params params_;
  runtime::Latest<v1::Observation> observation_;
  runtime::Latest<v1::TaskStatus> task_;
  runtime::Out<v1::Decision> decision_;
  runtime::Out<v1::FieldActivity> fields_;
  runtime::Latest<v1::TaskStatus> test_plan_;
  runtime::Latest<v1::TaskGoals> goals_;
  runtime::Out<v1::Decision> proposal_;
  runtime::Out<v1::TrialOutcome> outcome_;
  runtime::Out<v1::Explanation> explanation_;
  runtime::PortsEnd ports_end_;
  Imitator imitator_;
  double period_s_;
  long fields_every_, tick_ = 0;  // steps between two messages on `fields`; steps since the start
  Imitator::Stage stage_ = Imitator::Stage::waiting;
  runtime::Time decided_{}, entered_{}, asked_{};  // entered: of the present stage
  const Demonstration* proposed_ = nullptr;
  bool reported_ = false;  // this indecision
  bool doubted_ = false;   // in this demonstration
  bool saved_ = true;
  bool learns_always_ = false;                     // a link of the spec
  runtime::Job<std::string> saving_;               // beside the steps; why it failed
  bool replaying_;                                 // a replay writes no file
  bool plan_seen_ = false, failure_told_ = false;  // for the present decision
  v1::FieldActivity activity_;                     // kept, so that its buffers are
  runtime::Throttle bad_input_{std::chrono::seconds(1)}, bad_goals_{std::chrono::seconds(1)};
};

}  // namespace mimesis::cognition
