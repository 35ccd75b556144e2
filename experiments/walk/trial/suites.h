#pragma once
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <future>
#include <iosfwd>
#include <nlohmann/json_fwd.hpp>
#include <random>
#include <span>
#include <thread>
#include <vector>

#include "experiments/walk/trial/trial.h"

namespace mimesis::walk {

/// Random numbers that do not depend on the standard library.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : engine_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * double(engine_() >> 11) * 0x1p-53;
  }
  bool coin() { return between(0.0, 1.0) < 0.5; }

 private:
  std::mt19937_64 engine_;
};

/// Runs job(0) .. job(n − 1) on `jobs` threads and calls `done` with the results in this order from
/// the calling thread. Jobs must not share mutable data. The first exception is rethrown.
template <class Result>
void in_order(std::size_t n, int jobs, const std::function<Result(std::size_t)>& job,
              const std::function<void(const Result&)>& done) {
  std::vector<std::promise<Result>> results(n);
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < n; i = next++) {
      try {
        results[i].set_value(job(i));
      } catch (...) {
        results[i].set_exception(std::current_exception());
        next = n;  // the others would be for nothing
      }
    }
  };
  std::vector<std::jthread> workers;
  for (int i = 0; i < jobs; ++i) workers.emplace_back(work);
  for (auto& result : results) done(result.get_future().get());
}

/// @return results of job(0) .. job(n − 1), in this order, computed on all processors.
template <class Job>
auto in_parallel(std::size_t n, const Job& job) {
  using Result = decltype(job(std::size_t{}));
  std::vector<Result> out;
  const auto jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  in_order<Result>(n, jobs, job, [&](const Result& result) { out.push_back(result); });
  return out;
}

/// Names that make_suite() knows.
const std::vector<std::string>& suite_names();

/// The errors of a lab's sensors, and a walker that is told of them: it finds its attitude itself
/// and knows the nominal stiffness of springs that its encoders do not see. `body.plant` is set
/// before.
void use_real_senses(hw::sim::BodyOptions& body, walker::StabilizerSettings& walker);

/// With real senses unless told otherwise.
struct SuiteOptions {
  explicit SuiteOptions(hw::sim::Plant plant = hw::sim::Plant::springs, bool real_senses = true);

  Engine engine = Engine::dart;
  std::uint64_t seed = 1;  ///< seed of all random numbers
  int delay_ticks = 1;     ///< 5 ms each
  hw::sim::BodyOptions body;
  walker::WalkerSettings walker;
  /// What the walker takes for the stiffness of each group of joints is wrong by up to this share,
  /// at random.
  double stiffness_error = 0.2;
};

/// Settings for trial `number` of a suite: each has an IMU, noise, and errors of stiffness of its
/// own.
void set_up(const SuiteOptions& options, std::size_t number, hw::sim::BodyOptions& body,
            walker::WalkerSettings& walker);

/// Trials of a suite:
///   steps30  thirty walks of 16 s at 0.1, 0.2 and 0.3 m/s with moving arms, turning, side drift,
///            changes of speed and pushes of up to 5 N s
///   plates30 the same walks over plates of 5 mm that the robot does not know
///   walks30  the same walks with pushes of 10 N s
///   pushes   15 N s standing and 10 N s walking at 0.2 m/s from eight sides, early and late in
///            a step
///   random200  two hundred robots that stand (one in five) or walk at up to 0.3 m/s, turning, arms
///            swinging by up to 1 rad, are pushed once: 5 to 20 N s within 0.05 to 0.5 s, from 3 to
///            8 s, from any side; friction 0.4 to 0.9, up to a tenth of the robot's mass unknown in
///            the trunk, sensors a tick later in every second, up to 20 % of their readings lost.
///            All evenly drawn from the seed. Whether steps can capture the push is told:
///            capturability()
///   speeds   steady walks: forward, back, sideways, turning, with arms
///   naive    the speeds without stabilizer and filter, which must be able to fall
/// Impulses are those of biped.urdf: for another robot's mass as much more or less.
/// Arms that are heavier for their robot than those of biped.urdf swing less, so that they disturb
/// it no more: JVRC-1's by less than a half.
/// @param robot  outlives the trials. @throws ConfigError for another name
std::vector<TrialSpec> make_suite(const std::string& name, const Robot& robot,
                                  const SuiteOptions& options);

nlohmann::ordered_json to_json(const TrialResult& result);
/// Worst figures of all trials, and every fall.
nlohmann::ordered_json summary_json(std::span<const TrialResult> results);
/// Prints one row per trial in mm, N m, N, µs.
void print_table(std::span<const TrialResult> results, std::ostream& out, bool bold_heading);

}  // namespace mimesis::walk
