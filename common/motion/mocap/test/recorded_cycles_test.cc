// Cycles of the recorded clips in the shared folder, against the reference sets A and B.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>

#include "common/math/so3.h"
#include "common/motion/mocap/clip_file.h"
#include "common/motion/mocap/cycles.h"
#include "common/motion/mocap/resampling.h"
#include "common/motion/mocap/test/shared_folder.h"

namespace mimesis::mocap {
namespace {

class RecordedCycles : public ::testing::Test {
 protected:
  void SetUp() override { SKIP_WITHOUT_SHARED(); }
};

BodyClip body_of(const std::string& clip) { return to_body(read_clip(path_of(clip))); }

/// The same with the angles counted from the file's own zero posture, as the reference has them.
BodyClip from_the_files_zero(const std::string& name) {
  const Clip file = read_clip(path_of(name));
  const BodyMap& map = *std::ranges::find_if(known_body_maps(), [&](const BodyMap& m) {
    return file.skeleton.find(m.joints[kSpine]) >= 0 && file.skeleton.find(m.joints[kChest]) >= 0;
  });
  BodyClip clip = to_body(file);
  for (Eigen::Index f = 0; f < clip.frames(); ++f) {
    std::vector<Eigen::Matrix3d> R_WJ;
    for (const Joint& joint : file.skeleton.joints) {
      const auto row = static_cast<Eigen::Index>(3 * R_WJ.size());
      const Eigen::Vector3d angles = file.rotation_rad.block<3, 1>(row, f + clip.first_frame);
      const Eigen::Matrix3d R_PJ = math::exp_so3(angles);
      R_WJ.push_back(joint.parent < 0 ? R_PJ : R_WJ[static_cast<std::size_t>(joint.parent)] * R_PJ);
    }
    BodyPose pose;
    for (std::size_t j = 0; j < kBodyJoints; ++j) {
      pose.R_WJ[j] = R_WJ[static_cast<std::size_t>(file.skeleton.find(map.joints[j]))];
    }
    put_angles(pose, f, clip.angles_rad);
  }
  return clip;
}

/// A cycle of the reference sets, in the files' own zero postures, project axes.
struct ReferenceCycle {
  long first = 0, last = 0;
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(kBodyRows, 100);
};

std::map<std::string, std::map<int, ReferenceCycle>> reference(const std::string& set) {
  std::map<std::string, std::map<int, ReferenceCycle>> clips;
  std::ifstream file(shared_mocap() + "sets/" + set + ".csv");
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::stringstream in(line);
    std::vector<std::string> cells;
    for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
    ReferenceCycle& cycle = clips[cells[0]][std::stoi(cells[1])];
    cycle.first = std::stol(cells[2]);
    cycle.last = std::stol(cells[3]);
    const int row = 3 * std::stoi(cells[5]) + (cells[6][0] - 'x' + 1) % 3;
    for (int t = 0; t < 100; ++t)
      cycle.x(row, t) = std::stod(cells[static_cast<std::size_t>(7 + t)]);
  }
  return clips;
}

/// The reference numbers BVH frames from behind the T-posture.
long reference_shift(const std::string& clip) {
  return clip.ends_with(".bvh") && !clip.starts_with("dataset-") ? 1 : 0;
}

TEST_F(RecordedCycles, TheCyclesAreThoseOfTheReferenceSets) {
  for (const std::string set : {"A", "B"}) {
    std::size_t count = 0;
    for (const auto& [clip, cycles] : reference(set)) {
      const auto trials = cut_cycles(body_of(clip));
      ASSERT_TRUE(trials) << trials.error().reason;
      ASSERT_EQ(trials->trials.size(), cycles.size()) << clip;
      count += cycles.size();
      for (const auto& [i, cycle] : cycles) {
        const Trial& trial = trials->trials[static_cast<std::size_t>(i)];
        const long shift = reference_shift(clip);
        EXPECT_LE(std::abs(trial.first_frame - cycle.first - shift), 2) << clip << ' ' << i;
        EXPECT_LE(std::abs(trial.last_frame - cycle.last - shift), 2) << clip << ' ' << i;
      }
    }
    EXPECT_EQ(count, set == "A" ? 34u : 48u);
  }
}

// The reference is sampled between frames by straight lines, in the frames it found; so is ours.
// The remaining difference is rounding and, for the root, whether the heading is removed before the
// filter.
TEST_F(RecordedCycles, InTheReferencesFramesTheRotationsAreTheSame) {
  for (const std::string set : {"A", "B"}) {
    double sum = 0.0, spline_sum = 0.0, count = 0.0;
    for (const auto& [name, cycles] : reference(set)) {
      BodyClip clip = from_the_files_zero(name);
      clip.angles_rad = low_pass(clip.angles_rad, clip.rate_hz, 8.0);
      remove_heading(clip);
      const long shift = reference_shift(name) - clip.first_frame;
      for (const auto& [i, cycle] : cycles) {
        const auto first = static_cast<double>(cycle.first + shift);
        const auto last = static_cast<double>(cycle.last + shift);
        const Eigen::MatrixXd smooth = resample(clip.angles_rad, first, last, 100);
        for (Eigen::Index t = 0; t < 100; ++t) {
          const double at = first + (last - first) * static_cast<double>(t) / 100.0;
          const auto f = static_cast<Eigen::Index>(at);
          const double share = at - static_cast<double>(f);
          const Eigen::VectorXd x = (1.0 - share) * clip.angles_rad.col(f) +
                                    share * clip.angles_rad.col(std::min(f + 1, clip.frames() - 1));
          for (Eigen::Index j = 0; j < kBodyRows; j += 3) {
            const Eigen::Matrix3d R = math::exp_so3(cycle.x.block<3, 1>(j, t)).transpose();
            sum += math::log_so3(R * math::exp_so3(x.segment<3>(j))).squaredNorm();
            spline_sum += math::log_so3(R * math::exp_so3(smooth.block<3, 1>(j, t))).squaredNorm();
            count += 1.0;
          }
        }
      }
    }
    EXPECT_LT(std::sqrt(sum / count), 2e-4) << set;
    EXPECT_LT(std::sqrt(spline_sum / count), set == "A" ? 1e-3 : 5e-3) << set;
    RecordProperty("rms_rad_" + set, std::to_string(std::sqrt(sum / count)));
    std::printf("set %s: rms difference of rotations %.2e rad, by splines %.2e rad\n", set.c_str(),
                std::sqrt(sum / count), std::sqrt(spline_sum / count));
  }
}

TEST_F(RecordedCycles, OtherMotionsAreHandledOrRefusedWithTheReason) {
  const auto short_walk = cut_cycles(body_of("35_01.amc"));  // both strikes near its ends
  ASSERT_TRUE(short_walk) << short_walk.error().reason;
  ASSERT_EQ(short_walk->trials.size(), 1u);
  EXPECT_NEAR(short_walk->trials[0].duration_s, 1.12, 0.05);
  EXPECT_FALSE(cut_cycles(body_of("dataset-2_raise-up-both-hands_normal_001.bvh")));
  EXPECT_FALSE(cut_cycles(body_of("02_06.bvh")));

  const BodyClip back = body_of("dataset-1_walk-back_happy_001.bvh");
  EXPECT_TRUE(find_gait_events(back).backward);
  const auto cycles = cut_cycles(back);
  ASSERT_TRUE(cycles) << cycles.error().reason;
  EXPECT_GE(cycles->trials.size(), 3u);
  for (const Trial& trial : cycles->trials) EXPECT_LT(trial.step_length_m, -0.3);

  const auto left = cut_cycles(body_of("dataset-2_walk-turn-left_normal_001.bvh"));
  const auto right = cut_cycles(body_of("dataset-2_walk-turn-right_normal_001.bvh"));
  ASSERT_TRUE(left && right);
  EXPECT_GT(left->trials[0].turn_rad, 0.5);
  EXPECT_LT(right->trials[0].turn_rad, -0.5);
}

}  // namespace
}  // namespace mimesis::mocap
