#pragma once
#include <cstdint>
#include <optional>
#include <unordered_map>

namespace mimesis::crowd {

/// Rate at which headings of many agents come to where each wants to go, one slope of the logarithm
/// for all of their turns: each is a line of its own, pooled by least squares. What disturbs a turn
/// ends it. O(1) a sample; allocates for an agent that is seen for the first time.
class TurnFit {
 public:
  /// 0 < least < most, of the errors that are taken
  TurnFit(double least, double most) : least_(least), most_(most) {}

  /// Samples of one agent in the order of time. An error outside of the band, or NaN, ends a turn,
  /// and so does a pause of a second.
  void add(std::uint64_t agent, double t_s, double error);
  void restart();

  /// Of turns that fell by the factor e at least, in eight samples or more [1/s].
  std::optional<double> rate_1_s() const;

 private:
  /// Running means and sums of squares [Welford].
  struct Turn {
    double count = 0.0, origin_s = 0.0, last_s = 0.0;
    double mean_t = 0.0, mean_y = 0.0, var_t = 0.0, cov = 0.0, first_y = 0.0, last_y = 0.0;
    bool counts() const;
  };
  void end(Turn& turn);

  double least_, most_;
  double var_t_ = 0.0, cov_ = 0.0;  // of turns that ended
  std::unordered_map<std::uint64_t, Turn> turns_;
};

}  // namespace mimesis::crowd
