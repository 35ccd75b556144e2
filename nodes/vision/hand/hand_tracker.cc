#include "nodes/vision/hand/hand_tracker.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/math/so3.h"

namespace mimesis::vision {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

// Coordinates of the search: translation, rotation, joints, wrist, forearm; palm, breadth and
// length of HandShape.
constexpr std::size_t kAtJoints = 6, kAtWrist = kAtJoints + kHandJoints, kAtArm = kAtWrist + 2,
                      kAtShape = kAtArm + 3;
constexpr int kMono = static_cast<int>(kAtShape) + 2, kStereo = kMono + 1;

/// Steps that matter about equally: the motion of a quick hand between two pictures.
struct Steps {
  std::array<double, kAtShape> size{};
  Steps() {
    size[0] = size[1] = 0.005;
    size[2] = 0.008;
    for (std::size_t i = 3; i < 6; ++i) size[i] = radians(5);
    for (std::size_t j = 0; j < kHandJoints; ++j) {
      const bool spread = j >= 4 && j % 4 == 0;
      size[kAtJoints + j] = spread ? radians(3) : j % 4 == 3 ? radians(6) : radians(8);
    }
    size[kAtWrist] = size[kAtWrist + 1] = radians(5);
    size[kAtArm] = size[kAtArm + 1] = 0.03;
    size[kAtArm + 2] = 0.1;
  }
};
const Steps kSteps;

constexpr double kLostBelow = 0.6;                      // share of the usual score
constexpr double kJump = 0.1;                           // gain of cost that makes a digit jump
constexpr double kFineSigma = 0.5, kCoarseSigma = 2.0;  // of the first generation, in steps
constexpr double kForget = 0.05;  // share of the covariance that is forgotten between pictures
constexpr double kGuess_m = 0.03, kGuess_rad = 0.38;  // standard deviation of a guess
// Standard deviations of people's shapes about the published one: quotations of the palm differ by
// a fifth, and lengths are measured with a ruler. One camera is led astray by a palm that is freer.
constexpr std::array<double, 3> kShapeSdMono{0.06, 0.06, 0.03}, kShapeSdStereo{0.15, 0.08, 0.03};
// What one picture says of a shape, and what is never believed to be known better: later pictures
// resemble each other.
constexpr double kShapeOfPicture = 0.06, kLeastShapeSd = 0.005;
// A shape is learned of a hand that is followed well, in small steps: one that fits a wrong pose
// would keep that pose.
constexpr double kWell = 0.85, kMostShapeStep = 0.03;
constexpr int kSettled = 5;  // pictures in a row that are followed well
constexpr int kPolish = 4;   // searches of the first picture, each with what the last one taught
constexpr int kCoarse = 16;  // population of the coarse search
constexpr double kShortestArm = -3.0;  // logarithm, over the length of the hand
constexpr int kPatience = 2;           // pictures without the hand before it is sought elsewhere

/// Postures that a digit may have jumped to, since the search does not find the way there when the
/// digit hides behind others: as shares of each joint's range.
constexpr std::array<std::array<double, 4>, 5> kFingerPostures{{{0.5, 0.1, 0.08, 0.08},
                                                                {0.5, 0.75, 0.2, 0.2},
                                                                {0.5, 0.3, 0.7, 0.55},
                                                                {0.5, 0.75, 0.75, 0.6},
                                                                {0.5, 0.45, 0.4, 0.3}}};
constexpr std::array<std::array<double, 4>, 5> kThumbPostures{{{0.15, 0.2, 0.25, 0.2},
                                                               {0.7, 0.3, 0.3, 0.3},
                                                               {0.4, 0.75, 0.5, 0.4},
                                                               {0.75, 0.7, 0.7, 0.6},
                                                               {0.3, 0.5, 0.3, 0.3}}};

double square(double x) { return x * x; }

}  // namespace

HandTracker::HandTracker(const HandTrackerSetup& setup, std::span<const image::Camera> cameras)
    : setup_(setup),
      model_(setup.length_m),
      eye_T_(cameras.empty() ? Vector3d::Zero() : cameras[0].eye()),
      R_TC_(cameras.empty() ? Matrix3d::Identity() : Matrix3d(cameras[0].R_CT().transpose())),
      dimensions_(cameras.size() == 2 ? kStereo : kMono),
      people_sd_(cameras.size() == 2 ? kShapeSdStereo : kShapeSdMono),
      fine_(dimensions_, setup.population, setup.seed),
      coarse_(dimensions_, kCoarse, setup.seed + 1),
      random_(setup.seed + 2) {
  if (cameras.empty() || cameras.size() > 2) {
    throw ConfigError("hand tracker: expected one or two cameras");
  }
  for (const image::Camera& c : cameras) {
    if (c.width() != cameras[0].width() || c.height() != cameras[0].height()) {
      throw ConfigError("hand tracker: pictures of both cameras must have the same size");
    }
    SkinDensity density(c.width(), c.height());
    const int w = density.raster_width(), h = density.raster_height();
    Eye eye(std::move(density), w, h);
    const image::Lens& lens = c.lens();
    const double shrink = 1.0 / eye.density.factor();
    eye.camera.R = (c.R_CT() * R_TC_).cast<float>();
    eye.camera.t = (c.R_CT() * (eye_T_ - c.eye())).cast<float>();
    eye.camera.focal = static_cast<float>(0.5 * (lens.fx_px + lens.fy_px) * shrink);
    eye.camera.cu = static_cast<float>((lens.cx_px + 0.5) * shrink - 0.5);
    eye.camera.cv = static_cast<float>((lens.cy_px + 0.5) * shrink - 0.5);
    eye.camera.k1 = static_cast<float>(lens.distortion[0]);
    eye.camera.k2 = static_cast<float>(lens.distortion[1]);
    eye.evidence.resize(w, h);
    for (auto* n : {&eye.nx, &eye.ny, &eye.nz}) n->resize(eye.evidence.luma.size());
    eyes_.push_back(std::move(eye));
  }
  costs_.resize(static_cast<std::size_t>(std::max(setup.population, kCoarse)));
  zero_.resize(static_cast<std::size_t>(dimensions_));
  best_.resize(zero_.size());
}

HandPose HandTracker::from_T(const Vector3d& p_TH, const Matrix3d& R_TH, bool left) const {
  HandPose pose;
  pose.left = left;
  pose.p_CH = R_TC_.transpose() * (p_TH - eye_T_);
  pose.R_CH = R_TC_.transpose() * R_TH;
  for (std::size_t j = 0; j < kHandJoints; ++j) pose.joint_rad[j] = hand_joint_ranges()[j].rest;
  return pose;
}

void HandTracker::start(std::span<const HandPose> guesses) {
  MIMESIS_ASSERT(!guesses.empty() && guesses[0].p_CH.z() > 0.05);
  guesses_.assign(guesses.begin(), guesses.end());
  estimate_.pose = last_ = guesses[0];
  begun_ = moving_ = false;
  lost_ = 0;
  usual_score_ = 0.0;
  depth_m_ = guesses[0].p_CH.z();
  settled_ = shaped_ = 0;
  shape_step_.fill(0.0);
  for (Eye& eye : eyes_) {
    eye.shading = {};
    eye.normals.setZero();
    eye.with_luma.setZero();
    eye.luma2 = 0.0;
  }
}

HandPose HandTracker::moved(const HandPose& from, std::span<const double> x) const {
  const auto& s = kSteps.size;
  HandPose to = from;
  // along the line of sight and across it: the depth is what one camera knows least
  to.p_CH += Vector3d(s[0] * x[0], s[1] * x[1], 0.0) + s[2] * x[2] * from.p_CH.normalized();
  to.R_CH = from.R_CH * math::exp_so3(Vector3d(s[3] * x[3], s[4] * x[4], s[5] * x[5]));
  for (std::size_t j = 0; j < kHandJoints; ++j) {
    const JointRange& range = hand_joint_ranges()[j];
    to.joint_rad[j] = std::clamp(from.joint_rad[j] + s[kAtJoints + j] * x[kAtJoints + j],
                                 range.least, range.most);
  }
  for (std::size_t j = 0; j < 2; ++j) {
    to.wrist_rad[j] = std::clamp(from.wrist_rad[j] + s[kAtWrist + j] * x[kAtWrist + j],
                                 -radians(70), radians(70));
  }
  for (std::size_t j = 0; j < 3; ++j) to.arm[j] += s[kAtArm + j] * x[kAtArm + j];
  to.arm[2] = std::clamp(to.arm[2], kShortestArm, kLongestArm);
  const auto shaped = [&](std::size_t k, double value, double most) {
    return std::clamp(value + shape_step_[k] * x[kAtShape + k], -most, most);
  };
  to.shape.palm = shaped(0, from.shape.palm, kMostShape.palm);
  to.shape.breadth = shaped(1, from.shape.breadth, kMostShape.breadth);
  if (dimensions_ == kStereo) to.shape.length = shaped(2, from.shape.length, kMostShape.length);
  return to;
}

double HandTracker::cost(const HandPose& from, std::span<const double> x) {
  const HandPose pose = moved(from, x);
  model_.capsules(pose, capsules_);
  double evidence = 0.0;
  for (Eye& eye : eyes_) {
    const Match m = eye.raster.match(capsules_, eye.camera, eye.evidence, eye.shading);
    evidence += m.ratio + setup_.shading_weight * m.shading + setup_.forearm_weight * m.forearm;
  }
  double motion = 0.0, beyond = 0.0, habit = 0.0;
  if (seeking_) {  // how far off the guess is; nothing is known of the joints
    const double turn2 = 3.0 - (anchor_.R_CH.transpose() * pose.R_CH).trace();  // angle², about
    motion =
        (pose.p_CH - anchor_.p_CH).squaredNorm() / square(kGuess_m) + turn2 / square(kGuess_rad);
  } else {
    for (const double step : x.first(kAtShape)) motion += setup_.motion_weight * square(step);
  }
  double shape = 0.0;
  for (const double step : x.subspan(kAtShape)) shape += square(step);
  const HandShape& person = pose.shape;
  shape += setup_.shape_weight *
           (square(person.palm / people_sd_[0]) + square(person.breadth / people_sd_[1]) +
            square(person.length / people_sd_[2]));
  for (std::size_t j = 0; j < kHandJoints; ++j) {
    const double wished = from.joint_rad[j] + kSteps.size[kAtJoints + j] * x[kAtJoints + j];
    beyond += square((wished - pose.joint_rad[j]) / radians(4));
    habit += square((pose.joint_rad[j] - hand_joint_ranges()[j].rest) / radians(40));
  }
  for (std::size_t i = 1; i < 5; ++i) {
    const double* q = pose.joint_rad.data() + 4 * i;
    habit +=
        square((q[3] - 2.0 / 3.0 * q[2]) / radians(12));  // the end joint follows the middle one
    habit += square(q[0] / radians(8));
    if (i > 1) habit += square((q[1] - q[-3]) / radians(40)) + square((q[2] - q[-2]) / radians(40));
  }
  if (setup_.depth_sd_m > 0.0) {  // beyond, steeply: a hand that swallows the forearm looks near
    const double off = square((pose.p_CH.z() - depth_m_) / setup_.depth_sd_m);
    habit += off + 0.2 * square(off);
  }
  habit += square(pose.wrist_rad[0] / radians(40)) + square(pose.wrist_rad[1] / radians(25));
  habit += square(pose.arm[0] / 0.1) + square(pose.arm[1] / 0.15);
  return -setup_.evidence_weight * evidence +
         0.5 * (motion + beyond + shape + setup_.habit_weight * habit);
}

void HandTracker::try_postures(HandPose& pose) {
  double least = cost(pose, zero_);
  for (const double bare : {-2.2, -1.5, -1.0, -0.5, kLongestArm}) {
    HandPose other = pose;
    other.arm[2] = bare;
    const double value = cost(other, zero_);
    if (value >= least - kJump) continue;
    least = value;
    pose = other;
  }
  for (std::size_t digit = 0; digit < 5; ++digit) {
    for (const auto& posture : digit == 0 ? kThumbPostures : kFingerPostures) {
      HandPose other = pose;
      for (std::size_t k = 0; k < 4; ++k) {
        const JointRange& range = hand_joint_ranges()[4 * digit + k];
        other.joint_rad[4 * digit + k] = range.least + posture[k] * (range.most - range.least);
      }
      const double value = cost(other, zero_);
      if (value >= least - kJump) continue;
      least = value;
      pose = other;
    }
  }
}

double HandTracker::search(HandPose& around, CmaEs& cma, int generations, double sigma,
                           bool resume) {
  if (resume) {
    cma.resume(zero_, sigma, kForget);
  } else {
    cma.start(zero_, sigma);
  }
  double best = cost(around, zero_);
  std::copy(zero_.begin(), zero_.end(), best_.begin());
  const auto consider = [&](std::span<const double> x, double value) {
    if (value >= best) return;
    best = value;
    std::copy(x.begin(), x.end(), best_.begin());
  };
  for (int g = 0; g < generations; ++g) {
    cma.ask();
    for (int k = 0; k < cma.population(); ++k) {
      const double value = cost(around, cma.candidate(k));
      costs_[static_cast<std::size_t>(k)] = value;
      consider(cma.candidate(k), value);
    }
    cma.tell(std::span(costs_).first(static_cast<std::size_t>(cma.population())));
  }
  consider(cma.mean(), cost(around, cma.mean()));
  around = moved(around, best_);
  return best;
}

double HandTracker::mean_ratio(const HandPose& pose) {
  model_.capsules(pose, capsules_);
  double sum = 0.0, area = 0.0;
  for (Eye& eye : eyes_) {
    const Match m = eye.raster.match(capsules_, eye.camera, eye.evidence, eye.shading);
    sum += m.ratio;
    area += m.area;
  }
  return area > 0.0 ? sum / area : -1.0;
}

HandPose HandTracker::perturbed(const HandPose& from, double distance_m, double angle_rad) {
  const auto uniform = [this](double most) {
    return most * (2.0 * static_cast<double>(random_() >> 11) * 0x1.0p-53 - 1.0);
  };
  HandPose pose = from;
  pose.p_CH += Vector3d(uniform(distance_m), uniform(distance_m), uniform(distance_m));
  const Vector3d turn(uniform(angle_rad), uniform(angle_rad), uniform(angle_rad));
  pose.R_CH = pose.R_CH * math::exp_so3(turn);
  return pose;
}

void HandTracker::close_fingers(HandPose& pose, double share) const {
  for (std::size_t j = 4; j < kHandJoints; ++j) {
    const JointRange& range = hand_joint_ranges()[j];
    if (j % 4 != 0) pose.joint_rad[j] = std::max(0.0, range.least) + 0.9 * share * range.most;
  }
}

/// Seeks the hand around the last pose: several short searches, the best of which are refined. At
/// the start more of them, and from an open hand, a half closed one and a fist.
void HandTracker::relocate() {
  constexpr std::size_t kMostRefined = 8;
  const bool several = guesses_.size() > 1;  // near the hand, but for the roll
  const int tries = begun_ ? 6 : several ? 12 : 48, generations = begun_ ? 14 : 40;
  const std::size_t refined = begun_ ? 1 : several ? 4 : kMostRefined;
  const double distance = std::min(0.03 + 0.002 * lost_, 0.08);
  const double angle = radians(std::min(20.0 + lost_, 40.0));
  std::array<HandPose, kMostRefined> best, near;
  std::array<double, kMostRefined> least;
  least.fill(INFINITY);
  seeking_ = true;
  if (begun_) guesses_.assign(1, estimate_.pose);
  for (int k = 0; k < tries; ++k) {
    const auto given = static_cast<std::size_t>(k) % guesses_.size();
    anchor_ = guesses_[given];
    HandPose around = anchor_;
    HandPose pose =
        static_cast<std::size_t>(k) == given ? anchor_ : perturbed(anchor_, distance, angle);
    if (!begun_) close_fingers(pose, 0.15 + 0.35 * (k % 3));
    try_postures(pose);
    double found = search(pose, coarse_, generations, kCoarseSigma, false);
    for (std::size_t i = 0; i < refined; ++i) {  // sorted, best first
      if (found >= least[i]) continue;
      std::swap(found, least[i]);
      std::swap(pose, best[i]);
      std::swap(around, near[i]);
    }
  }
  double lowest = INFINITY;
  HandPose nearest;
  for (std::size_t i = 0; i < refined; ++i) {
    anchor_ = near[i];
    try_postures(best[i]);
    search(best[i], fine_, begun_ || several ? setup_.generations : 2 * setup_.generations, 1.0,
           false);
    const double found = cost(best[i], zero_);
    if (found >= lowest) continue;
    lowest = found;
    estimate_.pose = best[i];
    nearest = near[i];
  }
  anchor_ = nearest;
  seeking_ = false;
}

void HandTracker::learn_shading(Eye& eye, double rate) {
  // Normals of the fitted hand: the luma expected of a light along each axis.
  Shading axis;
  for (std::size_t k = 0; k < 3; ++k) {
    axis.slope = Eigen::Vector3f::Unit(static_cast<int>(k));
    eye.raster.match(capsules_, eye.camera, eye.evidence, axis);
    auto& to = k == 0 ? eye.nx : k == 1 ? eye.ny : eye.nz;
    std::copy(eye.raster.expected().begin(), eye.raster.expected().end(), to.begin());
  }
  const double keep = 1.0 - rate;
  eye.normals *= keep;
  eye.with_luma *= keep;
  eye.luma2 *= keep;
  const HandRaster::Window& w = eye.raster.window();
  for (int v = w.v0; v < w.v1; ++v) {
    for (int u = w.u0; u < w.u1; ++u) {
      const auto i = static_cast<std::size_t>(v * eye.evidence.stride + u);
      if (eye.raster.covered()[i] < 0.95f || eye.evidence.ratio[i] < 0.0f) continue;
      const double y = static_cast<double>(eye.evidence.luma[i]);
      const Vector4d n(1.0, static_cast<double>(eye.nx[i]), static_cast<double>(eye.ny[i]),
                       static_cast<double>(eye.nz[i]));
      eye.normals.noalias() += n * n.transpose();
      eye.with_luma += y * n;
      eye.luma2 += y * y;
    }
  }
  const double count = eye.normals(0, 0);
  if (count < 50.0) return;
  Matrix4d regular = eye.normals;
  for (int k = 1; k < 4; ++k) regular(k, k) += 0.02 * count;
  const Vector4d law = regular.llt().solve(eye.with_luma);
  const double mean = eye.with_luma[0] / count;
  const double total = eye.luma2 / count - square(mean);
  const double rest =
      (eye.luma2 - 2.0 * law.dot(eye.with_luma) + law.dot(eye.normals * law)) / count;
  constexpr double kLeast = 16.0;  // variance of noise and texture at least
  eye.shading.bias = static_cast<float>(law[0]);
  eye.shading.slope = law.tail<3>().cast<float>();
  eye.shading.mean = static_cast<float>(mean);
  eye.shading.weight = static_cast<float>(0.5 / std::max(rest, kLeast));
  eye.shading.weight_mean = static_cast<float>(0.5 / std::max(total, kLeast));
}

/// What each cell says of the hand. Hidden ones speak neither for it nor against it, and nothing is
/// learned from them.
void HandTracker::judge() {
  for (Eye& eye : eyes_) {
    eye.density.judge(eye.evidence);
    const auto width = static_cast<std::size_t>(eye.evidence.width);
    for (std::size_t i = 0; i < eye.hidden.size(); ++i) {
      if (eye.hidden[i] == 0) continue;
      const std::size_t at = i / width * static_cast<std::size_t>(eye.evidence.stride) + i % width;
      eye.evidence.ratio[at] = -1e-3f;
      eye.evidence.luma[at] = eye.shading.mean;
    }
  }
}

/// How far the shape may change with the next picture.
void HandTracker::allow_shape() {
  settled_ = estimate_.found && estimate_.likeness > kWell ? settled_ + 1 : 0;
  if (settled_ < kSettled) return shape_step_.fill(0.0);
  ++shaped_;
  for (std::size_t k = 0; k < 3; ++k) {
    const double pictures = shaped_ / square(kShapeOfPicture);
    const double sd = 1.0 / std::sqrt(1.0 / square(people_sd_[k]) + pictures);
    shape_step_[k] = std::clamp(sd, kLeastShapeSd, kMostShapeStep);
  }
}

void HandTracker::learn(double rate) {
  model_.capsules(estimate_.pose, capsules_);
  for (Eye& eye : eyes_) {
    eye.raster.match(capsules_, eye.camera, eye.evidence, eye.shading);
    eye.density.learn(eye.raster, rate);
    learn_shading(eye, rate);
  }
}

void HandTracker::see(std::size_t camera, const image::Image& image,
                      std::span<const std::uint8_t> hidden) {
  Eye& eye = eyes_.at(camera);
  eye.density.read(image, eye.evidence);
  eye.hidden.assign(hidden.begin(), hidden.end());
}

const HandEstimate& HandTracker::step(std::span<const image::Image* const> images) {
  MIMESIS_ASSERT(images.size() == eyes_.size());
  for (std::size_t k = 0; k < eyes_.size(); ++k) see(k, *images[k]);
  return step();
}

const HandEstimate& HandTracker::step() {
  if (!begun_) {
    for (Eye& eye : eyes_) {
      const Eigen::Vector3f p = eye.camera.R * estimate_.pose.p_CH.cast<float>() + eye.camera.t;
      const float scale = eye.camera.scale(p);
      eye.density.begin(eye.camera.cu + scale * p.x(), eye.camera.cv + scale * p.y(),
                        0.7f * static_cast<float>(length_m()) * scale);
    }
  }
  judge();
  if (!begun_) {
    relocate();
    learn(1.0);
    for (int k = 0; k < kPolish; ++k) {
      judge();
      seeking_ = true;
      search(estimate_.pose, fine_, 2 * setup_.generations, 1.0, false);
      seeking_ = false;
      learn(1.0);
    }
    usual_score_ = estimate_.score = mean_ratio(estimate_.pose);
    last_ = estimate_.pose;
    begun_ = true;
    estimate_.found = true;
    return estimate_;
  }

  HandPose pose = estimate_.pose;
  if (moving_ && lost_ == 0) {
    pose.p_CH += setup_.momentum * (pose.p_CH - last_.p_CH);
    pose.R_CH =
        pose.R_CH * math::exp_so3(setup_.momentum *
                                  math::log_so3(Matrix3d(last_.R_CH.transpose() * pose.R_CH)));
  }
  const HandPose before = estimate_.pose;
  if (lost_ <= kPatience) {
    try_postures(pose);
    search(pose, fine_, setup_.generations, kFineSigma, true);
  } else {
    relocate();
    pose = estimate_.pose;
  }
  estimate_.score = mean_ratio(pose);
  estimate_.likeness = estimate_.score / std::max(usual_score_, 0.1);
  estimate_.found = estimate_.likeness > kLostBelow;
  allow_shape();
  if (!estimate_.found) {
    estimate_.pose = before;
    moving_ = false;
    ++lost_;
    return estimate_;
  }
  estimate_.pose = pose;
  last_ = before;
  moving_ = lost_ == 0;
  lost_ = 0;
  usual_score_ += setup_.learning_rate * (estimate_.score - usual_score_);
  learn(setup_.learning_rate);
  return estimate_;
}

}  // namespace mimesis::vision
