#include "nodes/vision/teacher_hand.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "nodes/vision/regions.h"

namespace mimesis::vision {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kHalfHand_m = 0.11;  // from the blob's centre to what must be in the picture
constexpr double kApart_m = 0.08;     // of blob and model: then the model follows something else
constexpr int kAstray = 8;            // pictures

}  // namespace

TeacherHand::TeacherHand(const TeacherHandSetup& setup, std::span<const image::Camera> cameras)
    : camera_(cameras.front()),
      left_(setup.side == "either" ? std::vector<bool>{true, false}
                                   : std::vector<bool>{setup.side == "left"}),
      tracker_({.length_m = setup.length_m}, cameras),
      hidden_(static_cast<std::size_t>(camera_.width() / tracker_.cell_px()) *
              static_cast<std::size_t>(camera_.height() / tracker_.cell_px())) {}

bool TeacherHand::possible(const TeacherHandSetup& setup, std::span<const image::Camera> cameras) {
  constexpr double kLeastCells = 20.0;  // along the hand
  return std::ranges::all_of(cameras, [&](const image::Camera& c) {
    const int cell = SkinDensity(c.width(), c.height()).factor();
    return c.width() == cameras[0].width() && c.height() == cameras[0].height() &&
           setup.length_m * c.scale(Vector3d::Zero()) / cell >= kLeastCells;
  });
}

/// The whole hand is in the picture.
bool TeacherHand::whole(const Vector2d& blob) const {
  for (const double side : {-kHalfHand_m, kHalfHand_m}) {
    const Vector2d p = camera_.project({blob.x() + side, blob.y(), 0.0});
    if (p.x() < 0.0 || p.x() >= camera_.width()) return false;
  }
  return true;
}

void TeacherHand::begin(const Vector2d& blob) {
  std::vector<HandPose> guesses;
  for (int k = 0; k < 4; ++k) {  // fingers along x of T; palm down first
    const double roll = 0.5 * std::numbers::pi * k;
    const Vector3d x = Vector3d::UnitX(), z(0.0, -std::cos(roll), std::sin(roll));
    Eigen::Matrix3d R_TH;
    R_TH << x, z.cross(x), z;
    for (const bool left : left_)
      guesses.push_back(tracker_.from_T({blob.x(), blob.y(), 0.0}, R_TH, left));
  }
  tracker_.start(guesses);
  following_ = true;
  astray_ = 0;
}

void TeacherHand::see(std::size_t camera, const image::Image& picture,
                      std::span<const std::uint8_t> labels) {
  const int cell = tracker_.cell_px(), width = picture.width / cell;
  for (std::size_t i = 0; i < hidden_.size(); ++i) {
    const int u = static_cast<int>(i) % width * cell + cell / 2,
              v = static_cast<int>(i) / width * cell + cell / 2;
    const auto kind = static_cast<Kind>(labels[static_cast<std::size_t>(v * picture.width + u)]);
    hidden_[i] = kind == Kind::object || kind == Kind::bridge ? 1 : 0;
  }
  tracker_.see(camera, picture, hidden_);
}

void TeacherHand::follow(const std::optional<Vector2d>& blob) {
  sight_.reset();
  if (!following_) {
    if (!blob || !whole(*blob)) return;
    begin(*blob);
  }
  const bool found = tracker_.step().found;
  const Vector3d palm = tracker_.p_TH();
  const bool apart = !blob || (palm.head<2>() - *blob).norm() > kApart_m;
  astray_ = found && !apart ? 0 : astray_ + 1;
  if (astray_ >= kAstray) following_ = false;
  if (astray_ > 0) return;
  const Eigen::Matrix3d R = tracker_.R_TH();
  sight_ = {.wrist = tracker_.wrist_T(),
            .palm = palm,
            // A palm that looks up is that of the other hand, whose outline is the same, looking
            // down: nobody grasps like that.
            .palm_angle_rad = std::acos(std::min(std::abs(R(1, 2)), 1.0))};
}

}  // namespace mimesis::vision
