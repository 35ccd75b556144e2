#include "experiments/walk/trial/in_order.h"
#include "experiments/walk/trial/trial.h"

namespace mimesis::walk {

void run_trials(std::span<const TrialSpec> trials, int jobs,
                const std::function<void(const TrialResult&)>& done) {
  in_order<TrialResult>(
      trials.size(), jobs, [&](std::size_t i) { return run_trial(trials[i]); }, done);
}

}  // namespace mimesis::walk
