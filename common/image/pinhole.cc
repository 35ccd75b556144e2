#include "common/image/pinhole.h"

#include <Eigen/Geometry>

#include "common/error.h"

namespace mimesis::image {

Pinhole::Pinhole(const View& view)
    : eye_(view.eye_m.at(0), view.eye_m.at(1), view.eye_m.at(2)),
      focal_(view.focal_px),
      cx_(0.5 * (view.width_px - 1)),
      cy_(0.5 * (view.height_px - 1)),
      width_(view.width_px),
      height_(view.height_px) {
  const Eigen::Vector3d target(view.target_m.at(0), view.target_m.at(1), view.target_m.at(2));
  const Eigen::Vector3d axis = target - eye_;
  const Eigen::Vector3d side = axis.cross(Eigen::Vector3d::UnitY());
  if (side.norm() < 1e-6) {
    throw ConfigError("view: eye_m and target_m must differ, and not only in height (y)");
  }
  const Eigen::Vector3d forward = axis.normalized();
  const Eigen::Vector3d right = side.normalized();
  r_ct_.row(0) = right;
  r_ct_.row(1) = forward.cross(right);
  r_ct_.row(2) = forward;
}

Eigen::Vector2d Pinhole::project(const Eigen::Vector3d& p_T) const {
  const Eigen::Vector3d p = r_ct_ * (p_T - eye_);
  return {cx_ + focal_ * p.x() / p.z(), cy_ + focal_ * p.y() / p.z()};
}

double Pinhole::depth(const Eigen::Vector3d& p_T) const { return r_ct_.row(2).dot(p_T - eye_); }

Eigen::Vector3d Pinhole::ray(double u, double v) const {
  return r_ct_.transpose() * Eigen::Vector3d((u - cx_) / focal_, (v - cy_) / focal_, 1.0);
}

std::optional<Eigen::Vector2d> Pinhole::on_plane(double u, double v) const {
  const Eigen::Vector3d d = ray(u, v);
  const double t = -eye_.z() / d.z();
  if (!(t > 0.0) || t > 1e6) return std::nullopt;
  return (eye_ + t * d).head<2>();
}

}  // namespace mimesis::image
