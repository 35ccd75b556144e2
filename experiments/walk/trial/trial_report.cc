#include "experiments/walk/trial/trial_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "tools/mimesis/table.h"

namespace mimesis::walk {

using nlohmann::ordered_json;

ordered_json to_json(const TrialResult& r) {
  const hw::sim::WalkFigures& f = r.figures;
  ordered_json j{{"name", r.name}, {"fell", f.fell}};
  if (f.fell) {
    j["how"] = f.how;
    j["fell_at_s"] = r.fell_at_s;
  }
  j["steps"] = f.steps;
  j["walked_m"] = r.walked_m;
  j["step_error_rms_m"] = f.step_error_rms_m;
  j["step_error_max_m"] = f.step_error_max_m;
  j["dcm_rms_m"] = {r.dcm_rms_m.x(), r.dcm_rms_m.y()};
  j["dcm_max_m"] = r.dcm_max_m;
  j["zmp_error_rms_m"] = {f.zmp_error_rms_m.x(), f.zmp_error_rms_m.y()};
  j["ankle_pitch_peak_n_m"] = f.ankle_pitch_peak_n_m;
  j["ankle_pitch_slow_peak_n_m"] = f.ankle_pitch_slow_peak_n_m;
  j["normal_peak_n"] = f.normal_peak_n;
  j["raw_normal_peak_n"] = f.raw_normal_peak_n;
  j["reach_error_m"] = r.reach_error_m;
  j["limited_ticks"] = r.limited_ticks;
  j["clipped_ticks"] = r.clipped_ticks;
  j["failed_ticks"] = r.failed_ticks;
  j["saturated_ticks"] = r.saturated_ticks;
  j["trouble"] = r.trouble;
  j["tick_s"] = {{"p50", r.tick_p50_s}, {"p99", r.tick_p99_s}, {"max", r.tick_max_s}};
  j["real_time_factor"] = r.real_time_factor;
  return j;
}

ordered_json summary_json(std::span<const TrialResult> results) {
  ordered_json falls = ordered_json::array();
  double step = 0.0, dcm = 0.0, ankle = 0.0, ankle_slow = 0.0, normal = 0.0, p99 = 0.0;
  for (const TrialResult& r : results) {
    const hw::sim::WalkFigures& f = r.figures;
    if (f.fell) {
      falls.push_back({{"name", r.name}, {"how", f.how}, {"at_s", r.fell_at_s}});
      continue;  // what a falling robot does says nothing of walking
    }
    step = std::max(step, f.step_error_max_m);
    dcm = std::max(dcm, r.dcm_max_m);
    ankle = std::max(ankle, f.ankle_pitch_peak_n_m);
    ankle_slow = std::max(ankle_slow, f.ankle_pitch_slow_peak_n_m);
    normal = std::max(normal, f.normal_peak_n);
    p99 = std::max(p99, r.tick_p99_s);
  }
  return {{"trials", results.size()},
          {"falls", falls.size()},
          {"fell", falls},
          {"step_error_max_m", step},
          {"dcm_max_m", dcm},
          {"ankle_pitch_peak_n_m", ankle},
          {"ankle_pitch_slow_peak_n_m", ankle_slow},
          {"normal_peak_n", normal},
          {"tick_p99_s", p99}};
}

void print_table(std::span<const TrialResult> results, std::ostream& out, bool bold_heading) {
  tool::Table table({"trial", "fell", "steps", "m", "step err mm rms (max)", "DCM mm rms x/y (max)",
                     "ZMP mm x/y", "ankle Nm (20 ms)", "Fz N", "limited", "tick us p50/p99"});
  for (const TrialResult& r : results) {
    const hw::sim::WalkFigures& f = r.figures;
    table.row(
        {r.name, f.fell ? fmt::format("{:.1f} s", r.fell_at_s) : "no", std::to_string(f.steps),
         fmt::format("{:.2f}", r.walked_m),
         fmt::format("{:.1f} ({:.1f})", 1e3 * f.step_error_rms_m, 1e3 * f.step_error_max_m),
         fmt::format("{:.1f}/{:.1f} ({:.0f})", 1e3 * r.dcm_rms_m.x(), 1e3 * r.dcm_rms_m.y(),
                     1e3 * r.dcm_max_m),
         fmt::format("{:.1f}/{:.1f}", 1e3 * f.zmp_error_rms_m.x(), 1e3 * f.zmp_error_rms_m.y()),
         fmt::format("{:.0f} ({:.0f})", f.ankle_pitch_peak_n_m, f.ankle_pitch_slow_peak_n_m),
         fmt::format("{:.0f}", f.normal_peak_n), std::to_string(r.limited_ticks),
         fmt::format("{:.0f}/{:.0f}", 1e6 * r.tick_p50_s, 1e6 * r.tick_p99_s)});
  }
  table.print(out, bold_heading);
}

}  // namespace mimesis::walk
