#include "nodes/walker/walker_params.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <utility>

#include "common/error.h"
#include "common/model/files.h"

namespace mimesis::walker {
namespace {

constexpr std::array<std::pair<TaskKind, const char*>, 6> kKinds = {{
    {TaskKind::com, "com"},
    {TaskKind::foot, "foot"},
    {TaskKind::orientation, "orientation"},
    {TaskKind::position, "position"},
    {TaskKind::posture, "posture"},
    {TaskKind::regularisation, "regularisation"},
}};

void visit_kind(runtime::ParamVisitor& v, TaskKind& kind) {
  using Kind = decltype(kKinds)::value_type;
  std::string text = std::ranges::find(kKinds, kind, &Kind::first)->second;
  v("kind", text, {"com", "foot", "orientation", "position", "posture", "regularisation"});
  kind = std::ranges::find(kKinds, text, &Kind::second)->first;
}

void visit_axes(runtime::ParamVisitor& v, std::vector<bool>& axes) {
  std::vector<double> numbers(axes.begin(), axes.end());
  v("axes", numbers, 0.0, 1.0, 0);
  axes.clear();
  for (const double number : numbers) axes.push_back(number >= 0.5);
}

void visit_task(runtime::ParamVisitor& v, TaskSpec& task) {
  v("name", task.name);
  visit_kind(v, task.kind);
  v("priority", task.priority, 1, 100);
  v("weight", task.weight, 1e-6, 1e6);
  v("gain_1_s", task.gain_1_s, 1e-3, 1e4);
  v("link", task.link);
  v("joints", task.joints);
  visit_axes(v, task.axes);
}

constexpr double kPi = std::numbers::pi, kFar_m = 1e4;

struct GaitKey {
  const char* key;
  double GaitSettings::*figure;
  double most;
};
constexpr std::array<GaitKey, GaitParams::kCount> kGait = {{
    {"step_s", &GaitSettings::step_s, 2.0},
    {"double_support_s", &GaitSettings::double_support_s, 1.0},
    {"first_double_support_s", &GaitSettings::first_double_support_s, 3.0},
    {"step_height_m", &GaitSettings::step_height_m, 0.2},
    {"feet_distance_m", &GaitSettings::feet_distance_m, 0.6},
    {"longest_step_m", &GaitSettings::longest_step_m, 1.0},
    {"widest_step_m", &GaitSettings::widest_step_m, 1.0},
    {"narrowest_step_m", &GaitSettings::narrowest_step_m, 0.6},
    {"most_forward_m_s", &GaitSettings::most_forward_m_s, 1.0},
    {"most_sideways_m_s", &GaitSettings::most_sideways_m_s, 0.5},
    {"most_turn_rad_s", &GaitSettings::most_turn_rad_s, 1.0},
    {"most_foot_yaw_rad", &GaitSettings::most_foot_yaw_rad, 0.5},
}};

PatternKind kind_of(const std::string& name) {
  if (name == "linear") return PatternKind::linear;
  return name == "preview" ? PatternKind::preview : PatternKind::nonlinear;
}

}  // namespace

void visit_stack(runtime::ParamVisitor& v, StackSettings& settings) {
  v("damping", settings.damping, 1e-6, 1.0);
  v("knee_margin_rad", settings.knee_margin_rad, 0.0, 0.5);
  v("limit_margin_rad", settings.limit_margin_rad, 0.0, 0.2);
  v("speed_share", settings.speed_share, 0.01, 1.0);
  v.elements(
      "tasks", settings.tasks.size(), [&](std::size_t n) { settings.tasks.resize(n); },
      [&](runtime::ParamVisitor& g, std::size_t i) { visit_task(g, settings.tasks[i]); });
}

void GaitParams::visit(runtime::ParamVisitor& v) {
  for (std::size_t i = 0; i < kCount; ++i) v(kGait[i].key, figures[i], 0.0, kGait[i].most);
}

GaitSettings GaitParams::over(GaitSettings robot) const {
  for (std::size_t i = 0; i < kCount; ++i) {
    if (figures[i] > 0.0) robot.*kGait[i].figure = figures[i];
  }
  if (robot.double_support_s > 0.5 * robot.step_s) {
    throw ConfigError("walker.gait.double_support_s: more than half of step_s leaves no swing");
  }
  if (robot.narrowest_step_m > robot.feet_distance_m ||
      robot.widest_step_m < robot.feet_distance_m) {
    throw ConfigError("walker.gait: expected narrowest_step_m <= feet_distance_m <= widest_step_m");
  }
  return robot;
}

void WalkerParams::visit(runtime::ParamVisitor& v) {
  v("rate_hz", rate_hz, 1.0 / kTick_s, 1.0 / kTick_s);
  v("offset_s", offset_s, 0.0, 1.0);
  v.file("robot", robot, "biped");
  v("pattern", pattern, {"nonlinear", "linear", "preview"});
  v("filter", filter);
  v("filter_iterations", filter_iterations, 1, 5);
  v("filter_legs_only", filter_legs_only);
  v("stabilize", stabilize);
  v.group("stabilizer", [this](runtime::ParamVisitor& g) { stabilizer.visit(g); });
  v.group("stack", [this](runtime::ParamVisitor& g) { visit_stack(g, stack); });
  v.group("gait", [this](runtime::ParamVisitor& g) { gait.visit(g); });
  v.group("start", [this](runtime::ParamVisitor& g) {
    g("x_m", start.x_m, -kFar_m, kFar_m);
    g("y_m", start.y_m, -kFar_m, kFar_m);
    g("heading_rad", start.heading_rad, -kPi, kPi);
  });
  v.group("ready", [this](runtime::ParamVisitor& g) {
    g("near_rad", ready.near_rad, 0.01, 1.0);
    g("tilt_rad", ready.tilt_rad, 0.01, 0.5);
    g("weight_share", ready.weight_share, 0.0, 0.9);
    g("start_rad", ready.start_rad, 0.001, 0.2);
    g("approach_s", ready.approach_s, 0.1, 60.0);
    g("approach_share", ready.approach_share, 0.01, 0.5);
  });
  v("motion_stale_s", motion_stale_s, 0.01, 10.0);
  v("use_smooth_velocity", use_smooth_velocity);
  v("sensors_stale_s", sensors_stale_s, 0.006, 1.0);
  v("blind_s", conduct.blind_s, 0.0, 60.0);
  v("silence_s", conduct.silence_s, 0.0, 10.0);
}

double WalkerParams::robot_rate_hz() const {
  const double its_hz = model::rate_of_robot(robot);
  if (its_hz == 1.0 / kTick_s) return its_hz;
  throw ConfigError(fmt::format("{}: rate_hz: {}, expected {}: the walker's gains belong to it",
                                robot, its_hz, 1.0 / kTick_s));
}

WalkerSettings WalkerParams::settings(const robot::Biped& biped) const {
  WalkerSettings s;
  s.pattern = kind_of(pattern);
  s.filter = filter;
  s.filter_settings.iterations = filter_iterations;
  s.filter_settings.legs_only = filter_legs_only;
  s.stabilize = stabilize;
  s.stabilizer = stabilizer;
  s.stack = stack;
  s.gait = gait.over(gait_settings(biped));
  return s;
}

}  // namespace mimesis::walker
