#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "common/motion/demix/sisa.h"
#include "common/motion/mocap/body_map.h"
#include "common/motion/mocap/clip_file.h"
#include "common/motion/mocap/cycles.h"
#include "common/motion/mocap/test/shared_folder.h"
#include "nodes/synthesizer/dynamics/character_batch.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Vector3d;
constexpr int kAnkle[2] = {mocap::kLeftAnkle, mocap::kRightAnkle};
constexpr double kRate = 120.0;  // Hz, of the recording and the synthesis

/// A foot in a recorded clip: whether the toe stands (less than 2 cm above its lowest place, slower
/// than 0.3 m/s), and where it is.
struct RecordedToe {
  std::vector<Vector3d> p_W, p_H;  ///< in the world; relative to the pelvis in its heading frame
  std::vector<bool> stands;
  Eigen::VectorXd heading_rad;
};

RecordedToe recorded_toe(const mocap::BodyClip& clip, int side) {
  RecordedToe toe;
  mocap::BodyClip straight = clip;
  mocap::remove_heading(straight);
  toe.heading_rad = mocap::heading_rad(clip);
  double lowest = 1e9;
  const Vector3d& on_ankle = clip.body.toe_m[static_cast<std::size_t>(side)];
  for (Eigen::Index t = 0; t < clip.frames(); ++t) {
    toe.p_W.push_back(clip.pose(t).point(kAnkle[side], on_ankle));
    const mocap::BodyPose pose = straight.pose(t);
    toe.p_H.push_back(pose.point(kAnkle[side], on_ankle) - pose.p_WJ[0]);
    lowest = std::min(lowest, toe.p_W.back().z());
  }
  for (std::size_t t = 0; t < toe.p_W.size(); ++t) {
    const Vector3d& before = toe.p_W[t > 0 ? t - 1 : 0];
    toe.stands.push_back(toe.p_W[t].z() < lowest + 0.02 &&
                         (toe.p_W[t] - before).head<2>().norm() * kRate < 0.3);
  }
  return toe;
}

/// The walks of CMU's subject 07 as a model with tied delays, K = 5, one pattern a cycle.
struct Walks {
  std::vector<std::array<RecordedToe, 2>> toes;  ///< by clip
  std::vector<std::size_t> clip_of;              ///< by pattern
  std::vector<double> first_column;              ///< by pattern
  motion::MotionModel model;
};

Walks read_walks(const std::string& folder) {
  Walks walks;
  std::vector<mocap::Trials> sets;
  for (const char* name : {"01", "02", "03", "04", "05", "08", "11", "12"}) {
    const mocap::BodyClip clip =
        mocap::to_body(mocap::read_clip(folder + "cmu_bvh/07_" + name + ".bvh"));
    const auto trials = mocap::cut_cycles(clip);
    if (!trials) continue;
    for (const mocap::Trial& trial : trials->trials) {
      walks.clip_of.push_back(walks.toes.size());
      walks.first_column.push_back(static_cast<double>(trial.first_frame - clip.first_frame));
    }
    sets.push_back(*trials);
    walks.toes.push_back({recorded_toe(clip, mocap::kLeft), recorded_toe(clip, mocap::kRight)});
    walks.model.body = clip.body;
  }
  const mocap::Trials all = mocap::merge(sets);
  const demix::SisaResult result = demix::sisa(all, {.sources = 5, .tied = true});
  walks.model.name = "07";
  walks.model.rows = all.rows;
  walks.model.sources = result.mixture.sources;
  walks.model.tied = true;
  const Eigen::Index rows = all.rows_per_trial();
  for (std::size_t i = 0; i < all.trials.size(); ++i) {
    const Eigen::Index first = static_cast<Eigen::Index>(i) * rows;
    walks.model.patterns.push_back({all.trials[i], result.mixture.means.segment(first, rows),
                                    result.mixture.weights.middleRows(first, rows),
                                    result.mixture.delay_rad.middleRows(first, rows)});
  }
  return walks;
}

/// Motion of all toes while their recorded twins stand.
struct Standing {
  double speed_m_s = 0.0;   ///< mean, in the world
  double place_m = 0.0;     ///< rms deviation from the recorded toe's path, each stance's mean off
  double relative_m = 0.0;  ///< rms deviation from the recorded toe, both seen from the pelvis
};

Standing synthesize(const Walks& walks, bool lock) {
  const int count = static_cast<int>(walks.model.patterns.size());
  CharacterBatch batch(walks.model, count, {.dt_s = 1.0 / kRate, .foot_lock = lock});
  for (int i = 0; i < count; ++i) {
    batch.set_pattern(i, i);
    batch.set_frequency(i, 2.0 * std::numbers::pi /
                               walks.model.patterns[static_cast<std::size_t>(i)].trial.duration_s);
  }
  struct Stance {
    std::vector<Vector3d> made, recorded;
    double heading = 0.0;
  };
  std::vector<Stance> stances(static_cast<std::size_t>(2 * count));
  double path = 0.0, place = 0.0, relative = 0.0, steps = 0.0, points = 0.0;
  auto finish = [&](Stance& s) {
    Vector3d offset = Vector3d::Zero();
    for (std::size_t k = 0; k < s.made.size(); ++k) {
      offset += (s.made[k] - s.recorded[k]) / static_cast<double>(s.made.size());
    }
    for (std::size_t k = 0; k < s.made.size(); ++k) {
      place += (s.made[k] - s.recorded[k] - offset).head<2>().squaredNorm();
      if (k > 0) path += (s.made[k] - s.made[k - 1]).head<2>().norm();
      steps += k > 0 ? 1.0 : 0.0;
    }
    s = {};
  };
  for (int n = 0; n < 1200; ++n) {
    batch.step();
    for (int i = 0; n > 300 && i < 2 * count; ++i) {
      const auto p = static_cast<std::size_t>(i / 2);
      const RecordedToe& toe = walks.toes[walks.clip_of[p]][static_cast<std::size_t>(i % 2)];
      const double share = batch.phase(i / 2) / (2.0 * std::numbers::pi);
      const auto column = static_cast<std::size_t>(std::lround(
          walks.first_column[p] + share * walks.model.patterns[p].trial.duration_s * kRate));
      Stance& stance = stances[static_cast<std::size_t>(i)];
      if (column >= toe.stands.size() || !toe.stands[column]) {
        finish(stance);
        continue;
      }
      const RootPose root = batch.root(i / 2);
      auto turned = [](const Vector3d& v, double angle) -> Vector3d {
        return Eigen::AngleAxisd(angle, Vector3d::UnitZ()) * v;
      };
      const Vector3d made = batch.toe_W_m(i / 2, i % 2);
      if (stance.made.empty()) {
        stance.heading = root.heading_rad - toe.heading_rad[static_cast<Eigen::Index>(column)];
      }
      stance.made.push_back(turned(made, -stance.heading));
      stance.recorded.push_back(toe.p_W[column]);
      const Vector3d p_WH(root.position_W_m.x(), root.position_W_m.y(), root.height_m);
      relative += (turned(made - p_WH, -root.heading_rad) - toe.p_H[column]).squaredNorm();
      points += 1.0;
    }
  }
  return {path / steps * kRate, std::sqrt(place / points), std::sqrt(relative / points)};
}

TEST(RecordedWalk, FeetStandAsStillAsRecorded) {
  using mocap::shared_mocap;
  SKIP_WITHOUT_SHARED();
  const Walks walks = read_walks(shared_mocap());
  ASSERT_EQ(walks.model.patterns.size(), 14U);
  double path = 0.0, frames = 0.0;
  for (const auto& feet : walks.toes) {
    for (const RecordedToe& toe : feet) {
      for (std::size_t t = 1; t < toe.stands.size(); ++t) {
        if (!toe.stands[t]) continue;
        path += (toe.p_W[t] - toe.p_W[t - 1]).head<2>().norm();
        frames += 1.0;
      }
    }
  }
  const Standing free = synthesize(walks, false), locked = synthesize(walks, true);
  std::printf(
      "toe in stance: recorded %.1f cm/s; without lock %.1f cm/s, %.2f cm in place, %.2f cm "
      "from the pelvis; with %.1f cm/s, %.2f cm, %.2f cm\n",
      100 * path / frames * kRate, 100 * free.speed_m_s, 100 * free.place_m, 100 * free.relative_m,
      100 * locked.speed_m_s, 100 * locked.place_m, 100 * locked.relative_m);
  EXPECT_NEAR(path / frames * kRate, 0.083, 0.002);
  EXPECT_LT(locked.speed_m_s, 0.03);  // goal: 8.3 cm/s
  EXPECT_LT(locked.place_m, 0.006);   // goal: 1 cm
  EXPECT_LT(locked.speed_m_s, 0.6 * free.speed_m_s);
  // the model's error, and what the feet that rest are displaced by while the pelvis goes smoothly
  EXPECT_LT(locked.relative_m, free.relative_m + 0.007);
}

}  // namespace
}  // namespace mimesis::synthesizer
