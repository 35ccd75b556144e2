#pragma once
#include <cstdint>
#include <optional>
#include <unordered_map>

namespace mimesis::crowd {

/// Logarithm of a value over time: running means and sums of squares [Welford].
struct LogLine {
  double count = 0.0, origin_s = 0.0, last_s = 0.0;
  double mean_t = 0.0, mean_y = 0.0, var_t = 0.0, cov = 0.0, first_y = 0.0, last_y = 0.0;

  void add(double t_s, double value);
};

/// Rate of an exponential decay while it is measured: least squares of log R over time, of those R
/// that lie in a band. R of phases is the angular dispersion [M18 4.3.6], in [1e-6, 3e-2]: above,
/// it does not decay exponentially yet, below it is rounding. O(1) a sample, does not allocate.
class RateFit {
 public:
  /// 0 < least < most
  RateFit(double least, double most) : least_(least), most_(most) {}

  /// Samples in the order of time. A sample above the band starts again; one below it, or not a
  /// number, is left out.
  void add(double t_s, double value);
  void restart();
  /// From here on the band ends at `least`, which may be above its other end: then there is no
  /// rate.
  void set_least(double least) { least_ = least; }

  /// Once the values have fallen by the factor e² at least, in eight samples or more [1/s]; a rate
  /// below zero is growth, which needs as much.
  std::optional<double> rate_1_s() const;
  double lasted_s() const { return line_.last_s - line_.origin_s; }  ///< of the samples
  /// When the fitted line is at `value` > 0, if there is a rate [s]. At 1 it ends the offset time
  /// before the decay [M18 4.3.6].
  std::optional<double> reaches_s(double value) const;

 private:
  double least_, most_;
  LogLine line_;
};

/// Rate at which headings of many agents converge to their wished ones, one slope of the logarithm
/// for all of their turns: each is a line of its own, pooled by least squares. A disturbance ends a
/// turn. Turns that stall or grow count as those that fall. O(1) a sample; allocates for an agent
/// that is seen for the first time.
class TurnFit {
 public:
  /// 0 < least < most, of the errors that are taken
  TurnFit(double least, double most) : least_(least), most_(most) {}

  /// Samples of one agent in the order of time. An error outside of the band, or NaN, ends a turn,
  /// and so does a pause of a second.
  void add(std::uint64_t agent, double t_s, double error);
  void restart();
  /// As of RateFit.
  void set_least(double least) { least_ = least; }

  /// Rate [1/s] over turns of eight samples or more, once together they fell or grew by the factor
  /// e, or lasted five seconds; below zero: the disorder grows.
  std::optional<double> rate_1_s() const;

 private:
  struct Sums {
    double var_t = 0.0, cov = 0.0, went = 0.0, lasted_s = 0.0;
    void add(const LogLine& turn);
  };

  double least_, most_;
  Sums ended_;
  std::unordered_map<std::uint64_t, LogLine> turns_;
};

}  // namespace mimesis::crowd
