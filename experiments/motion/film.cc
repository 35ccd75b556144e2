#include "experiments/motion/film.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "common/error.h"
#include "common/image/image_file.h"

namespace mimesis::synthesizer {

// One picture: ground with lines and shadows, then rods and boxes with a depth buffer, all at twice
// the size and brought down at the end, which smooths every edge.

namespace {

using Eigen::Vector2d, Eigen::Vector3d;

constexpr int kZoom = 2;
constexpr int kShift = 4;            // OpenCV's pixel fractions: 1/16
constexpr double kGridReach = 12.0;  // lines fade out at this distance from the viewed point [m]
const cv::Scalar kPaper(250, 248, 246);
const Vector3d kLight = Vector3d(-0.30, -0.42, 1.0).normalized();  // towards the lamp, W

cv::Point fixed(const Vector2d& pixel) {
  const double most = 1e6;  // far outside the picture is as good as anywhere outside
  const Vector2d p = pixel.cwiseMax(-most).cwiseMin(most) * (1 << kShift);
  return {static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y()))};
}

class Canvas {
 public:
  explicit Canvas(const FilmFrame& frame)
      : frame_(frame),
        view_(frame.camera, kZoom),
        picture_(view_.height, view_.width, CV_8UC3, kPaper),
        depth_(view_.height, view_.width, CV_32F,
               cv::Scalar(std::numeric_limits<float>::infinity())) {}

  void grid();
  void shadows();
  void limb(const FilmLimb& limb);
  void box(const FilmBox& box);
  image::Image finish() const;

 private:
  struct Window {
    int u0, u1, v0, v1;
  };
  Window clip(const Vector2d& low, const Vector2d& high) const {
    return {std::max(0, static_cast<int>(std::floor(low.x()))),
            std::min(view_.width - 1, static_cast<int>(std::ceil(high.x()))),
            std::max(0, static_cast<int>(std::floor(low.y()))),
            std::min(view_.height - 1, static_cast<int>(std::ceil(high.y())))};
  }
  bool in_front(const Vector3d& p) const { return view_.depth(p) > FilmView::kNear; }
  void shadow(std::span<const Vector3d> points, cv::Mat& mask) const;
  void face(const std::array<Vector3d, 4>& corners, const Vector3d& normal, const Colour& colour);
  void pixel(int u, int v, double depth, const Vector3d& normal_W, const Colour& colour);

  const FilmFrame& frame_;
  FilmView view_;
  cv::Mat picture_, depth_;
};

void Canvas::grid() {
  const double cell = frame_.grid_m;
  if (cell <= 0.0) return;
  const Vector3d centre = frame_.camera.target_m;
  const int reach = static_cast<int>(kGridReach / cell);
  const double x0 = cell * std::round(centre.x() / cell), y0 = cell * std::round(centre.y() / cell);
  const auto line = [&](const Vector3d& a, const Vector3d& b) {
    if (!in_front(a) || !in_front(b)) return;
    const Vector2d away = (0.5 * (a + b) - centre).head<2>();
    const double ink = std::max(0.0, 1.0 - away.norm() / kGridReach);
    cv::line(picture_, fixed(view_.pixel(a)), fixed(view_.pixel(b)), kPaper * (1.0 - 0.2 * ink),
             kZoom, cv::LINE_AA, kShift);
  };
  for (int i = -reach; i <= reach; ++i) {
    for (int j = -reach; j < reach; ++j) {
      const double fixed_x = x0 + i * cell, y = y0 + j * cell;
      line({fixed_x, y, 0.0}, {fixed_x, y + cell, 0.0});
      const double fixed_y = y0 + i * cell, x = x0 + j * cell;
      line({x, fixed_y, 0.0}, {x + cell, fixed_y, 0.0});
    }
  }
}

/// Adds the convex shadow of points on the ground.
void Canvas::shadow(std::span<const Vector3d> points, cv::Mat& mask) const {
  std::vector<cv::Point> outline, hull;
  for (const Vector3d& p : points) {
    if (p.z() < -0.2) return;
    const Vector3d ground = p - p.z() / kLight.z() * kLight;
    if (!in_front(ground)) return;
    outline.push_back(fixed(view_.pixel(ground)));
  }
  cv::convexHull(outline, hull);
  cv::fillConvexPoly(mask, hull, 255, cv::LINE_AA, kShift);
}

std::array<Vector3d, 8> corners(const FilmBox& box) {
  const Eigen::Quaterniond turn = box.tilt * Eigen::AngleAxisd(box.yaw_rad, Vector3d::UnitZ());
  std::array<Vector3d, 8> out;
  for (int i = 0; i < 8; ++i) {
    const Vector3d sign((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
    out[static_cast<std::size_t>(i)] = box.center + turn * box.half_extent.cwiseProduct(sign);
  }
  return out;
}

void Canvas::shadows() {
  cv::Mat mask(view_.height, view_.width, CV_8U, cv::Scalar(0));
  for (const FilmLimb& limb : frame_.limbs) {
    constexpr int kRound = 12;
    std::array<Vector3d, 2 * kRound> rim;
    for (std::size_t k = 0; k < kRound; ++k) {
      const double angle = 2.0 * M_PI * static_cast<double>(k) / kRound;
      const Vector3d out(std::cos(angle), std::sin(angle), 0.0);
      rim[k] = limb.from + limb.radius_from * out;
      rim[kRound + k] = limb.to + limb.radius_to * out;
    }
    shadow(rim, mask);
  }
  for (const FilmBox& box : frame_.boxes) shadow(corners(box), mask);
  cv::GaussianBlur(mask, mask, cv::Size(0, 0), 1.5 * kZoom);
  for (int v = 0; v < picture_.rows; ++v) {
    for (int u = 0; u < picture_.cols; ++u) {
      if (mask.at<std::uint8_t>(v, u) != 0) {
        picture_.at<cv::Vec3b>(v, u) *= 1.0 - 0.3 * mask.at<std::uint8_t>(v, u) / 255.0;
      }
    }
  }
}

void Canvas::pixel(int u, int v, double depth, const Vector3d& normal_W, const Colour& colour) {
  auto& nearest = depth_.at<float>(v, u);
  if (depth >= static_cast<double>(nearest)) return;
  nearest = static_cast<float>(depth);
  const double shade = 0.62 + 0.38 * std::max(0.0, normal_W.dot(kLight));
  auto& out = picture_.at<cv::Vec3b>(v, u);
  // Seen through the ground from above: sunk
  const bool sunk = view_.R_CW(2, 2) < -1e-6 && view_.point(u, v, depth).z() < -2e-3;
  const double opaque = sunk ? 0.35 : 1.0;
  const std::array<int, 3> bgr = {colour.blue, colour.green, colour.red};
  for (int c = 0; c < 3; ++c) {
    out[c] = cv::saturate_cast<std::uint8_t>(opaque * shade * bgr[static_cast<std::size_t>(c)] +
                                             (1.0 - opaque) * out[c]);
  }
}

void Canvas::limb(const FilmLimb& limb) {
  const double za = view_.depth(limb.from), zb = view_.depth(limb.to);
  if (std::min(za, zb) < FilmView::kNear) return;
  const Vector2d a = view_.pixel(limb.from), b = view_.pixel(limb.to);
  const double ra = limb.radius_from * view_.pixels_per_metre(za);
  const double rb = limb.radius_to * view_.pixels_per_metre(zb);
  const Vector2d axis = b - a;
  const double inverse = 1.0 / std::max(axis.squaredNorm(), 1e-12);
  const Window w = clip((a.array() - ra).min(b.array() - rb).matrix(),
                        (a.array() + ra).max(b.array() + rb).matrix());
  for (int v = w.v0; v <= w.v1; ++v) {
    for (int u = w.u0; u <= w.u1; ++u) {
      const Vector2d p(u, v);
      const double s = std::clamp((p - a).dot(axis) * inverse, 0.0, 1.0);
      const double r = ra + s * (rb - ra);
      const Vector2d across = (p - (a + s * axis)) / r;
      if (across.squaredNorm() >= 1.0) continue;
      const double bulge = std::sqrt(1.0 - across.squaredNorm());
      const Vector3d normal = view_.R_CW.transpose() * Vector3d(across.x(), across.y(), -bulge);
      const double radius = limb.radius_from + s * (limb.radius_to - limb.radius_from);
      pixel(u, v, za + s * (zb - za) - radius * bulge, normal, limb.colour);
    }
  }
}

void Canvas::face(const std::array<Vector3d, 4>& quad, const Vector3d& normal,
                  const Colour& colour) {
  std::vector<cv::Point> outline;
  Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  for (const Vector3d& corner : quad) {
    if (!in_front(corner)) return;
    const Vector2d at = view_.pixel(corner);
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
    outline.push_back(fixed(at));
  }
  const Window w = clip(low, high);
  if (w.u1 < w.u0 || w.v1 < w.v0) return;
  cv::Mat mask(view_.height, view_.width, CV_8U, cv::Scalar(0));
  cv::fillConvexPoly(mask, outline, 255, cv::LINE_8, kShift);
  for (int v = w.v0; v <= w.v1; ++v) {
    for (int u = w.u0; u <= w.u1; ++u) {
      if (mask.at<std::uint8_t>(v, u) == 0) continue;
      // Where the ray of this pixel meets the face's plane
      const Vector3d near = view_.point(u, v, 1.0), far = view_.point(u, v, 2.0);
      const double along = (quad[0] - near).dot(normal) / (far - near).dot(normal);
      pixel(u, v, 1.0 + along, normal, colour);
    }
  }
}

void Canvas::box(const FilmBox& box) {
  const std::array<Vector3d, 8> c = corners(box);
  constexpr std::array<std::array<std::size_t, 4>, 6> kFaces = {
      {{0, 2, 6, 4}, {1, 5, 7, 3}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 6, 7, 5}}};
  for (const auto& f : kFaces) {
    const std::array<Vector3d, 4> quad = {c[f[0]], c[f[1]], c[f[2]], c[f[3]]};
    const Vector3d normal = (quad[1] - quad[0]).cross(quad[3] - quad[0]).normalized();
    const Vector3d outwards = 0.25 * (quad[0] + quad[1] + quad[2] + quad[3]) - box.center;
    const Vector3d n = normal.dot(outwards) < 0.0 ? Vector3d(-normal) : normal;
    const Vector3d middle = box.center + outwards;
    const Vector2d at = in_front(middle) ? view_.pixel(middle) : Vector2d::Zero();
    const Vector3d ray = view_.point(at.x(), at.y(), 2.0) - view_.point(at.x(), at.y(), 1.0);
    if (n.dot(ray) < -1e-9) face(quad, n, box.colour);
  }
}

image::Image Canvas::finish() const {
  image::Image out(frame_.camera.width_px, frame_.camera.height_px);
  cv::Mat small(out.height, out.width, CV_8UC3, out.bgr.data());
  cv::resize(picture_, small, small.size(), 0.0, 0.0, cv::INTER_AREA);
  if (!frame_.label.empty()) {  // grows with the picture: strips make pictures smaller
    const double k = std::max(0.6, out.height / 480.0);
    const cv::Point at(cvRound(12 * k), cvRound(32 * k));
    cv::putText(small, frame_.label, at, cv::FONT_HERSHEY_SIMPLEX, 0.9 * k, {70, 66, 62},
                cvRound(1.6 * k), cv::LINE_AA);
  }
  return out;
}

}  // namespace

image::Image draw(const FilmFrame& frame) {
  Canvas canvas(frame);
  canvas.grid();
  canvas.shadows();
  for (const FilmBox& box : frame.boxes) canvas.box(box);
  for (const FilmLimb& limb : frame.limbs) canvas.limb(limb);
  return canvas.finish();
}

namespace {

using Eigen::Vector3d;

// elevation of a side view [rad]: shows the lines on the ground
constexpr double kFromAbove = 0.16;

template <class Visit>
void for_each_point(const FilmFrame& frame, const Visit& visit) {
  for (const FilmLimb& limb : frame.limbs) {
    visit(limb.from, limb.radius_from);
    visit(limb.to, limb.radius_to);
  }
  for (const FilmBox& box : frame.boxes) {
    for (int i = 0; i < 8; ++i) {
      const Vector3d sign((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
      visit(Vector3d(box.center + box.tilt * Eigen::AngleAxisd(box.yaw_rad, Vector3d::UnitZ()) *
                                      box.half_extent.cwiseProduct(sign)),
            0.0);
    }
  }
}

Vector3d middle_of_limbs(const FilmFrame& frame) {
  Vector3d sum = Vector3d::Zero();
  for (const FilmLimb& limb : frame.limbs) sum += 0.5 * (limb.from + limb.to);
  return frame.limbs.empty() ? sum : Vector3d(sum / static_cast<double>(frame.limbs.size()));
}

/// Horizontal unit vector of travel; x of W if there is none to speak of.
Vector3d way(std::span<const FilmFrame> frames) {
  Vector3d way = middle_of_limbs(frames.back()) - middle_of_limbs(frames.front());
  way.z() = 0.0;
  return way.norm() > 0.1 ? Vector3d(way.normalized()) : Vector3d::UnitX();
}

void write(const std::filesystem::path& file, const image::Image& picture) {
  if (const auto written = image::write_png(file, picture); !written) {
    throw std::runtime_error(written.error().reason);
  }
}

}  // namespace

FilmCamera FilmCamera::moved(const Vector3d& by_m) const {
  FilmCamera out = *this;
  out.eye_m += by_m;
  out.target_m += by_m;
  return out;
}

std::string film_time(double seconds) { return fmt::format("t = {:.2f} s", seconds); }

FilmCamera side_view(std::span<const FilmFrame> frames, int width_px, int height_px) {
  MIMESIS_ASSERT(!frames.empty());
  FilmCamera camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.height_m = 1.0;
  camera.target_m.setZero();
  const Vector3d ahead = way(frames), left = Vector3d::UnitZ().cross(ahead);
  const Vector3d forward = std::cos(kFromAbove) * left - std::sin(kFromAbove) * Vector3d::UnitZ();
  camera.eye_m = -forward;
  const Eigen::Matrix3d R_CW = FilmView(camera, 1).R_CW;
  Vector3d low = Vector3d::Constant(1e9), high = -low;
  for (const FilmFrame& frame : frames) {
    for_each_point(frame, [&](const Vector3d& p, double radius) {
      low = low.cwiseMin(((R_CW * p).array() - radius).matrix());
      high = high.cwiseMax(((R_CW * p).array() + radius).matrix());
    });
  }
  MIMESIS_ASSERT(high.x() >= low.x());
  const double margin = 1.12, aspect = static_cast<double>(width_px) / height_px;
  const Vector3d extent = high - low;
  camera.height_m = margin * std::max({extent.y(), extent.x() / aspect, 0.1});
  camera.target_m = R_CW.transpose() * (0.5 * (low + high));
  camera.eye_m = camera.target_m - 10.0 * forward;
  return camera;
}

std::vector<std::size_t> evenly_chosen(std::size_t frames, int count) {
  const std::size_t n = std::min(frames, static_cast<std::size_t>(std::max(1, count)));
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < n; ++i) {
    chosen.push_back(n == 1 ? frames - 1 : (i * (frames - 1) + (n - 1) / 2) / (n - 1));
  }
  return chosen;
}

image::Image strip(std::span<const FilmFrame> frames, int count, int cell_width_px) {
  std::vector<cv::Mat> cells;
  for (const std::size_t i : evenly_chosen(frames.size(), count)) {
    image::Image picture = draw(frames[i]);
    const cv::Mat whole(picture.height, picture.width, CV_8UC3, picture.bgr.data());
    const int height =
        static_cast<int>(std::lround(1.0 * cell_width_px * picture.height / picture.width));
    cv::Mat& cell = cells.emplace_back();
    cv::resize(whole, cell, cv::Size(cell_width_px, height), 0.0, 0.0, cv::INTER_AREA);
    if (cells.size() > 1 && cell.rows != cells[0].rows) {
      cv::resize(cell, cell, cells[0].size(), 0.0, 0.0, cv::INTER_AREA);
    }
  }
  cv::Mat joined;
  cv::hconcat(cells, joined);
  image::Image out(joined.cols, joined.rows);
  joined.copyTo(cv::Mat(joined.rows, joined.cols, CV_8UC3, out.bgr.data()));
  return out;
}

image::Image poses_along_path(std::span<const FilmFrame> frames, int count,
                              const FilmCamera& camera) {
  const std::vector<std::size_t> chosen = evenly_chosen(frames.size(), count);
  FilmFrame all = frames.back();
  all.camera = camera;
  for (std::size_t k = 0; k + 1 < chosen.size(); ++k) {
    const double pale =
        0.6 * (1.0 - static_cast<double>(k + 1) / static_cast<double>(chosen.size()));
    for (FilmLimb limb : frames[chosen[k]].limbs) {
      limb.colour = paler(limb.colour, pale);
      all.limbs.push_back(limb);
    }
  }
  return draw(all);
}

std::vector<std::filesystem::path> write_film(std::span<const FilmFrame> frames,
                                              const std::filesystem::path& folder,
                                              const std::string& name,
                                              const StripOptions& options) {
  MIMESIS_ASSERT(!frames.empty());
  const std::filesystem::path pictures = folder / name, sheet = folder / (name + ".png");
  std::error_code failed;
  std::filesystem::create_directories(pictures, failed);
  if (failed) throw std::runtime_error(pictures.string() + ": " + failed.message());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    write(pictures / fmt::format("frame_{:04}.png", i), draw(frames[i]));
  }
  write(sheet, options.along_path ? poses_along_path(frames, options.count, *options.along_path)
                                  : strip(frames, options.count, options.cell_width_px));
  return {sheet, pictures};
}

namespace {

using Eigen::Vector3d;

// Radii of a person's limbs for legs of 0.835 m [m]
constexpr double kThigh = 0.062, kKnee = 0.046, kAnkle = 0.034, kSole = 0.024, kTrunk = 0.075,
                 kWaist = 0.06, kThroat = 0.036, kShoulder = 0.046, kElbow = 0.034, kWrist = 0.026,
                 kFinger = 0.018, kUsualLeg = 0.835;

double leg_length(const mocap::Body& body) {
  return body.offset_m[mocap::kLeftKnee].norm() + body.offset_m[mocap::kLeftAnkle].norm();
}

class Painter {
 public:
  Painter(FilmFrame& frame, double thick) : frame_(frame), thick_(thick) {}
  void limb(const Vector3d& a, const Vector3d& b, double ra, double rb, const Colour& colour) {
    frame_.limbs.push_back({a, b, thick_ * ra, thick_ * rb, colour});
  }
  double thick() const { return thick_; }

 private:
  FilmFrame& frame_;
  double thick_;
};

void paint_side(Painter& paint, const mocap::Body& body, const mocap::BodyPose& pose, int side,
                const Colour& colour) {
  using namespace mocap;
  const bool left = side == kLeft;
  const int hip = left ? kLeftHip : kRightHip, shoulder = left ? kLeftShoulder : kRightShoulder;
  const auto at = [&](int joint) { return pose.p_WJ[static_cast<std::size_t>(joint)]; };
  const auto s = static_cast<std::size_t>(side);
  paint.limb(at(hip), at(hip + 1), kThigh, kKnee, colour);
  paint.limb(at(hip + 1), at(hip + 2), kKnee, kAnkle, colour);
  // The sole's lower side, not its axis, goes through the ground points
  const Vector3d lift(0.0, 0.0, paint.thick() * kSole);
  const Vector3d heel = pose.point(hip + 2, body.heel_m[s] + lift);
  const Vector3d toe = pose.point(hip + 2, body.toe_m[s] + lift);
  paint.limb(heel, toe, kSole, kSole, colour);
  paint.limb(at(hip + 2), heel, kAnkle, kSole, colour);
  paint.limb(at(hip + 2), heel + 0.6 * (toe - heel), kAnkle, kSole, colour);
  paint.limb(at(shoulder), at(shoulder + 1), kShoulder, kElbow, colour);
  paint.limb(at(shoulder + 1), at(shoulder + 2), kElbow, kWrist, colour);
  paint.limb(at(shoulder + 2), pose.point(shoulder + 2, body.hand_m[s]), kWrist, kFinger, colour);
}

}  // namespace

Colour paler(const Colour& c, double amount) {
  const auto mix = [&](int v) { return static_cast<int>(std::lround(v + amount * (255 - v))); };
  return {mix(c.red), mix(c.green), mix(c.blue)};
}

void add_body(FilmFrame& to, const mocap::Body& body, const mocap::BodyPose& pose,
              const FilmPaint& p) {
  using namespace mocap;
  Painter paint(to, p.thick * leg_length(body) / kUsualLeg);
  const auto at = [&](int joint) { return pose.p_WJ[static_cast<std::size_t>(joint)]; };
  const Colour trunk = paler(p.trunk, p.pale);
  paint.limb(at(kLeftHip), at(kRightHip), kTrunk, kTrunk, trunk);
  paint.limb(0.5 * (at(kLeftHip) + at(kRightHip)), at(kSpine), kTrunk, kWaist, trunk);
  paint.limb(at(kSpine), at(kChest), kWaist, kTrunk, trunk);
  paint.limb(at(kChest), at(kNeck), kTrunk, kThroat, trunk);
  paint.limb(at(kLeftShoulder), at(kRightShoulder), kShoulder, kShoulder, trunk);
  paint.limb(at(kChest), 0.5 * (at(kLeftShoulder) + at(kRightShoulder)), kTrunk, kTrunk, trunk);
  paint.limb(at(kNeck), at(kHead), kThroat, kThroat, trunk);
  paint_side(paint, body, pose, kLeft, paler(p.left, p.pale));
  paint_side(paint, body, pose, kRight, paler(p.right, p.pale));
  const Vector3d top = pose.point(kHead, body.head_top_m);
  const double radius = std::max(0.085 * paint.thick(), 0.5 * (top - at(kHead)).norm());
  const Vector3d up = pose.R_WJ[kHead] * body.head_top_m.normalized();
  to.limbs.push_back({top - radius * up, top - radius * up, radius, radius, paler(p.skin, p.pale)});
}

void add_dot(FilmFrame& to, const Vector3d& p_W, double radius_m, const Colour& colour) {
  to.limbs.push_back({p_W, p_W, radius_m, radius_m, colour});
}

}  // namespace mimesis::synthesizer
