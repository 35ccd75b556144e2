#include "nodes/synthesizer/figure_drawing.h"

#include <array>
#include <cmath>

#include "common/model/drawing.h"
#include "common/motion/mocap/body.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Vector3d;

constexpr int kMostRods = 30;  // figures that are drawn as solids
constexpr model::Rgba kLeft{0.25, 0.49, 0.75, 1.0}, kRight{0.84, 0.41, 0.26, 1.0},
    kTrunk{0.62, 0.65, 0.69, 1.0};
constexpr double kThick_m = 0.035, kHead_m = 0.1, kLine_px = 2.0;

model::Rgba colour_of(int joint) {
  const char side = mocap::kBodyJointNames[static_cast<std::size_t>(joint)].front();
  return side == 'l' ? kLeft : joint != mocap::kRoot && side == 'r' ? kRight : kTrunk;
}

}  // namespace

std::optional<FigureDrawing> FigureDrawing::of(const Director& director) {
  FigureDrawing drawing;
  for (const std::string& row : director.characters().repertoire().model().rows) {
    int b = 0;
    while (b < mocap::kBodyRows && mocap::body_row_name(b) != row) ++b;
    if (b == mocap::kBodyRows) return std::nullopt;
    drawing.body_row_.push_back(b);
  }
  if (director.leads_robot()) return std::nullopt;
  return drawing;
}

foxglove::SceneUpdate FigureDrawing::draw(const Director& director,
                                          std::chrono::nanoseconds now) const {
  const mocap::Body& body = director.characters().repertoire().model().body;
  const bool solid = director.size() <= kMostRods;
  foxglove::SceneUpdate update;
  foxglove::SceneEntity& entity = model::add_entity(update, "figures", "world", now);
  foxglove::LinePrimitive* lines =
      solid ? nullptr
            : &model::add_line(entity, foxglove::LinePrimitive::LINE_LIST, kLine_px, kTrunk);
  const auto bone = [&](const Vector3d& from, const Vector3d& to, const model::Rgba& colour) {
    if (solid) return model::add_rod(entity, from, to, kThick_m, colour);
    model::add_point(*lines, from);
    model::add_point(*lines, to);
  };
  for (int i = 0; i < director.size(); ++i) {
    std::array<double, mocap::kBodyRows> angles_rad{};
    const auto rows = director.angles(i);
    for (std::size_t r = 0; r < body_row_.size(); ++r)
      angles_rad[static_cast<std::size_t>(body_row_[r])] = static_cast<double>(rows[r]);
    const mocap::BodyPose pose = forward_kinematics(body, angles_rad, Vector3d::Zero());
    const DirectedMotion motion = director.motion(i);
    const Eigen::Isometry3d X_WH =
        Eigen::Translation3d(motion.pelvis_W_m) *
        Eigen::Isometry3d(Eigen::AngleAxisd(motion.heading_rad, Vector3d::UnitZ()));
    const auto point = [&](int joint, const Vector3d& p_J) -> Vector3d {
      return X_WH * pose.point(joint, p_J);
    };
    const auto centre = [&](int joint) { return point(joint, Vector3d::Zero()); };
    for (int j = 1; j < mocap::kBodyJoints; ++j)
      bone(centre(mocap::kBodyParents[static_cast<std::size_t>(j)]), centre(j), colour_of(j));
    for (const mocap::Side side : {mocap::kLeft, mocap::kRight}) {
      const auto s = static_cast<std::size_t>(side);
      const int ankle = side == mocap::kLeft ? mocap::kLeftAnkle : mocap::kRightAnkle;
      const int wrist = side == mocap::kLeft ? mocap::kLeftWrist : mocap::kRightWrist;
      bone(point(ankle, body.heel_m[s]), point(ankle, body.toe_m[s]), colour_of(ankle));
      bone(centre(wrist), point(wrist, body.hand_m[s]), colour_of(wrist));
    }
    const Vector3d head = point(mocap::kHead, 0.5 * body.head_top_m);
    if (solid) model::add_ball(entity, head, kHead_m, kTrunk);
  }
  return update;
}

}  // namespace mimesis::synthesizer
