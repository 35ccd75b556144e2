#include <atomic>
#include <exception>
#include <future>
#include <thread>
#include <vector>

#include "tools/mimesis/walk/trial.h"

namespace mimesis::walk {

void run_trials(std::span<const TrialSpec> trials, int jobs,
                const std::function<void(const TrialResult&)>& done) {
  std::vector<std::promise<TrialResult>> results(trials.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < trials.size(); i = next++) {
      try {
        results[i].set_value(run_trial(trials[i]));
      } catch (...) {
        results[i].set_exception(std::current_exception());
        next = trials.size();  // the others would be for nothing
      }
    }
  };
  std::vector<std::jthread> workers;
  for (int i = 0; i < jobs; ++i) workers.emplace_back(work);
  for (auto& result : results) done(result.get_future().get());
}

}  // namespace mimesis::walk
