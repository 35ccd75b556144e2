#pragma once
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "nodes/planner/verb/plan_file.h"

namespace mimesis::tool {

/// The way that a plan's end effector keeps to, as a chain of straight lines: those of a circle are
/// at most a micrometre off it.
class ToolWay {
 public:
  /// @param X_WE  at its begin
  ToolWay(const Eigen::Isometry3d& X_WE, const std::vector<PlanToolPiece>& pieces)
      : R_WE_(X_WE.linear()), points_{X_WE.translation()} {
    for (const PlanToolPiece& piece : pieces) {
      const Eigen::Vector3d to = Eigen::Vector3d::Map(piece.to_m.data());
      if (!piece.via_m.empty()) add_arc(Eigen::Vector3d::Map(piece.via_m.data()), to);
      points_.push_back(to);
    }
  }

  double off_m(const Eigen::Vector3d& p) const {
    double least = (p - points_.front()).norm();
    for (std::size_t i = 1; i < points_.size(); ++i) {
      const Eigen::Vector3d line = points_[i] - points_[i - 1], from = p - points_[i - 1];
      const double share = from.dot(line) / std::max(line.squaredNorm(), 1e-18);
      least = std::min(least, (from - std::clamp(share, 0.0, 1.0) * line).norm());
    }
    return least;
  }
  double off_rad(const Eigen::Matrix3d& R) const {
    const double cosine = 0.5 * ((R_WE_.transpose() * R).trace() - 1.0);
    const Eigen::Matrix3d skew = R_WE_.transpose() * R - R.transpose() * R_WE_;
    const double sine = 0.5 * Eigen::Vector3d(skew(2, 1), skew(0, 2), skew(1, 0)).norm();
    return std::atan2(sine, cosine);
  }

 private:
  /// The centre is as far from all three points, and in their plane.
  void add_arc(const Eigen::Vector3d& via, const Eigen::Vector3d& to) {
    constexpr double kSagitta_m = 1e-6;
    const Eigen::Vector3d from = points_.back(), a = via - from, b = to - from;
    const Eigen::Vector3d normal = a.cross(b).normalized();
    Eigen::Matrix3d rows;
    rows << a.transpose(), b.transpose(), normal.transpose();
    const Eigen::Vector3d center =
        from + rows.inverse() * Eigen::Vector3d(0.5 * a.squaredNorm(), 0.5 * b.squaredNorm(), 0.0);
    const Eigen::Vector3d begin = from - center;
    const auto angle = [&](const Eigen::Vector3d& p) {
      const double turned = std::atan2(begin.cross(p - center).dot(normal), begin.dot(p - center));
      return turned < 0.0 ? turned + 2.0 * std::numbers::pi : turned;
    };
    const double whole = angle(to), radius = begin.norm();
    const int lines =
        1 + static_cast<int>(whole / std::sqrt(8.0 * kSagitta_m / std::max(radius, 1e-3)));
    for (int i = 1; i < lines; ++i)
      points_.push_back(center + Eigen::AngleAxisd(whole * i / lines, normal) * begin);
  }

  Eigen::Matrix3d R_WE_;
  std::vector<Eigen::Vector3d> points_;
};

}  // namespace mimesis::tool
