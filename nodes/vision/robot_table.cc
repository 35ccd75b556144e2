#include "nodes/vision/robot_table.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace mimesis::vision {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kStandsHigh = 0.01;  // [m] above the table
constexpr double kStandsOn = 0.02;    // [m] from its foot to what carries it

double worst_sigma(const Thing& thing) {
  return std::sqrt(thing.covariance_m2.diagonal().maxCoeff());
}

double height_variance(const Thing& thing) { return thing.covariance_m2(1, 1); }

class Converter {
 public:
  explicit Converter(const RobotTableSetup& setup) : setup_(setup), X_WT_(table_in_world(setup)) {}

  Vector3d point(const Vector3d& p_T) const { return X_WT_ * p_T; }
  Matrix3d covariance(const Matrix3d& c_T) const {
    return X_WT_.linear() * c_T * X_WT_.linear().transpose();
  }
  /// From the table up to `top_m` above it, around a place.
  kin::Box column(const Vector3d& p_W, double half_m, double top_m, double grown_m,
                  std::string name) const {
    const double ground = setup_.origin_m[2];
    const double half = half_m + grown_m;
    return {{p_W.x(), p_W.y(), ground + 0.5 * top_m}, {half, half, 0.5 * top_m}, std::move(name)};
  }
  void add_bar(const Thing& bar, kin::Table& out) const {
    const double grown = setup_.inflation_sigma * worst_sigma(bar);
    kin::BarShape shape;
    shape.half_width = 0.5 * bar.solid.length - bar.solid.half_width;  // posts stand below its ends
    shape.ball_radius = bar.solid.half_width + grown;
    shape.height = bar.solid.bottom() - grown;
    shape.max_spacing = setup_.spacing_m;
    out.bar_center = point(bar.solid.center);
    out.bar_height = bar.solid.bottom();
    out.bar_half_width = shape.half_width;
    if (shape.height < shape.ball_radius) return;
    // The shape stands at x = 0 along y; the bar's axis in W:
    const double yaw = bar.solid.yaw_rad;
    const Vector3d axis = X_WT_.linear() * Vector3d(std::cos(yaw), 0.0, -std::sin(yaw));
    const Eigen::AngleAxisd turn(std::atan2(-axis.x(), axis.y()), Vector3d::UnitZ());
    const Vector3d foot(out.bar_center.x(), out.bar_center.y(), setup_.origin_m[2]);
    for (kin::Ball ball : kin::bar_balls(shape)) {
      ball.center = foot + turn * ball.center;
      out.balls.push_back(ball);
    }
  }
  double inflation_sigma() const { return setup_.inflation_sigma; }

 private:
  const RobotTableSetup& setup_;
  Eigen::Isometry3d X_WT_;
};

}  // namespace

Eigen::Isometry3d table_in_world(const RobotTableSetup& setup) {
  Matrix3d R_WT;  // x, y, z of T are y, z, x of W
  R_WT << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  Eigen::Isometry3d X_WT(Eigen::Translation3d(Vector3d::Map(setup.origin_m.data())));
  X_WT.linear() = Eigen::AngleAxisd(setup.yaw_rad, Vector3d::UnitZ()).toRotationMatrix() * R_WT;
  return X_WT;
}

tl::expected<SeenTable, Status> robot_table(const StereoScene& scene, const RobotTableSetup& setup,
                                            bool stays_alone) {
  const Thing* bar = scene.bar();
  const std::vector<Thing> goals = scene.goals();
  std::vector<Thing> objects = scene.of(Kind::object);
  const auto none = [](std::string why) { return tl::unexpected(Status{std::move(why)}); };
  if (objects.empty()) return none("no object is seen");
  if (bar == nullptr) return none("no bar is seen");
  if (goals.empty()) return none("no goal is seen");
  for (const Thing& thing : scene.things()) {
    const double sigma = worst_sigma(thing);
    if (sigma <= setup.uncertain_m) continue;
    return none(
        fmt::format("{} {} is known to {:.1f} mm only (standard deviation), expected {:.1f} "
                    "or less: a part of it may be hidden",
                    name(thing.kind), thing.id, 1e3 * sigma, 1e3 * setup.uncertain_m));
  }
  const double gap = bar->solid.bottom() - goals.front().solid.top();
  const bool lone = goals.size() == 1, lone_high = gap < setup.small_gap_m;
  const bool told_apart =
      lone ? stays_alone : goals.front().solid.top() - goals.back().solid.top() >= kSameHeight_m;
  if (!told_apart) return none(lone ? "only one goal is seen" : "the goals are of one height");
  // An object on a goal was placed there already.
  const auto placed = [&goals](const Thing& object) {
    return std::ranges::any_of(goals, [&object](const Thing& goal) {
      const Vector3d off = object.solid.center - goal.solid.center;
      return std::hypot(off.x(), off.z()) < goal.solid.half_width &&
             std::abs(object.solid.bottom() - goal.solid.top()) < kStandsOn;
    });
  };
  std::ranges::sort(objects, {}, [&placed](const Thing& t) { return std::pair(placed(t), t.id); });
  const Converter to(setup);
  SeenTable out;
  kin::Table& table = out.table;
  table.boxes.push_back({Vector3d::Map(setup.top_center_m.data()),
                         Vector3d::Map(setup.top_half_m.data()), "table top"});
  to.add_bar(*bar, table);
  out.bar_m2 = to.covariance(bar->covariance_m2);
  const Thing& object = objects.front();
  table.object = to.point(object.solid.center);
  table.object_radius = object.solid.half_width;
  table.object_height = object.solid.length;
  out.object_m2 = to.covariance(object.covariance_m2);
  if (object.solid.bottom() > kStandsHigh) {
    table.boxes.push_back(to.column(table.object, setup.support_half_m, object.solid.bottom(),
                                    setup.inflation_sigma * worst_sigma(object), "plinth"));
  }
  for (std::size_t i = 1; i < objects.size(); ++i) {
    const Solid& s = objects[i].solid;
    table.boxes.push_back(to.column(to.point(s.center), s.half_width, s.top(),
                                    setup.inflation_sigma * worst_sigma(objects[i]),
                                    "another object"));
  }
  for (const Thing& goal : goals) {
    const bool high = lone ? lone_high : goal.id == goals.front().id;
    const bool low = !high && goal.id == goals.back().id;
    const std::string name = high ? "high" : low ? "low" : "other";
    const Vector3d center = to.point(goal.solid.center);
    table.boxes.push_back(to.column(center, goal.solid.half_width, goal.solid.top(),
                                    setup.inflation_sigma * worst_sigma(goal), name + " stand"));
    if (!high && !low) continue;
    // Rather let go above it than pressed into it.
    const double above =
        setup.inflation_sigma * std::sqrt(height_variance(object) + height_variance(goal));
    const double rest = setup.origin_m[2] + goal.solid.top() + 0.5 * table.object_height + above;
    table.goals.push_back({name, {center.x(), center.y(), rest}, setup.goal_radius_m});
    out.goals_m2.push_back(to.covariance(goal.covariance_m2));
  }
  return out;
}

}  // namespace mimesis::vision
