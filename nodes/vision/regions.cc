#include "nodes/vision/regions.h"

#include <algorithm>
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

void RegionFinder::scan_row(const std::uint8_t* labels, int row, int width) {
  int u = 0;
  while (u < width) {
    while (u + 8 <= width) {  // 8 background pixels at a time: most of a picture
      std::uint64_t word = 0;
      std::memcpy(&word, labels + u, sizeof word);
      if (word != 0) break;
      u += 8;
    }
    while (u < width && labels[u] == 0) ++u;
    if (u >= width) return;
    const int begin = u;
    while (u < width && labels[u] == labels[begin]) ++u;
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

}  // namespace mimesis::vision
