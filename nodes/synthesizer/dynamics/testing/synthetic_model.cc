#include "nodes/synthesizer/dynamics/testing/synthetic_model.h"

#include <cmath>
#include <numbers>
#include <random>

#include "common/math/circle.h"
#include "common/math/so3.h"
#include "common/motion/demix/sisa.h"

namespace mimesis::synthesizer::testing {
namespace {

constexpr int kSamples = 100;

motion::MotionModel body_model(const char* name) {
  motion::MotionModel model;
  model.name = name;
  model.created_by = "synthetic";
  model.body = mocap::standard_body();
  for (int r = 0; r < mocap::kBodyRows; ++r) model.rows.push_back(mocap::body_row_name(r));
  return model;
}

/// Position and height of a flat foot at a phase since its landing, in the frame of a pelvis that
/// moves at constant speed; where it rests it moves back.
struct FootPath {
  double x, y, z, yaw;
};
FootPath foot_path(double phase, double side, const WalkSettings& w) {
  constexpr double kStance = 0.6 * 2.0 * std::numbers::pi,
                   kSwing = 2.0 * std::numbers::pi - kStance;
  const double slide = side * w.slide_m;
  const double stance_s = 0.6 * w.duration_s;
  const double half = 0.5 * (w.speed_m_s * stance_s - slide);
  const double half_turn = 0.5 * w.turn_rad_s * stance_s;
  double along, z = 0.0;
  if (phase < kStance) {
    along = 1.0 - 2.0 * phase / kStance;
  } else {  // quintic return that leaves and arrives with the speed of the ground
    const double u = (phase - kStance) / kSwing, v = -2.0 * kSwing / kStance;  // per u
    along = -1.0 + 2.0 * u * u * u * (10.0 + u * (-15.0 + 6.0 * u)) +
            v * u * (1.0 - u) * (1.0 - 2.0 * u);
    z = 0.1 * 64.0 * std::pow(u * (1.0 - u), 3.0);
  }
  // the pelvis moves on a circle of radius speed/turn: a resting point turns about its centre
  const double a = half_turn * along;
  if (std::abs(w.turn_rad_s) < 1e-9) return {half * along, 0.085 * side, z, 0.0};
  const double radius = w.speed_m_s / w.turn_rad_s;
  const double from_centre = radius - 0.085 * side;
  return {from_centre * std::sin(a), radius - from_centre * std::cos(a), z, a};
}

void set_row(Eigen::MatrixXd& x, int joint, Eigen::Index t, const Eigen::Vector3d& w) {
  x.block<3, 1>(3 * joint, t) = w;
}

/// Hip, knee and ankle angles that put the ankle there, the foot flat with this yaw.
void bend_leg(const mocap::Body& body, int hip, const FootPath& foot, double pelvis_z,
              Eigen::Index t, Eigen::MatrixXd& x) {
  const auto h = static_cast<std::size_t>(hip);
  const double sole = -body.heel_m[0].z();
  const Eigen::Vector3d ankle(foot.x, foot.y, foot.z + sole - pelvis_z);
  const Eigen::Vector3d to = ankle - body.offset_m[h];
  const double l1 = body.offset_m[h + 1].norm(), l2 = body.offset_m[h + 2].norm(), d = to.norm();
  const double knee = std::numbers::pi - std::acos((l1 * l1 + l2 * l2 - d * d) / (2.0 * l1 * l2));
  const double at_hip = std::acos((l1 * l1 + d * d - l2 * l2) / (2.0 * l1 * d));
  // thigh's −z towards `to`, then forward by the angle at the hip; flexion is about −y
  const Eigen::Matrix3d R_aim = math::rotation_onto(-Eigen::Vector3d::UnitZ(), to);
  const Eigen::Matrix3d R_hip = R_aim * math::exp_so3({0.0, -at_hip, 0.0});
  const Eigen::Matrix3d R_knee = math::exp_so3({0.0, knee, 0.0});
  const Eigen::Matrix3d R_foot = math::exp_so3({0.0, 0.0, foot.yaw});
  set_row(x, hip, t, math::log_so3(R_hip));
  set_row(x, hip + 1, t, {0.0, knee, 0.0});
  set_row(x, hip + 2, t, math::log_so3((R_hip * R_knee).transpose() * R_foot));
}

}  // namespace

motion::MotionModel random_model(std::uint64_t seed, int sources, int patterns, int fixed) {
  std::mt19937_64 engine(seed);
  auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(engine() >> 11) * 0x1p-53;
  };
  motion::MotionModel model = body_model("random");
  model.tied = true;
  model.fixed = fixed;
  model.sources.setZero(sources, kSamples);
  for (int k = 0; k < sources; ++k) {
    for (int h = 1; h <= 5; ++h) {
      const double size = uniform(0.3, 1.0) / (h * h),
                   shift = uniform(-std::numbers::pi, std::numbers::pi);
      for (int t = 0; t < kSamples; ++t) {
        model.sources(k, t) += size * std::cos(math::kTwoPi * h * t / kSamples + shift);
      }
    }
    if (k < fixed) {
      model.sources.row(k) = demix::non_periodic(fixed, kSamples).row(k);
    }
    model.sources.row(k) /= std::sqrt(model.sources.row(k).squaredNorm() / kSamples);
  }
  Eigen::MatrixXd delay(mocap::kBodyRows, sources);
  for (double& phi : delay.reshaped()) phi = uniform(-std::numbers::pi, std::numbers::pi);
  delay.leftCols(fixed).setZero();
  for (int p = 0; p < patterns; ++p) {
    motion::Pattern q;
    q.trial.style = "random " + std::to_string(p);
    q.trial.duration_s = 1.0 + 0.1 * p;
    q.mean_rad.resize(mocap::kBodyRows);
    q.weight_rad.resize(mocap::kBodyRows, sources);
    for (double& m : q.mean_rad) m = uniform(-0.3, 0.3);
    for (double& w : q.weight_rad.reshaped()) w = uniform(-0.15, 0.15);
    q.delay_rad = delay;
    model.patterns.push_back(q);
  }
  return model;
}

motion::MotionModel walking_model(const WalkSettings& w) {
  motion::MotionModel model = body_model("walker");
  const double pelvis_z = 0.87;  // flat feet need bent knees
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(mocap::kBodyRows, kSamples);
  for (Eigen::Index t = 0; t < kSamples; ++t) {
    const double phase = math::kTwoPi * static_cast<double>(t) / kSamples;
    const double other = math::wrap_two_pi(phase + std::numbers::pi);
    bend_leg(model.body, mocap::kLeftHip, foot_path(phase, 1.0, w), pelvis_z, t, x);
    bend_leg(model.body, mocap::kRightHip, foot_path(other, -1.0, w), pelvis_z, t, x);
    set_row(x, mocap::kLeftShoulder, t, {-1.3, 0.3 * std::cos(phase), 0.0});
    set_row(x, mocap::kRightShoulder, t, {1.3, -0.3 * std::cos(phase), 0.0});
  }
  motion::Pattern p;
  p.trial.style = "walk";
  p.trial.duration_s = w.duration_s;
  p.trial.step_length_m = 0.5 * w.speed_m_s * w.duration_s;
  p.trial.turn_rad = w.turn_rad_s * w.duration_s;
  p.mean_rad = x.rowwise().mean();
  p.weight_rad.resize(mocap::kBodyRows, w.harmonics);
  p.delay_rad.resize(mocap::kBodyRows, w.harmonics);
  model.sources.resize(w.harmonics, kSamples);
  for (int h = 1; h <= w.harmonics; ++h) {
    Eigen::VectorXd c(kSamples), s(kSamples);
    for (int t = 0; t < kSamples; ++t) {
      c[t] = std::cos(math::kTwoPi * h * t / kSamples);
      s[t] = std::sin(math::kTwoPi * h * t / kSamples);
    }
    model.sources.row(h - 1) = std::sqrt(2.0) * c.transpose();
    const Eigen::VectorXd a = x * c * (2.0 / kSamples), b = x * s * (2.0 / kSamples);
    for (Eigen::Index r = 0; r < x.rows(); ++r) {  // a cos hφ + b sin hφ = A cos(h(φ − δ))
      p.weight_rad(r, h - 1) = std::hypot(a[r], b[r]) / std::sqrt(2.0);
      p.delay_rad(r, h - 1) = std::atan2(b[r], a[r]) / h;
    }
  }
  model.patterns.push_back(p);
  return model;
}

}  // namespace mimesis::synthesizer::testing
