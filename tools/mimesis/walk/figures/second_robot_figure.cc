// A robot that nothing was made for walks with what was found for biped.urdf: JVRC-1, 62 kg, legs a
// quarter longer, soles of 204 mm × 90 mm.
#include <fmt/format.h>

#include "tools/mimesis/walk/figures/list.h"
#include "tools/mimesis/walk/figures/study_rows.h"
#include "tools/mimesis/walk/study/parallel.h"
#include "tools/mimesis/walk/suites.h"

namespace mimesis::walk {
namespace {

using hw::sim::Plant;

/// Some trials of a suite: every `stride`-th from `first` on.
struct Part {
  const char *suite, *what;
  std::size_t first, stride;
};
// Three walks at each speed; one on plates at each; a push while it stands and seven while it
// walks, from as many sides at as many instants of a step.
constexpr std::array kParts = {Part{"steps30", "walks", 1, 3}, Part{"plates30", "on plates", 4, 10},
                               Part{"pushes", "pushed", 0, 9}};

std::vector<TrialResult> run(const Robot& robot, Plant plant, const Part& part) {
  SuiteOptions options;
  options.plant = plant;
  const std::vector<TrialSpec> all = make_suite(part.suite, robot, options);
  const std::size_t n = (all.size() - part.first + part.stride - 1) / part.stride;
  return in_parallel(n,
                     [&](std::size_t i) { return run_trial(all[part.first + i * part.stride]); });
}

}  // namespace

reproduce::Report second_robot(const PlotDir&) {
  const Robot robot = load_robot("jvrc1");
  const double weight = robot.biped.tree.mass_kg() * robot::kGravity;
  reproduce::Report report;
  for (const auto& [plant, name] :
       {std::pair{Plant::kSprings, "springs"}, std::pair{Plant::kServo, "servos"}}) {
    for (const Part& part : kParts) {
      const std::vector<TrialResult> results = run(robot, plant, part);
      const std::string what = std::string(name) + ", " + part.what + ": ";
      int fell = 0;
      double step = 0.0, normal = 0.0, ankle_pitch = 0.0;
      for (const TrialResult& r : results) {
        fell += r.figures.fell;
        step = std::max(step, r.figures.step_error_max_m);
        normal = std::max(normal, r.figures.normal_peak_n);
        ankle_pitch = std::max(ankle_pitch, r.figures.ankle_pitch_slow_peak_n_m);
      }
      report.rows.push_back(reproduce::near(fmt::format("{}falls of {}", what, results.size()),
                                            fell, 0, 0, "1", "goal of the project"));
      if (std::string(part.suite) != "steps30") continue;
      report.rows.push_back(reproduce::at_most(what + "sole off its planned place, largest", step,
                                               kMostError_m, "m", "as asked of biped.urdf"));
      report.rows.push_back(reproduce::at_most(
          what + "ground reaction force / weight, largest", normal / weight, 1.41, "1",
          "HRP-2's 800 N by its weight; nothing is published of this robot"));
      report.rows.push_back(reproduce::at_most(
          what + "ankle pitch torque / weight, largest", ankle_pitch / weight, 30.0 / 569.0, "m",
          "HRP-2's 30 N m by its weight; nothing is published of this robot"));
    }
  }
  return report;
}

}  // namespace mimesis::walk
