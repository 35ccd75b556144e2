#include "common/motion/mocap/trials.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>

#include "common/error.h"
#include "common/motion/mocap/body.h"
#include "common/motion/mocap/readers.h"

namespace mimesis::mocap {
namespace {

using Eigen::Index;

constexpr std::string_view kTrialColumns = "clip,cycle,start_frame,end_frame,duration_s";
constexpr std::string_view kHouseAxes = "# axes: x forward, y left, z up";
constexpr std::size_t kFirstOption = 5;  // column

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::size_t begin = 0;;) {
    const std::size_t end = line.find(',', begin);
    cells.push_back(line.substr(begin, end - begin));
    if (end == std::string_view::npos) return cells;
    begin = end + 1;
  }
}

class Reader {
 public:
  Reader(std::string_view text, const std::string& file) : rest_(text), file_(file) {}

  Trials read() {
    read_header();
    while (next_line()) {
      if (!line_.empty()) add_line();
    }
    if (set_.trials.empty()) fail("no trial, expected at least one line below the header");
    end_trial();
    const auto count = static_cast<Index>(set_.trials.size()) * set_.rows_per_trial();
    set_.samples =
        Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
            values_.data(), count, static_cast<Index>(samples_));
    if (!house_axes_) turn_axes();
    return std::move(set_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw ConfigError(one_line(fmt::format("{}:{}: {}", file_, number_, what)));
  }

  bool next_line() {
    if (rest_.empty()) return false;
    line_ = rest_.substr(0, rest_.find('\n'));
    rest_.remove_prefix(std::min(line_.size() + 1, rest_.size()));
    if (line_.ends_with('\r')) line_.remove_suffix(1);
    ++number_;
    return true;
  }

  void read_header() {
    bool any = next_line();
    if (any && line_ == kHouseAxes) {
      house_axes_ = true;
      any = next_line();
    }
    const std::vector<std::string_view> cells =
        any ? split(line_) : std::vector<std::string_view>();
    joint_ = static_cast<std::size_t>(std::ranges::find(cells, "joint") - cells.begin());
    if (!line_.starts_with(kTrialColumns) || joint_ < kFirstOption || joint_ + 1 >= cells.size() ||
        cells[kFirstOption - 1] != "duration_s" || cells[joint_ + 1] != "axis") {
      fail(
          fmt::format("not a header of trials, expected '{},joint,axis,t0,t1,...'", kTrialColumns));
    }
    for (std::size_t c = kFirstOption; c < joint_; ++c) {
      if (std::find(cells.begin(), cells.begin() + static_cast<long>(c), cells[c]) !=
          cells.begin() + static_cast<long>(c)) {
        fail(fmt::format("column {}: '{}' twice, expected each name once", c + 1, cells[c]));
      }
      options_.emplace_back(cells[c]);
      if (!is_of_trial(cells[c])) set_.task_names.emplace_back(cells[c]);
    }
    samples_ = cells.size() - joint_ - 2;
    if (samples_ < 4) fail(fmt::format("{} samples a row, expected at least 4", samples_));
  }

  template <class T>
  T parsed(std::string_view cell, std::size_t column) const {
    T value{};
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    bool good = error == std::errc() && end == cell.data() + cell.size();
    if constexpr (std::is_floating_point_v<T>) good = good && std::isfinite(value);
    if (!good) {
      fail(fmt::format("column {}: '{}', expected a {}number", column + 1, cell,
                       std::is_floating_point_v<T> ? "finite " : "whole "));
    }
    return value;
  }

  static bool is_of_trial(std::string_view column) {
    return column == "style" || column == "step_length_m" || column == "turn_rad";
  }

  void add_line() {
    const std::vector<std::string_view> cells = split(line_);
    const std::size_t first = joint_ + 2;  // column of t0
    if (cells.size() != first + samples_) {
      fail(fmt::format("{} columns, expected {} as the header", cells.size(), first + samples_));
    }
    Trial trial;
    trial.clip = cells[0];
    trial.cycle = parsed<int>(cells[1], 1);
    trial.first_frame = parsed<long>(cells[2], 2);
    trial.last_frame = parsed<long>(cells[3], 3);
    trial.duration_s = parsed<double>(cells[4], 4);
    if (trial.duration_s <= 0.0) fail("duration_s: expected more than 0");
    for (std::size_t c = kFirstOption; c < joint_; ++c) add_option(cells[c], c, trial);
    if (set_.trials.empty() || trial.clip != set_.trials.back().clip ||
        trial.cycle != set_.trials.back().cycle) {
      begin_trial(trial);
    }
    const std::string_view joint = joint_name(cells[joint_]), axis = cells[joint_ + 1];
    add_row(axis.empty() ? std::string(joint) : fmt::format("{}.{}", joint, axis));
    for (std::size_t t = 0; t < samples_; ++t) {
      values_.push_back(parsed<double>(cells[first + t], first + t));
    }
  }

  void add_option(std::string_view cell, std::size_t column, Trial& trial) const {
    const std::string& name = options_[column - kFirstOption];
    if (name == "style") {
      trial.style = cell;
      return;
    }
    const auto value = parsed<double>(cell, column);
    if (name == "step_length_m") {
      trial.step_length_m = value;
    } else if (name == "turn_rad") {
      trial.turn_rad = value;
    } else {
      trial.task.push_back(value);
    }
  }

  /// The sets number the joints of the body.
  std::string_view joint_name(std::string_view cell) const {
    if (house_axes_ || cell.find_first_not_of("0123456789") != std::string_view::npos) return cell;
    const int joint = parsed<int>(cell, joint_);
    if (joint >= kBodyJoints)
      fail(fmt::format("joint {}, expected 0 to {}", joint, kBodyJoints - 1));
    return kBodyJointNames[static_cast<std::size_t>(joint)];
  }

  void begin_trial(const Trial& trial) {
    if (!set_.trials.empty()) end_trial();
    for (const Trial& other : set_.trials) {
      if (other.clip == trial.clip && other.cycle == trial.cycle) {
        fail(fmt::format("{}, cycle {}, is there already, expected its lines together", trial.clip,
                         trial.cycle));
      }
    }
    set_.trials.push_back(trial);
    row_ = 0;
  }

  void end_trial() const {
    if (row_ == set_.rows.size()) return;
    fail(fmt::format("{}, cycle {}: {} rows, expected {} as the first trial",
                     set_.trials.back().clip, set_.trials.back().cycle, row_, set_.rows.size()));
  }

  void add_row(const std::string& name) {
    if (set_.trials.size() == 1) {
      if (std::ranges::find(set_.rows, name) != set_.rows.end()) {
        fail(fmt::format("row {} twice in one trial", name));
      }
      set_.rows.push_back(name);
    } else if (row_ >= set_.rows.size() || set_.rows[row_] != name) {
      fail(fmt::format("row {}, expected {}", name,
                       row_ < set_.rows.size() ? set_.rows[row_] : "another trial"));
    }
    ++row_;
  }

  /// From the sets' axes to the project's: names, and the order within a joint.
  void turn_axes() {
    const auto joint = [](const std::string& name) { return name.substr(0, name.rfind('.')); };
    for (std::string& name : set_.rows) {
      if (name.ends_with(".x")) {
        name.back() = 'y';
      } else if (name.ends_with(".y")) {
        name.back() = 'z';
      } else if (name.ends_with(".z")) {
        name.back() = 'x';
      }
    }
    std::vector<Index> from(set_.rows.size());
    std::iota(from.begin(), from.end(), 0);
    const auto name = [&](Index i) { return set_.rows[static_cast<std::size_t>(i)]; };
    for (std::size_t i = 0; i < from.size();) {  // runs of one joint
      std::size_t end = i;
      while (end < from.size() && joint(set_.rows[end]) == joint(set_.rows[i])) ++end;
      std::sort(from.begin() + static_cast<long>(i), from.begin() + static_cast<long>(end),
                [&](Index a, Index b) { return name(a) < name(b); });
      i = end;
    }
    const Index rows = set_.rows_per_trial();
    std::vector<std::string> names;
    for (const Index i : from) names.push_back(name(i));
    const Eigen::MatrixXd before = set_.samples;
    for (Index n = 0; n < before.rows(); ++n) {
      set_.samples.row(n) = before.row(n / rows * rows + from[static_cast<std::size_t>(n % rows)]);
    }
    set_.rows = std::move(names);
  }

  std::string_view rest_, line_;
  std::string file_;
  long number_ = 0;
  bool house_axes_ = false;
  std::size_t joint_ = 0, samples_ = 0, row_ = 0;  // column of the joint; numbers
  std::vector<std::string> options_;               // names of the columns before the joint's
  std::vector<double> values_;
  Trials set_;
};

}  // namespace

Trials parse_trials(std::string_view text, const std::string& file) {
  return Reader(text, file).read();
}

Trials read_trials(const std::string& file) { return parse_trials(read_bytes(file), file); }

}  // namespace mimesis::mocap
