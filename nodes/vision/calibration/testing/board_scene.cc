#include "nodes/vision/calibration/testing/board_scene.h"

#include <algorithm>
#include <cmath>

namespace mimesis::vision {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Vector2d bend(const std::array<double, 5>& k, const Vector2d& p) {
  const double r2 = p.squaredNorm();
  const double radial = 1.0 + k[0] * r2 + k[1] * r2 * r2 + k[4] * r2 * r2 * r2;
  return radial * p + Vector2d(2.0 * k[2] * p.x() * p.y() + k[3] * (r2 + 2.0 * p.x() * p.x()),
                               k[2] * (r2 + 2.0 * p.y() * p.y()) + 2.0 * k[3] * p.x() * p.y());
}

/// Direction of a pixel at depth 1, by repeated correction.
Vector2d unbend(const TrueCamera& c, double u, double v) {
  const Vector2d bent((u - c.cx) / c.fx, (v - c.cy) / c.fy);
  Vector2d p = bent;
  for (int i = 0; i < 12; ++i) p += 0.95 * (bent - bend(c.k, p));
  return p;
}

double between(std::mt19937& random, double lo, double hi) {
  return std::uniform_real_distribution<double>(lo, hi)(random);
}

Eigen::Matrix3d turn(double x, double y, double z) {
  return (Eigen::AngleAxisd(z, Vector3d::UnitZ()) * Eigen::AngleAxisd(y, Vector3d::UnitY()) *
          Eigen::AngleAxisd(x, Vector3d::UnitX()))
      .toRotationMatrix();
}

/// Reflectance at a point of the board's plane, in squares from the first inner corner.
double paint(const Board& board, double x, double y) {
  constexpr double kInk = 40.0, kPaper = 215.0, kDesk = 110.0, kBorder = 0.8;
  const bool printed = x > -1.0 && y > -1.0 && x < board.columns && y < board.rows;
  if (printed) {
    const int sum = static_cast<int>(std::floor(x)) + static_cast<int>(std::floor(y));
    return sum % 2 == 0 ? kInk : kPaper;
  }
  const bool paper = x > -1.0 - kBorder && y > -1.0 - kBorder && x < board.columns + kBorder &&
                     y < board.rows + kBorder;
  return paper ? kPaper : kDesk;
}

}  // namespace

Vector2d TrueCamera::pixel(const Vector3d& p_F) const {
  const Vector3d p = R_CF * (p_F - p_FC);
  const Vector2d bent = bend(k, p.head<2>() / p.z());
  return {cx + fx * bent.x(), cy + fy * bent.y()};
}

std::array<TrueCamera, 2> random_pair(std::mt19937& random) {
  std::array<TrueCamera, 2> pair;
  const double focal = between(random, 480.0, 850.0), k1 = between(random, -0.28, 0.06);
  for (TrueCamera& c : pair) {
    c.fx = focal * between(random, 0.98, 1.02);
    c.fy = c.fx * between(random, 0.992, 1.008);
    c.cx += between(random, -20.0, 20.0);
    c.cy += between(random, -20.0, 20.0);
    c.k = {k1 + between(random, -0.02, 0.02), between(random, 0.0, 0.12),
           between(random, -0.0015, 0.0015), between(random, -0.0015, 0.0015), 0.0};
  }
  pair[1].p_FC = {between(random, 0.06, 0.14), between(random, -0.008, 0.008),
                  between(random, -0.01, 0.01)};
  pair[1].R_CF =
      turn(between(random, -0.04, 0.04), between(random, 0.0, 0.14), between(random, -0.04, 0.04));
  return pair;
}

bool holds(const TrueCamera& camera, const Board& board, const Eigen::Isometry3d& X_FB) {
  for (const double x : {-2.0, board.columns + 1.0}) {
    for (const double y : {-2.0, board.rows + 1.0}) {
      const Vector3d p = X_FB * Vector3d(board.square_m * x, board.square_m * y, 0.0);
      if ((camera.R_CF * (p - camera.p_FC)).z() < 0.05) return false;
      const Vector2d at = camera.pixel(p);
      if (at.x() < 2 || at.y() < 2 || at.x() > camera.width - 3 || at.y() > camera.height - 3)
        return false;
    }
  }
  return true;
}

Eigen::Isometry3d random_place(const Board& board, const std::array<TrueCamera, 2>& pair,
                               std::mt19937& random) {
  const double width = board.square_m * (board.columns + 3);
  for (;;) {
    Eigen::Isometry3d X_FB = Eigen::Isometry3d::Identity();
    X_FB.linear() = turn(between(random, -0.75, 0.75), between(random, -0.75, 0.75),
                         between(random, -0.6, 0.6));
    const double z = pair[0].fx * width / (pair[0].width * between(random, 0.4, 0.85));
    const double u = between(random, 0.2, 0.8) * pair[0].width,
                 v = between(random, 0.2, 0.8) * pair[0].height;
    const Vector3d middle(z * (u - pair[0].cx) / pair[0].fx, z * (v - pair[0].cy) / pair[0].fy, z);
    X_FB.translation() = middle - X_FB.linear() * board.middle();
    if (holds(pair[0], board, X_FB) && holds(pair[1], board, X_FB)) return X_FB;
  }
}

image::Image board_picture(const TrueCamera& camera, const Board& board,
                           const Eigen::Isometry3d& X_FB, double noise, std::mt19937& random) {
  constexpr int kRays = 3;  // per pixel and direction
  // Directions at the corners of pixels; between them they are as good as linear.
  const int w = camera.width + 1;
  std::vector<Vector2d> corner(static_cast<std::size_t>(w * (camera.height + 1)));
  for (int v = 0; v <= camera.height; ++v) {
    for (int u = 0; u < w; ++u) {
      corner[static_cast<std::size_t>(v * w + u)] = unbend(camera, u - 0.5, v - 0.5);
    }
  }
  const Eigen::Isometry3d X_BF = X_FB.inverse();
  const Vector3d eye = X_BF * camera.p_FC / board.square_m;
  const Eigen::Matrix3d R_BC = X_BF.linear() * camera.R_CF.transpose();
  const double slope_u = between(random, -0.15, 0.15), slope_v = between(random, -0.15, 0.15);
  std::normal_distribution<double> grain(0.0, noise);
  image::Image out(camera.width, camera.height);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Vector2d* at = &corner[static_cast<std::size_t>(v * w + u)];
      double sum = 0.0;
      for (int i = 0; i < kRays * kRays; ++i) {
        const double a = (i % kRays + 0.5) / kRays, b = (i / kRays + 0.5) / kRays;
        const Vector2d p =
            (1.0 - b) * ((1.0 - a) * at[0] + a * at[1]) + b * ((1.0 - a) * at[w] + a * at[w + 1]);
        const Vector3d ray = R_BC * Vector3d(p.x(), p.y(), 1.0);
        const double far = -eye.z() / ray.z();
        sum += paint(board, eye.x() + far * ray.x(), eye.y() + far * ray.y());
      }
      const double light = 1.0 + slope_u * (u - 320) / 320.0 + slope_v * (v - 240) / 240.0;
      for (int c = 0; c < 3; ++c) {
        const double value = light * sum / (kRays * kRays) + (noise > 0.0 ? grain(random) : 0.0);
        out.at(u, v)[c] = static_cast<std::uint8_t>(std::clamp(value + 0.5, 0.0, 255.0));
      }
    }
  }
  return out;
}

Corners true_corners(const TrueCamera& camera, const Board& board, const Eigen::Isometry3d& X_FB) {
  Corners out;
  for (std::size_t i = 0; i < board.size(); ++i) out.push_back(camera.pixel(X_FB * board.point(i)));
  return out;
}

}  // namespace mimesis::vision
