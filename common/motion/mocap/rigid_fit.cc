#include "common/motion/mocap/rigid_fit.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <vector>

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
  const double width = Eigen::JacobiSVD<Eigen::Matrix3Xd>(b0).singularValues()[1];
  if (width < 1e-3 * std::sqrt(static_cast<double>(seen.size()))) return std::nullopt;

  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(w0 * b0.transpose(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) signs.z() = -1.0;
  RigidFit fit;
  fit.R_WB = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  fit.p_WB = w_mean - fit.R_WB * b_mean;
  fit.rms_m = std::sqrt((fit.R_WB * b0 - w0).squaredNorm() / static_cast<double>(seen.size()));
  return fit;
}

}  // namespace mimesis::mocap
