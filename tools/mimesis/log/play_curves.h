#pragma once
#include <array>
#include <condition_variable>
#include <deque>
#include <limits>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "proto/player.pb.h"
#include "tools/mimesis/log/playback.h"

// The fields of a log over its time, for plots: read once, by a thread of its own.
namespace mimesis::tool {

/// Least and largest of any stretch of a series, in O(log n): level k holds those of kWidth^(k+1)
/// values each. NaN: there is none.
class MinMaxPyramid {
 public:
  static constexpr std::size_t kWidth = 16;
  struct Range {
    double least = std::numeric_limits<double>::quiet_NaN();
    double largest = std::numeric_limits<double>::quiet_NaN();
  };

  void add(double value);  ///< amortised O(1)
  std::span<const double> values() const { return values_; }
  /// Of values [begin, end).
  Range range(std::size_t begin, std::size_t end) const;

 private:
  std::vector<double> values_;
  std::array<std::vector<Range>, 6> levels_;
};

/// What a plot of `columns` columns draws of [from_s, to_s] and of the values beside it: all points
/// where there are few, else least and largest of each column. O(columns log n), n times `at_s`.
void draw_curve(std::span<const double> at_s, const MinMaxPyramid& series, double from_s,
                double to_s, std::uint32_t columns, v1::PlayerCurve& out);

/// Curves by topic and path. A field is read from the log when it is first asked for; what was read
/// so far is drawn meanwhile.
class PlayCurves {
 public:
  explicit PlayCurves(const Playback& playback) : playback_(playback) {}
  v1::PlayerCurves draw(const v1::PlayerCurvesAsk& ask);

 private:
  /// Fields of one topic that were first asked for together.
  struct Fields {
    std::string topic;
    std::vector<std::string> paths;
    std::vector<double> at_s;
    std::deque<MinMaxPyramid> series;  ///< by path
    double read_s = 0.0;
    bool whole = false;
    std::vector<std::string> problems;  ///< by path; why it has no values
  };
  void read(const std::stop_token& stop);
  void read(Fields& fields, const std::stop_token& stop);

  const Playback& playback_;
  std::mutex mutex_;
  std::condition_variable_any news_;
  std::deque<Fields> all_;  ///< guarded by mutex_, grows only
  std::size_t next_ = 0;    ///< to be read
  std::jthread reader_;     ///< ends before what it uses
};

}  // namespace mimesis::tool
