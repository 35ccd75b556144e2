#include "nodes/vision/teacher_hand.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
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
constexpr int kBoth = 6;              // pictures in which a left and a right hand are followed

}  // namespace

TeacherHand::TeacherHand(const TeacherHandSetup& setup, std::span<const image::Camera> cameras)
    : camera_(cameras.front()) {
  for (const bool left : {true, false}) {
    if (setup.side == (left ? "right" : "left")) continue;
    hypotheses_.push_back({left, HandTracker({.length_m = setup.length_m}, cameras)});
  }
  const int cell = tracker().cell_px();
  hidden_.resize(static_cast<std::size_t>(camera_.width() / cell) *
                 static_cast<std::size_t>(camera_.height() / cell));
}

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
  for (Hypothesis& h : hypotheses_) {
    std::array<HandPose, 4> guesses;
    for (std::size_t k = 0; k < guesses.size(); ++k) {  // fingers along x of T; palm down first
      const double roll = 0.5 * std::numbers::pi * static_cast<double>(k);
      const Vector3d x = Vector3d::UnitX(), z(0.0, -std::cos(roll), std::sin(roll));
      Eigen::Matrix3d R_TH;
      R_TH << x, z.cross(x), z;
      guesses[k] = h.tracker.from_T({blob.x(), blob.y(), 0.0}, R_TH, h.left);
    }
    h.tracker.start(guesses);
    h.sum = 0.0;
  }
  following_ = true;
  astray_ = pictures_ = 0;
}

bool TeacherHand::chosen() const { return hypotheses_.size() == 1 || pictures_ >= kBoth; }

void TeacherHand::see(std::size_t camera, const image::Image& picture,
                      std::span<const std::uint8_t> labels) {
  const int cell = tracker().cell_px(), width = picture.width / cell;
  for (std::size_t i = 0; i < hidden_.size(); ++i) {
    const int u = static_cast<int>(i) % width * cell + cell / 2,
              v = static_cast<int>(i) / width * cell + cell / 2;
    const auto kind = static_cast<Kind>(labels[static_cast<std::size_t>(v * picture.width + u)]);
    hidden_[i] = kind == Kind::object || kind == Kind::bar ? 1 : 0;
  }
  for (std::size_t k = 0; k < hypotheses_.size(); ++k) {
    if (k == best_ || !following_ || !chosen())
      hypotheses_[k].tracker.see(camera, picture, hidden_);
  }
}

void TeacherHand::step() {
  if (chosen()) {
    hypotheses_[best_].tracker.step();
    return;
  }
  for (Hypothesis& h : hypotheses_) h.sum += h.tracker.step().score;
  best_ = hypotheses_[1].sum > hypotheses_[0].sum ? 1 : 0;
  ++pictures_;
}

void TeacherHand::follow(const std::optional<Vector2d>& blob) {
  sight_.reset();
  if (!following_) {
    if (!blob || !whole(*blob)) return;
    begin(*blob);
  }
  step();
  const bool found = tracker().estimate().found;
  const Vector3d palm = tracker().p_TH();
  const bool apart = !blob || (palm.head<2>() - *blob).norm() > kApart_m;
  astray_ = found && !apart ? 0 : astray_ + 1;
  if (astray_ >= kAstray) following_ = false;
  if (astray_ > 0 || !chosen()) return;
  const Eigen::Matrix3d R = tracker().R_TH();
  sight_ = {.wrist = tracker().wrist_T(),
            .palm = palm,
            // A palm that looks up is that of the other hand, whose outline is the same, looking
            // down: nobody grasps like that.
            .palm_angle_rad = std::acos(std::min(std::abs(R(1, 2)), 1.0))};
}

}  // namespace mimesis::vision
