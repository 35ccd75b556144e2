#include "nodes/vision/regions.h"

#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "common/error.h"

namespace mimesis::vision {

std::string_view name(Kind kind) {
  constexpr std::array<std::string_view, kKinds> kNames{"none", "hand",      "object",
                                                        "bar",  "goal_high", "goal_low"};
  return kNames[static_cast<std::size_t>(kind)];
}

Yuv to_yuv(double blue, double green, double red) {
  const double y = 0.299 * red + 0.587 * green + 0.114 * blue;
  return {y, 128.0 + 0.492 * (blue - y), 128.0 + 0.877 * (red - y)};
}

namespace {

Eigen::Vector3d bgr_of_yuyv(double y, double u, double v) {
  const double luma = 255.0 / 219.0 * (y - 16.0), blue = u - 128.0, red = v - 128.0;
  return Eigen::Vector3d(luma + 2.0172 * blue, luma - 0.3918 * blue - 0.8130 * red,
                         luma + 1.5960 * red)
      .cwiseMax(0.0)
      .cwiseMin(255.0);
}

/// Median of the bytes at first, first + step, ...
double median_byte(std::span<const std::uint8_t> bytes, std::size_t first, std::size_t step) {
  std::array<int, 256> histogram{};
  int count = 0;
  for (std::size_t i = first; i < bytes.size(); i += step, ++count) ++histogram[bytes[i]];
  int below = 0;
  std::size_t value = 0;
  while (value < 255 && 2 * (below + histogram[value]) < count) below += histogram[value++];
  // Within the bin, by its share: finer than one level.
  const double inside = histogram[value] > 0 ? (0.5 * count - below) / histogram[value] : 0.5;
  return static_cast<double>(value) - 0.5 + inside;
}

constexpr std::size_t kStride = 7;  // coprime to usual widths: samples spread over all columns

}  // namespace

Eigen::Vector3d bgr_at(const image::Image& image, int u, int v) {
  const std::uint8_t* p = image.at(u, v);
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

Eigen::Vector3d bgr_at(const YuyvImage& image, int u, int v) {
  const auto pixel = static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width) +
                     static_cast<std::size_t>(u);
  const std::uint8_t* pair = image.bytes.data() + 4 * (pixel / 2);
  return bgr_of_yuyv(pair[2 * (pixel % 2)], pair[1], pair[3]);
}

const ColorBox& ColorBoxes::of(Kind kind) const {
  switch (kind) {
    case Kind::hand:
      return hand;
    case Kind::object:
      return object;
    case Kind::bar:
      return bar;
    case Kind::goal_high:
      return goal_high;
    case Kind::goal_low:
      return goal_low;
    case Kind::none:
      break;
  }
  MIMESIS_ASSERT(!"none has no box");
  return hand;
}

ColorTable::ColorTable(const ColorBoxes& boxes) : boxes_(boxes) {
  set_gain(Eigen::Vector3d::Ones());
}

ColorTable::ColorTable(const ColorSpots& spots) : spots_(spots) {
  set_gain(Eigen::Vector3d::Ones());
}

double ColorSpot::distance2(const Yuv& c) const {
  if (c.y < y_min || c.y > y_max) return std::numeric_limits<double>::infinity();
  if (y == 0.0) {
    const Eigen::Vector2d off = Eigen::Vector2d(c.u, c.v) - mean;
    return off.dot(covariance.inverse() * off);
  }
  constexpr double kGrey = 128.0, kPure = 1.0 / 6.0, kHue = 1.0 / 20.0, kHalf = 0.5, kFaint = 6.0;
  const Eigen::Vector2d expected = c.y / y * (mean.array() - kGrey).matrix(),
                        chroma(c.u - kGrey, c.v - kGrey), off = chroma - expected;
  const bool faint = expected.norm() < kFaint;  // has no half that noise would leave alone
  if (!faint && chroma.dot(expected) < kHalf * expected.squaredNorm())
    return std::numeric_limits<double>::infinity();
  const Eigen::Vector2d across(-expected.y(), expected.x());
  const Eigen::Matrix2d wide = covariance + kPure * kPure * expected * expected.transpose() +
                               kHue * kHue * across * across.transpose();
  return off.dot(wide.inverse() * off);
}

Kind ColorTable::nearest(const Yuv& color) const {
  if (!spots_) {
    for (std::size_t k = 1; k < kKinds; ++k) {
      if (boxes_.of(static_cast<Kind>(k)).contains(color)) return static_cast<Kind>(k);
    }
    return Kind::none;
  }
  Kind nearest = Kind::none;
  double least = ColorSpots::kReach * ColorSpots::kReach;
  for (std::size_t k = 1; k < kKinds; ++k) {
    if (!spots_->of[k]) continue;
    const double distance2 = spots_->of[k]->distance2(color);
    if (distance2 > least) continue;
    least = distance2;
    nearest = static_cast<Kind>(k);
  }
  return nearest;
}

Kind ColorTable::classify(const Eigen::Vector3d& bgr) const {
  // A channel at its end hides how bright it is: in light brighter than the reference any value up
  // to 255 of the reference light may be behind it, and of what was taught a little more.
  constexpr double kBrighter = 0.95;
  constexpr int kSteps = 4;
  Kind kind = Kind::none;
  bool clipped = true;
  for (int step = 0; step <= kSteps && clipped && kind == Kind::none; ++step) {
    Eigen::Vector3d c = gain_.cwiseProduct(bgr);
    clipped = false;
    for (int i = 0; i < 3; ++i) {
      if (bgr[i] < kChannelEnd) continue;
      const double most =
          std::max(gain_[i] < kBrighter ? 255.0 : 0.0, spots_ ? kBehindEnd * c[i] : c[i]);
      c[i] += (most - c[i]) * step / kSteps;
      clipped = true;
    }
    kind = nearest(to_yuv(c[0], c[1], c[2]));
  }
  return kind;
}

void ColorTable::set_gain(const Eigen::Vector3d& gain_bgr) {
  gain_ = gain_bgr;
  for (unsigned i = 0; i < kCells; ++i) {
    cells_[i] = static_cast<std::uint8_t>(
        classify({8.0 * (i & 31) + 4.0, 8.0 * (i >> 5 & 31) + 4.0, 8.0 * (i >> 10) + 4.0}));
  }
  yuyv_cells_.reset();
}

void ColorTable::apply(const image::Image& image, std::vector<std::uint8_t>& labels) const {
  labels.resize(image.bgr.size() / 3);
  look_up_bgr(image.bgr.data(), labels.size(), cells_.data(), labels.data());
}

void ColorTable::apply(const YuyvImage& image, std::vector<std::uint8_t>& labels) {
  if (!yuyv_cells_) {
    std::vector<std::uint8_t> cells(kYuyvCells);
    for (unsigned i = 0; i < kYuyvCells; ++i) {
      const Eigen::Vector3d bgr =
          bgr_of_yuyv(16 * (i >> 12) + 8, 4 * (i & 63) + 2, 4 * (i >> 6 & 63) + 2);
      cells[i] = static_cast<std::uint8_t>(classify(bgr));
    }
    yuyv_cells_.emplace(std::move(cells));
  }
  labels.resize(image.bytes.size() / 2);
  look_up_yuyv(image.bytes.data(), labels.size(), *yuyv_cells_, labels.data());
}

Eigen::Vector3d median_bgr(const image::Image& image) {
  constexpr std::size_t kStep = 3 * kStride;
  return {median_byte(image.bgr, 0, kStep), median_byte(image.bgr, 1, kStep),
          median_byte(image.bgr, 2, kStep)};
}

Eigen::Vector3d median_bgr(const YuyvImage& image) {
  constexpr std::size_t kStep = 4 * kStride;
  return bgr_of_yuyv(median_byte(image.bytes, 0, kStep), median_byte(image.bytes, 1, kStep),
                     median_byte(image.bytes, 3, kStep));
}

const Eigen::Vector3d& LightMeter::update(const Eigen::Vector3d& median_bgr) {
  if (reference_.isZero()) return gain_;
  constexpr double kFollow = 0.2;  // share of a new frame: light changes slowly, the hand passes
  const Eigen::Vector3d median = median_bgr.cwiseMax(1.0);
  const Eigen::Vector3d seen = reference_.cwiseQuotient(median).cwiseMax(0.4).cwiseMin(2.5);
  gain_ = started_ ? Eigen::Vector3d(gain_ + kFollow * (seen - gain_)) : seen;
  started_ = true;
  return gain_;
}

void Moments::add(const Run& run) {
  const double n = run.end - run.begin, first = run.begin, last = run.end - 1, row = run.row;
  const double sum = 0.5 * n * (first + last);
  // Σ k² over first..last = n (first² + first·last + last²) / 3 + n (last - first) / 6
  const double squares =
      n * (first * first + first * last + last * last) / 3.0 + n * (last - first) / 6.0;
  area += n;
  u += sum;
  v += n * row;
  uu += squares;
  uv += sum * row;
  vv += n * row * row;
  left = std::min(left, run.begin);
  right = std::max(right, run.end - 1);
  top = std::min(top, run.row);
  bottom = std::max(bottom, run.row);
}

void Moments::add(const Moments& o) {
  area += o.area;
  u += o.u;
  v += o.v;
  uu += o.uu;
  uv += o.uv;
  vv += o.vv;
  left = std::min(left, o.left);
  right = std::max(right, o.right);
  top = std::min(top, o.top);
  bottom = std::max(bottom, o.bottom);
}

Axes axes(const Moments& m) {
  // A pixel is a unit square, not a point: 1/12 in both directions keeps thin blobs finite.
  const double cuu = m.uu / m.area - m.mean_u() * m.mean_u() + 1.0 / 12.0;
  const double cvv = m.vv / m.area - m.mean_v() * m.mean_v() + 1.0 / 12.0;
  const double cuv = m.uv / m.area - m.mean_u() * m.mean_v();
  const double middle = 0.5 * (cuu + cvv);
  const double spread = std::hypot(0.5 * (cuu - cvv), cuv);
  return {0.5 * std::atan2(2.0 * cuv, cuu - cvv),
          std::sqrt((middle + spread) / std::max(middle - spread, 1e-9))};
}

int RegionFinder::root(int i) {
  while (parent_[static_cast<std::size_t>(i)] != i) {
    int& p = parent_[static_cast<std::size_t>(i)];
    p = parent_[static_cast<std::size_t>(p)];  // halves the path
    i = p;
  }
  return i;
}

namespace {

/// First column from u on whose label is not `label`, eight at a time.
int end_of_run(const std::uint8_t* labels, int u, int width, std::uint8_t label) {
  constexpr std::uint64_t kEach = 0x0101010101010101;
  for (; u + 8 <= width; u += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, labels + u, sizeof word);
    word ^= kEach * label;
    if (word == 0) continue;
    if constexpr (std::endian::native != std::endian::little) break;
    return u + std::countr_zero(word) / 8;
  }
  while (u < width && labels[u] == label) ++u;
  return u;
}

}  // namespace

void RegionFinder::scan_row(const std::uint8_t* labels, int row, int width) {
  int u = 0;
  while (u < width) {
    u = end_of_run(labels, u, width, 0);
    if (u >= width) return;
    const int begin = u;
    u = end_of_run(labels, u, width, labels[begin]);
    const int index = static_cast<int>(runs_.size());
    runs_.push_back({row, begin, u, static_cast<Kind>(labels[begin]), index});
    parent_.push_back(index);
  }
}

/// Unites the newest row's runs with those of the row above that touch them, corners included.
void RegionFinder::join(std::size_t above_begin, std::size_t above_end) {
  std::size_t above = above_begin;
  for (std::size_t i = above_end; i < runs_.size(); ++i) {
    const Run& run = runs_[i];
    while (above < above_end && runs_[above].end < run.begin) ++above;
    for (std::size_t k = above; k < above_end && runs_[k].begin <= run.end; ++k) {
      if (runs_[k].kind != run.kind) continue;
      const int a = root(static_cast<int>(k)), b = root(static_cast<int>(i));
      // The smaller index wins, so that a region is named by its first run.
      parent_[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  }
}

void RegionFinder::find(std::span<const std::uint8_t> labels, int width, int height) {
  runs_.clear();
  parent_.clear();
  regions_.clear();
  std::size_t above = 0;
  for (int row = 0; row < height; ++row) {
    const std::size_t current = runs_.size();
    scan_row(labels.data() + static_cast<std::ptrdiff_t>(row) * width, row, width);
    join(above, current);
    above = current;
  }
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    Run& run = runs_[i];
    const int first = root(static_cast<int>(i));
    if (first == static_cast<int>(i)) {
      run.region = static_cast<int>(regions_.size());
      regions_.push_back({run.kind, {}});
    } else {
      run.region = runs_[static_cast<std::size_t>(first)].region;
    }
    regions_[static_cast<std::size_t>(run.region)].moments.add(run);
  }
}

template <class Picture>
void Segmentation::segment_any(const Picture& picture) {
  constexpr double kNoticeable = 0.02;  // change of gain worth a new table
  const Eigen::Vector3d& gain = light_.update(median_bgr(picture));
  if ((gain - table_.gain()).cwiseAbs().maxCoeff() > kNoticeable) table_.set_gain(gain);
  table_.apply(picture, labels_);
  if (open_) {
    opened_.resize(labels_.size());
    open_labels(labels_.data(), picture.width, picture.height, rows_, opened_.data());
    labels_.swap(opened_);
  }
  finder_.find(labels_, picture.width, picture.height);
}

template void Segmentation::segment_any(const image::Image&);
template void Segmentation::segment_any(const YuyvImage&);

}  // namespace mimesis::vision
