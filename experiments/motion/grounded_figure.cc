#include "experiments/motion/grounded_figure.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "common/error.h"

namespace mimesis::synthesizer {

std::vector<int> body_rows(const MotionModel& model) {
  std::vector<int> out;
  for (const std::string& row : model.rows) {
    int at = 0;
    while (at < mocap::kBodyRows && mocap::body_row_name(at) != row) ++at;
    if (at == mocap::kBodyRows) {
      throw ConfigError("row '" + row + "' is none of a body, expected one as lhip.x");
    }
    out.push_back(at);
  }
  return out;
}

mocap::BodyPose figure_pose(const mocap::Body& body,
                            const Eigen::Matrix<double, mocap::kBodyRows, 1>& angles_rad,
                            const Eigen::Vector3d& p_W, double heading_rad) {
  mocap::BodyPose pose = mocap::forward_kinematics(
      body, std::span<const double, mocap::kBodyRows>(angles_rad.data(), mocap::kBodyRows),
      Eigen::Vector3d::Zero());
  const Eigen::Matrix3d R_WH =
      Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  for (std::size_t j = 0; j < pose.p_WJ.size(); ++j) {
    pose.R_WJ[j] = R_WH * pose.R_WJ[j];
    pose.p_WJ[j] = p_W + R_WH * pose.p_WJ[j];
  }
  return pose;
}

GroundedFigure::GroundedFigure(const MotionModel& model)
    : body_(model.body), lanes_(model.body), body_row_(body_rows(model)) {
  angles_.setZero();
}

void GroundedFigure::step(const Eigen::VectorXd& angles_rad, double dt_s) {
  alignas(64) Lane lane[mocap::kBodyRows] = {};
  for (std::size_t r = 0; r < body_row_.size(); ++r) {
    angles_[body_row_[r]] = angles_rad[static_cast<Eigen::Index>(r)];
  }
  for (int r = 0; r < mocap::kBodyRows; ++r) {
    std::fill_n(lane[r], kLanes, static_cast<float>(angles_[r]));
  }
  RotationLanes rotation;
  PointLanes point;
  posture(lanes_, lane, rotation, point);
  root_motion(point, static_cast<float>(dt_s), root_);
  position_ += Eigen::Rotation2Dd(heading_) *
               Eigen::Vector2d(static_cast<double>(root_.dx[0]), static_cast<double>(root_.dy[0]));
  heading_ += static_cast<double>(root_.turn[0]);
}

mocap::BodyPose GroundedFigure::pose() const {
  return figure_pose(body_, angles_,
                     {position_.x(), position_.y(), static_cast<double>(root_.height[0])},
                     heading_);
}

}  // namespace mimesis::synthesizer
