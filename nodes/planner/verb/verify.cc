#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nodes/planner/verb/tool_way.h"
#include "nodes/planner/verb/verify_scene.h"

namespace mimesis::tool {
namespace {

constexpr std::size_t kMostFindings = 20;
/// Largest distance between the planner's path and the curve through its samples [m].
constexpr double kSampling_m = 2e-5;
constexpr std::size_t kTogether = 16;     // instants
constexpr std::size_t kFewPostures = 64;  // to prove more than is asked
/// Factor on the arm's accelerations: at low speeds braking lasts few periods [1].
constexpr double kOfPeriods = 1.25;
constexpr double kRounding = 1e-9;

VectorXd vector(const std::vector<double>& v) {
  return VectorXd::Map(v.data(), static_cast<Index>(v.size()));
}

class Verifier {
 public:
  Verifier(const PlanFile& plan, const kin::ArmModel& arm) : plan_(plan), arm_(arm) {}

  PlanVerdict run() {
    plan_.check(arm_.dof());
    const PlanMotion* before = nullptr;
    for (const PlanMotion& motion : plan_.motions) {
      index_ = static_cast<std::size_t>(&motion - plan_.motions.data());
      if (before != nullptr &&
          before->instants.back().position_rad != motion.instants.front().position_rad)
        find(0, "does not begin where the motion before it ends");
      judge(motion);
      before = &motion;
    }
    return std::move(verdict_);
  }

 private:
  void find(std::size_t instant, const std::string& what) {
    if (verdict_.findings.size() == kMostFindings) {
      ++verdict_.left_out;
      return;
    }
    verdict_.findings.push_back(fmt::format("motion {} ({}), {:.3f} s: {}", index_,
                                            plan_.motions[index_].phase,
                                            static_cast<double>(instant) * plan_.period_s, what));
  }

  void judge(const PlanMotion& motion) {
    Scene scene(arm_, motion);
    const double h = plan_.period_s;
    const auto& instants = motion.instants;
    pieces_.clear();
    for (std::size_t k = 0; k + 1 < instants.size(); ++k) {
      pieces_.emplace_back(vector(instants[k].position_rad), vector(instants[k].velocity_rad_s),
                           vector(instants[k + 1].position_rad),
                           vector(instants[k + 1].velocity_rad_s), h);
    }
    check_jerk(motion);
    if (!motion.tool.empty()) check_tool(scene, motion);
    std::string why;
    for (std::size_t k = 0; k < instants.size(); ++k) {
      ++verdict_.instants;
      const VectorXd q = vector(instants[k].position_rad), v = vector(instants[k].velocity_rad_s);
      check_limits(k, q, v);
      if (k % kTogether == 0) expect(scene, motion, k);
      const bool end = k == 0 || k + 1 == instants.size();
      if (end && v.cwiseAbs().maxCoeff() > kRounding) find(k, "is not at rest at its end");
      if (k + 1 < instants.size()) {
        check_rates(k, q, v, instants[k + 1]);
        if (!scene.proves(pieces_[k], plan_.margin_m - kSampling_m, verdict_, verdict_.nearest_m,
                          why))
          find(k, why);
      }
      const Ramps ramps{q, v, arm_.a_max, plan_.stop_delay_s};
      if (!scene.proves(ramps, plan_.stop_margin_m - kSampling_m, verdict_, verdict_.nearest_stop_m,
                        why))
        find(k, "the stop by the drives: " + why);
      if (plan_.stop_alone_s > 0.0) check_alone(scene, motion, k, ramps);
      check_stop(k, v, instants[k].stop_s);
    }
  }

  /// The end effector moves at most Σⱼ Lⱼ δⱼ, Lⱼ the stretched length of the arm from axis j on.
  void check_tool(Scene& scene, const PlanMotion& motion) {
    constexpr double kSampling_rad = 2e-4;
    VectorXd lever(arm_.dof()), turns = VectorXd::Ones(arm_.dof());
    double reach = arm_.X_LE.translation().norm();
    for (Index j = arm_.dof(); j-- > 0;) {
      const kin::DhLink& link = arm_.links[static_cast<std::size_t>(j)];
      const double slide =
          link.slides ? std::max(std::abs(arm_.q_min[j]), std::abs(arm_.q_max[j])) : 0.0;
      const double longer = std::abs(link.a) + std::abs(link.d) + slide;
      lever[j] = link.slides ? 1.0 : reach + longer;
      if (link.slides) turns[j] = 0.0;
      reach += longer;
    }
    Vector3d from = scene.tool(pieces_.front().at(0.0)).translation();
    for (const PlanToolPiece& piece : motion.tool) {
      const Vector3d to = Vector3d::Map(piece.to_m.data());
      if (!piece.via_m.empty()) {
        const Vector3d via = Vector3d::Map(piece.via_m.data());
        if ((via - from).cross(to - from).norm() <= 1e-6 * (to - from).norm())
          return find(0, "the points of an arc of the tool's way are on a line");
      }
      from = to;
    }
    const ToolWay way(scene.tool(pieces_.front().at(0.0)), motion.tool);
    const auto end = scene.tool(pieces_.back().at(1.0)).translation();
    if ((end - Vector3d::Map(motion.tool.back().to_m.data())).norm() > motion.tool_off_m)
      find(pieces_.size(), "the tool does not end at the end of its way");
    for (std::size_t k = 0; k < pieces_.size(); ++k) {
      std::vector<Region> open{pieces_[k].whole()};
      while (!open.empty()) {
        const Region region = open.back();
        open.pop_back();
        const VectorXd delta = pieces_[k].moves(region).rowwise().sum();
        const Eigen::Isometry3d X_WE = scene.tool(pieces_[k].at(region));
        const double off = way.off_m(X_WE.translation()), turned = way.off_rad(X_WE.linear());
        const double over_m = off - motion.tool_off_m - kSampling_m,
                     over_rad = turned - motion.tool_off_rad - kSampling_rad;
        if (over_m + lever.dot(delta) <= 0.0 && over_rad + turns.dot(delta) <= 0.0) continue;
        if (over_m > 0.0 || over_rad > 0.0 || delta.maxCoeff() < kUndecided_rad) {
          find(k, fmt::format("the tool is {:.3f} mm and {:.4f} rad off its way, expected {:.3f} "
                              "and {:.4f}",
                              1e3 * off, turned, 1e3 * motion.tool_off_m, motion.tool_off_rad));
          return;
        }
        const Range all = region[0];
        open.push_back({Range{all.middle(), all.hi}, region[1], region[2]});
        open.push_back({Range{all.lo, all.middle()}, region[1], region[2]});
      }
    }
  }

  /// Where the arm may get to at some instants from `begin` on.
  void expect(Scene& scene, const PlanMotion& motion, std::size_t begin) const {
    VectorXd lo = vector(motion.instants[begin].position_rad), hi = lo;
    const double late_s = std::max(plan_.stop_delay_s, plan_.stop_alone_s);
    const auto before = static_cast<std::size_t>(std::ceil(plan_.stop_alone_s / plan_.period_s));
    const std::size_t end = std::min(begin + kTogether + 1, motion.instants.size());
    for (std::size_t k = begin - std::min(begin, before); k < end; ++k) {
      const VectorXd q = vector(motion.instants[k].position_rad),
                     v = vector(motion.instants[k].velocity_rad_s);
      const VectorXd stop =
          q + late_s * v + 0.5 * v.cwiseProduct(v.cwiseAbs()).cwiseQuotient(arm_.a_max);
      lo = lo.cwiseMin(q).cwiseMin(stop);
      hi = hi.cwiseMax(q).cwiseMax(stop);
    }
    scene.expect(lo, hi, std::max(plan_.margin_m, plan_.stop_margin_m));
  }

  /// Of each joint; first of all at once, which proves most instants.
  void check_alone(Scene& scene, const PlanMotion& motion, std::size_t k, const Ramps& ramps) {
    const double least = plan_.stop_margin_m - kSampling_m;
    const auto periods = static_cast<std::size_t>(std::ceil(plan_.stop_alone_s / plan_.period_s));
    Alone family{ramps, ramps.q, ramps.q, plan_.stop_alone_s, Alone::kAll};
    for (std::size_t i = k - std::min(k, periods); i < k; ++i) {
      const VectorXd q = vector(motion.instants[i].position_rad);
      family.lo = family.lo.cwiseMin(q);
      family.hi = family.hi.cwiseMax(q);
    }
    double nearest = 0.0;
    std::string why;
    if (scene.proves(family, least, verdict_, nearest, why, kFewPostures)) return;
    for (family.joint = 0; family.joint < ramps.q.size(); ++family.joint) {
      if (!scene.proves(family, least, verdict_, verdict_.nearest_stop_m, why))
        find(k, fmt::format("the stop by the drives, that of joint {} failing alone: {}",
                            family.joint, why));
    }
  }

  void check_limits(std::size_t k, const VectorXd& q, const VectorXd& v) {
    for (Index j = 0; j < q.size(); ++j) {
      const bool endless = arm_.links[static_cast<std::size_t>(j)].endless;
      if (!endless && (q[j] < arm_.q_min[j] - kRounding || q[j] > arm_.q_max[j] + kRounding))
        find(k, fmt::format("joint {} is at {:.4f} rad, expected {:.4f} .. {:.4f}", j, q[j],
                            arm_.q_min[j], arm_.q_max[j]));
      if (std::abs(v[j]) > arm_.v_max[j])
        find(k, fmt::format("joint {} turns at {:.4f} rad/s, expected {:.4f} at most", j, v[j],
                            arm_.v_max[j]));
    }
  }

  void check_rates(std::size_t k, const VectorXd& q, const VectorXd& v, const PlanInstant& next) {
    const double h = plan_.period_s;
    const VectorXd v1 = vector(next.velocity_rad_s), step = vector(next.position_rad) - q;
    for (Index j = 0; j < q.size(); ++j) {
      const double a = std::abs(v1[j] - v[j]) / h;
      if (a > arm_.a_max[j])
        find(k, fmt::format("joint {} accelerates by {:.3f} rad/s², expected {:.3f} at most", j, a,
                            arm_.a_max[j]));
      if (std::abs(step[j] - 0.5 * h * (v[j] + v1[j])) > 0.25 * h * h * arm_.a_max[j] + kRounding)
        find(k, fmt::format("the velocity of joint {} is not that of its positions", j));
    }
  }

  /// The jerk of each joint, by third differences; the arm rests before and behind the motion.
  void check_jerk(const PlanMotion& motion) {
    const auto count = static_cast<Index>(motion.instants.size());
    for (Index j = 0; j < arm_.j_max.size(); ++j) {
      const auto q = [&](Index k) {
        const auto at = static_cast<std::size_t>(std::clamp(k, Index{0}, count - 1));
        return motion.instants[at].position_rad[static_cast<std::size_t>(j)];
      };
      for (Index k = -2; k < count; ++k) {
        const double jerk = std::abs(q(k + 2) - 3.0 * q(k + 1) + 3.0 * q(k) - q(k - 1)) /
                            std::pow(plan_.period_s, 3);
        if (jerk <= arm_.j_max[j]) continue;
        find(static_cast<std::size_t>(std::max(k, Index{0})),
             fmt::format("joint {} has a jerk of {:.1f} rad/s³, expected {:.1f} at most", j, jerk,
                         arm_.j_max[j]));
        break;
      }
    }
  }

  VectorXd on_path(double s) const {
    const double periods = s / plan_.period_s;
    const auto k = std::min(static_cast<std::size_t>(periods), pieces_.size() - 1);
    return pieces_[k].at(std::min(1.0, periods - static_cast<double>(k)));
  }

  void check_stop(std::size_t k, const VectorXd& v, const std::vector<double>& stop_s) {
    const double h = plan_.period_s, begin = static_cast<double>(k) * h;
    const double end = static_cast<double>(pieces_.size()) * h;
    double at = begin;
    VectorXd q = on_path(begin);
    // Mean rates of periods are compared, from that before the instant on.
    VectorXd rate = k == 0 ? v : VectorXd((q - on_path(begin - h)) / h);
    // How hard the arm slows down, as a share of its accelerations.
    const auto change_to = [&](const VectorXd& next) {
      const double share =
          ((next - rate).cwiseAbs().array() / (h * arm_.a_max.array() + kRounding)).maxCoeff();
      rate = next;
      return share;
    };
    for (const double s : stop_s) {
      if (s < at - kRounding || s > end + kRounding)
        return find(k, "the stop along the path leaves the motion, or goes backwards");
      const VectorXd next = on_path(std::clamp(s, begin, end));
      const double share = change_to((next - q) / h);
      if (share > kOfPeriods)
        return find(k, fmt::format("the stop along the path takes {:.2f} of the arm's "
                                   "accelerations, expected {} at most",
                                   share, kOfPeriods));
      q = next;
      at = s;
    }
    if (change_to(VectorXd::Zero(v.size())) > kOfPeriods)
      find(k, "the stop along the path does not end at rest");
  }

  const PlanFile& plan_;
  const kin::ArmModel& arm_;
  PlanVerdict verdict_;
  std::size_t index_ = 0;
  std::vector<Piece> pieces_;
};

}  // namespace

PlanVerdict verify_plan(const PlanFile& plan, const kin::ArmModel& arm) {
  return Verifier(plan, arm).run();
}

}  // namespace mimesis::tool
