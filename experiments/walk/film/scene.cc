#include "experiments/walk/film/scene.h"

#include <cmath>
#include <stdexcept>

#include "common/image/image_file.h"
#include "common/math/so3.h"

namespace mimesis::walk {
namespace {

constexpr synthesizer::Colour kPrint[] = {{150, 184, 220}, {234, 176, 152}};  // left, right
constexpr synthesizer::Colour kZmp{20, 150, 60};
constexpr double kThick_m = 0.002, kCross_m = 0.17, kBar_m = 0.012;

}  // namespace

void GroundMarks::see(const TrialTick& tick) {
  zmp_W_m_ = tick.truth.zmp_W_m;
  for (const robot::Side s : robot::kSides) {
    const bool stands = tick.out.pattern.contact[s];
    if (stands && !stands_[s]) {
      now_[s] = prints_.size();
      prints_.push_back({.center = Eigen::Vector3d::Zero(),
                         .half_extent = Eigen::Vector3d::Zero(),
                         .colour = kPrint[s]});
    }
    stands_[s] = stands;
    if (!stands) continue;
    const robot::Biped::Leg& leg = biped_.leg[s];
    const Eigen::Isometry3d& X_WS = tick.truth.X_WS[s];
    Eigen::Vector3d middle_S_m = Eigen::Vector3d::Zero();
    middle_S_m.head<2>() = 0.5 * (leg.min_S_m + leg.max_S_m);
    synthesizer::FilmBox& print = prints_[now_[s]];
    print.center = X_WS * middle_S_m;
    print.center.z() = kThick_m;
    print.half_extent << 0.5 * (leg.max_S_m - leg.min_S_m), kThick_m;
    print.yaw_rad = math::yaw_of(X_WS.linear());
  }
}

void GroundMarks::add_to(synthesizer::FilmFrame& frame) const {
  frame.boxes.insert(frame.boxes.end(), prints_.begin(), prints_.end());
  for (const Eigen::Vector2d& half : {Eigen::Vector2d(kCross_m, kBar_m), {kBar_m, kCross_m}}) {
    frame.boxes.push_back({.center = {zmp_W_m_.x(), zmp_W_m_.y(), 2.0 * kThick_m},
                           .half_extent = {half.x(), half.y(), 2.0 * kThick_m},
                           .colour = kZmp});
  }
}

namespace {

constexpr double kShown_s = 0.3;  // a push is over too soon to be seen
// distance from the trunk's centre of mass, beside the arm: arrows end there
constexpr double kBeside_m = 0.33;
constexpr int kHeight_px = 600;

}  // namespace

Scene::Scene(const Robot& robot, const Options& options)
    : figure_(robot.biped, robot.urdf_file),
      trunk_(robot.biped.trunk),
      com_L_m_(robot.biped.tree.link(trunk_).inertia.com_m),
      kinematics_(robot.biped.tree),
      options_(options),
      next_s_(options.from_s),
      marks_(robot.biped) {}

void Scene::see(const TrialTick& tick, const film::FilmDrawer* drawer) {
  marks_.see(tick);
  if (tick.time_s < next_s_ - 1e-9 || tick.time_s > options_.until_s) return;
  next_s_ += options_.picture_s;
  const Eigen::Isometry3d& X_WB = tick.truth.X_WB;
  synthesizer::FilmFrame& frame = frames_.emplace_back();
  figure_.add_to(frame, X_WB, tick.sensors.q);
  marks_.add_to(frame);
  if (drawer != nullptr) film::add_drawer(frame, *drawer);
  kinematics_.update(X_WB, tick.sensors.q);
  for (const hw::sim::Push& push : options_.pushes) {
    if (tick.time_s < push.at_s || tick.time_s > push.at_s + kShown_s) continue;
    const Eigen::Vector3d at = kinematics_.X_WL(trunk_) * com_L_m_;
    film::add_push(frame, at - kBeside_m * push.impulse_W_ns.normalized(), push.impulse_W_ns);
  }
  const Eigen::Vector2d beside = X_WB.translation().head<2>();
  frame.camera = film::camera_beside(options_.fixed_W_m.value_or(beside), 0.0, options_.camera_rad,
                                     options_.height_m);
  frame.camera.height_px = kHeight_px;
  frame.camera.width_px = static_cast<int>(std::lround(options_.aspect * kHeight_px));
  frame.label = synthesizer::film_time(tick.time_s);
}

std::vector<std::filesystem::path> Scene::write(const std::filesystem::path& dir,
                                                const std::string& name, int count) const {
  if (frames_.empty()) throw std::runtime_error(name + ": ended before anything was filmed");
  return synthesizer::write_film(
      frames_, dir, name, {.count = count, .cell_width_px = frames_.front().camera.width_px / 2});
}

void Scene::write_strip(const std::filesystem::path& png, int count) const {
  if (frames_.empty()) throw std::runtime_error(png.string() + ": ended before it was filmed");
  std::error_code ignored;
  std::filesystem::create_directories(png.parent_path(), ignored);
  const auto written =
      image::write_png(png, synthesizer::strip(frames_, count, frames_.front().camera.width_px));
  if (!written) throw std::runtime_error(written.error().reason);
}

}  // namespace mimesis::walk
