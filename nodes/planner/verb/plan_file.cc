#include "nodes/planner/verb/plan_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>

#include "common/error.h"
#include "common/runtime/param_source.h"

namespace mimesis::tool {
namespace {

using runtime::ParamVisitor;

constexpr const char* kPlanFormat = "mimesis.plan 3";
constexpr double kMost_m = 100.0, kMost_rad = 1000.0, kMost_s = 3600.0;

void check_size(const std::string& key, std::size_t size, std::size_t unit, bool exactly,
                const std::string& of) {
  if (exactly ? size == unit : size % unit == 0) return;
  throw ConfigError(key + " has " + std::to_string(size) + " numbers, expected " +
                    std::to_string(unit) + " for each " + of);
}

}  // namespace

void PlanInstant::visit(ParamVisitor& v) {
  v("position_rad", position_rad, -kMost_rad, kMost_rad, 0);
  v("velocity_rad_s", velocity_rad_s, -kMost_rad, kMost_rad, 0);
  v("stop_s", stop_s, 0.0, kMost_s, 0);
}

void PlanHull::visit(ParamVisitor& v) {
  v("name", name);
  v("points_m", points_m, -kMost_m, kMost_m, 0);
  v("radius_m", radius_m, 0.0, kMost_m);
}

void PlanToolPiece::visit(ParamVisitor& v) {
  v("via_m", via_m, -kMost_m, kMost_m, 0);
  v("to_m", to_m, -kMost_m, kMost_m, 0);
}

void PlanMotion::visit(ParamVisitor& v) {
  v("phase", phase);
  v("balls_m", balls_m, -kMost_m, kMost_m, 0);
  v("boxes_m", boxes_m, -kMost_m, kMost_m, 0);
  v("held_m", held_m, -kMost_m, kMost_m, 0);
  v("supports_m", supports_m, -kMost_m, kMost_m, 0);
  list(v, "hulls", hulls);
  list(v, "tool", tool);
  v("tool_off_m", tool_off_m, 0.0, 1.0);
  v("tool_off_rad", tool_off_rad, 0.0, 1.0);
  list(v, "instants", instants);
}

void PlanInput::visit(ParamVisitor& v) {
  v("file", file);
  v("sum", sum);
}

void PlanFile::visit(ParamVisitor& v) {
  v("format", format, {kPlanFormat});
  v("robot", robot);
  list(v, "inputs", inputs);
  v("period_s", period_s, 1e-4, 1.0);
  v("margin_m", margin_m, 0.0, 1.0);
  v("stop_margin_m", stop_margin_m, 0.0, 1.0);
  v("stop_delay_s", stop_delay_s, 0.0, 1.0);
  v("stop_alone_s", stop_alone_s, 0.0, 0.1);
  list(v, "motions", motions);
}

void PlanFile::check(int dof) const {
  const auto n = static_cast<std::size_t>(dof);
  if (motions.empty()) throw ConfigError("motions: there is none");
  for (std::size_t m = 0; m < motions.size(); ++m) {
    const PlanMotion& motion = motions[m];
    const std::string key = "motions[" + std::to_string(m) + "]";
    check_size(key + ".balls_m", motion.balls_m.size(), 4, false, "ball");
    check_size(key + ".held_m", motion.held_m.size(), 4, false, "ball");
    check_size(key + ".boxes_m", motion.boxes_m.size(), 6, false, "box");
    check_size(key + ".supports_m", motion.supports_m.size(), 6, false, "box");
    for (std::size_t i = 0; i < motion.hulls.size(); ++i) {
      const std::string hull = key + ".hulls[" + std::to_string(i) + "].points_m";
      check_size(hull, motion.hulls[i].points_m.size(), 3, false, "point");
      if (motion.hulls[i].points_m.empty()) throw ConfigError(hull + ": expected some");
    }
    for (std::size_t i = 0; i < motion.tool.size(); ++i) {
      const std::string piece = key + ".tool[" + std::to_string(i) + "]";
      check_size(piece + ".to_m", motion.tool[i].to_m.size(), 3, true, "point");
      if (!motion.tool[i].via_m.empty())
        check_size(piece + ".via_m", motion.tool[i].via_m.size(), 3, true, "point");
    }
    if (motion.instants.size() < 2) throw ConfigError(key + ".instants: expected two or more");
    for (std::size_t k = 0; k < motion.instants.size(); ++k) {
      const std::string at = key + ".instants[" + std::to_string(k) + "]";
      check_size(at + ".position_rad", motion.instants[k].position_rad.size(), n, true, "posture");
      check_size(at + ".velocity_rad_s", motion.instants[k].velocity_rad_s.size(), n, true,
                 "posture");
    }
  }
}

PlanFile load_plan(const std::string& file) {
  PlanFile plan;
  runtime::load_params(file, [&](ParamVisitor& v) { plan.visit(v); });
  return plan;
}

void save_plan(const PlanFile& plan, const std::string& file) {
  PlanFile copy = plan;  // a visit may change what it visits
  copy.format = kPlanFormat;
  std::ofstream out(file, std::ios::binary);
  out << runtime::dump_params([&](ParamVisitor& v) { copy.visit(v); });
  out.close();
  if (!out) throw ConfigError(file + ": not written: " + std::strerror(errno));
}

}  // namespace mimesis::tool
