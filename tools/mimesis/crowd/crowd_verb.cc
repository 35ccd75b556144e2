#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/runtime/param_source.h"
#include "nodes/crowd/scenario_file/scenario_file.h"
#include "tools/mimesis/crowd/certify_report.h"
#include "tools/mimesis/crowd/gait_of_model.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using Json = nlohmann::ordered_json;

struct CertifyOptions {
  std::string file;
  std::vector<std::string> sets;
  bool json = false;
};

struct GaitOptions {
  std::string model, style;
  int harmonics = crowd::SpeedFunction::kHarmonics;
  bool json = false;
};

int certify(const CertifyOptions& o) {
  const std::string file = crowd::find_scenario(o.file);
  const crowd::Scenario scenario = crowd::read_scenario(file, o.sets);
  const bool holds = o.json ? print_certificates_json(file, scenario, std::cout)
                            : print_certificates(scenario, std::cout, use_colour(STDOUT_FILENO));
  return holds ? 0 : 1;
}

void print_yaml(const std::vector<MeasuredGait>& gaits) {
  std::cout << "gaits:\n";
  for (const MeasuredGait& m : gaits) {
    const crowd::Gait& g = m.gait;
    std::cout << fmt::format(
        "  - name: {}                  # {:.3f} m/s, steps of {:.3f} m\n"
        "    eigenfrequency_rad_s: {:.4f}\n"
        "    mean_m_rad: {:.5f}            # g in [{:.4f}, {:.4f}], {:.4f} rms not in the series\n"
        "    cosine_m_rad: [{:.5f}]\n"
        "    sine_m_rad: [{:.5f}]\n"
        "    sway_cosine: [{:.5f}]\n"
        "    sway_sine: [{:.5f}]\n",
        g.name, g.mean_m_rad * g.eigenfrequency_rad_s, m.step_length_m, g.eigenfrequency_rad_s,
        g.mean_m_rad, m.least_m_rad, m.most_m_rad, m.rms_m_rad, fmt::join(g.cosine_m_rad, ", "),
        fmt::join(g.sine_m_rad, ", "), fmt::join(g.sway_cosine, ", "),
        fmt::join(g.sway_sine, ", "));
  }
}

int gait(const GaitOptions& o) {
  const motion::MotionModel model = motion::load_motion_model(runtime::find_model_file(o.model));
  const std::vector<MeasuredGait> gaits = measure_gaits(model, o.style, o.harmonics);
  if (!o.json) {
    print_yaml(gaits);
    return 0;
  }
  Json list = Json::array();
  for (const MeasuredGait& m : gaits) {
    list.push_back({{"name", m.gait.name},
                    {"eigenfrequency_rad_s", m.gait.eigenfrequency_rad_s},
                    {"mean_m_rad", m.gait.mean_m_rad},
                    {"cosine_m_rad", m.gait.cosine_m_rad},
                    {"sine_m_rad", m.gait.sine_m_rad},
                    {"sway_cosine", m.gait.sway_cosine},
                    {"sway_sine", m.gait.sway_sine},
                    {"least_m_rad", m.least_m_rad},
                    {"most_m_rad", m.most_m_rad},
                    {"rms_m_rad", m.rms_m_rad},
                    {"step_length_m", m.step_length_m}});
  }
  std::cout << Json{{"model", model.name}, {"gaits", list}}.dump() << '\n';
  return 0;
}

}  // namespace

void add_crowd(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("crowd", "Guarantees for crowds of walkers");
  verb->require_subcommand(1);

  auto certify_options = std::make_shared<CertifyOptions>();
  CLI::App* sub = verb->add_subcommand(
      "certify", "Guarantees of contraction theory for a scenario, and advice");
  sub->add_option("FILE", certify_options->file, "Scenario file, or its name in launch/crowd")
      ->required();
  sub->add_option("--set", certify_options->sets,
                  "Another value, KEY=VALUE: groups.0.count=25 (repeatable)")
      ->type_name("KEY=VALUE");
  sub->add_flag("--json", certify_options->json,
                "One object: file, name, holds, stages, largest_agents");
  sub->footer(
      "Exit codes: 0 every rule in force is guaranteed, 1 one is not, 2 the scenario is refused.\n"
      "Examples:\n  mimesis crowd certify formation\n"
      "  mimesis crowd certify launch/crowd/soldiers.yaml --set groups.0.count=40 --json");
  sub->callback([certify_options, &exit_code] { exit_code = certify(*certify_options); });

  auto gait_options = std::make_shared<GaitOptions>();
  sub = verb->add_subcommand(
      "gait",
      "Speed function g and sway g^psi of a motion model's styles, as scenario files write them");
  sub->add_option("MODEL", gait_options->model, "*.motion.json, here or in models/")->required();
  sub->add_option("--style", gait_options->style, "Only this style");
  sub->add_option("--harmonics", gait_options->harmonics, "Harmonics over a gait cycle")
      ->check(CLI::Range(0, crowd::SpeedFunction::kHarmonics))
      ->capture_default_str();
  sub->add_flag("--json", gait_options->json, "One object: model, gaits");
  sub->footer(
      "Exit codes: 0 done, 2 no such model or style, or g touches zero.\n"
      "Examples:\n  mimesis crowd gait walk.motion.json\n"
      "  mimesis crowd gait walk.motion.json --style walk --harmonics 2 --json");
  sub->callback([gait_options, &exit_code] { exit_code = gait(*gait_options); });
}

}  // namespace mimesis::tool
