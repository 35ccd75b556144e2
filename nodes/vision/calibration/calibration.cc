#include "nodes/vision/calibration/calibration.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <opencv2/calib3d.hpp>

#include "common/math/so3.h"

namespace mimesis::vision {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using image::Camera;
using image::Lens;

constexpr std::size_t kFewest = 4;    // positions of the board
constexpr double kAspect = 1.05;      // largest fx / fy of square pixels
constexpr double kKnown = 0.02;       // largest 2 sigma of the focal length, of it
constexpr double kTimesMedian = 3.0;  // a held-out error beyond this is a bad shot
constexpr double kLeastBad_px = 0.3;  // an error below it never is
// k3 of boards that do not reach the picture's corners is noise, which folds these corners over.
// Steps are damped, so their equations need no SVD, which takes most of the time otherwise.
constexpr int kModel = cv::CALIB_FIX_K3 | cv::CALIB_USE_LU;
const cv::TermCriteria kUntil(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 1e-6);

std::vector<cv::Point3f> places(const Board& board) {
  std::vector<cv::Point3f> out;
  for (std::size_t i = 0; i < board.size(); ++i) {
    const Vector3d p = board.point(i);
    out.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()), 0.0F);
  }
  return out;
}

std::vector<cv::Point2f> pixels(const Corners& corners) {
  std::vector<cv::Point2f> out;
  for (const Vector2d& p : corners)
    out.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
  return out;
}

cv::Mat matrix_of(const Lens& lens) {
  return (cv::Mat_<double>(3, 3) << lens.fx_px, 0.0, lens.cx_px, 0.0, lens.fy_px, lens.cy_px, 0.0,
          0.0, 1.0);
}

cv::Mat distortion_of(const Lens& lens) {
  return cv::Mat(1, 5, CV_64F, const_cast<double*>(lens.distortion.data())).clone();
}

Lens lens_of(const PictureSize& size, const cv::Mat& k, const cv::Mat& d) {
  Lens lens{
      size.width,         size.height, k.at<double>(0, 0), k.at<double>(1, 1), k.at<double>(0, 2),
      k.at<double>(1, 2), {}};
  for (int i = 0; i < 5; ++i) lens.distortion.at(static_cast<std::size_t>(i)) = d.at<double>(i);
  return lens;
}

Matrix3d rotation_of(const cv::Mat& r) {
  Matrix3d out;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out(i, j) = r.at<double>(i, j);
  }
  return out;
}

Camera at_origin(const Lens& lens) { return {lens, Matrix3d::Identity(), Vector3d::Zero()}; }

/// Pose of the board in one camera.
Eigen::Isometry3d pose_in(const Board& board, const Lens& lens, const Corners& corners) {
  cv::Mat turn, shift, rotation;
  cv::solvePnP(places(board), pixels(corners), matrix_of(lens), distortion_of(lens), turn, shift);
  cv::Rodrigues(turn, rotation);
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.linear() = rotation_of(rotation);
  out.translation() = Vector3d(shift.at<double>(0), shift.at<double>(1), shift.at<double>(2));
  return out;
}

struct Fit {
  std::vector<Camera> cameras;
  double rms_px = 0.0;
};

class Calibrator {
 public:
  Calibrator(const Board& board, std::span<const PictureSize> sizes)
      : board_(board), sizes_(sizes) {}

  /// One camera by itself. `rms_px`: rms distance of corners.
  Lens mono(std::span<const Shot* const> shots, std::size_t camera, double& rms_px) const {
    const std::vector<std::vector<cv::Point3f>> objects(shots.size(), places(board_));
    cv::Mat k, d;
    std::vector<cv::Mat> turns, shifts;
    rms_px = cv::calibrateCamera(objects, seen_by(shots, camera), cv_size(camera), k, d, turns,
                                 shifts, kModel, kUntil);
    return lens_of(sizes_[camera], k, d);
  }

  /// All cameras together, from the lenses of `start`.
  Fit joint(std::span<const Shot* const> shots, const std::vector<Lens>& start) const {
    Fit out;
    if (sizes_.size() == 1) {
      out.cameras.push_back(at_origin(mono(shots, 0, out.rms_px)));
      return out;
    }
    const std::vector<std::vector<cv::Point3f>> objects(shots.size(), places(board_));
    std::array<cv::Mat, 2> k{matrix_of(start[0]), matrix_of(start[1])},
        d{distortion_of(start[0]), distortion_of(start[1])};
    cv::Mat r, t, e, f;
    out.rms_px =
        cv::stereoCalibrate(objects, seen_by(shots, 0), seen_by(shots, 1), k[0], d[0], k[1], d[1],
                            cv_size(0), r, t, e, f, cv::CALIB_USE_INTRINSIC_GUESS | kModel, kUntil);
    const Matrix3d turn = rotation_of(r);
    const Vector3d shift(t.at<double>(0), t.at<double>(1), t.at<double>(2));
    out.cameras.push_back(at_origin(lens_of(sizes_[0], k[0], d[0])));
    out.cameras.emplace_back(lens_of(sizes_[1], k[1], d[1]), turn, -turn.transpose() * shift);
    return out;
  }

 private:
  cv::Size cv_size(std::size_t camera) const {
    return {sizes_[camera].width, sizes_[camera].height};
  }
  static std::vector<std::vector<cv::Point2f>> seen_by(std::span<const Shot* const> shots,
                                                       std::size_t camera) {
    std::vector<std::vector<cv::Point2f>> out;
    for (const Shot* shot : shots) out.push_back(pixels(shot->seen[camera]));
    return out;
  }

  const Board& board_;
  std::span<const PictureSize> sizes_;
};

std::vector<const Shot*> all_but(const std::vector<Shot>& shots, std::size_t left_out) {
  std::vector<const Shot*> out;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    if (i != left_out) out.push_back(&shots[i]);
  }
  return out;
}

double epipolar_error(std::span<const Camera> cameras, const Shot& shot) {
  double sum = 0.0;
  for (std::size_t i = 0; i < shot.seen[0].size(); ++i) {
    sum += image::epipolar_distance(cameras[0], cameras[1], shot.seen[0][i], shot.seen[1][i]);
  }
  return sum / static_cast<double>(shot.seen[0].size());
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Takes away positions whose corners are not all there. Numbers boards without a beginning in the
/// second camera such that the cameras are turned by less than a right angle.
void check_shots(const Board& board, std::size_t cameras, std::vector<Shot>& shots,
                 std::vector<Rejected>& rejected) {
  std::erase_if(shots, [&](const Shot& shot) {
    MIMESIS_ASSERT(shot.seen.size() == cameras);
    std::string found;
    bool whole = true;
    for (const Corners& corners : shot.seen) {
      found += (found.empty() ? "" : " and ") + std::to_string(corners.size());
      whole = whole && corners.size() == board.size();
    }
    if (!whole)
      rejected.push_back(
          {shot.name, fmt::format("{} corners seen, expected {}{}", found, board.size(),
                                  cameras > 1 ? " in each picture" : "")});
    return !whole;
  });
}

void number_alike(const Board& board, const std::vector<Lens>& lenses, std::vector<Shot>& shots) {
  if (lenses.size() < 2 || board.has_a_beginning()) return;
  for (Shot& shot : shots) {
    const Matrix3d between = pose_in(board, lenses[1], shot.seen[1]).linear() *
                             pose_in(board, lenses[0], shot.seen[0]).linear().transpose();
    if (between.trace() < 1.0) std::ranges::reverse(shot.seen[1]);  // cos(angle) < 0
  }
}

/// Takes away positions that are far from what most of the others say about the right camera, as
/// each camera sees them by itself: a wrong partner would carry the joint fit away.
void check_partners(const Board& board, const std::vector<Lens>& lenses, std::vector<Shot>& shots,
                    std::vector<Rejected>& rejected) {
  constexpr double kFar = 0.025;  // of the picture's width; a good lens of its own is within 0.01
  if (lenses.size() < 2) return;
  std::vector<Eigen::Isometry3d> in_left, between;  // X_LB, X_RL
  for (const Shot& shot : shots) {
    in_left.push_back(pose_in(board, lenses[0], shot.seen[0]));
    between.push_back(pose_in(board, lenses[1], shot.seen[1]) * in_left.back().inverse());
  }
  double least = std::numeric_limits<double>::infinity();
  std::vector<double> errors;
  for (const Eigen::Isometry3d& X_RL : between) {
    std::vector<double> by_this;
    for (std::size_t i = 0; i < shots.size(); ++i) {
      double squares = 0.0;
      for (std::size_t k = 0; k < board.size(); ++k) {
        const Vector3d p = X_RL * in_left[i] * board.point(k);
        squares += (lenses[1].project(p) - shots[i].seen[1][k]).squaredNorm();
      }
      by_this.push_back(std::sqrt(squares / static_cast<double>(board.size())));
    }
    const double usual = median(by_this);
    if (usual < least) {
      least = usual;
      errors = by_this;
    }
  }
  std::vector<Shot> kept;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    if (errors[i] <= kFar * lenses[1].width_px) {
      kept.push_back(std::move(shots[i]));
    } else {
      rejected.push_back(
          {shots[i].name,
           fmt::format("the right picture is {:.0f} px from where the left one puts the board: was "
                       "it moved, or is this another picture's partner?",
                       errors[i])});
    }
  }
  shots = std::move(kept);
}

constexpr const char* kMoreViews = "; show the board nearer, at all edges and more tilted";

/// Reason why the calibration is implausible; empty if it is plausible.
std::string implausible(const Lens& lens) {
  const double aspect = std::max(lens.fx_px, lens.fy_px) / std::min(lens.fx_px, lens.fy_px);
  if (!(aspect <= kAspect)) {  // and the views bound both: it is not for want of views
    const double now = static_cast<double>(lens.width_px) / lens.height_px;
    return fmt::format(
        "focal lengths {:.0f} and {:.0f} px differ by more than {:.0f} %: pictures of {:.2f} to 1 "
        "seem to be scaled to {}x{}, unlike across and down; give them as the camera took them",
        lens.fx_px, lens.fy_px, 100.0 * (kAspect - 1.0), now * lens.fy_px / lens.fx_px,
        lens.width_px, lens.height_px);
  }
  const double x = lens.cx_px / lens.width_px, y = lens.cy_px / lens.height_px;
  if (!(x > 0.25 && x < 0.75 && y > 0.25 && y < 0.75)) {
    return fmt::format(
        "the optical axis is at ({:.0f}, {:.0f}) px, expected in the middle half of {}x{}{}",
        lens.cx_px, lens.cy_px, lens.width_px, lens.height_px, kMoreViews);
  }
  if (lens.folds()) return fmt::format("its distortion folds the picture over{}", kMoreViews);
  return {};
}

std::string implausible(const Calibrated& result) {
  constexpr std::array<const char*, 2> kWhich{"left", "right"};
  for (std::size_t c = 0; c < result.cameras.size(); ++c) {
    const std::string which =
        result.cameras.size() > 1 ? std::string(kWhich.at(c)) + " camera" : "camera";
    const Lens& lens = result.cameras[c].lens();
    const LensSigma& sigma = result.sigma[c];
    const double two = 2.0 * std::max(sigma.fx_px, sigma.fy_px);
    if (!(two <= kKnown * lens.fx_px)) {
      const std::string known = std::isfinite(two) ? fmt::format("2 sigma {:.3g} px", two)
                                                   : std::string("without any bound");
      return fmt::format(
          "{}: these views do not bound its focal length: {:.0f} px, {}, expected 2 sigma of at "
          "most {:.0f} %; most helps a view of {}",
          which, lens.fx_px, known, 100.0 * kKnown, sigma.helps);
    }
    const std::string why = implausible(lens);
    if (why.empty()) continue;
    return fmt::format("{}: {}", which, why);
  }
  if (result.cameras.size() < 2) return {};
  const Vector3d p = 1e3 * result.cameras[1].eye();
  if (std::abs(p.x()) < std::max(std::abs(p.y()), std::abs(p.z()))) {
    return fmt::format(
        "the right camera stands ({:.0f}, {:.0f}, {:.0f}) mm to the right, below and before the "
        "left "
        "one; expected it mostly to the right",
        p.x(), p.y(), p.z());
  }
  if (p.x() < 0.0) {
    return fmt::format(
        "the right camera stands {:.0f} mm to the left of the left one: are the "
        "pictures swapped?",
        -p.x());
  }
  const double share = result.baseline_m() / result.coverage[0].nearest_m;
  if (!(share > 0.02 && result.baseline_m() < 1.5 * result.coverage[0].farthest_m)) {
    return fmt::format(
        "the baseline of {:.1f} mm is {:.1f} % of the board's distance, expected 2 to 150 %",
        1e3 * result.baseline_m(), 100.0 * share);
  }
  return {};
}

Coverage coverage_of(const Board& board, const std::vector<Camera>& cameras, std::size_t camera,
                     const std::vector<Shot>& shots) {
  constexpr int kAcross = 8, kDown = 6;
  constexpr std::array<const char*, 4> kQuarters{"upper left", "upper right", "lower left",
                                                 "lower right"};
  const Lens& lens = cameras[camera].lens();
  std::array<bool, kAcross * kDown> held{};
  Coverage out;
  out.nearest_m = 1e9;
  for (const Shot& shot : shots) {
    for (const Vector2d& p : shot.seen[camera]) {
      const int u = std::clamp(static_cast<int>(p.x() / lens.width_px * kAcross), 0, kAcross - 1),
                v = std::clamp(static_cast<int>(p.y() / lens.height_px * kDown), 0, kDown - 1);
      held.at(static_cast<std::size_t>(v * kAcross + u)) = true;
    }
    const Eigen::Isometry3d pose = pose_in(board, lens, shot.seen[camera]);
    const double distance = (pose * board.middle()).norm();
    out.nearest_m = std::min(out.nearest_m, distance);
    out.farthest_m = std::max(out.farthest_m, distance);
    const double tilt = std::acos(std::clamp(std::abs(pose.linear()(2, 2)), 0.0, 1.0));
    out.tilt_deg = std::max(out.tilt_deg, tilt * 180.0 / std::numbers::pi);
  }
  std::array<int, 4> cells{};
  for (int v = 0; v < kDown; ++v) {
    for (int u = 0; u < kAcross; ++u) {
      const auto quarter = static_cast<std::size_t>(2 * (2 * v / kDown) + 2 * u / kAcross);
      if (held.at(static_cast<std::size_t>(v * kAcross + u))) ++cells.at(quarter);
    }
  }
  for (std::size_t q = 0; q < 4; ++q) {
    if (cells.at(q) < kAcross * kDown / 16) out.missing.emplace_back(kQuarters.at(q));
  }
  out.cells = std::accumulate(cells.begin(), cells.end(), 0.0) / (kAcross * kDown);
  return out;
}

// Parameters whose deviations are told: fx fy cx cy k1 k2 p1 p2. k3 is not fitted.
constexpr int kParameters = 8;
using Information = Eigen::Matrix<double, kParameters, kParameters>;

Lens moved(Lens lens, int parameter, double by) {
  const std::array<double*, 4> pinhole{&lens.fx_px, &lens.fy_px, &lens.cx_px, &lens.cy_px};
  const auto k = static_cast<std::size_t>(parameter);
  (k < pinhole.size() ? *pinhole.at(k) : lens.distortion.at(k - pinhole.size())) += by;
  return lens;
}

/// What a view tells of the lens, in 1/px², while its own pose is unknown, too: with the corners'
/// derivatives J by the lens and P by the pose, JᵀJ − JᵀP (PᵀP)⁻¹ PᵀJ.
Information told_by(const Board& board, const Lens& lens, const Eigen::Isometry3d& X_CB) {
  const auto rows = 2 * static_cast<Eigen::Index>(board.size());
  Eigen::MatrixXd j(rows, kParameters), p(rows, 6);
  for (std::size_t i = 0; i < board.size(); ++i) {
    const auto row = 2 * static_cast<Eigen::Index>(i);
    const Vector3d x = X_CB * board.point(i), arm = X_CB.linear() * board.point(i);
    for (int k = 0; k < kParameters; ++k) {
      const double h = k < 4 ? 1e-3 : 1e-6;
      j.block<2, 1>(row, k) =
          (moved(lens, k, h).project(x) - moved(lens, k, -h).project(x)) / (2.0 * h);
    }
    for (int k = 0; k < 6; ++k) {
      const double h = 1e-6;
      const Vector3d axis = h * Vector3d::Unit(k % 3);
      const Vector3d by = k < 3 ? axis : Vector3d(axis.cross(arm));
      p.block<2, 1>(row, k) = (lens.project(x + by) - lens.project(x - by)) / (2.0 * h);
    }
  }
  const Eigen::MatrixXd pj = p.transpose() * j;
  return j.transpose() * j - pj.transpose() * (p.transpose() * p).ldlt().solve(pj);
}

/// Standard deviations per pixel of noise; infinite if the views leave some combination open.
Eigen::Vector<double, kParameters> deviations(const Information& told) {
  constexpr double kOpen = 1e-9;  // of the scaled information's smallest direction
  const Eigen::Vector<double, kParameters> scale = told.diagonal().cwiseSqrt().cwiseInverse();
  const Information scaled = scale.asDiagonal() * told * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Information> eigen(scaled);
  if (!(eigen.eigenvalues()[0] > kOpen))
    return Eigen::Vector<double, kParameters>::Constant(std::numeric_limits<double>::infinity());
  const Information inverse = eigen.eigenvectors() *
                              eigen.eigenvalues().cwiseInverse().asDiagonal() *
                              eigen.eigenvectors().transpose();
  return inverse.diagonal().cwiseSqrt().cwiseProduct(scale);
}

/// Which further view would narrow fx most.
std::string best_view(const Board& board, const Lens& lens, const Information& told,
                      double distance_m) {
  struct View {
    const char* text;
    double about_x, about_y, nearer;
  };
  constexpr double kTilt = 0.7;
  constexpr std::array kViews{
      View{"the board tilted by 40°, its left edge nearer", 0.0, -kTilt, 1.0},
      View{"the board tilted by 40°, its right edge nearer", 0.0, kTilt, 1.0},
      View{"the board tilted by 40°, its upper edge nearer", kTilt, 0.0, 1.0},
      View{"the board tilted by 40°, its lower edge nearer", -kTilt, 0.0, 1.0},
      View{"the board at two thirds of the distance", 0.0, 0.0, 0.67}};
  std::string best;
  double least = std::numeric_limits<double>::infinity();
  for (const View& view : kViews) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = math::exp_so3(Vector3d(view.about_x, view.about_y, 0.0));
    pose.translation() =
        Vector3d(0.0, 0.0, view.nearer * distance_m) - pose.linear() * board.middle();
    const double left = deviations(told + told_by(board, lens, pose))[0];
    if (left < least || best.empty()) best = view.text;
    least = std::min(least, left);
  }
  return best;
}

LensSigma sigma_of(const Board& board, const Camera& camera, std::size_t index,
                   const std::vector<Shot>& shots, const std::vector<HeldOut>& held) {
  const Camera alone = at_origin(camera.lens());
  Information told = Information::Zero();
  double squares = 0.0, distance_m = 0.0;
  for (const Shot& shot : shots) {
    const BoardPose pose =
        locate_board(board, std::span(&alone, 1), std::span(&shot.seen[index], 1));
    told += told_by(board, camera.lens(), pose.X_FB);
    squares += pose.rms_px * pose.rms_px * static_cast<double>(board.size());
    distance_m += (pose.X_FB * board.middle()).norm() / static_cast<double>(shots.size());
  }
  const auto n = static_cast<double>(shots.size());
  const double free = n * (2.0 * static_cast<double>(board.size()) - 6.0) - kParameters;
  const Eigen::Vector<double, kParameters> deviation = deviations(told) * std::sqrt(squares / free);
  double mean = 0.0, spread = 0.0;  // jackknife
  for (const HeldOut& h : held) mean += h.fx_px[index] / n;
  for (const HeldOut& h : held) spread += std::pow(h.fx_px[index] - mean, 2);
  const double more =
      deviation[0] > 0.0 ? std::max(1.0, std::sqrt((n - 1.0) / n * spread) / deviation[0]) : 1.0;
  return {more * deviation[0], more * deviation[1], more * deviation[2], more * deviation[3],
          best_view(board, camera.lens(), told, distance_m)};
}

std::vector<HeldOut> leave_each_out(const Board& board, const Calibrator& calibrator,
                                    const std::vector<Lens>& start,
                                    const std::vector<Shot>& shots) {
  std::vector<HeldOut> out;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const Fit fit = calibrator.joint(all_but(shots, i), start);
    HeldOut held{shots[i].name, locate_board(board, fit.cameras, shots[i].seen).rms_px};
    for (const Camera& camera : fit.cameras) held.fx_px.push_back(camera.lens().fx_px);
    if (fit.cameras.size() > 1) {
      held.epipolar_px = epipolar_error(fit.cameras, shots[i]);
      held.baseline = fit.cameras[1].eye().norm();
    }
    out.push_back(held);
  }
  return out;
}

/// Which position the others do not predict; nothing if all are predicted.
std::optional<std::size_t> bad_shot(const std::vector<HeldOut>& held, std::string& reason) {
  std::vector<double> errors;
  for (const HeldOut& h : held) errors.push_back(h.reprojection_px);
  const double usual = median(errors);
  const auto worst = std::ranges::max_element(errors);
  if (!(*worst > std::max(kTimesMedian * usual, kLeastBad_px))) return std::nullopt;
  const auto index = static_cast<std::size_t>(worst - errors.begin());
  reason = fmt::format(
      "its corners are {:.2f} px (rms) from where the others put them, usual are {:.2f} px: was "
      "the "
      "board moved, or bent?",
      *worst, usual);
  return index;
}

}  // namespace

HeldOutSummary summary(std::span<const HeldOut> held_out) {
  HeldOutSummary out;
  double squares = 0.0, worst = -1.0, mean = 0.0;
  const auto n = static_cast<double>(held_out.size());
  for (const HeldOut& h : held_out) {
    squares += h.reprojection_px * h.reprojection_px / n;
    out.epipolar_px += h.epipolar_px / n;
    out.worst_epipolar_px = std::max(out.worst_epipolar_px, h.epipolar_px);
    mean += h.baseline / n;
    if (h.reprojection_px > worst) {
      worst = h.reprojection_px;
      out.worst = h.name;
    }
  }
  out.reprojection_px = std::sqrt(squares);
  double variance = 0.0;
  for (const HeldOut& h : held_out) variance += (h.baseline - mean) * (h.baseline - mean) / n;
  if (mean > 0.0) out.baseline_spread = std::sqrt(variance) / mean;
  return out;
}

BoardPose locate_board(const Board& board, std::span<const Camera> cameras,
                       std::span<const Corners> seen) {
  const Camera& first = cameras[0];
  BoardPose out;
  const Eigen::Isometry3d X_CB = pose_in(board, first.lens(), seen[0]);
  out.X_FB.linear() = first.R_CT().transpose() * X_CB.linear();
  out.X_FB.translation() = first.R_CT().transpose() * X_CB.translation() + first.eye();

  const auto n = static_cast<Eigen::Index>(board.size());
  const auto residuals = [&](const Eigen::Isometry3d& pose) {
    Eigen::VectorXd r(2 * n * static_cast<Eigen::Index>(cameras.size()));
    Eigen::Index row = 0;
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      for (std::size_t i = 0; i < board.size(); ++i, row += 2) {
        r.segment<2>(row) = seen[c][i] - cameras[c].project(pose * board.point(i));
      }
    }
    return r;
  };
  const auto moved = [](const Eigen::Isometry3d& pose, const Eigen::Vector<double, 6>& by) {
    Eigen::Isometry3d next = pose;  // turned about the board's own origin
    next.translation() += by.head<3>();
    next.linear() = math::exp_so3(by.tail<3>()) * pose.linear();
    return next;
  };
  const double step_m = 1e-6 * X_CB.translation().norm();
  Eigen::VectorXd r = residuals(out.X_FB);
  for (int i = 0; i < 20; ++i) {  // Gauss-Newton, derivatives by central differences
    Eigen::Matrix<double, Eigen::Dynamic, 6> j(r.size(), 6);
    for (int k = 0; k < 6; ++k) {
      const double h = k < 3 ? step_m : 1e-6;
      const Eigen::Vector<double, 6> by = h * Eigen::Vector<double, 6>::Unit(k);
      j.col(k) = (residuals(moved(out.X_FB, by)) - residuals(moved(out.X_FB, -by))) / (2.0 * h);
    }
    const Eigen::Vector<double, 6> step =
        -(j.transpose() * j).ldlt().solve(Eigen::Vector<double, 6>(j.transpose() * r));
    const Eigen::Isometry3d next = moved(out.X_FB, step);
    const Eigen::VectorXd next_r = residuals(next);
    if (!(next_r.squaredNorm() < r.squaredNorm())) break;
    out.X_FB = next;
    const bool done = r.squaredNorm() - next_r.squaredNorm() < 1e-12 * r.squaredNorm();
    r = next_r;
    if (done) break;
  }
  out.rms_px = std::sqrt(r.squaredNorm() / static_cast<double>(n * std::ssize(cameras)));
  return out;
}

tl::expected<Calibrated, Status> calibrate(const Board& board, std::span<const PictureSize> sizes,
                                           std::vector<Shot> shots) {
  MIMESIS_ASSERT(sizes.size() == 1 || sizes.size() == 2);
  const std::size_t given = shots.size();
  const Calibrator calibrator(board, sizes);
  Calibrated out;
  check_shots(board, sizes.size(), shots, out.rejected);
  const std::size_t whole = shots.size();
  for (bool settled = false; !settled;) {
    if (shots.size() < kFewest) {
      return tl::unexpected(Status{fmt::format(
          "{} of {} positions of the board are of use, expected {} or more, best 12 and "
          "more",
          shots.size(), given, kFewest)});
    }
    out.mono_rms_px.assign(sizes.size(), 0.0);
    std::vector<Lens> lenses;
    for (std::size_t c = 0; c < sizes.size(); ++c) {
      lenses.push_back(calibrator.mono(all_but(shots, shots.size()), c, out.mono_rms_px[c]));
    }
    number_alike(board, lenses, shots);
    const std::size_t before = shots.size();
    check_partners(board, lenses, shots, out.rejected);
    if (shots.size() == before) {
      Fit fit = calibrator.joint(all_but(shots, shots.size()), lenses);
      out.cameras = std::move(fit.cameras);
      out.rms_px = fit.rms_px;
      out.held_out = leave_each_out(board, calibrator, lenses, shots);
      std::string reason;
      const auto bad = bad_shot(out.held_out, reason);
      settled = !bad;
      if (bad) {
        out.rejected.push_back({shots[*bad].name, reason});
        shots.erase(shots.begin() + static_cast<std::ptrdiff_t>(*bad));
      }
    }
    if (3 * (whole - shots.size()) > whole) {
      return tl::unexpected(Status{fmt::format(
          "the positions of the board contradict each other: {} of {} do not fit the "
          "rest, last '{}': {}",
          whole - shots.size(), whole, out.rejected.back().name, out.rejected.back().reason)});
    }
  }
  for (std::size_t c = 0; c < sizes.size(); ++c) {
    out.coverage.push_back(coverage_of(board, out.cameras, c, shots));
    out.sigma.push_back(sigma_of(board, out.cameras[c], c, shots, out.held_out));
  }
  const std::string why = implausible(out);
  if (!why.empty()) return tl::unexpected(Status{why});
  out.shots = std::move(shots);
  return out;
}

tl::expected<OnTable, Status> place_on_table(const Board& board, std::span<const Camera> cameras,
                                             std::span<const Corners> seen, Side side,
                                             double thickness_m, const Vector2d& middle_m,
                                             double most_px) {
  constexpr double kAskew = 0.766;  // cosine of 40°
  BoardPose pose = locate_board(board, cameras, seen);
  if (seen.size() > 1 && !board.has_a_beginning()) {  // the second camera may have begun at its end
    std::vector<Corners> turned(seen.begin(), seen.end());
    std::ranges::reverse(turned[1]);
    const BoardPose other = locate_board(board, cameras, turned);
    if (other.rms_px < pose.rms_px) pose = other;
  }
  if (!(pose.rms_px <= most_px)) {
    return tl::unexpected(
        Status{fmt::format("the board on the table is {:.2f} px (rms) from where the rig sees it, "
                           "expected at most {:.2f}: "
                           "calibrate anew if a camera or its lens was moved",
                           pose.rms_px, most_px)});
  }
  const Matrix3d R_FB = pose.X_FB.linear();
  const Vector3d up = -R_FB.col(2);
  const Vector3d right = cameras[0].R_CT().row(0).transpose();
  const Vector3d level = (right - up * up.dot(right)).normalized();
  Vector3d x = level;
  double best = 0.0;
  for (const Vector3d& edge : {Vector3d(R_FB.col(0)), Vector3d(R_FB.col(1))}) {
    if (std::abs(edge.dot(level)) > best) {
      best = std::abs(edge.dot(level));
      x = edge.dot(level) > 0.0 ? edge : Vector3d(-edge);
    }
  }
  if (best < kAskew) {
    return tl::unexpected(
        Status{fmt::format("the board lies {:.0f}° askew in the left picture, expected an edge "
                           "within 40° of the picture's rows",
                           std::acos(best) * 180.0 / std::numbers::pi)});
  }
  if (side == Side::far) x = -x;
  Matrix3d R_TF;
  R_TF << x.transpose(), up.transpose(), x.cross(up).transpose();
  const Vector3d middle_T(middle_m.x(), thickness_m, middle_m.y());
  const Vector3d middle_F = pose.X_FB * board.middle();
  OnTable out;
  for (const Camera& camera : cameras) {
    out.cameras.emplace_back(camera.lens(), camera.R_CT() * R_TF.transpose(),
                             R_TF * (camera.eye() - middle_F) + middle_T);
  }
  out.rms_px = pose.rms_px;
  return out;
}

}  // namespace mimesis::vision
