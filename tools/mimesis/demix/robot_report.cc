#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>

#include "tools/mimesis/demix/robot_motion.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

using nlohmann::ordered_json;
using retarget::Deviation;

constexpr std::size_t kNearest = 8;  // rows in the table

std::string text(const Deviation& d, double unit) {
  return fmt::format("{:.1f} / {:.1f}", unit * d.rms, unit * d.max);
}

ordered_json json(const Deviation& d) { return {{"rms", d.rms}, {"max", d.max}}; }

std::string list(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : " ") + word;
  return out.empty() ? "none" : out;
}

/// The rows that come nearest to their limits or pass them, worst first.
std::vector<motion::LimitExcess> sorted_excess(const motion::MotionModel& model) {
  std::vector<motion::LimitExcess> rows = motion::limit_excess(model);
  std::ranges::stable_sort(rows, std::greater{}, &motion::LimitExcess::beyond_rad);
  return rows;
}

}  // namespace

void print_retargeting(const std::vector<RetargetedClip>& clips) {
  const bool bold = use_colour(STDOUT_FILENO);
  Table table({"clip", "scale", "feet rms/max [mm]", "feet [mrad]", "hands [mm]", "chest [mrad]",
               "figure's ankles [mm]", "speed/limit", "fastest"});
  for (const RetargetedClip& c : clips) {
    const retarget::RobotReport& r = c.report;
    table.row({c.file, fmt::format("{:.3f}", r.scale), text(r.foot_m, 1e3), text(r.foot_rad, 1e3),
               text(r.hand_m, 1e3), text(r.chest_rad, 1e3), text(c.ankle_m, 1e3),
               fmt::format("{:.2f}", r.speed_share), r.fastest_joint});
  }
  table.print(std::cout, bold);
  for (const RetargetedClip& c : clips) {
    std::cout << fmt::format("{}: at their limits in {} of {} frames: {}\n", c.file,
                             c.report.frames_at_limits, c.frames, list(c.report.joints_at_limits));
  }
  std::cout << '\n';
}

void print_limits(const motion::MotionModel& model) {
  const auto rows = sorted_excess(model);
  const auto beyond = std::ranges::count_if(rows, [](const auto& r) { return r.beyond_rad > 0.0; });
  std::cout << fmt::format(
      "\n{} of {} rows with limits pass them in some pattern (blends: see motion_model.h)\n",
      beyond, rows.size());
  Table table({"nearest to limits", "beyond [rad]", "pattern", "phase [rad]"});
  for (std::size_t i = 0; i < std::min(kNearest, rows.size()); ++i) {
    table.row({rows[i].row, fmt::format("{:.4f}", rows[i].beyond_rad),
               std::to_string(rows[i].pattern), fmt::format("{:.2f}", rows[i].phase_rad)});
  }
  table.print(std::cout, use_colour(STDOUT_FILENO));
}

ordered_json retargeting_json(const std::vector<RetargetedClip>& clips) {
  ordered_json out = ordered_json::array();
  for (const RetargetedClip& c : clips) {
    const retarget::RobotReport& r = c.report;
    out.push_back({{"file", c.file},
                   {"frames", c.frames},
                   {"scale", r.scale},
                   {"foot_m", json(r.foot_m)},
                   {"foot_rad", json(r.foot_rad)},
                   {"hand_m", json(r.hand_m)},
                   {"hand_rad", json(r.hand_rad)},
                   {"chest_rad", json(r.chest_rad)},
                   {"head_rad", json(r.head_rad)},
                   {"figure_ankle_m", json(c.ankle_m)},
                   {"figure_wrist_m", json(c.wrist_m)},
                   {"joints_at_limits", r.joints_at_limits},
                   {"frames_at_limits", r.frames_at_limits},
                   {"speed_share", r.speed_share},
                   {"fastest_joint", r.fastest_joint},
                   {"roughness_before", r.roughness_before},
                   {"roughness_after", r.roughness_after},
                   {"stance_speed_m_s", r.stance_speed_m_s}});
  }
  return out;
}

ordered_json limits_json(const motion::MotionModel& model) {
  ordered_json out = ordered_json::array();
  for (const motion::LimitExcess& row : sorted_excess(model)) {
    out.push_back({{"row", row.row},
                   {"beyond_rad", row.beyond_rad},
                   {"pattern", row.pattern},
                   {"phase_rad", row.phase_rad}});
  }
  return out;
}

}  // namespace mimesis::tool
