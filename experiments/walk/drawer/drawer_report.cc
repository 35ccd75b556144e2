#include "experiments/walk/drawer/drawer_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "tools/mimesis/table.h"
#include "experiments/walk/drawer/drawer_suite.h"
#include "experiments/walk/trial/trial_report.h"

namespace mimesis::walk {
namespace {

using nlohmann::ordered_json;

const char* name_of(DrawerEnd end) {
  switch (end) {
    case DrawerEnd::kTaken:
      return "taken";
    case DrawerEnd::kRefused:
      return "refused";
    case DrawerEnd::kFell:
      return "fell";
    case DrawerEnd::kSilent:
      break;
  }
  return "silent";
}

std::string reason_of(const DrawerResult& r) {
  switch (end_of(r)) {
    case DrawerEnd::kTaken:
      return "";
    case DrawerEnd::kFell:
      return fmt::format("{} at {:.1f} s", r.walk.figures.how, r.walk.fell_at_s);
    default:
      return r.refused;
  }
}

}  // namespace

ordered_json to_json(const DrawerResult& r) {
  ordered_json j = to_json(r.walk);
  j["end"] = name_of(end_of(r));
  j["reason"] = reason_of(r);
  j["done_s"] = r.done_s;
  j["object_error_m"] = r.reach_error_m;
  j["handle_error_m"] = r.handle_error_m;
  j["length_error_max_m"] = r.length_error_max_m();
  return j;
}

ordered_json summary_json(std::span<const DrawerResult> results) {
  ordered_json ends = ordered_json::array();
  std::vector<TrialResult> walks;
  double object = 0.0, handle = 0.0, length = 0.0;
  int taken = 0, silent = 0;
  for (const DrawerResult& r : results) {
    walks.push_back(r.walk);
    const DrawerEnd end = end_of(r);
    silent += end == DrawerEnd::kSilent;
    if (end == DrawerEnd::kTaken) {
      ++taken;
      object = std::max(object, r.reach_error_m);
      handle = std::max(handle, r.handle_error_m);
    } else {
      ends.push_back({{"name", r.walk.name}, {"end", name_of(end)}, {"reason", reason_of(r)}});
    }
    if (end != DrawerEnd::kFell) length = std::max(length, r.length_error_max_m());
  }
  ordered_json j = summary_json(walks);
  j["taken"] = taken;
  j["silent"] = silent;
  j["not_taken"] = ends;
  j["object_error_max_m"] = object;
  j["handle_error_max_m"] = handle;
  j["length_error_max_m"] = length;
  return j;
}

void print_table(std::span<const DrawerResult> results, std::ostream& out, bool bold_heading) {
  tool::Table table({"task", "end", "s", "object mm", "handle mm", "step err mm", "length err mm",
                     "ankle Nm (20 ms)", "Fz N", "tick us p50/p99", "why"});
  for (const DrawerResult& r : results) {
    const hw::sim::WalkFigures& f = r.walk.figures;
    table.row({r.walk.name, name_of(end_of(r)), r.taken ? fmt::format("{:.1f}", r.done_s) : "",
               fmt::format("{:.1f}", 1e3 * r.reach_error_m),
               fmt::format("{:.1f}", 1e3 * r.handle_error_m),
               fmt::format("{:.1f}", 1e3 * f.step_error_max_m),
               fmt::format("{:.1f}", 1e3 * r.length_error_max_m()),
               fmt::format("{:.0f} ({:.0f})", f.ankle_pitch_peak_n_m, f.ankle_pitch_slow_peak_n_m),
               fmt::format("{:.0f}", f.normal_peak_n),
               fmt::format("{:.0f}/{:.0f}", 1e6 * r.walk.tick_p50_s, 1e6 * r.walk.tick_p99_s),
               reason_of(r)});
  }
  table.print(out, bold_heading);
}

}  // namespace mimesis::walk
