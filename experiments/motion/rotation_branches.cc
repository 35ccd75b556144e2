#include "experiments/motion/rotation_branches.h"

#include <limits>
#include <vector>

#include "common/math/so3.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Index;

bool is_joint(const std::vector<std::string>& rows, std::size_t r) {
  if (r + 2 >= rows.size() || !rows[r].ends_with(".x")) return false;
  const std::string name = rows[r].substr(0, rows[r].size() - 1);
  return rows[r + 1] == name + "y" && rows[r + 2] == name + "z";
}

/// The trajectory (3×T) on the branch nearest to `reference`, sample by sample along its own
/// direction. Does nothing where no other branch is nearer.
Eigen::Matrix3Xd nearest_branch(const Eigen::Matrix3Xd& x, const Eigen::Vector3d& reference) {
  // the branch is that of the whole trajectory: the one of its mean
  const Eigen::Vector3d mean = x.rowwise().mean();
  const Eigen::Vector3d moved = math::nearest_axis_angle(mean, reference);
  const double turn = (moved - mean).dot(mean.normalized());
  if (mean.norm() < 1e-9 || std::abs(turn) < 1.0) return x;
  Eigen::Matrix3Xd out = x;
  for (Index t = 0; t < x.cols(); ++t) out.col(t) += turn * x.col(t).normalized();
  return out;
}

}  // namespace

int align_rotation_branches(mocap::Trials& trials) {
  const Index rows = trials.rows_per_trial(), count = static_cast<Index>(trials.trials.size());
  int changed = 0;
  for (Index r = 0; r < rows; ++r) {
    if (!is_joint(trials.rows, static_cast<std::size_t>(r))) continue;
    const auto joint = [&](Index i) { return trials.samples.middleRows(i * rows + r, 3); };
    double best = std::numeric_limits<double>::infinity();
    Eigen::Vector3d reference = Eigen::Vector3d::Zero();
    for (Index i = 0; i < count; ++i) {
      const Eigen::Vector3d around = joint(i).rowwise().mean();
      double spread = 0.0;
      for (Index j = 0; j < count; ++j) {
        spread += (nearest_branch(joint(j), around).rowwise().mean() - around).squaredNorm();
      }
      if (spread < best * (1.0 - 1e-9)) {
        best = spread;
        reference = around;
      }
    }
    for (Index i = 0; i < count; ++i) {
      const Eigen::Matrix3Xd moved = nearest_branch(joint(i), reference);
      if ((moved - joint(i)).cwiseAbs().maxCoeff() < 1.0) continue;
      joint(i) = moved;
      ++changed;
    }
  }
  return changed;
}

}  // namespace mimesis::synthesizer
