#include "common/motion/mocap/markers.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

#include "common/motion/mocap/resampling.h"

namespace mimesis::mocap {

std::optional<RigidFit> fit_rigid(const Eigen::Ref<const Eigen::Matrix3Xd>& body,
                                  const Eigen::Ref<const Eigen::Matrix3Xd>& world) {
  std::vector<Eigen::Index> seen;
  for (Eigen::Index i = 0; i < body.cols(); ++i) {
    if (body.col(i).allFinite() && world.col(i).allFinite()) seen.push_back(i);
  }
  if (seen.size() < 3) return std::nullopt;
  const Eigen::Matrix3Xd b = body(Eigen::all, seen), w = world(Eigen::all, seen);
  const Eigen::Vector3d b_mean = b.rowwise().mean(), w_mean = w.rowwise().mean();
  const Eigen::Matrix3Xd b0 = b.colwise() - b_mean, w0 = w.colwise() - w_mean;
  using Svd = Eigen::JacobiSVD<Eigen::Matrix3d>;
  const double width2 = Svd(b0 * b0.transpose()).singularValues()[1];  // squared, of all markers
  if (width2 < 1e-6 * static_cast<double>(seen.size())) return std::nullopt;

  const Svd svd(w0 * b0.transpose(), Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) signs.z() = -1.0;
  RigidFit fit;
  fit.R_WB = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  fit.p_WB = w_mean - fit.R_WB * b_mean;
  return fit;
}

namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
Matrix3Xd points(const Markers& markers, const MarkerGroup& group, Index frame) {
  Matrix3Xd p(3, static_cast<Index>(group.size()));
  for (std::size_t i = 0; i < group.size(); ++i) {
    p.col(static_cast<Index>(i)) = markers.position_m.block<3, 1>(3 * group[i], frame);
  }
  return p;
}

/// The group's markers in a frame of its own [m], 3×N: mean over the frames that show them all,
/// each turned onto the first of them (the nominal geometry [M18 3.3.2]).
std::optional<Matrix3Xd> nominal_geometry(const Markers& markers, const MarkerGroup& group) {
  Matrix3Xd first, sum;
  int count = 0;
  for (Index f = 0; f < markers.frames(); ++f) {
    const Matrix3Xd p = points(markers, group, f);
    if (!p.allFinite()) continue;
    if (count == 0) {
      first = p.colwise() - Vector3d(p.rowwise().mean());
      sum = Matrix3Xd::Zero(3, p.cols());
    }
    const auto fit = fit_rigid(first, p);
    if (!fit) return std::nullopt;
    sum += fit->R_WB.transpose() * (p.colwise() - fit->p_WB);
    ++count;
  }
  if (count == 0) return std::nullopt;
  return sum / count;
}
struct Gap {
  Index first, last;
};

std::vector<Gap> gaps_of(const Eigen::Ref<const Eigen::MatrixXd>& path) {
  std::vector<Gap> gaps;
  for (Index f = 0; f < path.cols(); ++f) {
    if (path.col(f).allFinite()) continue;
    if (!gaps.empty() && gaps.back().last == f - 1) {
      gaps.back().last = f;
    } else {
      gaps.push_back({f, f});
    }
  }
  return gaps;
}

/// Fills gaps from the prediction of the group, NaN where there is none.
void fill_from(const Matrix3Xd& predicted, Eigen::Ref<Eigen::MatrixXd> path) {
  const Matrix3Xd measured = path;
  auto deviation = [&](Index f, Vector3d& d) {
    if (f < 0 || f >= path.cols()) return false;
    d = measured.col(f) - predicted.col(f);
    return d.allFinite();
  };
  for (const Gap& gap : gaps_of(measured)) {
    Vector3d before, after;
    const bool has_before = deviation(gap.first - 1, before);
    const bool has_after = deviation(gap.last + 1, after);
    if (!has_before) before = has_after ? after : Vector3d(Vector3d::Zero());
    if (!has_after) after = before;
    for (Index f = gap.first; f <= gap.last; ++f) {
      if (!predicted.col(f).allFinite()) continue;
      const double share =
          static_cast<double>(f - gap.first + 1) / static_cast<double>(gap.last - gap.first + 2);
      path.col(f) = predicted.col(f) + (1.0 - share) * before + share * after;
    }
  }
}

void fill_by_spline(Eigen::Ref<Eigen::MatrixXd> path, Index longest) {
  std::vector<double> knots;
  std::vector<Index> seen;
  for (Index f = 0; f < path.cols(); ++f) {
    if (!path.col(f).allFinite()) continue;
    knots.push_back(static_cast<double>(f));
    seen.push_back(f);
  }
  if (knots.size() < 2) return;
  const Spline spline(knots, path(Eigen::all, seen));
  for (const Gap& gap : gaps_of(path)) {
    const bool inside = gap.first > 0 && gap.last + 1 < path.cols();
    if (!inside || gap.last - gap.first + 1 > longest) continue;
    for (Index f = gap.first; f <= gap.last; ++f) {
      path.col(f) = spline.at(static_cast<double>(f));
    }
  }
}

}  // namespace

void fill_gaps(Markers& markers, std::span<const MarkerGroup> groups, double longest_s) {
  const Markers recorded = markers;
  for (const MarkerGroup& group : groups) {
    const auto nominal = nominal_geometry(recorded, group);
    if (!nominal) continue;
    for (std::size_t i = 0; i < group.size(); ++i) {
      // by the others alone, in all frames: a marker that drops out must not shift its prediction
      Matrix3Xd others = *nominal;
      others.col(static_cast<Index>(i)).setConstant(NAN);
      Matrix3Xd predicted = Matrix3Xd::Constant(3, markers.frames(), NAN);
      for (Index f = 0; f < markers.frames(); ++f) {
        const auto fit = fit_rigid(others, points(recorded, group, f));
        if (!fit) continue;
        predicted.col(f) = fit->R_WB * nominal->col(static_cast<Index>(i)) + fit->p_WB;
      }
      fill_from(predicted, markers.position_m.middleRows(3 * group[i], 3));
    }
  }
  const auto longest = static_cast<Index>(std::floor(longest_s * markers.rate_hz));
  for (std::size_t m = 0; m < markers.labels.size(); ++m) {
    fill_by_spline(markers.position_m.middleRows(static_cast<Index>(3 * m), 3), longest);
  }
}

}  // namespace mimesis::mocap
