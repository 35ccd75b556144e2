// A second robot walks with the settings of biped.urdf: JVRC-1, 62 kg, legs a quarter longer, soles
// of 204 mm × 90 mm, and takes things out of a drawer of its size.
#include <fmt/format.h>

#include "experiments/walk/figures.h"
#include "experiments/walk/study/drawer_rows.h"
#include "experiments/walk/study/drawer_study.h"
#include "experiments/walk/trial/suites.h"

namespace mimesis::walk {
namespace {

using namespace reproduce;
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
  const std::vector<TrialSpec> all = make_suite(part.suite, robot, SuiteOptions(plant));
  const std::size_t n = (all.size() - part.first + part.stride - 1) / part.stride;
  return in_parallel(n,
                     [&](std::size_t i) { return run_trial(all[part.first + i * part.stride]); });
}

/// A drawer of its size: near from a stand, far, aside, and one that is pushed away and one that is
/// pushed nearer on the way.
struct DrawerTask {
  double front_m, left_m;
  hw::sim::DrawerJump jump;
};
constexpr std::array kDrawerTasks = {DrawerTask{0.75, 0.0, {}}, DrawerTask{2.5, 0.0, {}},
                                     DrawerTask{1.66, 0.12, {}},
                                     DrawerTask{1.4, 0.0, {.at_s = 4.0, .by_m = 0.10}},
                                     DrawerTask{2.0, -0.08, {.at_s = 3.5, .by_m = -0.08}}};

std::vector<DrawerResult> run_drawers(const Robot& robot, const synthesizer::BipedDrawer& actions,
                                      Plant plant) {
  return in_parallel(kDrawerTasks.size(), [&](std::size_t i) {
    const DrawerTask& task = kDrawerTasks[i];
    DrawerTrialSpec spec;
    spec.robot = &robot;
    spec.actions = &actions;
    spec.body.plant = plant;
    spec.front_m = task.front_m;
    spec.left_m = task.left_m;
    if (task.jump.by_m != 0.0) spec.jumps.push_back(task.jump);
    spec.walker = launched_walker();
    use_real_senses(spec.body, spec.walker.stabilizer);
    spec.delay_ticks = kSensorDelayTicks;
    return run_drawer_trial(spec);
  });
}

/// The worst of some walks.
struct Worst {
  int fell = 0;
  double step_m = 0.0, normal_n = 0.0, ankle_pitch_n_m = 0.0;

  void add(const hw::sim::WalkFigures& f) {
    fell += f.fell;
    step_m = std::max(step_m, f.step_error_max_m);
    normal_n = std::max(normal_n, f.normal_peak_n);
    ankle_pitch_n_m = std::max(ankle_pitch_n_m, f.ankle_pitch_slow_peak_n_m);
  }
};

class Rows {
 public:
  explicit Rows(const Robot& robot) : weight_n_(robot.biped.tree.mass_kg() * robot::kGravity) {}

  void falls(const std::string& what, const Worst& worst, std::size_t n) {
    report.near(fmt::format("{}falls of {}", what, n), worst.fell, goal(0), 0, "1");
  }
  void limits(const std::string& what, const Worst& worst) {
    report.at_most(what + "sole off its planned place, largest", worst.step_m, kMostWithSenses_m,
                   "m", "as asked of biped.urdf with these senses");
    report.at_most(what + "ground reaction force / weight, largest", worst.normal_n / weight_n_,
                   1.41, "1", "HRP-2's 800 N by its weight; nothing is published of this robot");
    report.at_most(what + "ankle pitch torque / weight, largest", worst.ankle_pitch_n_m / weight_n_,
                   30.0 / 569.0, "m",
                   "HRP-2's 30 N m by its weight; nothing is published of this robot");
  }
  void drawers(const std::string& what, const std::vector<DrawerResult>& results) {
    Worst worst;
    int taken = 0;
    double reach = 0.0;
    for (const DrawerResult& r : results) {
      worst.add(r.walk.figures);
      taken += r.taken && !r.walk.figures.fell;
      reach = std::max({reach, r.reach_error_m, r.handle_error_m});
    }
    falls(what, worst, results.size());
    const int n = static_cast<int>(results.size());
    report.near(fmt::format("{}objects taken of {}", what, n), taken, goal(n), 0, "1");
    report.at_most(what + "hand off handle or object, largest", reach, kMostError_m, "m",
                   "as asked of biped.urdf");
    limits(what, worst);
  }
  Report report;

 private:
  double weight_n_;
};

}  // namespace

Report second_robot(const PlotDir&) {
  const Robot robot = load_robot("jvrc1");
  const synthesizer::BipedDrawer actions = synthesizer::make_biped_drawer(robot.biped);
  Rows rows(robot);
  for (const auto& [plant, name] :
       {std::pair{Plant::springs, "springs"}, std::pair{Plant::servo, "servos"}}) {
    for (const Part& part : kParts) {
      const std::vector<TrialResult> results = run(robot, plant, part);
      const std::string what = std::string(name) + ", " + part.what + ": ";
      Worst worst;
      for (const TrialResult& r : results) worst.add(r.figures);
      rows.falls(what, worst, results.size());
      if (std::string(part.suite) == "steps30") rows.limits(what, worst);
    }
    rows.drawers(std::string(name) + ", drawers: ", run_drawers(robot, actions, plant));
  }
  return rows.report;
}

}  // namespace mimesis::walk
