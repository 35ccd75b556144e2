#include "experiments/motion/grafted_raises.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <string>

#include "common/error.h"
#include "common/motion/mocap/clip_file.h"
#include "common/motion/mocap/cycles.h"
#include "common/motion/mocap/resampling.h"
#include "experiments/motion/rotation_branches.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using mocap::Side;

constexpr std::array kWalks = {"dataset-1_walk-left_normal_001.bvh",
                               "dataset-1_walk-right_normal_001.bvh",
                               "dataset-1_walk_active_001.bvh",
                               "dataset-1_walk_angry_001.bvh",
                               "dataset-1_walk_happy_001.bvh",
                               "dataset-1_walk_normal_001.bvh",
                               "dataset-1_walk_sad_001.bvh",
                               "dataset-1_walk_tired_001.bvh",
                               "dataset-2_walk-turn-left_normal_001.bvh",
                               "dataset-2_walk-turn-right_normal_001.bvh",
                               "dataset-2_walk_normal_001.bvh"};
// clip of the actor who raises hands
constexpr const char* kLegs = "dataset-2_walk_normal_001.bvh";
constexpr std::array kOnsets = {0.0, 0.1, 0.2, 0.3};
constexpr double kCutoff_hz = 8.0;

struct Raise {
  const char* clip;
  std::vector<Side> sides;
};

mocap::Trials cycles_of(const std::filesystem::path& file) {
  const auto cut = mocap::cut_cycles(mocap::to_body(mocap::read_clip(file.string())));
  if (!cut) throw ConfigError(file.string() + ": " + cut.error().reason);
  return *cut;
}

/// Rows of the arms of a clip, filtered, from its first frame until a hand is highest.
MatrixXd raise_of(const mocap::BodyClip& clip, Side side, const std::vector<Index>& rows) {
  const MatrixXd smooth = mocap::low_pass(clip.angles_rad, clip.rate_hz, kCutoff_hz);
  return smooth(rows, Eigen::seq(0, std::max<Index>(1, highest_hand(clip, side))));
}

}  // namespace

void graft(Eigen::Ref<MatrixXd> trial, const MatrixXd& movement, const std::vector<Index>& rows,
           const Graft& where) {
  const auto count = static_cast<Index>(rows.size());
  if (count != movement.rows() || movement.cols() < 2 ||
      std::ranges::any_of(rows, [&](Index r) { return r < 0 || r >= trial.rows(); })) {
    throw ConfigError("graft: " + std::to_string(count) + " rows for a movement of " +
                      std::to_string(movement.rows()) + " rows and " +
                      std::to_string(movement.cols()) + " frames, expected as many rows of the " +
                      "trial and two frames");
  }
  if (!(where.onset >= 0.0 && where.span > 0.0 && where.onset + where.span <= 1.0)) {
    throw ConfigError("graft: onset " + std::to_string(where.onset) + " and span " +
                      std::to_string(where.span) + ", expected both within the period");
  }
  const auto last = static_cast<double>(movement.cols() - 1);
  for (Index t = 0; t < trial.cols(); ++t) {
    const double phase = static_cast<double>(t) / static_cast<double>(trial.cols());
    const double at = last * std::clamp((phase - where.onset) / where.span, 0.0, 1.0);
    const Index frame = std::min(static_cast<Index>(at), movement.cols() - 2);
    const double share = at - static_cast<double>(frame);
    for (Index i = 0; i < count; ++i) {
      trial(rows[static_cast<std::size_t>(i)], t) =
          (1.0 - share) * movement(i, frame) + share * movement(i, frame + 1);
    }
  }
}

std::vector<Index> arm_rows(Side side) {
  std::vector<Index> rows(9);
  std::iota(rows.begin(), rows.end(),
            3 * (side == mocap::kLeft ? mocap::kLeftShoulder : mocap::kRightShoulder));
  return rows;
}

Index highest_hand(const mocap::BodyClip& clip, Side side) {
  const int wrist = side == mocap::kLeft ? mocap::kLeftWrist : mocap::kRightWrist;
  Index best = 0;
  double highest = 0.0;
  for (Index i = 0; i < clip.frames(); ++i) {
    const mocap::BodyPose pose = clip.pose(i);
    const auto& hand = clip.body.hand_m[static_cast<std::size_t>(side)];
    const double z = pose.point(wrist, hand).z() - pose.p_WJ[mocap::kRoot].z();
    if (i == 0 || z > highest) {
      highest = z;
      best = i;
    }
  }
  return best;
}

GraftedSet walks_with_raises(const std::filesystem::path& clips, double span) {
  std::vector<mocap::Trials> sets;
  for (const char* walk : kWalks) sets.push_back(cycles_of(clips / walk));
  GraftedSet out{mocap::merge(sets), 0};
  out.walks = static_cast<Index>(out.trials.trials.size());

  const mocap::Trials legs = cycles_of(clips / kLegs);
  const Index rows = legs.rows_per_trial();
  const std::array raises = {
      Raise{"dataset-2_raise-up-left-hand_normal_001.bvh", {mocap::kLeft}},
      Raise{"dataset-2_raise-up-right-hand_normal_001.bvh", {mocap::kRight}},
      Raise{"dataset-2_raise-up-both-hands_normal_001.bvh", {mocap::kLeft, mocap::kRight}}};
  mocap::Trials composed = legs;
  composed.trials.clear();
  composed.samples.resize(static_cast<Index>(raises.size() * kOnsets.size()) * rows,
                          legs.samples.cols());
  for (const Raise& raise : raises) {
    const mocap::BodyClip clip = mocap::to_body(mocap::read_clip((clips / raise.clip).string()));
    for (const double onset : kOnsets) {
      const std::size_t number = composed.trials.size(), from = number % legs.trials.size();
      auto trial = composed.samples.middleRows(static_cast<Index>(number) * rows, rows);
      trial = legs.samples.middleRows(static_cast<Index>(from) * rows, rows);
      for (const Side side : raise.sides) {
        const std::vector<Index> arm = arm_rows(side);
        graft(trial, raise_of(clip, side, arm), arm, {onset, span});
      }
      composed.trials.push_back(legs.trials[from]);
      composed.trials.back().clip += std::string(" + ") + raise.clip;
      composed.trials.back().style = "raise";
    }
  }
  const std::array both = {std::move(out.trials), std::move(composed)};
  out.trials = mocap::merge(both);
  align_rotation_branches(out.trials);
  return out;
}

}  // namespace mimesis::synthesizer
