#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "common/motion/mocap/body_map.h"

namespace mimesis::mocap {

/// Heading of the figure in every frame [rad]: direction of the root's x axis seen from above, from
/// W's x axis, + to the left, without jumps by 2π.
Eigen::VectorXd heading_rad(const BodyClip& clip);

/// Takes the heading out of the root's rotation: afterwards it faces W's x axis in every frame.
/// The position stays.
void remove_heading(BodyClip& clip);

/// The figure walks if its heels swing this far relative to the pelvis, further than this share of
/// the clip's largest swing, and this fast over the ground.
inline constexpr double kLeastSwing_m = 0.10, kLeastSwingShare = 0.35, kLeastSwing_m_s = 0.5;

/// Frames of a clip (columns) in which feet meet and leave the ground, by side.
struct GaitEvents {
  std::array<std::vector<Eigen::Index>, 2> heel_strike, toe_off;
  bool backward = false;  ///< the figure walks against its heading
};

/// Zeni's coordinate method: a foot strikes where its heel is farthest ahead of the pelvis, and
/// leaves where its toe is farthest behind (Zeni, Richards, Higginson 2008). "Ahead" is along the
/// heading, or against it in clips that travel backwards (then it is the toe that strikes). A
/// maximum counts if the heel swings by kLeastSwing_m and kLeastSwingShare on both sides of it;
/// half of that at the ends of a clip; a strike counts if the foot flew at kLeastSwing_m_s within
/// half a second before it. No walking, no events.
GaitEvents find_gait_events(const BodyClip& clip);

/// First and last frame (column) of an interval.
struct FrameInterval {
  Eigen::Index first = 0, last = 0;
};

/// When a foot stands: its heel or its toe is slower than 0.6 m/s and lower than 8 cm above that
/// foot's lowest level (5th percentile of the lower point). Breaks below 50 ms are closed, then
/// stances below 50 ms dropped.
std::array<std::vector<FrameInterval>, 2> stance_intervals(const BodyClip& clip);

}  // namespace mimesis::mocap
