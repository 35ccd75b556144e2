#include "nodes/vision/calibration/hand_eye.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "common/math/so3.h"

namespace mimesis::vision {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t kFewestPoses = 4, kEnoughPoses = 12;
constexpr double kBound = 0.02;  // largest 2 sigma: of the board's distance, and rad
constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kInfinite = std::numeric_limits<double>::infinity();
// Position and turn of X_camera, of X_board, then the board's size; all in m, rad, 1.
constexpr int kRigid = 12, kAll = 13;
using Step = Eigen::Vector<double, kAll>;
using Normal = Eigen::Matrix<double, kAll, kAll>;

/// A X_CB(i) = Y for every picture i, with A(i) = A_i X: A_i is X_WF, or X_FW if the arm carries
/// the board; X is X_camera, Y is X_board.
struct Solution {
  Isometry3d X = Isometry3d::Identity(), Y = Isometry3d::Identity();
  double size = 1.0;  ///< of the board, over the one that was said
};

/// Pictures with the poses of one reading.
struct Sample {
  const ArmShot* shot;
  Isometry3d A;
  BoardPose alone;  ///< X_CB, as the picture alone has it
  /// 6 rows that make errors of its corners one of the board's pose, in deviations of camera and
  /// arm; empty: corners count as they are.
  Eigen::MatrixXd weight{};
};
using Samples = std::vector<Sample>;

Solution stepped(const Solution& fit, const Step& by) {
  Solution out = fit;
  out.X.translation() += by.segment<3>(0);
  out.X.linear() = math::exp_so3(by.segment<3>(3)) * fit.X.linear();
  out.Y.translation() += by.segment<3>(6);
  out.Y.linear() = math::exp_so3(by.segment<3>(9)) * fit.Y.linear();
  out.size += by[12];
  return out;
}

/// A rotation that fits best to M = Σ a bᵀ, a = R b. [Kabsch 1976]
Matrix3d best_rotation(const Matrix3d& m) {
  const Eigen::JacobiSVD<Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vector3d signs = Vector3d::Ones();
  signs[2] = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

/// Where linear equations put X and Y. @param free_size also the board's size; else it is 1
Solution closed_form(const Samples& samples, bool free_size) {
  constexpr double kMostTurn = 170.0 * kDegree;  // nearer to a half turn its axis has no sign
  struct Motion {
    Isometry3d a, b;
  };
  std::vector<Motion> motions;
  Matrix3d m = Matrix3d::Zero();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (std::size_t j = i + 1; j < samples.size(); ++j) {
      const Motion each{samples[j].A.inverse() * samples[i].A,
                        samples[j].alone.X_FB * samples[i].alone.X_FB.inverse()};
      const Vector3d a = math::log_so3(each.a.linear()), b = math::log_so3(each.b.linear());
      motions.push_back(each);
      if (a.norm() < kMostTurn && b.norm() < kMostTurn) m += a * b.transpose();
    }
  }
  Solution out;
  out.X.linear() = best_rotation(m);
  // (R_a − 1) p_X − size R_X p_b = −p_a
  Eigen::Matrix4d h = Eigen::Matrix4d::Zero();
  Eigen::Vector4d g = Eigen::Vector4d::Zero();
  for (const Motion& each : motions) {
    Eigen::Matrix<double, 3, 4> row;
    row << each.a.linear() - Matrix3d::Identity(), -(out.X.linear() * each.b.translation());
    Vector3d right = -each.a.translation();
    if (!free_size) {
      right -= row.col(3);
      row.col(3).setZero();
    }
    h += row.transpose() * row;
    g += row.transpose() * right;
  }
  if (!free_size) h(3, 3) = g[3] = 1.0;
  const Eigen::Vector4d x = h.completeOrthogonalDecomposition().solve(g);
  out.X.translation() = x.head<3>();
  out.size = x[3];
  Matrix3d turns = Matrix3d::Zero();
  Vector3d places = Vector3d::Zero();
  for (const Sample& s : samples) {
    Isometry3d X_CB = s.alone.X_FB;
    X_CB.translation() *= out.size;
    const Isometry3d Y = s.A * out.X * X_CB;
    turns += Y.linear();
    places += Y.translation() / static_cast<double>(samples.size());
  }
  out.Y.linear() = best_rotation(turns);
  out.Y.translation() = places;
  return out;
}

/// One picture's corners: what is predicted less what is seen, and its derivatives.
struct Terms {
  Eigen::VectorXd r;
  Eigen::Matrix<double, Eigen::Dynamic, kAll> j;
};

using Six = Eigen::Matrix<double, 6, 6>;  // of a pose: shift, then turn

/// Deviations of corners [px], and of an arm's poses along and about each axis of F [m, rad].
struct Noise {
  double px = 0.0, arm_m = 0.0, arm_rad = 0.0;
};

/// How corners tell the board's pose in C: 6 rows, and its covariance per px² of noise.
struct BoardTold {
  Eigen::MatrixXd pose_of;
  Six covariance;
};

class Problem {
 public:
  Problem(const Board& board, const image::Lens& lens, OnArm on_arm)
      : board_(board), lens_(lens), on_arm_(on_arm) {}

  Isometry3d predicted(const Solution& fit, const Isometry3d& A) const {
    return (A * fit.X).inverse() * fit.Y;
  }

  /// Empty if a corner is not before the camera.
  Eigen::VectorXd residuals(const Solution& fit, const Isometry3d& A, const Corners* seen) const {
    return residuals(predicted(fit, A), fit.size, seen);
  }
  Eigen::VectorXd residuals(const Isometry3d& X_CB, double size, const Corners* seen) const {
    Eigen::VectorXd r(2 * static_cast<Eigen::Index>(board_.size()));
    for (std::size_t i = 0; i < board_.size(); ++i) {
      const Vector3d p = X_CB * (size * board_.point(i));
      if (!(p.z() > kNearest * p.norm())) return {};
      const Vector2d at = seen != nullptr ? (*seen)[i] : Vector2d::Zero();
      r.segment<2>(2 * static_cast<Eigen::Index>(i)) = lens_.project(p) - at;
    }
    return r;
  }

  Terms terms(const Solution& fit, const Isometry3d& A, const Corners* seen) const {
    constexpr double kTurn_rad = 1e-6;
    Terms out{residuals(fit, A, seen), {}};
    const double step_m = 1e-6 * predicted(fit, A).translation().norm();
    out.j.setZero(out.r.size(), kAll);
    for (int k = 0; k < kAll; ++k) {
      const double h = k % 6 < 3 && k < kRigid ? step_m : kTurn_rad;
      const Eigen::VectorXd up = residuals(stepped(fit, h * Step::Unit(k)), A, seen),
                            down = residuals(stepped(fit, -h * Step::Unit(k)), A, seen);
      if (up.size() == out.r.size() && down.size() == out.r.size())
        out.j.col(k) = (up - down) / (2.0 * h);
    }
    return out;
  }

  Terms weighted_terms(const Solution& fit, const Sample& s) const {
    Terms out = terms(fit, s.A, &s.shot->seen);
    if (s.weight.size() == 0) return out;
    return {s.weight * out.r, s.weight * out.j};
  }

  BoardTold told_by_corners(const Isometry3d& X_CB, double size) const {
    constexpr double kStep = 1e-6;
    Eigen::MatrixXd g(2 * static_cast<Eigen::Index>(board_.size()), 6);
    for (int k = 0; k < 6; ++k) {
      Isometry3d up = X_CB, down = X_CB;
      const Vector3d by = kStep * Vector3d::Unit(k % 3);
      if (k < 3) {
        up.translation() += by;
        down.translation() -= by;
      } else {
        up.linear() = math::exp_so3(by) * X_CB.linear();
        down.linear() = math::exp_so3(-by) * X_CB.linear();
      }
      g.col(k) = (residuals(up, size, nullptr) - residuals(down, size, nullptr)) / (2.0 * kStep);
    }
    const Six covariance = Six(g.transpose() * g).ldlt().solve(Six::Identity());
    return {covariance * g.transpose(), covariance};
  }

  /// What an arm's shift and turn about F's origin do to the board's pose in C.
  Six by_arm(const Solution& fit, const Isometry3d& A, const Isometry3d& X_CB) const {
    const Isometry3d X_CF = on_arm_ == OnArm::camera ? fit.X.inverse() : (A * fit.X).inverse();
    Six m = Six::Identity();
    m.topRightCorner<3, 3>() = -math::hat(X_CB.translation() - X_CF.translation());
    return m;
  }

  /// Sum of squares [px², or 1 by weights]; infinite if a corner is not before the camera.
  double cost(const Solution& fit, const Samples& samples, bool weighted) const {
    double sum = 0.0;
    for (const Sample& s : samples) {
      const Eigen::VectorXd r = residuals(fit, s.A, &s.shot->seen);
      if (r.size() == 0) return kInfinite;
      sum += weighted && s.weight.size() > 0 ? (s.weight * r).squaredNorm() : r.squaredNorm();
    }
    return sum;
  }
  double rms_px(double squares, std::size_t pictures) const {
    return std::sqrt(squares / static_cast<double>(board_.size() * pictures));
  }
  double rms_px(const Solution& fit, const Samples& samples) const {
    return rms_px(cost(fit, samples, false), samples.size());
  }

  /// Brings corners to where they are seen: Levenberg-Marquardt on the first `unknowns` of Step.
  Solution refined(Solution fit, const Samples& samples, int unknowns) const {
    constexpr int kMost = 60;
    double now = cost(fit, samples, true), damping = 1e-4;
    for (int i = 0; i < kMost && std::isfinite(now); ++i) {
      Normal h = Normal::Zero();
      Step g = Step::Zero();
      for (const Sample& s : samples) {
        const Terms t = weighted_terms(fit, s);
        h += t.j.transpose() * t.j;
        g += t.j.transpose() * t.r;
      }
      Eigen::MatrixXd damped = h.topLeftCorner(unknowns, unknowns);
      damped.diagonal() *= 1.0 + damping;
      Step step = Step::Zero();
      step.head(unknowns) = -damped.ldlt().solve(g.head(unknowns));
      const Solution next = stepped(fit, step);
      const double then =
          step.allFinite() && next.size > 0.0 ? cost(next, samples, true) : kInfinite;
      if (then < now) {
        const bool done = now - then < 1e-10 * now;
        fit = next;
        now = then;
        damping = std::max(1e-9, 0.2 * damping);
        if (done) break;
      } else {
        damping *= 10.0;
        if (damping > 1e8) break;
      }
    }
    return fit;
  }

  /// Whether pixels, u v u v ..., are all in the picture.
  bool in_picture(const Eigen::VectorXd& pixels) const {
    for (Eigen::Index i = 0; i < pixels.size(); i += 2) {
      const double u = pixels[i], v = pixels[i + 1];
      if (!(u > 0.0 && v > 0.0 && u < lens_.width_px - 1.0 && v < lens_.height_px - 1.0))
        return false;
    }
    return pixels.size() > 0;
  }
  const Board& board() const { return board_; }

 private:
  static constexpr double kNearest = 1e-3;  // cosine of the widest ray to the axis
  const Board& board_;
  const image::Lens& lens_;
  OnArm on_arm_;
};

/// Inverse of what pictures tell of the first `unknowns`; nothing if they leave some
/// combination open.
std::optional<Eigen::MatrixXd> inverse_of(const Normal& told, int unknowns) {
  constexpr double kOpen = 1e-10;  // of the scaled matrix's smallest direction
  const Eigen::MatrixXd h = told.topLeftCorner(unknowns, unknowns);
  const Eigen::VectorXd scale = h.diagonal().cwiseSqrt().cwiseInverse();
  if (!scale.allFinite()) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale.asDiagonal() * h *
                                                             scale.asDiagonal());
  if (!(eigen.eigenvalues()[0] > kOpen)) return std::nullopt;
  return scale.asDiagonal() * eigen.eigenvectors() *
         eigen.eigenvalues().cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose() *
         scale.asDiagonal();
}

Six covariance_of(const Noise& noise, const Six& corners, const Six& by_arm) {
  Eigen::Vector<double, 6> arm;
  arm << Vector3d::Constant(noise.arm_m), Vector3d::Constant(noise.arm_rad);
  return noise.px * noise.px * corners + by_arm * arm.cwiseAbs2().asDiagonal() * by_arm.transpose();
}

/// Rows that make errors of corners one of the pose with covariance 1.
Eigen::MatrixXd weight_of(const Problem& problem, const Solution& fit, const Isometry3d& A,
                          const Isometry3d& X_CB, const Noise& noise) {
  const BoardTold told = problem.told_by_corners(X_CB, fit.size);
  const Six s = covariance_of(noise, told.covariance, problem.by_arm(fit, A, X_CB));
  return Eigen::LLT<Six>(s).matrixL().solve(told.pose_of);
}

/// Deviations of camera and arm: of the camera by the pictures alone, of the arm by restricted
/// maximum likelihood (expectation-maximization on the poses' errors, linear about the fit).
Noise noise_of(const Problem& problem, const Solution& fit, const Samples& samples) {
  constexpr int kMost = 300;
  constexpr double kLeast_px = 0.01, kLeast = 1e-7, kSettled = 1e-3;
  struct Pose {
    Eigen::Vector<double, 6> d;
    Eigen::Matrix<double, 6, kRigid> b;
    Six corners, by_arm;
  };
  std::vector<Pose> poses;
  const auto corners = static_cast<double>(problem.board().size());
  const auto n = static_cast<double>(samples.size());
  Noise noise{0.0, 1e-3, 1e-3};
  for (const Sample& s : samples) {
    const Isometry3d& X_CB = s.alone.X_FB;
    const BoardTold told = problem.told_by_corners(X_CB, fit.size);
    const Terms t = problem.terms(fit, s.A, &s.shot->seen);
    poses.push_back({told.pose_of * t.r, told.pose_of * t.j.leftCols(kRigid), told.covariance,
                     problem.by_arm(fit, s.A, X_CB)});
    noise.px += s.alone.rms_px * s.alone.rms_px * corners / (2.0 * corners - 6.0) / n;
  }
  noise.px = std::max(kLeast_px, std::sqrt(noise.px));
  for (int i = 0; i < kMost; ++i) {
    Normal told = Normal::Zero();
    Eigen::Vector<double, kRigid> g = Eigen::Vector<double, kRigid>::Zero();
    std::vector<Six> w;
    for (const Pose& p : poses) {
      w.push_back(covariance_of(noise, p.corners, p.by_arm).ldlt().solve(Six::Identity()));
      told.topLeftCorner<kRigid, kRigid>() += p.b.transpose() * w.back() * p.b;
      g += p.b.transpose() * w.back() * p.d;
    }
    const auto inverse = inverse_of(told, kRigid);
    if (!inverse) break;
    Eigen::Vector<double, 6> arm = Eigen::Vector<double, 6>::Zero(), prior;
    prior << Vector3d::Constant(noise.arm_m * noise.arm_m),
        Vector3d::Constant(noise.arm_rad * noise.arm_rad);
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const Pose& p = poses[k];
      const Six gain = prior.asDiagonal() * p.by_arm.transpose() * w[k];
      const Eigen::Vector<double, 6> e = gain * (p.d - p.b * (*inverse * g));
      const Eigen::MatrixXd through = gain * p.b;
      const Six left = Six(prior.asDiagonal()) - gain * p.by_arm * prior.asDiagonal();
      arm +=
          e.cwiseAbs2() + left.diagonal() + (through * *inverse * through.transpose()).diagonal();
    }
    const Noise before = noise;
    noise.arm_m = std::max(kLeast, std::sqrt(arm.head<3>().sum() / (3.0 * n)));
    noise.arm_rad = std::max(kLeast, std::sqrt(arm.tail<3>().sum() / (3.0 * n)));
    const bool settled = std::abs(noise.arm_m / before.arm_m - 1.0) < kSettled &&
                         std::abs(noise.arm_rad / before.arm_rad - 1.0) < kSettled;
    if (settled) break;
  }
  return noise;
}

/// A fit with its deviations, and how each picture fits what the others say.
struct Judged {
  Step sigma = Step::Constant(kInfinite);
  std::vector<double> held_out_px;
  Normal told = Normal::Zero();
};

Judged judged(const Problem& problem, const Solution& fit, const Samples& samples, int unknowns) {
  Judged out;
  std::vector<Terms> terms;
  double cost = 0.0, rows = 0.0;
  for (const Sample& s : samples) {
    terms.push_back(problem.weighted_terms(fit, s));
    out.told += terms.back().j.transpose() * terms.back().j;
    cost += terms.back().r.squaredNorm();
    rows += static_cast<double>(terms.back().r.size());
  }
  const auto n = static_cast<double>(samples.size());
  const auto inverse = inverse_of(out.told, unknowns);
  if (inverse)
    out.sigma.head(unknowns) = (cost / (rows - unknowns) * inverse->diagonal()).cwiseSqrt();
  // Each picture left out: one Gauss-Newton step from the fit of all.
  std::vector<Eigen::VectorXd> steps;
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(unknowns);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Terms& t = terms[i];
    const auto rest = inverse_of(out.told - t.j.transpose() * t.j, unknowns);
    Eigen::VectorXd step = Eigen::VectorXd::Constant(unknowns, kInfinite);
    if (rest) step = *rest * (t.j.leftCols(unknowns).transpose() * t.r);
    const Terms corners = problem.terms(fit, samples[i].A, &samples[i].shot->seen);
    const double squares = rest ? (corners.r + corners.j.leftCols(unknowns) * step).squaredNorm()
                                : corners.r.squaredNorm();
    out.held_out_px.push_back(problem.rms_px(squares, 1));
    steps.push_back(step);
    mean += step / n;
  }
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(unknowns);
  for (const Eigen::VectorXd& step : steps) variance += (n - 1.0) / n * (step - mean).cwiseAbs2();
  for (int k = 0; k < unknowns; ++k) {
    const double other = std::isfinite(variance[k]) ? std::sqrt(variance[k]) : kInfinite;
    out.sigma[k] = std::max(out.sigma[k], other);
  }
  return out;
}

/// Words of an axis of the camera.
constexpr std::array<const char*, 3> kAxes{"the picture's horizontal", "the picture's vertical",
                                           "the line of sight"};

/// Why the motions that the pictures show do not bound the result; empty if they may.
std::string unbounded(const Board& board, const Samples& samples) {
  constexpr double kLeastTurn = 5.0 * kDegree, kLeastSecond = 3.0 * kDegree, kLeast_m = 5e-3;
  Matrix3d scatter = Matrix3d::Zero();
  double most = 0.0, way_m = 0.0, count = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (std::size_t j = i + 1; j < samples.size(); ++j, ++count) {
      const Vector3d b = math::log_so3(
          Matrix3d(samples[j].alone.X_FB.linear() * samples[i].alone.X_FB.linear().transpose()));
      scatter += b * b.transpose();
      most = std::max(most, b.norm());
      way_m = std::max(
          way_m,
          (samples[j].alone.X_FB * board.middle() - samples[i].alone.X_FB * board.middle()).norm());
    }
  }
  if (most < kLeastTurn && way_m < kLeast_m)
    return "all pictures show the board at one place: move the arm between them, and turn it by "
           "30° or more about two axes";
  if (most < kLeastTurn) {
    return fmt::format(
        "the camera turns against the board by {:.1f}° at most: shifts alone tell nothing of where "
        "the camera is; turn the arm by 30° or more about two axes",
        most / kDegree);
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(scatter / count);
  const double second = std::sqrt(std::max(0.0, eigen.eigenvalues()[1]));
  if (second >= kLeastSecond) return {};
  const Vector3d axis = eigen.eigenvectors().col(2);
  Eigen::Index along = 0, across = 0;
  axis.cwiseAbs().maxCoeff(&along);
  axis.cwiseAbs().minCoeff(&across);
  return fmt::format(
      "all turns are about one axis, near {} (the second has {:.1f}° rms, expected {:.0f}° or "
      "more): the place along it is not bounded; add poses in which the board is turned by 30° or "
      "more about {}",
      kAxes.at(static_cast<std::size_t>(along)), second / kDegree, kLeastSecond / kDegree,
      kAxes.at(static_cast<std::size_t>(across)));
}

/// Which further view would narrow X_camera most.
std::string best_pose(const Problem& problem, const Solution& fit, const Normal& told,
                      const Noise& noise, double distance_m) {
  constexpr double kTurn = 35.0;
  std::string best;
  double least = kInfinite;
  for (int k = 0; k < 8; ++k) {
    Isometry3d X_CB = Isometry3d::Identity();  // the board's middle in the middle of the picture
    const bool nearer = k >= 6;
    const double sign = k % 2 == 0 ? 1.0 : -1.0;
    if (!nearer) X_CB.linear() = math::exp_so3(sign * kTurn * kDegree * Vector3d::Unit(k / 2));
    const double away = nearer ? (k == 6 ? 0.67 : 1.5) * distance_m : distance_m;
    X_CB.translation() = Vector3d(0.0, 0.0, away) - X_CB.linear() * problem.board().middle();
    const Isometry3d A = fit.Y * X_CB.inverse() * fit.X.inverse();
    const Terms t = problem.terms(fit, A, nullptr);
    if (!problem.in_picture(t.r)) continue;
    const Eigen::MatrixXd j = weight_of(problem, fit, A, X_CB, noise) * t.j;
    const auto inverse = inverse_of(told + j.transpose() * j, kRigid);
    if (!inverse) continue;
    const double left = inverse->diagonal().head<3>().sum() / (distance_m * distance_m) +
                        inverse->diagonal().segment<3>(3).sum();
    if (left >= least) continue;
    least = left;
    best = nearer ? fmt::format("the board at {:.2g} m", away)
                  : fmt::format("the board turned by {:+.0f}° about {}", sign * kTurn,
                                kAxes.at(static_cast<std::size_t>(k / 2)));
  }
  return best.empty() ? "the board turned about two axes" : best;
}

/// A reading of the poses as it may be meant.
struct Guess {
  const PoseReading* reading;
  bool turned;  ///< F in W is W in F; or the other one is on the arm: the same equations
  int shift;    ///< row of the pose, less that of the picture
};

Samples samples_of(const Guess& guess, OnArm on_arm, const std::vector<ArmShot>& shots,
                   const std::vector<BoardPose>& alone) {
  Samples out;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const auto row = static_cast<std::ptrdiff_t>(shots[i].row) + guess.shift;
    if (row < 0 || row >= std::ssize(guess.reading->X_WF)) continue;
    const Isometry3d& X_WF = guess.reading->X_WF[static_cast<std::size_t>(row)];
    const bool inverse = (on_arm == OnArm::board) != guess.turned;
    out.push_back({&shots[i], inverse ? X_WF.inverse() : X_WF, alone[i], {}});
  }
  return out;
}

/// What a factor between the arm's lengths and the board's says.
std::string size_text(const Board& board, double size) {
  constexpr double kUnit = 0.1;
  const auto near = [size](double value) { return std::abs(size / value - 1.0) < kUnit; };
  if (near(1000.0)) return "the positions are in mm, not in m";
  if (near(0.001)) return "the positions are in m, not in mm";
  if (near(1.0 / 0.0254)) return "the positions are in inches, not in m";
  return fmt::format("the squares have {:.4g} mm, not {:.4g} mm", 1e3 * size * board.square_m,
                     1e3 * board.square_m);
}

/// The reading that fits five times better than the given one, in words; empty if none does.
std::string better_reading(const Problem& problem, OnArm on_arm, const std::vector<ArmShot>& shots,
                           const std::vector<BoardPose>& alone,
                           std::span<const PoseReading> readings, double given_px) {
  constexpr double kTimes = 5.0;
  struct Tried {
    Guess guess;
    double rms_px, size;
  };
  std::vector<Tried> tried;
  for (const PoseReading& reading : readings) {
    for (const bool turned : {false, true}) {
      for (const int shift : {0, 1, -1}) {
        const Guess guess{&reading, turned, shift};
        Samples samples = samples_of(guess, on_arm, shots, alone);
        if (samples.size() < kFewestPoses) continue;
        Solution fit = closed_form(samples, true);
        const double size = fit.size;
        if (!(size > 0.0)) continue;
        for (Sample& s : samples) s.A.translation() /= size;  // in units of the board
        fit.X.translation() /= size;
        fit.Y.translation() /= size;
        fit.size = 1.0;
        fit = problem.refined(fit, samples, kAll);
        const double rms = problem.rms_px(fit, samples);
        if (std::isfinite(rms)) tried.push_back({guess, rms, size * fit.size});
      }
    }
  }
  const auto best = std::ranges::min_element(tried, {}, &Tried::rms_px);
  if (best == tried.end() || kTimes * best->rms_px > given_px) return {};
  std::vector<std::string> words;
  if (!best->guess.reading->name.empty()) words.push_back(best->guess.reading->name);
  if (best->guess.turned) {
    words.push_back(fmt::format(
        "each pose is that of the base in the flange, the inverse of what is expected; or it is "
        "the {} that the arm carries",
        on_arm == OnArm::camera ? "board" : "camera"));
  }
  if (best->guess.shift != 0) {
    words.push_back(fmt::format("each pose belongs to the picture one row {} it",
                                best->guess.shift > 0 ? "before" : "behind"));
  }
  if (std::abs(best->size - 1.0) > kBound) words.push_back(size_text(problem.board(), best->size));
  if (words.empty()) return {};
  const std::string given = std::isfinite(given_px)
                                ? fmt::format("{:.3g} px (rms) as they are given", given_px)
                                : std::string("they do not fit at all as they are given");
  return fmt::format("poses and pictures fit to {:.3g} px if {}; {}", best->rms_px,
                     fmt::join(words, ", and if "), given);
}

/// How much the arm's turns differ from those that the pictures show, whatever X is [rad, rms].
double turn_error(const Samples& samples) {
  double squares = 0.0, count = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (std::size_t j = i + 1; j < samples.size(); ++j, ++count) {
      const auto turn = [](const Isometry3d& a, const Isometry3d& b) {
        return math::log_so3(Matrix3d(a.linear().transpose() * b.linear())).norm();
      };
      const double off = turn(samples[i].A, samples[j].A) -
                         turn(samples[i].alone.X_FB.inverse(), samples[j].alone.X_FB.inverse());
      squares += off * off;
    }
  }
  return std::sqrt(squares / count);
}

double middle_value(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

tl::expected<HandEye, Status> calibrate_hand_eye(const Board& board, const image::Lens& lens,
                                                 OnArm on_arm, std::vector<ArmShot> shots,
                                                 std::span<const PoseReading> readings) {
  // An arm's own errors stay below the first. The second is a picture that nobody predicts.
  constexpr double kSuspect_px = 2.0, kLeastWrong_px = 1.0, kTimesUsual = 6.0;
  constexpr double kSizeSigmas = 4.0, kMost_px = 20.0;
  MIMESIS_ASSERT(!readings.empty());
  const auto refuse = [](std::string why) { return tl::unexpected(Status{std::move(why)}); };
  const Problem problem(board, lens, on_arm);
  const image::Camera camera(lens, Matrix3d::Identity(), Vector3d::Zero());
  const std::size_t given = shots.size();
  HandEye out;
  for (;;) {
    if (shots.size() < kFewestPoses) {
      return refuse(
          fmt::format("{} of {} pictures are of use, expected {} or more, best {} and more",
                      shots.size(), given, kFewestPoses, kEnoughPoses));
    }
    std::vector<BoardPose> alone;
    double distance_m = 0.0;
    for (const ArmShot& shot : shots) {
      MIMESIS_ASSERT(shot.seen.size() == board.size() && shot.row < readings[0].X_WF.size());
      alone.push_back(locate_board(board, {&camera, 1}, {&shot.seen, 1}));
      distance_m += (alone.back().X_FB * board.middle()).norm() / static_cast<double>(shots.size());
    }
    Samples samples = samples_of({&readings[0], false, 0}, on_arm, shots, alone);
    if (std::string why = unbounded(board, samples); !why.empty()) return refuse(why);
    Solution fit = problem.refined(closed_form(samples, false), samples, kRigid);
    out.rms_px = problem.rms_px(fit, samples);
    const double given_px = out.rms_px;  // of corners alone
    if (!(given_px < kSuspect_px)) {
      std::string why = better_reading(problem, on_arm, shots, alone, readings, given_px);
      if (!why.empty()) return refuse(why);
    }
    Noise noise{kLeastWrong_px, 0.0, 0.0};
    for (int i = 0; std::isfinite(out.rms_px) && i < 3; ++i) {
      noise = noise_of(problem, fit, samples);
      for (Sample& s : samples) s.weight = weight_of(problem, fit, s.A, s.alone.X_FB, noise);
      fit = problem.refined(fit, samples, kRigid);
      out.rms_px = problem.rms_px(fit, samples);
    }
    const Judged known = judged(problem, fit, samples, kRigid);
    const auto worst = std::ranges::max_element(known.held_out_px);
    const double usual = middle_value(known.held_out_px);
    if (std::isfinite(out.rms_px) && *worst > std::max(kTimesUsual * usual, kLeastWrong_px)) {
      const auto at = worst - known.held_out_px.begin();
      out.rejected.push_back(
          {shots[static_cast<std::size_t>(at)].name,
           fmt::format("its corners are {:.2f} px (rms) from where the other poses put them, usual "
                       "are {:.2f} px: did the arm still move, or is it another picture's pose?",
                       *worst, usual)});
      shots.erase(shots.begin() + at);
      if (3 * out.rejected.size() > given) {
        return refuse(fmt::format(
            "poses and pictures contradict each other: {} of {} do not fit the rest, last '{}': {}",
            out.rejected.size(), given, out.rejected.back().name, out.rejected.back().reason));
      }
      continue;
    }
    if (!(given_px < kMost_px)) {
      return refuse(fmt::format(
          "poses and pictures contradict each other: {}, the arm's turns differ by {:.1f}° (rms) "
          "from those that the pictures show; no other reading of the poses fits better",
          std::isfinite(given_px) ? fmt::format("{:.0f} px (rms)", given_px)
                                  : std::string("the board would be behind the camera"),
          turn_error(samples) / kDegree));
    }
    const Solution sized = problem.refined(fit, samples, kAll);
    out.square_ratio = sized.size;
    out.square_ratio_sigma = judged(problem, sized, samples, kAll).sigma[kAll - 1];
    const double off = std::abs(out.square_ratio - 1.0);
    if (off > kBound && off > kSizeSigmas * out.square_ratio_sigma) {
      return refuse(fmt::format(
          "by the arm's motions {} (2 sigma {:.2g} mm): measure them, and give their size by "
          "--square-m; or the arm's lengths are not right",
          size_text(board, out.square_ratio), 2e3 * out.square_ratio_sigma * board.square_m));
    }
    out.X_camera = fit.X;
    out.X_board = fit.Y;
    out.position_sigma_m = known.sigma.segment<3>(0);
    out.rotation_sigma_rad = known.sigma.segment<3>(3);
    out.arm_sigma_m = noise.arm_m;
    out.arm_sigma_rad = noise.arm_rad;
    out.helps = best_pose(problem, fit, known.told, noise, distance_m);
    if (!(out.position_2sigma_m() <= kBound * distance_m && out.rotation_2sigma_rad() <= kBound)) {
      return refuse(fmt::format(
          "these motions do not bound where the camera is: 2 sigma {:.2g} m and {:.2g}°, expected "
          "at most {:.0f} % of the board's distance ({:.2g} m) and {:.1f}°; most helps a view of "
          "{}",
          out.position_2sigma_m(), out.rotation_2sigma_rad() / kDegree, 100.0 * kBound,
          kBound * distance_m, kBound / kDegree, out.helps));
    }
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const Sample& s = samples[i];
      const double squares = problem.residuals(fit, s.A, &s.shot->seen).squaredNorm();
      const Vector3d middle_C = s.alone.X_FB * board.middle();
      out.fits.push_back({s.shot->name, problem.rms_px(squares, 1), known.held_out_px[i],
                          middle_C.norm(),
                          (problem.predicted(fit, s.A) * board.middle() - middle_C).norm()});
    }
    return out;
  }
}

}  // namespace mimesis::vision
