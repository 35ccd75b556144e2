#include "common/motion/mocap/cycles.h"

#include <algorithm>
#include <cmath>

#include "common/math/circle.h"
#include "common/math/so3.h"
#include "common/motion/mocap/resampling.h"

namespace mimesis::mocap {
namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Paths of heels and toes in W, by side [m].
struct FootPaths {
  std::array<Matrix3Xd, 2> heel, toe;
};

FootPaths foot_paths(const BodyClip& clip) {
  FootPaths paths;
  for (std::size_t s = 0; s < 2; ++s) {
    paths.heel[s].resize(3, clip.frames());
    paths.toe[s].resize(3, clip.frames());
  }
  for (Index f = 0; f < clip.frames(); ++f) {
    const BodyPose pose = clip.pose(f);
    for (std::size_t s = 0; s < 2; ++s) {
      const int ankle = s == kLeft ? kLeftAnkle : kRightAnkle;
      paths.heel[s].col(f) = pose.point(ankle, clip.body.heel_m[s]);
      paths.toe[s].col(f) = pose.point(ankle, clip.body.toe_m[s]);
    }
  }
  return paths;
}

/// Distance ahead of the pelvis along the heading [m].
VectorXd ahead_of_pelvis(const Matrix3Xd& path, const BodyClip& clip, const VectorXd& heading) {
  VectorXd ahead(path.cols());
  for (Index f = 0; f < path.cols(); ++f) {
    const Vector3d d = path.col(f) - clip.root_position_W_m.col(f);
    ahead[f] = d.x() * std::cos(heading[f]) + d.y() * std::sin(heading[f]);
  }
  return ahead;
}

/// Speed by central differences [m/s].
double speed(const Matrix3Xd& path, Index f, double rate_hz) {
  const Index before = std::max<Index>(f - 1, 0), after = std::min(f + 1, path.cols() - 1);
  if (after == before) return 0.0;
  return (path.col(after) - path.col(before)).norm() * rate_hz /
         static_cast<double>(after - before);
}

constexpr double kFlight_m_s = 1.0;  ///< a foot this fast is in the air

/// Whether the foot stands in a frame of the interval, as it does after a strike.
bool stands(const Matrix3Xd& foot, Index first, Index last, double rate_hz) {
  constexpr double kStill_m_s = 0.3;
  for (Index f = first; f <= last; ++f) {
    if (speed(foot, f, rate_hz) < kStill_m_s) return true;
  }
  return false;
}

/// Maxima from which x, the foot's way ahead, falls by `drop` on both sides before it rises as high
/// again; where the clip begins or ends before that, half of it, or, with `ends`, that the foot
/// comes flying or stands then. The first and the last value do not count: x may continue to rise.
std::vector<Index> maxima(const VectorXd& x, double drop, bool ends, const Matrix3Xd& foot,
                          double rate_hz) {
  std::vector<Index> found;
  Index high = 0, low = 0, lowest_before = 0;
  bool seek_maximum = true;
  auto take = [&](bool falls) {
    const double rise = x[high] - x[lowest_before];
    const bool begins =
        found.empty() && (rise >= 0.5 * drop || (ends && speed(foot, 0, rate_hz) > kFlight_m_s));
    if (high > 0 && falls && (begins || rise >= drop)) found.push_back(high);
  };
  for (Index f = 1; f < x.size(); ++f) {
    if (seek_maximum && x[f] > x[high]) high = low = f;
    if (x[f] < x[low]) low = f;
    if (high == 0 && x[f] < x[lowest_before]) high = lowest_before = low = f;
    if (seek_maximum && x[f] <= x[high] - drop) {
      take(true);
      seek_maximum = false;
    } else if (!seek_maximum && x[f] >= x[low] + drop) {
      lowest_before = low;
      high = low = f;
      seek_maximum = true;
    }
  }
  if (seek_maximum) {
    take(x[high] - x[low] >= 0.5 * drop || (ends && stands(foot, high + 1, x.size() - 1, rate_hz)));
  }
  return found;
}

/// Keeps the frames before which the foot came flying, not those where only the pelvis moved away.
void keep_swings(std::vector<Index>& frames, const Matrix3Xd& foot, double rate_hz) {
  constexpr double kSwing_s = 0.5;
  const auto reach = static_cast<Index>(std::lround(kSwing_s * rate_hz));
  std::erase_if(frames, [&](Index frame) {
    for (Index f = std::max<Index>(frame - reach, 0); f <= frame; ++f) {
      if (speed(foot, f, rate_hz) > kLeastSwing_m_s) return false;
    }
    return true;
  });
}

tl::unexpected<Status> no_trial(const BodyClip& clip, const std::string& reason) {
  return tl::unexpected(Status{clip.name + ": " + reason});
}

/// A gait cycle, and the share of its frames after which the left heel strikes.
struct GaitCycle {
  FrameInterval frames;
  double left_strike = 0.0;
};

/// From strike to strike of one side.
std::vector<GaitCycle> cycles_of(const GaitEvents& events, Side side, double rate_hz,
                                 const CycleOptions& options) {
  std::vector<GaitCycle> cycles;
  const std::vector<Index>& strikes = events.heel_strike[side];
  for (std::size_t i = 0; i + 1 < strikes.size(); ++i) {
    GaitCycle cycle{{strikes[i], strikes[i + 1]}};
    const auto [first, last] = cycle.frames;
    const double duration_s = static_cast<double>(last - first) / rate_hz;
    if (duration_s < options.shortest_s || duration_s > options.longest_s) continue;
    if (side == kRight) {
      cycle.left_strike = 0.5;
      for (const Index left : events.heel_strike[kLeft]) {
        if (left <= first || left >= last) continue;
        cycle.left_strike = static_cast<double>(left - first) / static_cast<double>(last - first);
      }
    }
    cycles.push_back(cycle);
  }
  return cycles;
}

tl::expected<std::vector<GaitCycle>, Status> gait_cycles(const BodyClip& clip,
                                                         const CycleOptions& options) {
  const std::array<GaitEvents, 2> events = {find_gait_events(clip), find_gait_events(clip, true)};
  for (const Side side : {kLeft, kRight}) {
    for (const GaitEvents& e : events) {
      auto cycles = cycles_of(e, side, clip.rate_hz, options);
      if (!cycles.empty()) return cycles;
    }
  }
  const auto& strikes = events[1].heel_strike;
  if (strikes[kLeft].empty() && strikes[kRight].empty()) {
    return no_trial(clip, "no heel strike: nobody walks, or less than a step");
  }
  if (std::max(strikes[kLeft].size(), strikes[kRight].size()) < 2) {
    return no_trial(clip, "less than one gait cycle: no heel strikes twice");
  }
  return no_trial(clip, "no two strikes of a heel are a gait cycle apart");
}

/// Way of the pelvis along its heading over an interval [m].
double travel(const BodyClip& clip, const VectorXd& heading, Index first, Index last) {
  double sum = 0.0;
  for (Index f = first; f < last; ++f) {
    const Vector3d d = clip.root_position_W_m.col(f + 1) - clip.root_position_W_m.col(f);
    sum += d.x() * std::cos(heading[f]) + d.y() * std::sin(heading[f]);
  }
  return sum;
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
  trial.step_length_m = travel(clip, heading, interval.first, interval.last);
  return trial;
}

}  // namespace

VectorXd heading_rad(const BodyClip& clip) {
  VectorXd heading(clip.frames());
  for (Index f = 0; f < clip.frames(); ++f) {
    const Vector3d x = math::exp_so3(clip.angles_rad.block<3, 1>(0, f)).col(0);
    const double angle = std::atan2(x.y(), x.x());
    heading[f] = f == 0 ? angle : heading[f - 1] + math::wrap_pi(angle - heading[f - 1]);
  }
  return heading;
}

void remove_heading(BodyClip& clip) {
  const VectorXd heading = heading_rad(clip);
  Vector3d before = Vector3d::Zero();
  for (Index f = 0; f < clip.frames(); ++f) {
    const Eigen::Matrix3d turned =
        math::exp_so3({0.0, 0.0, -heading[f]}) * math::exp_so3(clip.angles_rad.block<3, 1>(0, f));
    before = math::nearest_axis_angle(math::log_so3(turned), before);
    clip.angles_rad.block<3, 1>(0, f) = before;
  }
}

GaitEvents find_gait_events(const BodyClip& clip, bool ends) {
  GaitEvents events;
  if (clip.frames() < 3) return events;
  const FootPaths paths = foot_paths(clip);
  const VectorXd heading = heading_rad(clip);

  events.backward = travel(clip, heading, 0, clip.frames() - 1) < -kLeastSwing_m;
  const double sign = events.backward ? -1.0 : 1.0;

  for (std::size_t s = 0; s < 2; ++s) {
    // backwards the toe is the end of the foot that arrives first
    const Matrix3Xd& strikes = events.backward ? paths.toe[s] : paths.heel[s];
    const VectorXd front = sign * ahead_of_pelvis(strikes, clip, heading);
    const double swing = front.maxCoeff() - front.minCoeff();
    Matrix3Xd on_ground = strikes;  // a foot that stands may still roll
    on_ground.row(2).setZero();
    const double drop = std::max(kLeastSwing_m, kLeastSwingShare * swing);
    events.heel_strike[s] = maxima(front, drop, ends, on_ground, clip.rate_hz);
    keep_swings(events.heel_strike[s], strikes, clip.rate_hz);
  }
  return events;
}

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

  std::vector<GaitCycle> cycles = {{.frames = {0, clip.frames() - 1}}};
  if (options.cut == CycleOptions::Cut::gait_cycles) {
    auto found = gait_cycles(smooth, options);
    if (!found) return tl::unexpected(found.error());
    cycles = *found;
  }

  Trials out;
  for (int row = 0; row < kBodyRows; ++row) out.rows.push_back(body_row_name(row));
  out.rows.insert(out.rows.end(), more.names.begin(), more.names.end());
  remove_heading(smooth);
  const std::string style = options.style.empty() ? style_of(clip.name) : options.style;
  const Index rows = kBodyRows + added;
  out.samples.resize(static_cast<Index>(cycles.size()) * rows, options.samples);
  for (std::size_t i = 0; i < cycles.size(); ++i) {
    out.trials.push_back(describe(smooth, cycles[i].frames, heading, style));
    out.trials.back().cycle = static_cast<int>(i);
    const auto first = static_cast<double>(cycles[i].frames.first);
    const auto last = static_cast<double>(cycles[i].frames.last);
    auto trial = out.samples.middleRows(static_cast<Index>(i) * rows, rows);
    trial.topRows(kBodyRows) = resample(smooth.angles_rad, first, last, options.samples);
    if (added > 0) trial.bottomRows(added) = resample(smooth_more, first, last, options.samples);
    const auto turn = std::lround(cycles[i].left_strike * options.samples) % options.samples;
    if (turn > 0) {  // the cycle is closed: it may as well begin at the left strike
      const Index rest = options.samples - turn;
      const Eigen::MatrixXd whole = trial;
      trial << whole.rightCols(rest), whole.leftCols(turn);
    }
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
