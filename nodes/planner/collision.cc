#include "nodes/planner/collision.h"

#include <algorithm>
#include <cmath>

#include "nodes/planner/ball_gaps.h"

namespace mimesis::planner {
namespace {

/// Parts whose joints move less are not halved further: no ball moves by more than some hundredths
/// of a millimetre there, and an undecided part counts as touching [rad].
constexpr double kUndecided = 1e-5;

int group_of_last_frame(const kin::ArmModel& arm) {
  for (const auto& ball : arm.balls) {
    if (ball.frame == arm.dof()) return ball.group;
  }
  return arm.balls.empty() ? 0 : arm.balls.back().group;
}

}  // namespace

std::string in_mm(const Eigen::Vector3d& p) {
  const auto mm = [](double v) { return std::to_string(std::lround(v * 1e3)); };
  return "(" + mm(p.x()) + ", " + mm(p.y()) + ", " + mm(p.z()) + ") mm";
}

std::string in_words(const kin::Box& box) {
  return box.name.empty() ? "the box at " + in_mm(box.center) : "the " + box.name;
}

CollisionChecker::CollisionChecker(const kin::ArmModel& arm, const Obstacles& obstacles,
                                   double margin_m)
    : arm_(arm), obstacles_(obstacles), margin_(margin_m) {
  add_balls(true);
  of_the_arm_ = balls_.size();
  for (const auto& ball : obstacles_.held) {
    balls_.push_back({arm_.dof(), group_of_last_frame(arm_), arm_.X_LE * ball.center, ball.radius});
    names_.emplace_back("the held object");
  }
  against_all_ = balls_.size();
  add_balls(false);
  add_self_pairs();

  const std::size_t count = balls_.size();
  const auto n = static_cast<std::size_t>(arm_.dof());
  x_.resize(count);
  y_.resize(count);
  z_.resize(count);
  for (const auto& ball : balls_) reach_.push_back(ball.radius + margin_);
  no_motion_.assign(count, 0.0);
  bound_.assign(n + 1, std::vector<double>(count, 0.0));
  moved_by_.assign(n, std::vector<double>(count, 0.0));
  for (std::size_t joint = 0; joint < n; ++joint) {
    for (std::size_t i = 0; i < count; ++i) {
      moved_by_[joint][i] = static_cast<int>(joint) < balls_[i].frame ? 1.0 : 0.0;
    }
  }
  X_WF_.resize(n + 1);
  deviation_.resize(arm_.dof());
  middle_.resize(arm_.dof());
}

void CollisionChecker::add_balls(bool against_obstacles) {
  for (std::size_t i = 0; i < arm_.balls.size(); ++i) {
    const auto& ball = arm_.balls[i];
    const auto& groups = arm_.env_groups;
    if ((std::find(groups.begin(), groups.end(), ball.group) != groups.end()) != against_obstacles)
      continue;
    balls_.push_back(ball);
    names_.push_back("ball " + std::to_string(i) + " (" +
                     arm_.groups[static_cast<std::size_t>(ball.group)] + ")");
  }
}

void CollisionChecker::add_self_pairs() {
  for (const auto& [group_a, group_b] : arm_.self_pairs) {
    for (std::size_t a = 0; a < balls_.size(); ++a) {
      for (std::size_t b = 0; b < balls_.size(); ++b) {
        if (balls_[a].group != group_a || balls_[b].group != group_b) continue;
        self_pairs_.push_back({a, b, balls_[a].radius + balls_[b].radius + margin_});
      }
    }
  }
}

void CollisionChecker::place(const Eigen::Ref<const Eigen::VectorXd>& q) {
  ++postures_;
  kin::forward(arm_, q, X_WF_);
  for (std::size_t i = 0; i < balls_.size(); ++i) {
    const Eigen::Vector3d p = X_WF_[static_cast<std::size_t>(balls_[i].frame)] * balls_[i].center;
    x_[i] = p.x();
    y_[i] = p.y();
    z_[i] = p.z();
  }
}

void CollisionChecker::bound_motion() {
  const BallArrays all{x_.data(), y_.data(), z_.data(), reach_.data(), balls_.size()};
  for (std::size_t joint = moved_by_.size(); joint-- > 0;) {
    const Eigen::Isometry3d& X_WF = X_WF_[joint];  // joint j turns about z of frame j
    const Eigen::Vector3d origin = X_WF.translation(), axis = X_WF.linear().col(2);
    add_joint_motion(all, moved_by_[joint].data(), origin.data(), axis.data(),
                     deviation_[static_cast<Eigen::Index>(joint)], bound_[joint + 1].data(),
                     bound_[joint].data());
  }
}

double CollisionChecker::relative_bound(const SelfPair& pair) const {
  const auto frame_a = static_cast<std::size_t>(balls_[pair.a].frame);
  const auto frame_b = static_cast<std::size_t>(balls_[pair.b].frame);
  return bound_[frame_a][pair.b] + bound_[frame_b][pair.a];  // one of the two is 0
}

CollisionChecker::Verdict CollisionChecker::judge(bool with_bounds) const {
  bool within = false;
  const double* bound = with_bounds ? bound_[0].data() : no_motion_.data();
  const BallArrays all{x_.data(), y_.data(), z_.data(), reach_.data(), against_all_};
  const BallArrays of_the_arm{x_.data(), y_.data(), z_.data(), reach_.data(), of_the_arm_};
  const auto touches = [&within](const Gaps& gaps) {
    within |= gaps.within_bound;
    return gaps.touches;
  };
  for (const auto& box : obstacles_.boxes) {
    if (touches(box_gaps(all, bound, box))) return Verdict::touches;
  }
  for (const auto& box : obstacles_.supports) {
    if (touches(box_gaps(of_the_arm, bound, box))) return Verdict::touches;
  }
  for (const auto& ball : obstacles_.balls) {
    if (touches(ball_gaps(all, bound, ball))) return Verdict::touches;
  }
  for (const auto& pair : self_pairs_) {
    const double dx = x_[pair.a] - x_[pair.b], dy = y_[pair.a] - y_[pair.b],
                 dz = z_[pair.a] - z_[pair.b];
    const double squared = dx * dx + dy * dy + dz * dz;
    if (squared < pair.reach * pair.reach) return Verdict::touches;
    if (!with_bounds) continue;
    const double far = pair.reach + relative_bound(pair);
    within |= squared < far * far;
  }
  return with_bounds && !within ? Verdict::certified : Verdict::free;
}

bool CollisionChecker::free(const Eigen::Ref<const Eigen::VectorXd>& q) {
  place(q);
  return judge(false) != Verdict::touches;
}

std::optional<std::string> CollisionChecker::contact(const Eigen::Ref<const Eigen::VectorXd>& q) {
  place(q);
  const auto center = [&](std::size_t i) { return Eigen::Vector3d(x_[i], y_[i], z_[i]); };
  for (std::size_t i = 0; i < against_all_; ++i) {
    const BallArrays one{&x_[i], &y_[i], &z_[i], &reach_[i], 1};
    const auto box_text = [&](const kin::Box& box) {
      return names_[i] + " touches " + in_words(box);
    };
    for (const auto& ball : obstacles_.balls) {
      if (ball_gaps(one, no_motion_.data(), ball).touches) {
        return names_[i] + " touches the obstacle ball at " + in_mm(ball.center);
      }
    }
    for (const auto& box : obstacles_.boxes) {
      if (box_gaps(one, no_motion_.data(), box).touches) return box_text(box);
    }
    for (const auto& box : obstacles_.supports) {
      if (i < of_the_arm_ && box_gaps(one, no_motion_.data(), box).touches) return box_text(box);
    }
  }
  for (const auto& pair : self_pairs_) {
    if ((center(pair.a) - center(pair.b)).squaredNorm() < pair.reach * pair.reach) {
      return names_[pair.a] + " touches " + names_[pair.b];
    }
  }
  return std::nullopt;
}

bool CollisionChecker::certify(const Eigen::Ref<const Eigen::VectorXd>& a,
                               const Eigen::Ref<const Eigen::VectorXd>& b) {
  from_ = a;
  along_ = b - a;
  return certify_part(0.5, 0.5);
}

bool CollisionChecker::certify_part(double center, double half_width) {
  middle_ = from_ + center * along_;
  deviation_ = half_width * along_.cwiseAbs();
  const bool last = deviation_.maxCoeff() < kUndecided;
  place(middle_);
  bound_motion();
  const Verdict verdict = judge(true);
  if (verdict == Verdict::certified) return true;
  if (verdict == Verdict::touches || last) return false;
  const double quarter = 0.5 * half_width;
  return certify_part(center - quarter, quarter) && certify_part(center + quarter, quarter);
}

bool CollisionChecker::certify_curve(const Eigen::MatrixXd& control_points) {
  return certify_part(control_points);
}

bool CollisionChecker::certify_part(const Eigen::MatrixXd& control_points) {
  // De Casteljau at 1/2. The curve stays in the hull of its control points, hence within
  // `deviation_`.
  const Eigen::Index m = control_points.cols();
  Eigen::MatrixXd left(control_points.rows(), m), right = control_points;
  left.col(0) = right.col(0);
  for (Eigen::Index level = 1; level < m; ++level) {
    for (Eigen::Index i = 0; i < m - level; ++i)
      right.col(i) = 0.5 * (right.col(i) + right.col(i + 1));
    left.col(level) = right.col(0);
  }
  middle_ = right.col(0);
  deviation_ = (control_points.colwise() - middle_).cwiseAbs().rowwise().maxCoeff();
  const bool last = deviation_.maxCoeff() < kUndecided;
  place(middle_);
  bound_motion();
  const Verdict verdict = judge(true);
  if (verdict == Verdict::certified) return true;
  if (verdict == Verdict::touches || last) return false;
  return certify_part(left) && certify_part(right);
}

}  // namespace mimesis::planner
