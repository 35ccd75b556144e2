#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>

#include "common/error.h"
#include "common/motion/demix/sisa.h"
#include "common/motion/mocap/body_map.h"
#include "common/motion/mocap/clip_file.h"
#include "common/motion/mocap/trials.h"
#include "common/motion/model/motion_model.h"
#include "common/time.h"
#include "tools/mimesis/demix/demix_report.h"
#include "tools/mimesis/number_check.h"
#include "tools/mimesis/progress.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::vector<std::string> files, styles;
  TrialFileOptions trials;
  demix::SisaOptions sisa;
  int fixed = 0, smooth = 0, up_to = 8;
  bool average = false, whole_clips = false, json = false;
  std::string method = "sisa";
  std::string out, name, plot_dir, trials_out, export_to;
};

void read_styles(Options& o) {
  for (const std::string& word : o.styles) {
    const std::size_t at = word.rfind('=');
    if (at == std::string::npos || at == 0 || at + 1 == word.size()) {
      throw ConfigError("--style: '" + word + "' is not FILE=NAME");
    }
    o.trials.styles[fs::path(word.substr(0, at)).filename().string()] = word.substr(at + 1);
  }
  for (const auto& [file, style] : o.trials.styles) {
    const bool known = std::ranges::any_of(o.files, [&file = file](const std::string& f) {
      return fs::path(f).filename() == fs::path(file);
    });
    if (!known) throw ConfigError("--style: " + file + " is none of the files");
  }
}

TrialFiles read_files(const Options& o) {
  Progress bar("reading", o.files.size(), Progress::Unit::none);
  return read_trial_files(o.files, o.trials, [&bar](std::size_t done) { bar.at(done); });
}

/// Refuses options that the methods cannot combine.
void check(const Options& o) {
  if (o.average && !o.sisa.tied) {
    throw ConfigError("--average: needs --tied (free delays have no mean)");
  }
  if (o.method == "wigner") {
    const char* not_with = o.sisa.tied          ? "--tied"
                           : o.sisa.nonnegative ? "--nonnegative"
                           : o.fixed > 0        ? "--fixed"
                                                : nullptr;
    if (not_with) {
      throw ConfigError(std::string("--method wigner: not with ") + not_with +
                        ", it has free delays and weights of any sign alone");
    }
  }
}

demix::SisaResult learn(Options& o, const mocap::Trials& set) {
  if (o.fixed > 0) o.sisa.fixed = demix::non_periodic(o.fixed, set.samples.cols());
  Progress bar("demixing", 1000, Progress::Unit::none);
  const auto progress = [&bar](double share) {
    bar.at(std::uint64_t(std::lround(1000.0 * share)));
  };
  demix::SisaResult result;
  if (o.method == "wigner") {
    result = demix::wigner(set, {.sources = o.sisa.sources, .progress = progress});
  } else {
    demix::SisaOptions options = o.sisa;
    options.progress = progress;
    result = demix::sisa(set, options);
  }
  if (o.smooth == 0) return result;
  return demix::smooth_sources(set, result.mixture,
                               {.half_window = o.smooth, .nonnegative = o.sisa.nonnegative});
}

std::string command_line(const Options& o) {
  std::string text = fmt::format("mimesis demix {} --sources {}", MIMESIS_VERSION, o.sisa.sources);
  if (o.sisa.tied) text += " --tied";
  if (o.sisa.nonnegative) text += " --nonnegative";
  if (o.fixed > 0) text += fmt::format(" --fixed {}", o.fixed);
  if (o.smooth > 0) text += fmt::format(" --smooth {}", o.smooth);
  if (o.average) text += " --average";
  if (o.method != "sisa") text += " --method " + o.method;
  if (!o.trials.robot.file.empty()) {
    text += fmt::format(" --robot {} --limit-margin-rad {}",
                        fs::path(o.trials.robot.file).filename().string(),
                        o.trials.robot.limit_margin_rad);
  }
  return text;
}

/// Writes one period of the first pattern as the model has it. The pelvis travels the step length
/// along x, at the height that puts the lowest point of the feet onto the ground.
void export_motion(const motion::MotionModel& model, const std::string& file) {
  const motion::Pattern& p = model.patterns.front();
  for (int r = 0; r < mocap::kBodyRows; ++r) {
    if (static_cast<int>(model.rows.size()) <= r ||
        model.rows[static_cast<std::size_t>(r)] != mocap::body_row_name(r)) {
      throw ConfigError("--export: the rows are not those of the figure of 17 joints");
    }
  }
  mocap::BodyClip clip;
  clip.body = model.body;
  clip.name = model.name;
  clip.angles_rad =
      demix::Mixture{model.sources, p.weight_rad, p.delay_rad, p.mean_rad, model.fixed}
          .reconstruct()
          .topRows(mocap::kBodyRows);
  const auto frames = static_cast<double>(clip.frames());
  clip.rate_hz = frames / p.trial.duration_s;
  clip.root_position_W_m = Eigen::Matrix3Xd::Zero(3, clip.frames());
  for (Eigen::Index t = 0; t < clip.frames(); ++t) {
    const mocap::BodyPose pose = clip.pose(t);
    double lowest = 0.0;
    for (const auto& [ankle, side] : {std::pair{mocap::kLeftAnkle, mocap::kLeft},
                                      std::pair{mocap::kRightAnkle, mocap::kRight}}) {
      lowest = std::min({lowest, pose.point(ankle, clip.body.heel_m[side]).z(),
                         pose.point(ankle, clip.body.toe_m[side]).z()});
    }
    clip.root_position_W_m.col(t) << p.trial.step_length_m * static_cast<double>(t) / frames, 0.0,
        -lowest;
  }
  mocap::write_clip(mocap::to_clip(clip), file);
}

motion::MotionModel save(const Options& o, const TrialFiles& files, const demix::Mixture& mixture) {
  motion::MotionModel model = motion::make_model(files.set, mixture, o.sisa.tied, files.body);
  if (o.average) model = motion::average_styles(model);
  model.name = o.name;
  model.created_by = command_line(o);
  model.learned_from = files.files;
  model.limits_rad = files.limits_rad;
  if (!o.export_to.empty()) export_motion(model, o.export_to);
  motion::save_motion_model(model, o.out);
  return model;
}

int run(Options& o) {
  const auto started = std::chrono::steady_clock::now();
  read_styles(o);
  check(o);
  if (o.whole_clips) o.trials.cut.cut = mocap::CycleOptions::Cut::whole_clip;
  if (o.name.empty()) {
    o.name = fs::path(o.out).filename().string();
    o.name = o.name.substr(0, o.name.find('.'));
  }
  const TrialFiles files = read_files(o);
  for (const auto& [file, reason] : files.left_out) {
    std::cerr << file << ": left out: " << reason << '\n';
  }
  if (!o.trials_out.empty()) mocap::write_trials(files.set, o.trials_out);
  const demix::SisaResult result = learn(o, files.set);
  if (files.standard_body) {
    std::cerr
        << "no clip tells the lengths of the figure's limbs: a standard one of 1.70 m is taken\n";
  }
  const motion::MotionModel model = save(o, files, result.mixture);
  const auto delays = o.sisa.tied ? demix::Delays::tied : demix::Delays::free;
  const DemixReport report = make_report(files.set, result.mixture,
                                         o.method == "wigner" ? "anechoic (Wigner-Ville)"
                                         : o.sisa.tied        ? "anechoic, tied delays (SISA)"
                                                              : "anechoic (SISA)",
                                         delays);
  std::vector<std::string> plots;
  if (!o.plot_dir.empty()) {
    plots = plot_demixing(o.plot_dir, o.name, files.set, result.mixture, o.sisa, o.up_to);
  }
  const double seconds = to_seconds(std::chrono::steady_clock::now() - started);
  if (!o.json) {
    if (!files.retargeted.empty()) print_retargeting(files.retargeted);
    print(report);
    if (!model.limits_rad.empty()) print_limits(model);
    for (const std::string& plot : plots) std::cout << "plot: " << plot << '\n';
    std::cout << fmt::format("model: {} ({:.1f} s)\n", o.out, seconds);
    return 0;
  }
  nlohmann::ordered_json json = to_json(report);
  json["model"] = o.out;
  json["plots"] = plots;
  if (!files.retargeted.empty()) {
    json["retargeting"] = retargeting_json(files.retargeted);
    json["limits"] = limits_json(model);
  }
  json["left_out"] = nlohmann::ordered_json::array();
  for (const auto& [file, reason] : files.left_out) {
    json["left_out"].push_back({{"file", file}, {"reason", reason}});
  }
  json["seconds"] = seconds;
  std::cout << json.dump() << '\n';
  return 0;
}

void add_learning_options(CLI::App& verb, Options& o) {
  verb.add_option("-k,--sources", o.sisa.sources, "Number of sources, fixed ones among them")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  verb.add_flag("--tied", o.sisa.tied,
                "One delay per joint angle and source, the same in all trials: for blending");
  verb.add_flag("--nonnegative", o.sisa.nonnegative, "No weight below 0");
  verb.add_option("--fixed", o.fixed, "Non-periodic sources: cos(πt/T), then cos and sin(πt/2T)")
      ->check(CLI::Range(0, 3))
      ->capture_default_str();
  verb.add_option("--smooth", o.smooth,
                  "Smooth sources by cubics over N samples on either side, then fit the "
                  "weights again; 0: off")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  verb.add_option("--method", o.method,
                  "sisa, or wigner: marginals of Wigner-Ville spectra, for free delays and any "
                  "weights only; its plot of Q is that of sisa")
      ->check(CLI::IsMember({"sisa", "wigner"}))
      ->capture_default_str();
  verb.add_flag("--average", o.average, "One pattern per style in the model, not one per trial");
}

void add_reading_options(CLI::App& verb, Options& o) {
  verb.add_flag("--whole-clips", o.whole_clips,
                "Each clip is one trial; otherwise gait cycles are cut");
  verb.add_option("--samples", o.trials.cut.samples, "Number of samples of a trial")
      ->check(CLI::Range(8, 2000))
      ->capture_default_str();
  verb.add_option("--cutoff-hz", o.trials.cut.cutoff_hz, "Low-pass of the angles; 0: none")
      ->check(number_not_below_zero)
      ->capture_default_str();
  verb.add_option("--asf", o.trials.read.asf,
                  "Skeleton of AMC files; otherwise the one beside them");
  verb.add_option("--unit-m", o.trials.read.unit_m, "Length of the files' unit; 0: by their kind")
      ->check(number_not_below_zero);
  verb.add_flag("--markers-legs-only", o.trials.markers_legs_only,
                "C3D: markers of pelvis and legs are enough, the rest stands stiff");
  verb.add_option("--style", o.styles, "Name of a file's style; otherwise from its name")
      ->type_name("FILE=NAME");
  verb.add_option("--licence", o.trials.licence, "Licence of the files, kept in the model");
}

void add_robot_options(CLI::App& verb, Options& o) {
  RobotChoice& robot = o.trials.robot;
  verb.add_option("--robot", robot.file,
                  "Retarget clips to this robot, described as in models/biped.yaml; the rows are "
                  "those of its figure, then its joints")
      ->type_name("YAML");
  verb.add_option("--limit-margin-rad", robot.limit_margin_rad,
                  "Margin to joint limits when retargeting: the mixture overshoots")
      ->check(number_not_below_zero)
      ->capture_default_str();
}

}  // namespace

void add_demix(CLI::App& program, int& exit_code) {
  auto o = std::make_shared<Options>();
  CLI::App* verb =
      program.add_subcommand("demix", "Learns motion primitives: sources, weights and delays");
  verb->add_option("FILE...", o->files, "Clips (.bvh, .amc, .c3d) and sets of trials (.csv)")
      ->required();
  verb->add_option("-o,--out", o->out, "Model: NAME.motion.json")->required();
  add_learning_options(*verb, *o);
  add_reading_options(*verb, *o);
  add_robot_options(*verb, *o);
  verb->add_option("--name", o->name, "Name of the model; otherwise from --out");
  verb->add_option("--trials-out", o->trials_out, "Write the trials as CSV");
  verb->add_option("--export", o->export_to,
                   "Write the first pattern's motion as the model has it: .bvh or .csv")
      ->type_name("FILE");
  verb->add_option("--plot", o->plot_dir, "PNG of the sources, and of Q against K (needs gnuplot)")
      ->type_name("DIR");
  verb->add_option("--up-to", o->up_to, "Largest K of that plot")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  verb->add_flag("--json", o->json, "Print one JSON object at the end");
  verb->footer(
      "Q = 1 - |X - X'|/|X| and Q2 = 1 - |X - X'|^2/|X|^2 over all rows, means removed.\n"
      "Exit codes: 0 done, 1 a plot failed, 2 usage, or a file that cannot be used.\nExamples:\n"
      "  mimesis demix walks/*.bvh --sources 4 --out walk.motion.json --plot /tmp\n"
      "  mimesis demix *.amc --tied --average --style 16_15.amc=slow -k 5 -o gaits.motion.json\n"
      "  mimesis demix *.bvh --robot models/biped.urdf --tied --average -k 6 -o b.motion.json");
  verb->callback([o, &exit_code] { exit_code = run(*o); });
}

}  // namespace mimesis::tool
