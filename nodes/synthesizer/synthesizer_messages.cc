#include "nodes/synthesizer/synthesizer_messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/math/circle.h"
#include "common/model/drawing.h"
#include "common/model/messages.h"
#include "common/motion/mocap/body.h"
#include "common/motion/model/motion_model.h"

namespace mimesis::synthesizer {

namespace {

using model::to_eigen;
using model::to_proto;

constexpr double kFar_m = 1e4;           // from the origin: beyond it floats of batches get coarse
constexpr double kFastest_rad_s = 50.0;  // largest rate of any rhythm
constexpr double kLongestStep_m = 5.0;
constexpr double kLongestChange_s = 600.0;

std::string unknown_character(std::uint32_t character, const Characters& characters) {
  if (character < static_cast<std::uint32_t>(characters.size())) return {};
  return fmt::format("character {}: there are {}, from 0", character, characters.size());
}

/// Numbers on the wire are finite: ports see to it. They may be absurd.
bool within(double value, double low, double high) { return value >= low && value <= high; }

constexpr double kLongest_s = 60.0;

bool near(double x) { return std::abs(x) <= kFar_m; }
bool near(const v1::Vector3& p) { return near(p.x_m()) && near(p.y_m()) && near(p.z_m()); }

mocap::Side side(v1::Foot foot) { return foot == v1::FOOT_LEFT ? mocap::kLeft : mocap::kRight; }
v1::Foot foot(mocap::Side side) { return side == mocap::kLeft ? v1::FOOT_LEFT : v1::FOOT_RIGHT; }

SolePrint to_print(const v1::Footprint& message) {
  return {.side = side(message.foot()),
          .p_W_m = to_eigen(message.position_in_world_m()).head<2>(),
          .yaw_rad = message.yaw_rad()};
}

RobotGait to_gait(v1::WalkState state) {
  switch (state) {
    case v1::WALK_STATE_STANDING:
      return RobotGait::standing;
    case v1::WALK_STATE_STARTING:
      return RobotGait::starting;
    case v1::WALK_STATE_WALKING:
      return RobotGait::walking;
    case v1::WALK_STATE_STOPPING:
      return RobotGait::stopping;
    case v1::WALK_STATE_SAFE:
      return RobotGait::safe;
    default:
      return RobotGait::waiting;
  }
}

std::string hands_fault(const google::protobuf::RepeatedPtrField<v1::Vector3>& hands) {
  if (hands.size() != 0 && hands.size() != 2) {
    return fmt::format("{} hands, expected none or two", hands.size());
  }
  return std::ranges::all_of(hands, [](const v1::Vector3& p) { return near(p); })
             ? ""
             : "a hand is nowhere";
}

using Eigen::Vector3d;

constexpr int kMostSolid = 30;  // figures that are drawn as solids
constexpr model::Rgba kLeft{0.25, 0.49, 0.75, 1.0}, kRight{0.84, 0.41, 0.26, 1.0},
    kTrunk{0.62, 0.65, 0.69, 1.0};
constexpr double kLine_px = 2.0;

model::Rgba colour_of(int joint) {
  const char side = mocap::kBodyJointNames[static_cast<std::size_t>(joint)].front();
  return side == 'l' ? kLeft : joint != mocap::kRoot && side == 'r' ? kRight : kTrunk;
}

void add_lines(const mocap::Body& body, const mocap::BodyPose& pose,
               foxglove::LinePrimitive& lines) {
  const auto bone = [&](const Vector3d& from, const Vector3d& to) {
    model::add_point(lines, from);
    model::add_point(lines, to);
  };
  const auto centre = [&](int joint) { return pose.p_WJ[static_cast<std::size_t>(joint)]; };
  for (int j = 1; j < mocap::kBodyJoints; ++j)
    bone(centre(mocap::kBodyParents[static_cast<std::size_t>(j)]), centre(j));
  for (const mocap::Side side : {mocap::kLeft, mocap::kRight}) {
    const auto s = static_cast<std::size_t>(side);
    const int ankle = side == mocap::kLeft ? mocap::kLeftAnkle : mocap::kRightAnkle;
    const int wrist = side == mocap::kLeft ? mocap::kLeftWrist : mocap::kRightWrist;
    bone(pose.point(ankle, body.heel_m[s]), pose.point(ankle, body.toe_m[s]));
    bone(centre(wrist), pose.point(wrist, body.hand_m[s]));
  }
}

}  // namespace

std::string fault(const v1::MotionGoal& goal, const Characters& characters) {
  if (auto why = unknown_character(goal.character(), characters); !why.empty()) return why;
  if (goal.kind() == v1::MOTION_GOAL_KIND_STOP) return {};
  if (!v1::MotionGoalKind_IsValid(goal.kind()) || goal.kind() == v1::MOTION_GOAL_KIND_UNSPECIFIED) {
    return fmt::format("kind {} is none of WALK_TO, DRAWER, STOP", static_cast<int>(goal.kind()));
  }
  const double x = goal.position_in_world_m().x_m(), y = goal.position_in_world_m().y_m();
  if (!within(x, -kFar_m, kFar_m) || !within(y, -kFar_m, kFar_m)) {
    return fmt::format("goal at ({:g}, {:g}) m is farther than {:g} m", x, y, kFar_m);
  }
  if (!characters.moves()) {
    return fmt::format("model '{}' gets nowhere: its steps have no length",
                       characters.repertoire().model().name);
  }
  if (goal.kind() == v1::MOTION_GOAL_KIND_DRAWER && !within(goal.object_depth_m(), 0.0, 1.0)) {
    return fmt::format("object {:g} m behind the front, expected 0 .. 1", goal.object_depth_m());
  }
  return {};
}

std::string fault(const v1::StyleWish& wish, const Characters& characters) {
  for (const std::uint32_t character : wish.characters()) {
    if (auto why = unknown_character(character, characters); !why.empty()) return why;
  }
  if (wish.shares().empty()) return "names no style; known: " + characters.repertoire().known();
  for (const v1::StyleShare& share : wish.shares()) {
    if (characters.repertoire().find(share.style()) < 0) {
      return fmt::format("style '{}' is unknown; known: {}", share.style().substr(0, 60),
                         characters.repertoire().known());
    }
    if (!(share.share() > 0.0 && share.share() <= 1e6)) {
      return fmt::format("style '{}' has share {:g}, expected more than 0", share.style(),
                         share.share());
    }
  }
  if (!within(wish.duration_s(), 0.0, kLongestChange_s)) {
    return fmt::format("duration {:g} s is outside [0, {:g}]", wish.duration_s(), kLongestChange_s);
  }
  return {};
}

std::string fault(const v1::Beat& beat) {
  if (!within(beat.phase_rate_rad_s(), 0.0, kFastest_rad_s)) {
    return fmt::format("rate {:g} rad/s is outside [0, {:g}]", beat.phase_rate_rad_s(),
                       kFastest_rad_s);
  }
  if (!within(beat.phase_rad(), -1e6, 1e6)) {
    return fmt::format("phase {:g} rad is no phase", beat.phase_rad());
  }
  return {};
}

std::string fault(const v1::GaitCommand& gait, const Characters& characters) {
  if (auto why = unknown_character(gait.character(), characters); !why.empty()) return why;
  if (!within(gait.phase_rate_rad_s(), 0.0, kFastest_rad_s)) {
    return fmt::format("character {}: rate {:g} rad/s is outside [0, {:g}]", gait.character(),
                       gait.phase_rate_rad_s(), kFastest_rad_s);
  }
  if (!within(gait.step_length_m(), 0.0, kLongestStep_m)) {
    return fmt::format("character {}: step of {:g} m is outside [0, {:g}]", gait.character(),
                       gait.step_length_m(), kLongestStep_m);
  }
  if (!within(gait.phase_rad(), -1e6, 1e6) || !within(gait.heading_rad(), -1e6, 1e6)) {
    return fmt::format("character {}: phase {:g} rad, heading {:g} rad are no angles",
                       gait.character(), gait.phase_rad(), gait.heading_rad());
  }
  return {};
}

std::vector<double> to_shares(const v1::StyleWish& wish, const Repertoire& repertoire) {
  std::vector<double> shares(static_cast<std::size_t>(repertoire.style_count()), 0.0);
  double sum = 0.0;
  for (const v1::StyleShare& share : wish.shares()) {
    shares[static_cast<std::size_t>(repertoire.find(share.style()))] += share.share();
    sum += share.share();
  }
  for (double& share : shares) share /= sum;
  return shares;
}

GaitWish to_gait(const v1::GaitCommand& gait) {
  GaitWish wish;
  if (gait.has_phase_rate_rad_s()) wish.phase_rate_rad_s = gait.phase_rate_rad_s();
  if (gait.has_step_length_m()) wish.step_length_m = gait.step_length_m();
  if (gait.has_heading_rad()) wish.heading_rad = gait.heading_rad();
  return wish;
}

void to_proto(const Director& director, v1::MotionBatch& batch) {
  const int count = director.size(), rows = director.characters().rows();
  batch.mutable_phase_rad()->Resize(count, 0.0F);
  batch.mutable_heading_rad()->Resize(count, 0.0F);
  batch.mutable_position_pelvis_in_world_m()->Resize(3 * count, 0.0F);
  batch.mutable_position_rad()->Resize(rows * count, 0.0F);
  float* phase = batch.mutable_phase_rad()->mutable_data();
  float* heading = batch.mutable_heading_rad()->mutable_data();
  float* place = batch.mutable_position_pelvis_in_world_m()->mutable_data();
  float* angle = batch.mutable_position_rad()->mutable_data();
  for (int i = 0; i < count; ++i) {
    const CharacterState& state = director.state(i);
    *phase++ = static_cast<float>(state.phase_rad);
    *heading++ = static_cast<float>(math::wrap_pi(state.root.heading_rad));
    *place++ = static_cast<float>(state.root.position_W_m.x());
    *place++ = static_cast<float>(state.root.position_W_m.y());
    *place++ = static_cast<float>(state.root.height_m);
    const auto angles = director.angles(i);
    std::copy(angles.begin(), angles.end(), angle);
    motion::clamp_to_limits(director.characters().repertoire().model(),
                            std::span(angle, angles.size()));
    angle += angles.size();
  }
}

v1::MotionStatus to_proto(int i, const Progress& progress) {
  v1::MotionStatus status;
  status.set_character(static_cast<std::uint32_t>(i));
  switch (progress.kind) {
    case GoalKind::walk_to:
      status.set_kind(v1::MOTION_GOAL_KIND_WALK_TO);
      break;
    case GoalKind::drawer:
      status.set_kind(v1::MOTION_GOAL_KIND_DRAWER);
      break;
    case GoalKind::stop:
      status.set_kind(v1::MOTION_GOAL_KIND_STOP);
      break;
    case GoalKind::none:
      break;
  }
  status.set_reached(progress.reached);
  status.set_reason(progress.reason);
  status.set_goal_distance_m(progress.distance_m);
  return status;
}

std::string fault(const v1::WalkFeedback& f) {
  if (!v1::WalkState_IsValid(f.state()) || f.state() == v1::WALK_STATE_UNSPECIFIED) {
    return fmt::format("state {} is none of a walker", static_cast<int>(f.state()));
  }
  if (!near(f.position_pelvis_in_world_m()) || !near(f.heading_rad())) {
    return fmt::format("pelvis at ({:g}, {:g}) m, heading {:g} rad is nowhere",
                       f.position_pelvis_in_world_m().x_m(), f.position_pelvis_in_world_m().y_m(),
                       f.heading_rad());
  }
  if (!(f.to_landing_s() >= 0.0 && f.to_landing_s() <= kLongest_s)) {
    return fmt::format("{:g} s to the landing, expected 0 .. {:g}", f.to_landing_s(), kLongest_s);
  }
  if (f.to_landing_s() > 0.0 && f.swing() != v1::FOOT_LEFT && f.swing() != v1::FOOT_RIGHT) {
    return "a step of no foot";
  }
  if (f.feet_size() != 2 || f.feet(0).foot() != v1::FOOT_LEFT ||
      f.feet(1).foot() != v1::FOOT_RIGHT) {
    return fmt::format("{} feet, expected the left and the right one", f.feet_size());
  }
  for (const v1::Footprint& print : {f.feet(0), f.feet(1), f.landing()}) {
    if (!near(print.position_in_world_m()) || !near(print.yaw_rad())) return "a foot is nowhere";
  }
  if (f.has_world_from_head()) {
    const v1::Quaternion& q = f.world_from_head();
    const double length = Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()).norm();
    if (!near(f.head_in_world_m()) || !(std::abs(length - 1.0) < 1e-3))
      return "the head is nowhere";
  }
  return hands_fault(f.hands_in_world_m());
}

RobotFeedback to_feedback(const v1::WalkFeedback& m) {
  RobotFeedback f;
  f.gait = to_gait(m.state());
  f.pelvis_W_m = to_eigen(m.position_pelvis_in_world_m());
  f.heading_rad = math::wrap_pi(m.heading_rad());
  f.swing = side(m.swing());
  f.to_landing_s = m.to_landing_s();
  f.landing = to_print(m.landing());
  f.feet = {to_print(m.feet(0)), to_print(m.feet(1))};
  f.steps = static_cast<int>(m.steps() & 0x7fffffffU);
  f.hands_known = m.hands_in_world_m_size() == 2;
  for (int i = 0; i < m.hands_in_world_m_size(); ++i) {
    f.hand_W_m[static_cast<std::size_t>(i)] = to_eigen(m.hands_in_world_m(i));
  }
  if (m.has_world_from_head()) {
    const v1::Quaternion& q = m.world_from_head();
    f.X_WH.emplace(Eigen::Translation3d(to_eigen(m.head_in_world_m())) *
                   Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()).normalized());
  }
  return f;
}

std::string fault(const v1::HeadSight& sight) {
  if (!near(sight.handle_in_head_m()) || !near(sight.object_in_head_m())) {
    return "handle or object is nowhere";
  }
  return {};
}

DrawerSenses::Sight to_sight(const v1::HeadSight& m, double age_s) {
  DrawerSenses::Sight sight{.age_s = age_s, .handle_H_m = {}, .object_H_m = {}};
  if (m.has_handle_in_head_m()) sight.handle_H_m = to_eigen(m.handle_in_head_m());
  if (m.has_object_in_head_m()) sight.object_H_m = to_eigen(m.object_in_head_m());
  return sight;
}

void to_proto(const Director& director, int i, const LimitedMotion& limited, v1::Motion& message) {
  const DirectedMotion motion = director.motion(i);
  const Characters& characters = director.characters();
  message.set_phase_rad(motion.phase_rad);
  message.set_phase_rate_rad_s(motion.phase_rate_rad_s);
  message.set_velocity_forward_m_s(motion.velocity[0]);
  message.set_velocity_left_m_s(motion.velocity[1]);
  message.set_yaw_rate_rad_s(motion.velocity[2]);
  to_proto(motion.pelvis_W_m, *message.mutable_position_pelvis_in_world_m());
  message.set_heading_rad(math::wrap_pi(motion.heading_rad));
  message.clear_position_rad();
  message.clear_velocity_rad_s();
  for (const float angle : limited.angles_rad) message.add_position_rad(static_cast<double>(angle));
  for (const double rate : limited.velocity_rad_s) message.add_velocity_rad_s(rate);
  message.set_smooth_velocity_forward_m_s(motion.smooth_velocity[0]);
  message.set_smooth_velocity_left_m_s(motion.smooth_velocity[1]);
  message.set_smooth_yaw_rate_rad_s(motion.smooth_velocity[2]);
  message.set_style(characters.repertoire().style(characters.walk(i).style().largest()).name);
  message.set_action(motion.action);
  message.clear_hands();
  for (const std::size_t h : {std::size_t{0}, std::size_t{1}}) {
    if (!motion.hand[h]) continue;
    v1::HandGoal& goal = *message.add_hands();
    goal.set_left(h == 0);
    to_proto(motion.hand[h]->p_W_m, *goal.mutable_position_in_world_m());
    goal.set_share(motion.hand[h]->share);
  }
  message.clear_landings();
  for (const auto& landing : motion.landing) {
    if (!landing) break;
    v1::Footprint& print = *message.add_landings();
    print.set_foot(foot(landing->side));
    to_proto({landing->p_W_m.x(), landing->p_W_m.y(), 0.0}, *print.mutable_position_in_world_m());
    print.set_yaw_rad(landing->yaw_rad);
  }
  message.set_stands(motion.stands);
}

std::vector<int> body_rows(std::span<const std::string> rows) {
  std::vector<int> found;
  for (const std::string& row : rows) {
    int b = 0;
    while (b < mocap::kBodyRows && mocap::body_row_name(b) != row) ++b;
    found.push_back(b < mocap::kBodyRows ? b : -1);
  }
  return found;
}

void add_figure(const mocap::Body& body, const mocap::BodyPose& pose,
                foxglove::SceneEntity& entity) {
  // of an adult of 1.70 m, whose legs are 0.835 m long
  const double size =
      (body.offset_m[mocap::kLeftKnee].norm() + body.offset_m[mocap::kLeftAnkle].norm()) / 0.835;
  const auto centre = [&](int joint) { return pose.p_WJ[static_cast<std::size_t>(joint)]; };
  const auto limb = [&](int from, int to, double thick_m, double thin_m) {
    model::add_taper(entity, centre(from), centre(to), size * thick_m, size * thin_m,
                     colour_of(to));
    model::add_ball(entity, centre(from), size * thick_m, colour_of(to));
    model::add_ball(entity, centre(to), size * thin_m, colour_of(to));
  };
  const auto part = [&](int joint, const Vector3d& p_W, const Vector3d& axes_m) {
    Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
    at.linear() = pose.R_WJ[static_cast<std::size_t>(joint)];
    at.translation() = p_W;
    model::add_ellipsoid(entity, at, axes_m, colour_of(joint));
  };
  const auto half_way = [&](int a, int b) -> Vector3d { return 0.5 * (centre(a) + centre(b)); };
  const auto hips = half_way(mocap::kLeftHip, mocap::kRightHip);
  part(mocap::kRoot, 0.5 * (centre(mocap::kRoot) + hips), size * Vector3d(0.21, 0.33, 0.22));
  part(mocap::kSpine, half_way(mocap::kSpine, mocap::kChest), size * Vector3d(0.19, 0.28, 0.30));
  part(mocap::kChest, half_way(mocap::kChest, mocap::kNeck), size * Vector3d(0.23, 0.35, 0.36));
  limb(mocap::kNeck, mocap::kHead, 0.055, 0.050);
  part(mocap::kHead, pose.point(mocap::kHead, 0.5 * body.head_top_m),
       size * Vector3d(0.19, 0.155, 0.24));
  for (const mocap::Side side : {mocap::kLeft, mocap::kRight}) {
    const auto s = static_cast<std::size_t>(side);
    const bool left = side == mocap::kLeft;
    const int hip = left ? mocap::kLeftHip : mocap::kRightHip, knee = hip + 1, ankle = hip + 2;
    const int shoulder = left ? mocap::kLeftShoulder : mocap::kRightShoulder;
    const int elbow = shoulder + 1, wrist = shoulder + 2;
    limb(hip, knee, 0.080, 0.053);
    limb(knee, ankle, 0.053, 0.037);
    limb(shoulder, elbow, 0.054, 0.037);
    limb(elbow, wrist, 0.037, 0.027);
    // its sole is on the line from heel to toes
    const Vector3d foot = body.toe_m[s] - body.heel_m[s];
    const double high = 0.08 * size;
    const Vector3d up(0.0, 0.0, 0.5 * high);
    part(ankle, pose.point(ankle, 0.5 * (body.toe_m[s] + body.heel_m[s]) + up),
         {1.12 * foot.norm(), 0.095 * size, high});
    model::add_taper(entity, centre(ankle), pose.point(ankle, body.heel_m[s] + 0.42 * foot + up),
                     0.037 * size, 0.042 * size, colour_of(ankle));
    const Vector3d& hand = body.hand_m[s];
    part(wrist, pose.point(wrist, 0.5 * hand), {0.075 * size, hand.norm(), 0.035 * size});
  }
}

std::optional<FigureDrawing> FigureDrawing::of(const Director& director) {
  FigureDrawing drawing;
  drawing.body_row_ = body_rows(director.characters().repertoire().model().rows);
  if (director.leads_robot() || std::ranges::count(drawing.body_row_, -1) > 0) return std::nullopt;
  return drawing;
}

foxglove::SceneUpdate FigureDrawing::draw(const Director& director,
                                          std::chrono::nanoseconds now) const {
  const mocap::Body& body = director.characters().repertoire().model().body;
  foxglove::SceneUpdate update;
  foxglove::SceneEntity& entity = model::add_entity(update, "figures", "world", now);
  foxglove::LinePrimitive* lines =
      director.size() <= kMostSolid
          ? nullptr
          : &model::add_line(entity, foxglove::LinePrimitive::LINE_LIST, kLine_px, kTrunk);
  for (int i = 0; i < director.size(); ++i) {
    std::array<double, mocap::kBodyRows> angles_rad{};
    const auto rows = director.angles(i);
    for (std::size_t r = 0; r < body_row_.size(); ++r)
      angles_rad[static_cast<std::size_t>(body_row_[r])] = static_cast<double>(rows[r]);
    mocap::BodyPose pose = forward_kinematics(body, angles_rad, Vector3d::Zero());
    const DirectedMotion motion = director.motion(i);
    const Eigen::Isometry3d X_WH =
        Eigen::Translation3d(motion.pelvis_W_m) *
        Eigen::Isometry3d(Eigen::AngleAxisd(motion.heading_rad, Vector3d::UnitZ()));
    for (Vector3d& p : pose.p_WJ) p = X_WH * p;
    for (Eigen::Matrix3d& R : pose.R_WJ) R = X_WH.linear() * R;
    if (lines == nullptr) {
      add_figure(body, pose, entity);
    } else {
      add_lines(body, pose, *lines);
    }
  }
  return update;
}

}  // namespace mimesis::synthesizer
