#include "common/motion/mocap/cycles.h"

#include <algorithm>
#include <cmath>

#include "common/motion/mocap/gait.h"
#include "common/motion/mocap/low_pass.h"
#include "common/motion/mocap/spline.h"

namespace mimesis::mocap {
namespace {

using Eigen::Index;

tl::unexpected<Status> no_trial(const BodyClip& clip, const std::string& reason) {
  return tl::unexpected(Status{clip.name + ": " + reason});
}

tl::expected<std::vector<FrameInterval>, Status> gait_cycles(const BodyClip& clip,
                                                             const CycleOptions& options) {
  const std::vector<Index> strikes = find_gait_events(clip).heel_strike[kLeft];
  if (strikes.empty()) {
    return no_trial(clip, "no left heel strike: nobody walks, or less than a step");
  }
  if (strikes.size() == 1) {
    return no_trial(clip, "less than one gait cycle: the only left heel strike is in frame " +
                              std::to_string(clip.first_frame + strikes[0]));
  }
  std::vector<FrameInterval> cycles;
  for (std::size_t i = 0; i + 1 < strikes.size(); ++i) {
    const double duration_s = static_cast<double>(strikes[i + 1] - strikes[i]) / clip.rate_hz;
    if (duration_s >= options.shortest_s && duration_s <= options.longest_s) {
      cycles.push_back({strikes[i], strikes[i + 1]});
    }
  }
  if (cycles.empty()) return no_trial(clip, "no two left heel strikes are a gait cycle apart");
  return cycles;
}

std::vector<FrameInterval> given_ranges(const BodyClip& clip, const CycleOptions& options) {
  const long first = clip.first_frame, last = first + static_cast<long>(clip.frames()) - 1;
  if (options.ranges.empty()) throw ConfigError(clip.name + ": no frame ranges are given");
  std::vector<FrameInterval> trials;
  for (const auto& [from, to] : options.ranges) {
    if (from < first || to > last || from >= to) {
      throw ConfigError(clip.name + ": frames " + std::to_string(from) + " to " +
                        std::to_string(to) + ", expected a range within " + std::to_string(first) +
                        " to " + std::to_string(last));
    }
    trials.push_back({from - first, to - first});
  }
  return trials;
}

Trial describe(const BodyClip& clip, const FrameInterval& interval, const Eigen::VectorXd& heading,
               const std::string& style) {
  Trial trial;
  trial.clip = clip.name;
  trial.style = style;
  trial.first_frame = clip.first_frame + interval.first;
  trial.last_frame = clip.first_frame + interval.last;
  trial.duration_s = static_cast<double>(interval.last - interval.first) / clip.rate_hz;
  trial.turn_rad = heading[interval.last] - heading[interval.first];
  for (Index f = interval.first; f < interval.last; ++f) {
    const Eigen::Vector3d d = clip.root_position_W_m.col(f + 1) - clip.root_position_W_m.col(f);
    trial.step_length_m += d.x() * std::cos(heading[f]) + d.y() * std::sin(heading[f]);
  }
  return trial;
}

}  // namespace

tl::expected<Trials, Status> cut_cycles(const BodyClip& clip, const CycleOptions& options,
                                        const MoreRows& more) {
  if (options.samples < 2) {
    throw ConfigError("samples a cycle: " + std::to_string(options.samples) + ", expected 2..");
  }
  const auto added = static_cast<Index>(more.names.size());
  if (more.values_rad.rows() != added || (added > 0 && more.values_rad.cols() != clip.frames())) {
    throw ConfigError(clip.name + ": further trajectories are not one of " +
                      std::to_string(clip.frames()) + " frames for each name");
  }
  if (clip.frames() < 3) return no_trial(clip, "fewer than three frames");

  BodyClip smooth = clip;
  Eigen::MatrixXd smooth_more = more.values_rad;
  if (options.cutoff_hz > 0.0) {
    smooth.angles_rad = low_pass(clip.angles_rad, clip.rate_hz, options.cutoff_hz);
    smooth.root_position_W_m = low_pass(clip.root_position_W_m, clip.rate_hz, options.cutoff_hz);
    if (added > 0) smooth_more = low_pass(more.values_rad, clip.rate_hz, options.cutoff_hz);
  }
  const Eigen::VectorXd heading = heading_rad(smooth);

  std::vector<FrameInterval> intervals;
  if (options.cut == CycleOptions::Cut::kGaitCycles) {
    auto cycles = gait_cycles(smooth, options);
    if (!cycles) return tl::unexpected(cycles.error());
    intervals = *cycles;
  } else if (options.cut == CycleOptions::Cut::kWholeClip) {
    intervals = {{0, clip.frames() - 1}};
  } else {
    intervals = given_ranges(clip, options);
  }

  Trials out;
  for (int row = 0; row < kBodyRows; ++row) out.rows.push_back(body_row_name(row));
  out.rows.insert(out.rows.end(), more.names.begin(), more.names.end());
  if (!options.keep_heading) remove_heading(smooth);
  const std::string style = options.style.empty() ? style_of(clip.name) : options.style;
  const Index rows = kBodyRows + added;
  out.samples.resize(static_cast<Index>(intervals.size()) * rows, options.samples);
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    out.trials.push_back(describe(smooth, intervals[i], heading, style));
    out.trials.back().cycle = static_cast<int>(i);
    const auto first = static_cast<double>(intervals[i].first);
    const auto last = static_cast<double>(intervals[i].last);
    auto trial = out.samples.middleRows(static_cast<Index>(i) * rows, rows);
    trial.topRows(kBodyRows) = resample(smooth.angles_rad, first, last, options.samples);
    if (added > 0) trial.bottomRows(added) = resample(smooth_more, first, last, options.samples);
  }
  return out;
}

Trials merge(std::span<const Trials> sets) {
  if (sets.empty()) throw ConfigError("no set of trials to merge");
  Trials all = sets.front();
  Index rows = 0;
  for (const Trials& set : sets) rows += set.samples.rows();
  all.samples.resize(rows, sets.front().samples.cols());
  all.trials.clear();
  Index row = 0;
  for (const Trials& set : sets) {
    const std::string clip = set.trials.empty() ? "a set" : set.trials.front().clip;
    if (set.rows != all.rows || set.task_names != all.task_names) {
      throw ConfigError(clip + ": its trajectories or task parameters are not those of " +
                        "the first set");
    }
    if (set.samples.cols() != all.samples.cols()) {
      throw ConfigError(clip + ": " + std::to_string(set.samples.cols()) +
                        " samples a cycle, expected " + std::to_string(all.samples.cols()));
    }
    all.samples.middleRows(row, set.samples.rows()) = set.samples;
    row += set.samples.rows();
    all.trials.insert(all.trials.end(), set.trials.begin(), set.trials.end());
  }
  return all;
}

std::string style_of(const std::string& file) {
  // [SET_]MOTION_STYLE_NUMBER.ending, as Bandai-Namco names its clips
  std::vector<std::string> words(1);
  for (const char c : file.substr(0, file.find('.'))) {
    if (c == '_') {
      words.emplace_back();
    } else {
      words.back() += c;
    }
  }
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  const auto is_name = [&](const std::string& w) { return !w.empty() && letter(w.front()); };
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  if (words.size() < 3 || words.size() > 4) return {};
  const std::string &motion = words.end()[-3], &style = words.end()[-2], &number = words.back();
  if (!is_name(motion) || !is_name(style) || number.empty() ||
      !std::ranges::all_of(number, digit)) {
    return {};
  }
  return motion == "walk" ? style : motion + "_" + style;
}

}  // namespace mimesis::mocap
