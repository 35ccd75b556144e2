#include "nodes/walker/pattern/support_polygon.h"

namespace mimesis::walker {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace

void support_polygon(const Footprint& a, const Footprint& b, const Eigen::Vector2d& half,
                     std::vector<HalfPlane>& sides) {
  std::array<Eigen::Vector2d, 8> corner;
  std::size_t n = 0;
  for (const Footprint* foot : {&a, &b})
    for (const Eigen::Vector2d& s : {Eigen::Vector2d(1, 1), Eigen::Vector2d(-1, 1),
                                     Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, -1)})
      corner[n++] = foot->p_W_m + rotation(foot->yaw_rad) * s.cwiseProduct(half);
  std::size_t start = 0;
  for (std::size_t i = 1; i < n; ++i)
    if (corner[i].x() < corner[start].x()) start = i;
  // wraps the corners counter-clockwise: the next one has all others on its left
  sides.clear();
  std::size_t from = start;
  do {
    std::size_t to = (from + 1) % n;
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector2d best = corner[to] - corner[from], other = corner[i] - corner[from];
      const double turn = cross(best, other);
      if (turn < -1e-12 || (turn <= 1e-12 && other.squaredNorm() > best.squaredNorm())) to = i;
    }
    const Eigen::Vector2d edge = corner[to] - corner[from];
    const Eigen::Vector2d normal = Eigen::Vector2d(edge.y(), -edge.x()).normalized();
    sides.push_back({normal, normal.dot(corner[from])});
    from = to;
  } while (from != start && sides.size() < 8);
}

}  // namespace mimesis::walker
