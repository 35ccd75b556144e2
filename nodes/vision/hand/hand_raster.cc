#include "nodes/vision/hand/hand_raster.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "common/math/vector_clones.h"

namespace mimesis::vision {
namespace {

using Eigen::Vector3f;

constexpr int kLane = HandRaster::kBlock;
constexpr float kFar = 1e9f, kNear = 0.05f;  // [m]
using Window = HandRaster::Window;

/// A capsule in the picture [cells], and how its luma depends on the place.
struct Flat {
  float au, av, du, dv;          // axis: start and unit direction
  float length, per_length;      // per_length: 1 / length
  float radius, radius_slope;    // over the share of the length
  float radius_end;              // at its end
  float inverse, inverse_slope;  // 1 / radius, exact at both ends
  float reach;                   // largest distance from the axis that is drawn
  float depth, depth_slope;      // [m]
  float bulge, bulge_slope;      // radius [m]
  float luma, luma_across, luma_along, luma_bulge;
  Window window;
};

bool flatten(const Capsule& c, const RasterCamera& camera, const Shading& shading, int width,
             int height, Flat& out) {
  const Vector3f a = camera.R * c.a + camera.t;
  Vector3f b = camera.R * c.b + camera.t;
  if (a.z() < kNear || c.radius_a <= 0.0f) return false;
  if (b.z() < kNear) b = a + (a.z() - kNear) / (a.z() - b.z()) * (b - a);
  const float za = camera.scale(a), zb = camera.scale(b);
  const float ua = camera.cu + za * a.x(), va = camera.cv + za * a.y();
  const float ub = camera.cu + zb * b.x(), vb = camera.cv + zb * b.y();
  const float ra = za * c.radius_a, rb = zb * c.radius_b;
  const float u0 = std::min(ua - ra, ub - rb) - 0.5f, u1 = std::max(ua + ra, ub + rb) + 0.5f;
  const float v0 = std::min(va - ra, vb - rb) - 0.5f, v1 = std::max(va + ra, vb + rb) + 0.5f;
  const auto w = static_cast<float>(width), h = static_cast<float>(height);
  if (!(u1 > 0.0f && v1 > 0.0f && u0 < w && v0 < h)) return false;
  out.window = {static_cast<int>(std::max(u0, 0.0f)), static_cast<int>(std::min(u1, w - 1.0f)) + 1,
                static_cast<int>(std::ceil(std::max(v0, 0.0f))),
                static_cast<int>(std::min(v1, h - 1.0f)) + 1};
  const float du = ub - ua, dv = vb - va, length = std::sqrt(du * du + dv * dv);
  const bool end_on = length < 1e-3f;
  out.au = ua;
  out.av = va;
  out.du = end_on ? 1.0f : du / length;
  out.dv = end_on ? 0.0f : dv / length;
  out.length = length;
  out.per_length = end_on ? 0.0f : 1.0f / length;
  out.radius = ra;
  out.radius_slope = rb - ra;
  out.radius_end = rb;
  out.inverse = 1.0f / ra;
  out.inverse_slope = 1.0f / rb - out.inverse;
  out.reach = std::max(ra, rb) + 0.5f;
  out.depth = a.z();
  out.depth_slope = b.z() - a.z();
  out.bulge = c.radius_a;
  out.bulge_slope = c.radius_b - c.radius_a;
  // Normals of a cylinder: across the line of sight at its rim, and in its middle the one normal to
  // the axis that points to the camera.
  const Vector3f slope = camera.R * shading.slope;  // in this camera's frame
  const Vector3f axis = b - a, sight = 0.5f * (a + b);
  Vector3f front = axis * (sight.dot(axis) / std::max(axis.squaredNorm(), 1e-9f)) - sight;
  const float reach = front.norm();
  front = reach > 1e-6f ? Vector3f(front / reach) : Vector3f(-sight.normalized());
  out.luma = shading.bias;
  out.luma_across = -out.dv * slope.x() + out.du * slope.y();
  out.luma_along = out.du * slope.x() + out.dv * slope.y();
  out.luma_bulge = front.dot(slope);
  return true;
}

struct Buffers {
  float *covered, *expected, *depth;
};

// Vectors of the compiler: loops over these places are not vectorised reliably. Passed by reference
// only, since the calling convention for them depends on the instruction set.
using Lanes = float __attribute__((vector_size(4 * kLane), aligned(4)));
using Bits = std::int32_t __attribute__((vector_size(4 * kLane), aligned(4)));

constexpr Lanes kCount{0, 1, 2, 3, 4, 5, 6, 7};

inline void load(Lanes& to, const float* from) { std::memcpy(&to, from, sizeof to); }
inline void store(float* to, const Lanes& from) { std::memcpy(to, &from, sizeof from); }
inline void at_least(Lanes& x, float least) { x = x > least ? x : Lanes{} + least; }
inline void at_most(Lanes& x, float most) { x = x < most ? x : Lanes{} + most; }

/// √x for x >= 0 by two Newton steps on 1/√x, relative error below 5e-6.
inline void root(Lanes& x) {
  Bits bits;
  std::memcpy(&bits, &x, sizeof bits);
  bits = 0x5f3759df - (bits >> 1);
  Lanes y;
  std::memcpy(&y, &bits, sizeof y);
  const Lanes half = 0.5f * x;
  y = y * (1.5f - half * y * y);
  y = y * (1.5f - half * y * y);
  x = x * y;
}

/// Places of a block of cells relative to a capsule.
struct Places {
  Lanes share, across, along, rim2, cover;
};
inline void locate(const Flat& f, float du, float dv, Places& p) {
  const Lanes u = du + kCount;
  const Lanes s = u * f.du + dv * f.dv;
  p.share = s * f.per_length;
  at_least(p.share, 0.0f);
  at_most(p.share, 1.0f);
  const Lanes inverse = f.inverse + p.share * f.inverse_slope;
  p.across = (dv * f.du - u * f.dv) * inverse;
  p.along = (s - p.share * f.length) * inverse;
  p.rim2 = p.across * p.across + p.along * p.along;
  // Share of a cell within the rim: exact to first order at the edge, 0 and 1 beyond half a cell.
  p.cover = 0.5f + 0.5f * (f.radius + p.share * f.radius_slope) * (1.0f - p.rim2);
  at_least(p.cover, 0.0f);
  at_most(p.cover, 1.0f);
}

/// Columns of a row that a capsule may touch: those within reach of its axis, half open.
struct Span {
  int begin, end;
};
inline Span span_of(const Flat& f, int v) {
  const float slant = f.dv < 0.0f ? -f.dv : f.dv;
  if (slant < 0.05f) return {f.window.u0, f.window.u1};
  const float middle = f.au + (static_cast<float>(v) - f.av) * f.du / f.dv, half = f.reach / slant;
  const float left = middle - half, right = middle + half;
  const auto u0 = static_cast<float>(f.window.u0), u1 = static_cast<float>(f.window.u1);
  if (!(right > u0 && left < u1)) return {0, 0};
  return {left > u0 ? static_cast<int>(left) : f.window.u0,
          right < u1 ? static_cast<int>(right) + 1 : f.window.u1};
}

MIMESIS_VECTOR_CLONES
void draw_flat(const Flat& f, int stride, const Buffers& to) {
  for (int v = f.window.v0; v < f.window.v1; ++v) {
    const float dv = static_cast<float>(v) - f.av;
    const Span span = span_of(f, v);
    for (int u = span.begin; u < span.end; u += kLane) {
      const int at = v * stride + u;
      Places p;
      locate(f, static_cast<float>(u) - f.au, dv, p);
      Lanes bulge = 1.0f - p.rim2;
      at_least(bulge, 0.0f);
      root(bulge);
      const Lanes z =
          f.depth + p.share * f.depth_slope - (f.bulge + p.share * f.bulge_slope) * bulge;
      const Lanes luma =
          f.luma + p.across * f.luma_across + p.along * f.luma_along + bulge * f.luma_bulge;
      Lanes covered, expected, depth;
      load(covered, to.covered + at);
      load(expected, to.expected + at);
      load(depth, to.depth + at);
      const Lanes here = p.cover > 0.5f ? z : Lanes{} + kFar;
      store(to.expected + at, here < depth ? luma : expected);
      store(to.depth + at, here < depth ? here : depth);
      store(to.covered + at, p.cover > covered ? p.cover : covered);
    }
  }
}

MIMESIS_VECTOR_CLONES
float forearm_sum(const Flat& f, int stride, const float* ratio, const float* covered,
                  float* forearm) {
  Lanes sum{};
  for (int v = f.window.v0; v < f.window.v1; ++v) {
    const float dv = static_cast<float>(v) - f.av;
    const Span span = span_of(f, v);
    for (int u = span.begin; u < span.end; u += kLane) {
      const int at = v * stride + u;
      Places p;
      locate(f, static_cast<float>(u) - f.au, dv, p);
      Lanes hidden, before, r;
      load(hidden, covered + at);
      load(before, forearm + at);
      load(r, ratio + at);
      Lanes bare = 1.0f - p.along * f.radius_end;  // cut off straight where the sleeve begins
      at_least(bare, 0.0f);
      at_most(bare, 1.0f);
      Lanes more = p.cover * bare - hidden - before;
      at_least(more, 0.0f);
      store(forearm + at, before + more);
      sum += more * r;
    }
  }
  float total = 0.0f;
  for (int k = 0; k < kLane; ++k) total += sum[k];
  return total;
}

/// Luma evidence of a cell counts at most this much, either way [nat].
constexpr float kMostShading = 1.5f;

MIMESIS_VECTOR_CLONES
void sum_match(const Window& w, int stride, const HandRaster& drawn, const Evidence& evidence,
               const Shading& shading, float constant, Match& out) {
  Lanes area{}, hand{}, shade{};
  for (int v = w.v0; v < w.v1; ++v) {
    for (int u = w.u0; u < w.u1; u += kLane) {
      const auto at = static_cast<std::size_t>(v * stride + u);
      Lanes covered, expected, ratio, luma;
      load(covered, drawn.covered().data() + at);
      load(expected, drawn.expected().data() + at);
      load(ratio, evidence.ratio.data() + at);
      load(luma, evidence.luma.data() + at);
      const Lanes off = luma - expected, off_mean = luma - shading.mean;
      Lanes gain =
          constant - shading.weight * off * off + shading.weight_mean * off_mean * off_mean;
      at_least(gain, -kMostShading);
      at_most(gain, kMostShading);
      area += covered;
      hand += covered * ratio;
      shade += covered > 0.5f ? gain : Lanes{};
    }
  }
  for (int k = 0; k < kLane; ++k) {
    out.area += area[k];
    out.ratio += hand[k];
    out.shading += shade[k];
  }
}

}  // namespace

void Evidence::resize(int w, int h) {
  width = w;
  height = h;
  stride = HandRaster::stride(w);
  const auto n = static_cast<std::size_t>(stride) * static_cast<std::size_t>(h);
  ratio.assign(n, 0.0f);
  luma.assign(n, 0.0f);
}

HandRaster::HandRaster(int width, int height)
    : width_(width), height_(height), stride_(stride(width)) {
  const auto n = static_cast<std::size_t>(stride_) * static_cast<std::size_t>(height);
  for (auto* buffer : {&covered_, &expected_, &depth_, &forearm_}) buffer->assign(n, 0.0f);
  clear({0, width_, 0, height});
}

void HandRaster::clear(const Window& w) {
  for (int v = w.v0; v < w.v1; ++v) {
    // blocks reach beyond the window, into the padding
    const auto row = static_cast<std::ptrdiff_t>(v) * stride_;
    const int end = std::min(w.u1 + kLane, stride_);
    std::fill(covered_.begin() + row + w.u0, covered_.begin() + row + end, 0.0f);
    std::fill(forearm_.begin() + row + w.u0, forearm_.begin() + row + end, 0.0f);
    std::fill(depth_.begin() + row + w.u0, depth_.begin() + row + end, kFar);
  }
}

Match HandRaster::match(const HandCapsules& capsules, const RasterCamera& camera,
                        const Evidence& evidence, const Shading& shading) {
  clear(window_);
  std::array<Flat, kHandCapsules> flat;
  std::size_t count = 0;
  Window all{width_, 0, height_, 0};
  const auto extend = [&all](const Window& w) {
    all = {std::min(all.u0, w.u0), std::max(all.u1, w.u1), std::min(all.v0, w.v0),
           std::max(all.v1, w.v1)};
  };
  for (std::size_t k = 0; k + kForearmCapsules < kHandCapsules; ++k) {
    if (!flatten(capsules[k], camera, shading, width_, height_, flat[count])) continue;
    extend(flat[count++].window);
  }
  const Buffers to{covered_.data(), expected_.data(), depth_.data()};
  for (std::size_t k = 0; k < count; ++k) draw_flat(flat[k], stride_, to);
  Match out;
  if (count > 0) {
    const float constant = shading.weight > 0.0f && shading.weight_mean > 0.0f
                               ? 0.5f * std::log(shading.weight / shading.weight_mean)
                               : 0.0f;
    sum_match(all, stride_, *this, evidence, shading, constant, out);
  }
  for (std::size_t k = kHandCapsules - kForearmCapsules; k < kHandCapsules; ++k) {
    if (!flatten(capsules[k], camera, shading, width_, height_, flat[count])) continue;
    out.forearm +=
        forearm_sum(flat[count], stride_, evidence.ratio.data(), covered_.data(), forearm_.data());
    extend(flat[count].window);
  }
  window_ = all.u1 > all.u0 && all.v1 > all.v0 ? all : Window{0, 0, 0, 0};
  return out;
}

}  // namespace mimesis::vision
