#include "experiments/sight/truth/hand_world.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace mimesis::truth {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double rad(double degrees) { return degrees * std::numbers::pi / 180.0; }
constexpr std::size_t kNoisePool = 1u << 18;
constexpr int kWidth = 640, kHeight = 480;

cv::Scalar color(const Vector3f& bgr) { return {bgr[0], bgr[1], bgr[2]}; }

double normal(std::mt19937_64& random) {
  const double a = draw(random, 1e-12, 1.0), b = draw(random, 0.0, 2.0 * std::numbers::pi);
  return std::sqrt(-2.0 * std::log(a)) * std::cos(b);
}

}  // namespace

double HandWorld::Wave::at(double t_s) const {
  double sum = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    sum += amplitude[k] * std::sin(omega_1_s[k] * t_s + phase[k]);
  }
  return sum;
}

HandWorld::Wave HandWorld::wave(double slowest_hz, double fastest_hz) {
  Wave w{};
  double sum = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    w.amplitude[k] = draw(random_, 0.3, 1.0);
    w.omega_1_s[k] = 2.0 * std::numbers::pi * draw(random_, slowest_hz, fastest_hz);
    w.phase[k] = draw(random_, 0.0, 2.0 * std::numbers::pi);
    sum += w.amplitude[k];
  }
  for (double& a : w.amplitude) a /= sum;
  return w;
}

HandWorld::HandWorld(const HandWorldSetup& setup)
    : setup_(setup), random_(0x51ed27u + setup.seed * 7919u), anatomy_(Anatomy::drawn(random_)) {
  draw_cameras();
  draw_motion();
  draw_light();
  for (Camera& camera : cameras_) draw_background(camera, setup.seed);
  noise_.resize(kNoisePool);
  for (std::int8_t& n : noise_) {
    n = static_cast<std::int8_t>(std::clamp(setup.noise * normal(random_), -127.0, 127.0));
  }
}

void HandWorld::draw_cameras() {
  const double azimuth = rad(draw(random_, -25.0, 25.0)), height = rad(draw(random_, -5.0, 35.0));
  const double distance = draw(random_, 0.56, 0.66), focal = draw(random_, 500.0, 620.0);
  centre_T_ = {draw(random_, -0.2, 0.2), draw(random_, 0.1, 0.3), draw(random_, -0.1, 0.1)};
  const Vector3d back(std::sin(azimuth) * std::cos(height), std::sin(height),
                      std::cos(azimuth) * std::cos(height));
  const Vector3d eye = centre_T_ + distance * back;
  const Vector3d aim =
      centre_T_ + Vector3d(draw(random_, -0.02, 0.02), draw(random_, -0.02, 0.02), 0.0);
  const double turn = draw(random_, 0.0, 1.0);  // 0: parallel, 1: both look at the hand
  const Vector3d right = (aim - eye).cross(Vector3d::UnitY()).normalized();
  for (int k = 0; k < setup_.cameras; ++k) {
    const Vector3d at = eye + k * setup_.baseline_m * right;
    const Vector3d target = aim + k * (1.0 - turn) * setup_.baseline_m * right;
    const double f = focal * (1.0 + 0.02 * k);
    views_.push_back(
        {{at.x(), at.y(), at.z()}, {target.x(), target.y(), target.z()}, f, kWidth, kHeight});
    // A calibrated camera that keeps its picture upright.
    Camera camera{};
    const Vector3d z = (target - at).normalized();
    const Vector3d x = z.cross(Vector3d(0.0, 1.0, 0.0)).normalized();
    camera.R_CT << x.transpose(), z.cross(x).transpose(), z.transpose();
    camera.eye_T = at;
    camera.focal_px = f;
    camera.cu = (kWidth - 1) / 2.0;
    camera.cv = (kHeight - 1) / 2.0;
    cameras_.push_back(std::move(camera));
  }
}

void HandWorld::draw_motion() {
  const bool palm_seen = (random_() & 1) != 0;
  const double roll = draw(random_, -rad(80.0), rad(80.0)) + ((random_() & 1) ? rad(180.0) : 0.0);
  const Vector3d x(std::cos(roll), std::sin(roll), 0.0), z(0.0, 0.0, palm_seen ? -1.0 : 1.0);
  Matrix3d base_CH;
  base_CH << x, z.cross(x), z;
  const double axis = draw(random_, 0.0, 2.0 * std::numbers::pi);
  const Matrix3d tilt =
      AngleAxisd(rad(draw(random_, 0.0, 30.0)), Vector3d(std::cos(axis), std::sin(axis), 0.0))
          .toRotationMatrix();
  base_TH_ = cameras_[0].R_CT.transpose() * tilt * base_CH;
  for (Wave& w : body_) w = wave(0.05, 0.35);
  reach_ = {draw(random_, 0.03, 0.08),      draw(random_, 0.03, 0.06),
            draw(random_, 0.03, 0.06),      rad(draw(random_, 18.0, 29.0)),
            rad(draw(random_, 15.0, 25.0)), rad(draw(random_, 20.0, 36.0))};
  for (Wave& w : fist_) w = wave(0.05, 0.4);
  for (Wave& w : own_) w = wave(0.1, 0.5);
  together_ = wave(0.05, 0.3);
  thumb_a_ = wave(0.1, 0.4);
  thumb_b_ = wave(0.1, 0.4);
  wrist_a_ = wave(0.05, 0.3);
  wrist_b_ = wave(0.05, 0.3);
}

void HandWorld::draw_light() {
  const auto in = [this](double least, double most) {
    return static_cast<float>(draw(random_, least, most));
  };
  const float red = in(180.0, 235.0);
  skin_bgr_ = {red * in(0.48, 0.62), red * in(0.64, 0.75), red};
  const float hue = in(0.0, 1.0);  // anything but the colours of skin
  cloth_bgr_ = {in(90.0, 190.0) * (0.6f + 0.4f * hue), in(60.0, 150.0), in(20.0, 80.0)};
  light_bgr_ = {in(0.94, 1.06), 1.0f, in(0.94, 1.06)};
  const double a = draw(random_, 0.0, 2.0 * std::numbers::pi), off = rad(draw(random_, 20.0, 60.0));
  const Vector3d to_light_C(std::sin(off) * std::cos(a), -std::abs(std::sin(off) * std::sin(a)),
                            -std::cos(off));
  to_light_T_ = cameras_[0].R_CT.transpose() * to_light_C;
  ambient_ = in(0.35, 0.55);
  shine_ = in(0.0, 0.18);
  blur_px_ = draw(random_, 0.5, 1.0);
}

/// Coloured discs and quadrangles at several distances behind the hand, far ones first. All cameras
/// draw the same things.
void HandWorld::draw_background(Camera& camera, std::uint64_t seed) const {
  std::mt19937_64 random(seed * 104729u + 17u);
  const auto in = [&random](double least, double most) { return draw(random, least, most); };
  camera.background = image::Image(kWidth, kHeight);
  cv::Mat view(kHeight, kWidth, CV_8UC3, camera.background.bgr.data());
  const double grey = in(90.0, 190.0);
  const Vector3d tint(in(0.9, 1.1), 1.0, in(0.9, 1.1));
  for (int v = 0; v < kHeight; ++v) {
    const double shade = grey * (0.85 + 0.3 * v / kHeight);
    view.row(v).setTo(cv::Scalar(shade * tint[0], shade, shade * tint[2]));
  }
  const Matrix3d R_TC = cameras_[0].R_CT.transpose();
  const int count = setup_.clutter + setup_.skin_patches;
  for (int k = 0; k < count; ++k) {
    const double depth = 1.5 - 0.6 * k / std::max(count, 1);
    const Vector3d middle =
        cameras_[0].eye_T + R_TC * (depth * Vector3d(in(-0.6, 0.6), in(-0.45, 0.45), 1.0));
    const double size = in(0.012, 0.06), angle = in(0.0, 3.0), flat = in(0.4, 1.0);
    Vector3f bgr(static_cast<float>(in(20, 235)), static_cast<float>(in(20, 235)),
                 static_cast<float>(in(20, 235)));
    const bool as_skin = k >= setup_.clutter;
    const float bright = static_cast<float>(in(0.55, 1.0)),
                shift = static_cast<float>(in(-0.06, 0.06));
    if (as_skin) {
      bgr = bright * skin_bgr_.cwiseProduct(light_bgr_);
      bgr[0] *= 1.0f + shift;
    } else if (bgr[2] > 1.15f * bgr[1] && bgr[1] > bgr[0]) {
      std::swap(bgr[0], bgr[2]);  // what looks like skin is asked for by skin_patches
    }
    std::vector<cv::Point> outline;
    const int corners = (k & 1) ? 4 : 24;
    for (int c = 0; c < corners; ++c) {
      const double t = angle + 2.0 * std::numbers::pi * c / corners;
      const Vector3d p_T =
          middle + R_TC * Vector3d(size * std::cos(t), size * flat * std::sin(t), 0.0);
      const Vector3d p = camera.R_CT * (p_T - camera.eye_T);
      outline.emplace_back(
          static_cast<int>(std::lround(camera.cu + camera.focal_px * p.x() / p.z())),
          static_cast<int>(std::lround(camera.cv + camera.focal_px * p.y() / p.z())));
    }
    cv::fillConvexPoly(view, outline, color(bgr), cv::LINE_AA);
  }
}

HandTruth HandWorld::truth(int frame) const {
  const double t = frame * kFrame_s;
  HandTruth hand;
  const auto body = [&](std::size_t k) { return reach_[k] * body_[k].at(t); };
  hand.palm_T = centre_T_ + cameras_[0].R_CT.transpose() * Vector3d(body(0), body(1), body(2));
  hand.R_TH =
      base_TH_ * (AngleAxisd(body(3), Vector3d::UnitX()) * AngleAxisd(body(4), Vector3d::UnitY()) *
                  AngleAxisd(body(5), Vector3d::UnitZ()))
                     .toRotationMatrix();
  const double common = 0.45 + 0.6 * together_.at(t);
  for (std::size_t i = 0; i < 4; ++i) {
    const double alone = 0.42 + 0.6 * fist_[i].at(t);
    const double close =
        std::clamp(setup_.grasping ? 0.55 * common + 0.45 * alone : alone, 0.0, 1.0);
    auto& q = hand.gesture.fingers[i];
    q[0] = rad(9.0) * own_[3 * i].at(t) * (1.0 - 0.6 * close);
    q[1] = rad(-4.0 + 66.0 * close + 9.0 * own_[3 * i + 1].at(t));
    q[2] = rad(std::max(2.0, 6.0 + 80.0 * close + 12.0 * own_[3 * i + 2].at(t)));
    q[3] = rad(2.0 + 48.0 * close) + 0.2 * rad(12.0) * own_[3 * i + 2].at(t);
  }
  const double press = std::clamp(0.5 + 0.7 * thumb_a_.at(t), 0.0, 1.0);
  hand.gesture.thumb = {rad(8.0 + 38.0 * press), rad(14.0 + 20.0 * thumb_b_.at(t)),
                        rad(8.0 + 30.0 * press), rad(8.0 + 40.0 * press)};
  hand.gesture.wrist = {rad(25.0) * wrist_a_.at(t), rad(14.0) * wrist_b_.at(t)};
  Mesh mesh;
  build_hand(anatomy_, hand.gesture, mesh);
  for (std::size_t i = 0; i < 5; ++i) {
    hand.tips_T[i] = hand.palm_T + hand.R_TH * mesh.tips[i];
  }
  return hand;
}

void HandWorld::draw_mesh(const Camera& camera, const HandTruth& hand, image::Image& out) {
  nearest_.assign(static_cast<std::size_t>(kWidth) * kHeight, 0.0f);
  const Eigen::Matrix3f R = (camera.R_CT * hand.R_TH).cast<float>();
  const Vector3f t = (camera.R_CT * (hand.palm_T - camera.eye_T)).cast<float>();
  const Vector3f light = (camera.R_CT * to_light_T_).cast<float>();
  struct Corner {
    float u, v, w;  // w = 1 / depth
    Vector3f bgr;
  };
  std::vector<Corner> corners;
  corners.reserve(mesh_.vertices.size());
  for (const Vertex& vertex : mesh_.vertices) {
    const Vector3f p = R * vertex.at + t;
    const Vector3f n = R * vertex.normal;
    const float w = 1.0f / p.z();
    const float lit = std::max(0.0f, n.dot(light));
    const Vector3f mirror = 2.0f * lit * n - light;
    const float gloss = vertex.tone > 0.0f && lit > 0.0f
                            ? shine_ * std::pow(std::max(0.0f, -mirror.dot(p.normalized())), 12.0f)
                            : 0.0f;
    const Vector3f albedo = vertex.tone > 0.0f ? Vector3f(vertex.tone * skin_bgr_) : cloth_bgr_;
    Vector3f bgr =
        albedo * (ambient_ + (1.0f - ambient_) * lit) + Vector3f::Constant(255.0f * gloss);
    bgr = bgr.cwiseProduct(light_bgr_);
    const auto f = static_cast<float>(camera.focal_px);
    corners.push_back({static_cast<float>(camera.cu) + f * p.x() * w,
                       static_cast<float>(camera.cv) + f * p.y() * w, w, bgr});
  }
  for (const auto& [ia, ib, ic] : mesh_.triangles) {
    const Corner &a = corners[ia], &b = corners[ib], &c = corners[ic];
    if (a.w <= 0.0f || b.w <= 0.0f || c.w <= 0.0f) continue;
    const float area = (b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u);
    if (std::abs(area) < 1e-6f) continue;
    const int u0 = std::max(0, static_cast<int>(std::ceil(std::min({a.u, b.u, c.u})))),
              u1 = std::min(kWidth - 1, static_cast<int>(std::floor(std::max({a.u, b.u, c.u})))),
              v0 = std::max(0, static_cast<int>(std::ceil(std::min({a.v, b.v, c.v})))),
              v1 = std::min(kHeight - 1, static_cast<int>(std::floor(std::max({a.v, b.v, c.v}))));
    for (int v = v0; v <= v1; ++v) {
      for (int u = u0; u <= u1; ++u) {
        const auto x = static_cast<float>(u), y = static_cast<float>(v);
        const float kb = ((x - a.u) * (c.v - a.v) - (y - a.v) * (c.u - a.u)) / area;
        const float kc = ((b.u - a.u) * (y - a.v) - (b.v - a.v) * (x - a.u)) / area;
        const float ka = 1.0f - kb - kc;
        if (ka < 0.0f || kb < 0.0f || kc < 0.0f) continue;
        const float w = ka * a.w + kb * b.w + kc * c.w;
        float& near = nearest_[static_cast<std::size_t>(v) * kWidth + static_cast<std::size_t>(u)];
        if (w <= near) continue;
        near = w;
        const Vector3f bgr = ka * a.bgr + kb * b.bgr + kc * c.bgr;
        std::uint8_t* pixel = out.at(u, v);
        for (int k = 0; k < 3; ++k) {
          pixel[k] = static_cast<std::uint8_t>(std::clamp(bgr[k], 0.0f, 255.0f));
        }
      }
    }
  }
}

/// A grey-green board between camera and hand, larger than the hand.
void HandWorld::draw_board(const Camera& camera, const HandTruth& hand, image::Image& out) const {
  const Vector3d p = camera.R_CT * (hand.palm_T - camera.eye_T);
  const double scale = camera.focal_px / (0.8 * p.z());
  const cv::Point middle(static_cast<int>(camera.cu + camera.focal_px * p.x() / p.z()),
                         static_cast<int>(camera.cv + camera.focal_px * p.y() / p.z()));
  const cv::Point half(static_cast<int>(0.16 * scale), static_cast<int>(0.16 * scale));
  cv::Mat view(kHeight, kWidth, CV_8UC3, out.bgr.data());
  cv::rectangle(view, middle - half, middle + half, cv::Scalar(96, 128, 92), cv::FILLED);
}

void HandWorld::add_faults(int frame, int camera, image::Image& out) const {
  cv::Mat view(kHeight, kWidth, CV_8UC3, out.bgr.data());
  if (setup_.light_changes >= 0 && frame >= setup_.light_changes) {
    cv::multiply(view, cv::Scalar(0.6 / 1.3, 0.6, 0.6 * 1.3), view);
  }
  cv::GaussianBlur(view, view, cv::Size(), blur_px_);
  if (setup_.noise <= 0.0) return;
  std::mt19937_64 random(setup_.seed * 7577u + static_cast<std::uint64_t>(2 * frame + camera));
  constexpr std::size_t kRow = 3 * kWidth;
  for (int v = 0; v < kHeight; ++v) {
    const std::int8_t* noise = noise_.data() + random() % (kNoisePool - kRow);
    std::uint8_t* pixel = out.at(0, v);
    for (std::size_t i = 0; i < kRow; ++i) {
      pixel[i] = static_cast<std::uint8_t>(std::clamp(pixel[i] + noise[i], 0, 255));
    }
  }
}

void HandWorld::render(int frame, int camera, image::Image& out) {
  const HandTruth hand = truth(frame);
  const Camera& seen_by = cameras_.at(static_cast<std::size_t>(camera));
  out = seen_by.background;
  build_hand(anatomy_, hand.gesture, mesh_);
  draw_mesh(seen_by, hand, out);
  const auto& hidden = setup_.hidden;
  if (hidden && frame >= (*hidden)[0] && frame < (*hidden)[1]) draw_board(seen_by, hand, out);
  add_faults(frame, camera, out);
}

}  // namespace mimesis::truth
