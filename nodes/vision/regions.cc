#include "nodes/vision/regions.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace mimesis::vision {

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
  const Eigen::Vector3d& gain = light_.update(picture);
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
