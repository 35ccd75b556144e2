#include "nodes/walker/stack_params_node.h"

#include <array>
#include <utility>

namespace mimesis::walker {
namespace {

constexpr std::array<std::pair<TaskKind, const char*>, 6> kKinds = {{
    {TaskKind::kCom, "com"},
    {TaskKind::kFoot, "foot"},
    {TaskKind::kOrientation, "orientation"},
    {TaskKind::kPosition, "position"},
    {TaskKind::kPosture, "posture"},
    {TaskKind::kRegularisation, "regularisation"},
}};

/// Kinds by their names.
void visit_kind(runtime::ParamVisitor& v, TaskKind& kind) {
  std::string text;
  for (const auto& [known, word] : kKinds) {
    if (known == kind) text = word;
  }
  v("kind", text, {"com", "foot", "orientation", "position", "posture", "regularisation"});
  for (const auto& [known, word] : kKinds) {
    if (text == word) kind = known;
  }
}

/// Axes as a list of 0 and 1.
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

}  // namespace mimesis::walker
