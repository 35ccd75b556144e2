#include <algorithm>
#include <cmath>

#include "common/shared_data.h"
#include "experiments/sight/figures.h"
#include "nodes/vision/verb/calibration_pictures.h"

namespace mimesis::vision {
namespace {

using namespace reproduce;

constexpr const char* kReference = "vision.md";
const Board kBoard{9, 6, 1.0};  // the squares' true size is unknown: lengths are in squares

struct RowErrors {
  double mean_px = 0.0, max_px = 0.0;
};

/// Differences of rows of corners in the rectified pictures.
RowErrors row_errors(const Calibrated& c) {
  const image::Rectification turned(c.cameras[0], c.cameras[1]);
  RowErrors out;
  double count = 0.0;
  for (const Shot& shot : c.shots) {
    for (std::size_t i = 0; i < shot.seen[0].size(); ++i, ++count) {
      const double dy = std::abs(turned.rectified(0, shot.seen[0][i]).y() -
                                 turned.rectified(1, shot.seen[1][i]).y());
      out.mean_px += dy;
      out.max_px = std::max(out.max_px, dy);
    }
  }
  out.mean_px /= count;
  return out;
}

/// Edges of squares between triangulated corners: mean and standard deviation, in squares.
std::pair<double, double> edges(const Calibrated& c) {
  std::vector<double> lengths;
  for (const Shot& shot : c.shots) {
    std::vector<Eigen::Vector3d> corners;
    for (std::size_t i = 0; i < kBoard.size(); ++i) {
      const std::array<image::Sighting, 2> seen{
          {{&c.cameras[0], shot.seen[0][i]}, {&c.cameras[1], shot.seen[1][i]}}};
      const auto found = image::triangulate(seen);
      corners.push_back(found ? found->p_T : Eigen::Vector3d::Constant(std::nan("")));
    }
    for (std::size_t i = 0; i < kBoard.size(); ++i) {
      const auto columns = static_cast<std::size_t>(kBoard.columns);
      if ((i + 1) % columns != 0) lengths.push_back((corners[i + 1] - corners[i]).norm());
      if (i + columns < kBoard.size())
        lengths.push_back((corners[i + columns] - corners[i]).norm());
    }
  }
  double mean = 0.0, variance = 0.0;
  for (const double l : lengths) mean += l / static_cast<double>(lengths.size());
  for (const double l : lengths)
    variance += (l - mean) * (l - mean) / static_cast<double>(lengths.size());
  return {mean, std::sqrt(variance)};
}

Report stereo_calibration(const PlotDir&) {
  Report report;
  const auto folder = shared_data("vision/stereo_calibration");
  if (!std::filesystem::exists(folder)) {
    report.holds("pictures are there", false, goal(),
                 folder.string() + " is absent; MIMESIS_SHARED names the folder");
    return report;
  }
  const tool::CalibrationPictures pictures = tool::read_calibration_pictures(
      kBoard, {(folder / "left").string(), (folder / "right").string()});
  const auto calibrated = calibrate(kBoard, pictures.sizes, pictures.shots);
  if (!calibrated) throw std::runtime_error(calibrated.error().reason);
  const HeldOutSummary held = summary(calibrated->held_out);
  const RowErrors rows = row_errors(*calibrated);
  const auto [edge, spread] = edges(*calibrated);
  const char *corners = "distance of corners from where the calibration puts them",
             *rectified = "in rectified pictures that hold all of both, 640x480",
             *lines =
                 "each pair left out once; mean distance in undistorted pixels, not the sum "
                 "of both sides";
  auto& r = report.rows;
  r.push_back(
      near("pairs used", static_cast<double>(calibrated->shots.size()), goal(13), 0.0, "1"));
  r.push_back(at_most("rms of all corners", calibrated->rms_px, goal(0.22), "px", corners));
  r.push_back(at_most("difference of rows: mean", rows.mean_px, goal(0.105), "px", rectified));
  r.push_back(at_most("difference of rows: largest", rows.max_px, goal(0.6), "px", rectified));
  r.push_back(
      at_most("held-out epipolar error per side: mean", held.epipolar_px, goal(0.14), "px", lines));
  r.push_back(at_most("held-out epipolar error per side: worst pair", held.worst_epipolar_px,
                      goal(0.21), "px", lines));
  r.push_back(at_most("spread of the baseline, one pair left out", 100.0 * held.baseline_spread,
                      goal(0.1), "%", "standard deviation over mean"));
  r.push_back(near("baseline", calibrated->baseline_m(), prototype(3.3275, kReference), 0.0075,
                   "squares", "three times its range there"));
  r.push_back(near("edges of triangulated squares: mean", edge, closed_form(1.0, "printed"), 0.002,
                   "squares", "a wrong scale or focal length"));
  r.push_back(at_most("edges of triangulated squares: deviation", spread,
                      prototype(0.008, kReference), "squares", "of single edges"));
  std::vector<Shot> mixed = pictures.shots;
  mixed[6].seen[1] = mixed[2].seen[1];
  const auto told = calibrate(kBoard, pictures.sizes, mixed);
  r.push_back(holds("a wrong partner is rejected by name",
                    told && told->rejected.size() == 1 && told->rejected[0].name == mixed[6].name,
                    goal()));
  return report;
}

}  // namespace

reproduce::Figure stereo_calibration_figure() {
  return Figure("stereo-calibration", "A real stereo pair calibrated from 13 positions of a board",
                "M18", Declared{.closed_form = 1, .prototype = 2, .goal = 8}, stereo_calibration);
}

}  // namespace mimesis::vision
