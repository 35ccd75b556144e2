#include "common/motion/retarget/to_robot.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "common/math/so3.h"

namespace mimesis::retarget {
namespace {

using Eigen::Index, Eigen::Isometry3d, Eigen::VectorXd;

constexpr double kMissed = 1e-3;                 // weighted error of exact goals [m, rad]
constexpr double kAtLimit = 1e-9;                // [rad]
constexpr int kFirstSearch = 400, kSearch = 60;  // iterations: the easy posture may be far away

class Sum {
 public:
  void add(double value) {
    squares_ += value * value;
    max_ = std::max(max_, std::abs(value));
    ++count_;
  }
  Deviation result() const {
    return {count_ > 0 ? std::sqrt(squares_ / static_cast<double>(count_)) : 0.0, max_};
  }

 private:
  double squares_ = 0.0, max_ = 0.0;
  long count_ = 0;
};

double distance(const robot::Kinematics& k, const Goal& g) {
  return (k.X_WL(g.link) * g.X_LE.translation() - g.X_WE.translation()).norm();
}
double angle(const robot::Kinematics& k, const Goal& g) {
  const Isometry3d X_WE = k.X_WL(g.link) * g.X_LE;
  return math::log_so3(g.X_WE.linear() * X_WE.linear().transpose()).norm();
}

void report_limits(const robot::RobotTree& tree, const std::vector<Posture>& postures,
                   RobotReport& report) {
  const VectorXd lower = tree.lower(), upper = tree.upper();
  std::set<std::string> names;
  for (const Posture& p : postures) {
    bool any = false;
    for (Index i = 0; i < p.q.size(); ++i) {
      if (p.q[i] > lower[i] + kAtLimit && p.q[i] < upper[i] - kAtLimit) continue;
      names.insert(tree.moved(static_cast<int>(i)).joint);
      any = true;
    }
    report.frames_at_limits += any ? 1 : 0;
  }
  report.joints_at_limits.assign(names.begin(), names.end());
}

void report_speed(const robot::RobotTree& tree, const std::vector<Posture>& postures,
                  double rate_hz, RobotReport& report) {
  const VectorXd limit = tree.max_speed();
  for (std::size_t t = 1; t < postures.size(); ++t) {
    const VectorXd share =
        ((postures[t].q - postures[t - 1].q) * rate_hz).cwiseAbs().cwiseQuotient(limit);
    Index fastest = 0;
    const double most = share.maxCoeff(&fastest);
    if (most <= report.speed_share) continue;
    report.speed_share = most;
    report.fastest_joint = tree.moved(static_cast<int>(fastest)).joint;
  }
}

void report_deviations(robot::Kinematics& k, const std::vector<Posture>& postures,
                       const std::vector<FrameGoals>& goals, RobotReport& report) {
  Sum foot_m, foot_rad, hand_m, hand_rad, chest, head;
  for (std::size_t t = 0; t < postures.size(); ++t) {
    k.update(postures[t].X_WB, postures[t].q);
    for (const std::size_t side : {0u, 1u}) {
      foot_m.add(distance(k, goals[t].exact[side]));
      foot_rad.add(angle(k, goals[t].exact[side]));
      hand_m.add(distance(k, goals[t].exact[2 + side]));
      hand_rad.add(angle(k, goals[t].exact[2 + side]));
    }
    chest.add(angle(k, goals[t].wishes[1]));
    head.add(angle(k, goals[t].wishes[2]));
  }
  report.foot_m = foot_m.result();
  report.foot_rad = foot_rad.result();
  report.hand_m = hand_m.result();
  report.hand_rad = hand_rad.result();
  report.chest_rad = chest.result();
  report.head_rad = head.result();
}

RobotClip to_clip(const robot::RobotTree& tree, const std::vector<Posture>& postures,
                  double rate_hz) {
  RobotClip clip;
  clip.rate_hz = rate_hz;
  clip.joints = tree.joint_names();
  const auto frames = static_cast<Index>(postures.size());
  clip.q.resize(tree.dof(), frames);
  clip.pelvis_position_W_m.resize(3, frames);
  clip.pelvis_rotation_rad.resize(3, frames);
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (Index t = 0; t < frames; ++t) {
    const Posture& p = postures[static_cast<std::size_t>(t)];
    clip.q.col(t) = p.q;
    clip.pelvis_position_W_m.col(t) = p.X_WB.translation();
    before = math::nearest_axis_angle(math::log_so3(p.X_WB.linear()), before);
    clip.pelvis_rotation_rad.col(t) = before;
  }
  return clip;
}

using Eigen::Vector3d;

std::size_t joint_index(int i) { return static_cast<std::size_t>(i); }

/// Bends the legs of a pose so that ankles of `body` are where the pose says.
void bend_legs(const mocap::Body& body, mocap::BodyPose& pose) {
  for (const int hip : {int{mocap::kLeftHip}, int{mocap::kRightHip}}) {
    const Vector3d hip_W = pose.point(mocap::kRoot, body.offset_m[joint_index(hip)]);
    const LimbPosture leg =
        reach({body.offset_m[joint_index(hip + 1)], body.offset_m[joint_index(hip + 2)]},
              pose.R_WJ[joint_index(hip)], pose.R_WJ[joint_index(hip + 1)], hip_W,
              pose.p_WJ[joint_index(hip + 2)]);
    pose.R_WJ[joint_index(hip)] = leg.R_upper;
    pose.R_WJ[joint_index(hip + 1)] = leg.R_lower;
  }
}

}  // namespace

Posture RobotClip::posture(Index frame) const {
  Posture p;
  p.X_WB.linear() = math::exp_so3(pelvis_rotation_rad.col(frame));
  p.X_WB.translation() = pelvis_position_W_m.col(frame);
  p.q = q.col(frame);
  return p;
}

std::vector<Posture> follow(const robot::RobotTree& tree, const Posture& start,
                            const std::vector<FrameGoals>& goals, RobotReport& report,
                            int smoothing_sweeps) {
  robot::Kinematics kinematics(tree);
  std::vector<Posture> postures;
  std::vector<std::vector<Goal>> exact;
  Posture now = start;
  now.q = now.q.cwiseMax(tree.lower()).cwiseMin(tree.upper());
  const VectorXd easy = now.q;
  int iterations = kFirstSearch;
  for (const FrameGoals& frame : goals) {
    IkResult found = solve(kinematics, now, frame.exact, frame.wishes, iterations);
    if (found.exact_error > kMissed) {
      // Limits may hold a posture where an easier one would do: once more from the easy joints
      const Posture fresh{found.posture.X_WB, easy};
      const IkResult other = solve(kinematics, fresh, frame.exact, frame.wishes, iterations);
      if (other.exact_error < 0.5 * found.exact_error) found = other;
    }
    now = found.posture;
    iterations = kSearch;
    postures.push_back(now);
    exact.push_back(frame.exact);
  }
  report.roughness_before = roughness(postures);
  smooth(kinematics, exact, postures, smoothing_sweeps);
  report.roughness_after = roughness(postures);
  report_limits(tree, postures, report);
  return postures;
}

RobotClip retarget(const mocap::BodyClip& recorded, const robot::RobotTree& tree,
                   const RobotFigure& figure, int smoothing_sweeps) {
  const BodyMotion motion = retarget(recorded, robot_body(tree, figure));
  const RobotGoals robot_goals(tree, figure);
  std::vector<FrameGoals> goals;
  Posture start;
  for (Index t = 0; t < motion.clip.frames(); ++t) {
    const mocap::BodyPose pose = motion.clip.pose(t);
    if (t == 0) start = robot_goals.start(pose);
    goals.push_back({robot_goals.exact(pose), robot_goals.wishes(pose)});
  }
  RobotReport report;
  const std::vector<Posture> postures = follow(tree, start, goals, report, smoothing_sweeps);
  RobotClip clip = to_clip(tree, postures, recorded.rate_hz);
  robot::Kinematics kinematics(tree);
  report_deviations(kinematics, postures, goals, report);
  report_speed(tree, postures, recorded.rate_hz, report);
  report.scale = motion.scale;
  report.stance_speed_m_s = stance_speed(motion.clip, motion.contacts);
  clip.report = report;
  return clip;
}

FigureClip figure_clip(const RobotClip& motion, const mocap::BodyClip& recorded,
                       const robot::RobotTree& tree, const RobotFigure& figure) {
  FigureClip out;
  mocap::BodyClip& clip = out.clip;
  clip.body = robot_body(tree, figure);
  clip.name = recorded.name;
  clip.rate_hz = motion.rate_hz;
  clip.first_frame = recorded.first_frame;
  clip.root_position_W_m = motion.pelvis_position_W_m;
  clip.angles_rad.resize(mocap::kBodyRows, motion.frames());
  robot::Kinematics kinematics(tree);
  Sum ankles, wrists;
  for (Index t = 0; t < motion.frames(); ++t) {
    const Posture posture = motion.posture(t);
    kinematics.update(posture.X_WB, posture.q);
    const mocap::BodyPose robot = body_pose(kinematics, figure);
    mocap::BodyPose pose = robot;
    bend_legs(clip.body, pose);
    put_angles(pose, t, clip.angles_rad);
    const mocap::BodyPose made = clip.pose(t);
    const auto apart = [&](int joint) {
      return (made.p_WJ[joint_index(joint)] - robot.p_WJ[joint_index(joint)]).norm();
    };
    for (const int joint : {int{mocap::kLeftAnkle}, int{mocap::kRightAnkle}})
      ankles.add(apart(joint));
    for (const int joint : {int{mocap::kLeftWrist}, int{mocap::kRightWrist}})
      wrists.add(apart(joint));
  }
  out.ankle_m = ankles.result();
  out.wrist_m = wrists.result();
  return out;
}

}  // namespace mimesis::retarget
