// Another physics judges the same walker with the same gains: MuJoCo beside DART.
#include <fmt/format.h>

#include <cmath>

#include "experiments/walk/figures.h"
#include "experiments/walk/study/drawer_rows.h"
#include "experiments/walk/trial/suites.h"

namespace mimesis::walk {
namespace {

using namespace reproduce;
using hw::sim::Plant;

/// Errors are root mean squares of the walks that did not fall.
struct Judged {
  std::size_t walks = 0;
  int falls = 0;
  double step_m = 0.0, dcm_m = 0.0;
};

Judged judge(const char* suite, const Robot& robot, Plant plant, Engine engine) {
  SuiteOptions options(plant);
  options.engine = engine;
  const std::vector<TrialSpec> trials = make_suite(suite, robot, options);
  Judged out{.walks = trials.size()};
  int steps = 0;
  for (const TrialResult& r :
       in_parallel(trials.size(), [&](std::size_t i) { return run_trial(trials[i]); })) {
    const hw::sim::WalkFigures& f = r.figures;
    out.falls += f.fell;
    if (f.fell) continue;
    out.step_m += f.steps * f.step_error_rms_m * f.step_error_rms_m;
    steps += f.steps;
    out.dcm_m += r.dcm_rms_m.squaredNorm();
  }
  out.step_m = std::sqrt(out.step_m / steps);
  out.dcm_m = std::sqrt(out.dcm_m / (static_cast<double>(out.walks) - out.falls));
  return out;
}

}  // namespace

Report second_engine(const PlotDir&) {
  const Robot robot = load_robot("biped");
  Report report;
  for (const auto& [plant, name] :
       {std::pair{Plant::springs, "springs"}, std::pair{Plant::servo, "servos"}}) {
    for (const char* suite : {"steps30", "pushes"}) {
      const Judged dart = judge(suite, robot, plant, Engine::dart),
                   mujoco = judge(suite, robot, plant, Engine::mujoco);
      const std::string what = fmt::format("{}, {}: ", suite, name);
      report.near(fmt::format("{}falls of {}", what, mujoco.walks), mujoco.falls, goal(0), 0, "1");
      const std::string step = what + "sole off its planned place, rms";
      const std::string in_dart = fmt::format("{:.4f} m in DART", dart.step_m);
      if (std::string_view(suite) == "steps30") {
        report.at_most(step, mujoco.step_m, kMostError_m, "m", in_dart);
      } else {
        report.at_most(step + ", over DART's", mujoco.step_m / dart.step_m, 1.5, "1",
                       in_dart + "; who is pushed steps elsewhere");
      }
      report.at_most(
          what + "DCM off the plan, rms, over DART's", mujoco.dcm_m / dart.dcm_m, 1.5, "1",
          fmt::format("{:.4f} m in DART; another physics may add half as much", dart.dcm_m));
    }
  }
  return report;
}

}  // namespace mimesis::walk
