#include "experiments/sight/hand_runs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/math/so3.h"
#include "nodes/vision/hand/hand_tracker.h"

namespace mimesis::sight {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using truth::HandTruth;
using truth::HandWorld;
using vision::HandPose;
using vision::HandTracker;

constexpr double kLostAway_m = 0.04, kRightAway_m = 0.025;
constexpr double kLostTurn_rad = std::numbers::pi / 3.0, kRightTurn_rad = 0.611;

/// Cameras as the tracker knows them, and the first guess.
struct Stage {
  HandWorld world;
  std::vector<image::Camera> cameras;
  Vector3d p_TH;
  Matrix3d R_TH;

  explicit Stage(const HandTrial& trial) : world(trial.world) {
    for (int k = 0; k < trial.world.cameras; ++k) cameras.emplace_back(world.view(k));
    std::mt19937_64 random(trial.world.seed * 31 + 7);
    const auto direction = [&random]() -> Vector3d {
      Vector3d d;
      for (int i = 0; i < 3; ++i) d[i] = truth::draw(random, -1.0, 1.0);
      return d.normalized();
    };
    const HandTruth hand = world.truth(0);
    p_TH = hand.palm_T + trial.start_off_m * direction();
    R_TH = hand.R_TH * math::exp_so3(trial.start_turn_rad * direction());
  }

  void measure(const HandTruth& hand, const Vector3d& p, const Matrix3d& R,
               HandCourse& course) const {
    const Vector3d error = cameras[0].R_CT() * (p - hand.palm_T);
    course.across_m.push_back(error.head<2>().norm());
    course.along_m.push_back(std::abs(error.z()));
    course.turn_rad.push_back(math::log_so3(Matrix3d(hand.R_TH.transpose() * R)).norm());
  }
};

vision::HandTrackerSetup setup_for(const HandTrial& trial, const HandWorld& world) {
  vision::HandTrackerSetup setup;
  setup.length_m = world.anatomy().length_m * (1.0 + trial.length_error);
  return setup;
}

}  // namespace

int HandCourse::lost() const {
  int count = 0;
  for (std::size_t k = 0; k < across_m.size(); ++k) {
    count += across_m[k] > kLostAway_m || turn_rad[k] > kLostTurn_rad ? 1 : 0;
  }
  return count;
}

bool HandCourse::right(int frame) const {
  const auto k = static_cast<std::size_t>(frame);
  return across_m.at(k) < kRightAway_m && turn_rad.at(k) < kRightTurn_rad;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return NAN;
  const auto k = std::min(values.size() - 1,
                          static_cast<std::size_t>(share * static_cast<double>(values.size())));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(k), values.end());
  return values[k];
}

HandCourse track_hand(const HandTrial& trial) {
  Stage stage(trial);
  HandTracker tracker(setup_for(trial, stage.world), stage.cameras);
  tracker.start(tracker.from_T(stage.p_TH, stage.R_TH, stage.world.anatomy().left));
  std::vector<image::Image> images(stage.cameras.size());
  std::vector<const image::Image*> seen;
  for (const image::Image& i : images) seen.push_back(&i);
  HandCourse course;
  for (int f = 0; f < trial.frames; ++f) {
    for (std::size_t k = 0; k < images.size(); ++k) {
      stage.world.render(f, static_cast<int>(k), images[k]);
    }
    const vision::HandEstimate& hand = tracker.step(seen);
    const HandTruth truth = stage.world.truth(f);
    stage.measure(truth, tracker.p_TH(), tracker.R_TH(), course);
    course.found.push_back(hand.found);
    const auto tips = tracker.model().tips(hand.pose);
    double off = 0.0;
    for (std::size_t i = 0; i < 5; ++i) {
      const Vector3d tip_C = stage.cameras[0].R_CT() * (truth.tips_T[i] - stage.cameras[0].eye());
      off += (tip_C - tips[i]).norm() / 5.0;
    }
    course.tips_m.push_back(off);
  }
  course.length_ratio = tracker.length_m() / stage.world.anatomy().length_m;
  return course;
}

HandCourse freeze_hand(const HandTrial& trial) {
  const Stage stage(trial);
  HandCourse course;
  for (int f = 0; f < trial.frames; ++f) {
    stage.measure(stage.world.truth(f), stage.p_TH, stage.R_TH, course);
  }
  return course;
}

HandCourse follow_blob(const HandTrial& trial) {
  Stage stage(trial);
  const image::Camera& camera = stage.cameras[0];
  vision::SkinDensity density(camera.width(), camera.height());
  vision::Evidence evidence;
  evidence.resize(density.raster_width(), density.raster_height());
  const double depth = camera.depth(stage.p_TH), cell = density.factor();
  const Eigen::Vector2d start = camera.project(stage.p_TH);
  const double reach = 0.13 * camera.scale(stage.p_TH) / cell;
  image::Image image;
  HandCourse course;
  for (int f = 0; f < trial.frames; ++f) {
    stage.world.render(f, 0, image);
    density.read(image, evidence);
    if (f == 0) {
      density.begin(static_cast<float>(start.x() / cell), static_cast<float>(start.y() / cell),
                    static_cast<float>(reach));
    }
    density.judge(evidence);
    double sum = 0.0, u = 0.0, v = 0.0;
    for (int y = 0; y < evidence.height; ++y) {
      for (int x = 0; x < evidence.width; ++x) {
        if (evidence.ratio[static_cast<std::size_t>(y * evidence.stride + x)] < 1.0f) continue;
        sum += 1.0;
        u += x;
        v += y;
      }
    }
    const Vector3d p =
        sum > 0.0 ? Vector3d(camera.eye() + depth * camera.ray((u / sum + 0.5) * cell - 0.5,
                                                               (v / sum + 0.5) * cell - 0.5))
                  : stage.p_TH;
    stage.measure(stage.world.truth(f), p, stage.R_TH, course);
  }
  return course;
}

HandCourse track_by_free_histogram(const HandTrial& trial) {
  constexpr int kDimensions = 26, kGenerations = 60, kBins = 24, kMargin = 8;
  Stage stage(trial);
  const image::Camera& camera = stage.cameras[0];
  const int cell = 4, width = camera.width() / cell, height = camera.height() / cell;
  vision::HandModel model(stage.world.anatomy().length_m);
  vision::HandRaster raster(width, height);
  vision::Evidence none;
  none.resize(width, height);
  vision::RasterCamera eye;
  eye.focal =
      static_cast<float>(camera.scale(camera.eye() + camera.R_CT().row(2).transpose()) / cell);
  eye.cu = 0.5f * static_cast<float>(width - 1);
  eye.cv = 0.5f * static_cast<float>(height - 1);
  vision::CmaEs cma(kDimensions, 24, 1);
  std::vector<double> zero(kDimensions), cost(24);
  std::vector<std::uint16_t> bins(static_cast<std::size_t>(width) *
                                  static_cast<std::size_t>(height));

  // From the truth, so that only the score is at fault.
  const HandTruth first = stage.world.truth(0);
  HandPose pose;
  pose.left = stage.world.anatomy().left;
  pose.p_CH = camera.R_CT() * (first.palm_T - camera.eye());
  pose.R_CH = camera.R_CT() * first.R_TH;
  for (std::size_t j = 0; j < vision::kHandJoints; ++j) {
    pose.joint_rad[j] = j < 4 ? first.gesture.thumb[j] : first.gesture.fingers[j / 4 - 1][j % 4];
  }
  const auto moved = [&pose](std::span<const double> x) {
    HandPose to = pose;
    to.p_CH += Vector3d(0.005 * x[0], 0.005 * x[1], 0.008 * x[2]);
    to.R_CH = pose.R_CH * math::exp_so3(0.09 * Vector3d(x[3], x[4], x[5]));
    for (std::size_t j = 0; j < vision::kHandJoints; ++j) {
      const vision::JointRange& range = vision::hand_joint_ranges()[j];
      to.joint_rad[j] = std::clamp(pose.joint_rad[j] + 0.12 * x[6 + j], range.least, range.most);
    }
    return to;
  };
  vision::HandCapsules capsules;
  const auto information = [&](const HandPose& candidate, const vision::HandRaster::Window& w) {
    model.capsules(candidate, capsules);
    raster.match(capsules, eye, none, {});
    std::array<std::array<double, kBins * kBins>, 2> joint{};
    std::array<double, 2> label{};
    double all = 0.0;
    for (int v = w.v0; v < w.v1; ++v) {
      for (int u = w.u0; u < w.u1; ++u) {
        const double on =
            static_cast<double>(raster.covered()[static_cast<std::size_t>(v * none.stride + u)]);
        const std::uint16_t b = bins[static_cast<std::size_t>(v * width + u)];
        joint[1][b] += on;
        joint[0][b] += 1.0 - on;
        label[1] += on;
        label[0] += 1.0 - on;
        all += 1.0;
      }
    }
    double nats = 0.0;
    for (std::size_t b = 0; b < joint[0].size(); ++b) {
      const double color = joint[0][b] + joint[1][b];
      for (std::size_t k = 0; k < 2; ++k) {
        if (joint[k][b] > 0.0)
          nats += joint[k][b] / all * std::log(joint[k][b] * all / (color * label[k]));
      }
    }
    return nats;
  };

  image::Image image;
  HandCourse course;
  for (int f = 0; f < trial.frames; ++f) {
    stage.world.render(f, 0, image);
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        int blue = 0, green = 0, red = 0;
        for (int y = 0; y < cell; ++y) {
          const std::uint8_t* p = image.at(cell * u, cell * v + y);
          for (int x = 0; x < cell; ++x, p += 3) {
            blue += p[0];
            green += p[1];
            red += p[2];
          }
        }
        const int sum = std::max(blue + green + red, 1);
        bins[static_cast<std::size_t>(v * width + u)] =
            static_cast<std::uint16_t>(std::min(kBins - 1, red * kBins / sum) * kBins +
                                       std::min(kBins - 1, blue * kBins / sum));
      }
    }
    model.capsules(pose, capsules);
    raster.match(capsules, eye, none, {});
    vision::HandRaster::Window w = raster.window();
    w = {std::max(w.u0 - kMargin, 0), std::min(w.u1 + kMargin, width), std::max(w.v0 - kMargin, 0),
         std::min(w.v1 + kMargin, height)};
    cma.start(zero, 1.0);
    for (int g = 0; g < kGenerations; ++g) {
      cma.ask();
      for (int k = 0; k < cma.population(); ++k) {
        double prior = 0.0;
        for (const double x : cma.candidate(k)) prior += x * x;
        cost[static_cast<std::size_t>(k)] =
            1e-3 * 0.5 * prior - information(moved(cma.candidate(k)), w);
      }
      cma.tell(cost);
    }
    pose = moved(cma.mean());
    stage.measure(stage.world.truth(f), camera.eye() + camera.R_CT().transpose() * pose.p_CH,
                  camera.R_CT().transpose() * pose.R_CH, course);
  }
  return course;
}

}  // namespace mimesis::sight
