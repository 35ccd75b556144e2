#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

/// Families of postures that `plan verify` judges: each has ranges that can be halved. at() is the
/// posture in the middle of a region, moves() how far the joints leave it there.
namespace mimesis::tool::families {

using Eigen::Index;
using Eigen::VectorXd;

struct Range {
  double lo = 0.0, hi = 0.0;
  double middle() const { return 0.5 * (lo + hi); }
  double half() const { return 0.5 * (hi - lo); }
};
using Region = std::array<Range, 3>;
/// How far half of each range moves the joints at most, n × 3 [rad].
using Moves = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// The streamed motion from one instant to the next; range 0: the part of the period.
struct Piece {
  std::array<VectorXd, 4> p;  // Bézier
  Piece(const VectorXd& q0, const VectorXd& v0, const VectorXd& q1, const VectorXd& v1, double h)
      : p{q0, q0 + h / 3.0 * v0, q1 - h / 3.0 * v1, q1} {}

  Region whole() const { return {Range{0.0, 1.0}, Range{}, Range{}}; }
  VectorXd at(double t) const {
    const double s = 1.0 - t;
    return s * s * s * p[0] + 3.0 * s * s * t * p[1] + 3.0 * s * t * t * p[2] + t * t * t * p[3];
  }
  VectorXd at(const Region& r) const { return at(r[0].middle()); }
  Moves moves(const Region& r) const {
    Moves m = Moves::Zero(p[0].size(), 3);
    for (std::size_t k = 0; k < 3; ++k)
      m.col(0) = m.col(0).cwiseMax(3.0 * r[0].half() * (p[k + 1] - p[k]).cwiseAbs());
    return m;
  }
};

/// Stops by the drives; ranges: delay τ, time u since then, share s.
struct Ramps {
  VectorXd q, v, a;
  double delay_s;

  Region whole() const {
    return {Range{0.0, delay_s}, Range{0.0, v.cwiseAbs().cwiseQuotient(a).maxCoeff()},
            Range{0.0, 1.0}};
  }
  double ramp(Index j, double u) const {
    const double t = std::min(u, std::abs(v[j]) / a[j]);
    return std::copysign(std::abs(v[j]) * t - 0.5 * a[j] * t * t, v[j]);
  }
  VectorXd at(const Region& r) const {
    VectorXd out = q + r[0].middle() * v;
    for (Index j = 0; j < q.size(); ++j) out[j] += r[2].middle() * ramp(j, r[1].middle());
    return out;
  }
  Moves moves(const Region& r) const {
    Moves m(q.size(), 3);
    for (Index j = 0; j < q.size(); ++j) {
      const double left = std::max(0.0, std::abs(v[j]) - a[j] * r[1].lo);
      m.row(j) << std::abs(v[j]) * r[0].half(), r[2].hi * left * r[1].half(),
          std::abs(ramp(j, r[1].hi)) * r[2].half();
    }
    return m;
  }
};

/// Stops in which the drive of one joint fails alone; ranges: time u, share s, and where that joint
/// is between the ends of what it may reach.
struct Alone {
  Ramps ramps;
  VectorXd lo, hi;  // places of the last alone_s
  double alone_s;
  Index joint;  // kAll: each is somewhere there
  static constexpr Index kAll = -1;

  Region whole() const { return {ramps.whole()[1], ramps.whole()[2], Range{0.0, 1.0}}; }
  bool alone(Index j) const { return joint == kAll || j == joint; }
  double late(Index j, double u, double s) const {
    return ramps.q[j] + alone_s * ramps.v[j] + s * ramps.ramp(j, u);
  }
  VectorXd at(const Region& r) const {
    const double u = r[0].middle(), s = r[1].middle();
    VectorXd out = ramps.q;
    for (Index j = 0; j < out.size(); ++j) {
      out[j] += s * ramps.ramp(j, u);
      if (!alone(j)) continue;
      const double end = late(j, u, s), least = std::min(lo[j], end), most = std::max(hi[j], end);
      out[j] = least + r[2].middle() * (most - least);
    }
    return out;
  }
  Moves moves(const Region& r) const {
    Moves m = ramps.moves({Range{}, r[0], r[1]});
    m.col(0) = m.col(1);
    m.col(1) = m.col(2);
    m.col(2).setZero();
    for (Index j = 0; j < m.rows(); ++j) {
      if (!alone(j)) continue;
      const double one = late(j, r[0].lo, r[1].lo), other = late(j, r[0].hi, r[1].hi);
      m(j, 2) = r[2].half() * (std::max({hi[j], one, other}) - std::min({lo[j], one, other}));
    }
    return m;
  }
};

}  // namespace mimesis::tool::families
