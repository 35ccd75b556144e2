#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/error.h"
#include "common/json_text.h"
#include "common/motion/demix/held_out.h"
#include "common/motion/demix/sisa.h"
#include "common/motion/mocap/trials.h"
#include "common/motion/model/motion_model.h"
#include "common/time.h"
#include "nodes/synthesizer/verb/trial_files.h"
#include "tools/mimesis/progress.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;

// --- Report

using demix::Delays;
using demix::Mixture;
using nlohmann::ordered_json;

/// How well one way to describe the set does; parameters without the means. `held`: on clips that
/// were left out; null: not asked for.
ordered_json measure(const std::string& name, const mocap::Trials& set, const Mixture& mixture,
                     Delays delays, const demix::HeldOut* held) {
  const Eigen::MatrixXd fit = mixture.reconstruct();
  ordered_json out{{"name", name},
                   {"sources", mixture.sources.rows()},
                   {"parameters", demix::parameter_count(mixture, set, delays)},
                   {"Q", demix::quality(set.samples, fit)},
                   {"Q2", demix::quality_squared(set.samples, fit)}};
  if (held == nullptr) return out;
  const bool some = held->groups > 0;
  out["Q_held_out"] = some ? ordered_json(held->quality) : ordered_json(nullptr);
  out["Q2_held_out"] = some ? ordered_json(held->quality_squared) : ordered_json(nullptr);
  return out;
}

/// "lhip" of "lhip.x".
std::string joint_of(const std::string& row) { return row.substr(0, row.rfind('.')); }

ordered_json joint_errors(const mocap::Trials& set, const Mixture& mixture) {
  const Eigen::MatrixXd error = mixture.reconstruct() - set.samples;
  const auto rows = static_cast<std::size_t>(set.rows_per_trial());
  ordered_json out = ordered_json::array();
  for (std::size_t first = 0; first < rows;) {
    std::size_t last = first + 1;
    while (last < rows && joint_of(set.rows[last]) == joint_of(set.rows[first])) ++last;
    double squares = 0.0;
    for (std::size_t i = 0; i < set.trials.size(); ++i) {
      const auto block = static_cast<Eigen::Index>(i * rows + first);
      squares += error.middleRows(block, static_cast<Eigen::Index>(last - first)).squaredNorm();
    }
    const auto values =
        static_cast<double>(set.trials.size() * (last - first)) * static_cast<double>(error.cols());
    out.push_back({{"joint", joint_of(set.rows[first])}, {"rms_rad", std::sqrt(squares / values)}});
    first = last;
  }
  return out;
}

/// Q and Q2 of a mixture, beside as many principal components. `held`: of the mixture; null: none
/// is asked for.
ordered_json make_report(const mocap::Trials& set, const Mixture& mixture, const std::string& name,
                         Delays delays, const demix::HeldOut* held) {
  ordered_json report{
      {"trials", set.trials.size()}, {"rows", set.rows.size()}, {"samples", set.samples.cols()}};
  report.update(measure(name, set, mixture, delays, held));
  const int k = std::min(report["sources"].get<int>(), static_cast<int>(demix::rank(set)));
  const auto pca = [k](const mocap::Trials& of) { return demix::principal_components(of, k); };
  demix::HeldOut its;
  if (held != nullptr) its = demix::held_out(set, Delays::none, false, pca);
  report["others"] = {measure("principal components (PCA)", set, pca(set), Delays::none,
                              held == nullptr ? nullptr : &its)};
  report["joints"] = joint_errors(set, mixture);
  return report;
}

void print(const ordered_json& report) {
  std::cout << fmt::format("{} trials of {} rows, {} samples a period\n", report["trials"].dump(),
                           report["rows"].dump(), report["samples"].dump());
  const bool bold = use_colour(STDOUT_FILENO);
  TextTable table({"method", "sources", "parameters", "Q", "Q2", "Q held out", "Q2 held out"});
  const auto row = [&table](const ordered_json& m) {
    const auto digits = [&m](const char* key) {
      return m.contains(key) && m[key].is_number() ? fmt::format("{:.4f}", m[key].get<double>())
                                                   : std::string("-");
    };
    table.row({m["name"], m["sources"].dump(), m["parameters"].dump(), digits("Q"), digits("Q2"),
               digits("Q_held_out"), digits("Q2_held_out")});
  };
  row(report);
  for (const ordered_json& m : report["others"]) row(m);
  table.print(std::cout, bold);
  if (report.contains("held_out")) {
    const ordered_json& held = report["held_out"];
    if (held["groups"].get<int>() == 0) {
      std::cout << fmt::format("held out: none: {}\n", held["reason"].get<std::string>());
    } else {
      std::cout << fmt::format("held out: each of {} {}s once ({:.1f} s, learning {:.1f} s)\n",
                               held["groups"].dump(), held["by"].get<std::string>(),
                               held["seconds"].get<double>(),
                               report["learning_seconds"].get<double>());
    }
  }
  std::cout << '\n';
  TextTable joints({"joint", "rms error [rad]"});
  for (const ordered_json& j : report["joints"]) {
    joints.row({j["joint"], fmt::format("{:.4f}", j["rms_rad"].get<double>())});
  }
  joints.print(std::cout, bold);
}

// --- Report on the robot

constexpr std::size_t kNearest = 8;  // rows in the table

std::string text(const retarget::Deviation& d, double unit) {
  return fmt::format("{:.1f} / {:.1f}", unit * d.rms, unit * d.max);
}

ordered_json json(const retarget::Deviation& d) { return {{"rms", d.rms}, {"max", d.max}}; }

void print_retargeting(const std::vector<RetargetedClip>& clips) {
  const bool bold = use_colour(STDOUT_FILENO);
  TextTable table({"clip", "scale", "feet rms/max [mm]", "feet [mrad]", "hands [mm]",
                   "chest [mrad]", "figure's ankles [mm]", "speed/limit", "fastest"});
  for (const RetargetedClip& c : clips) {
    const retarget::RobotReport& r = c.report;
    table.row({c.file, fmt::format("{:.3f}", r.scale), text(r.foot_m, 1e3), text(r.foot_rad, 1e3),
               text(r.hand_m, 1e3), text(r.chest_rad, 1e3), text(c.ankle_m, 1e3),
               fmt::format("{:.2f}", r.speed_share), r.fastest_joint});
  }
  table.print(std::cout, bold);
  for (const RetargetedClip& c : clips) {
    std::cout << fmt::format("{}: at their limits in {} of {} frames: {}\n", c.file,
                             c.report.frames_at_limits, c.frames,
                             c.report.joints_at_limits.empty()
                                 ? "none"
                                 : fmt::format("{}", fmt::join(c.report.joints_at_limits, " ")));
  }
  std::cout << '\n';
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

/// The rows that come nearest to their limits or pass them, worst first.
ordered_json limits_json(const motion::MotionModel& model) {
  std::vector<motion::LimitExcess> rows = motion::limit_excess(model);
  std::ranges::stable_sort(rows, std::greater{}, &motion::LimitExcess::beyond_rad);
  ordered_json out = ordered_json::array();
  for (const motion::LimitExcess& row : rows) {
    out.push_back({{"row", row.row},
                   {"beyond_rad", row.beyond_rad},
                   {"pattern", row.pattern},
                   {"phase_rad", row.phase_rad}});
  }
  return out;
}

void print_limits(const ordered_json& rows) {
  const auto beyond = std::ranges::count_if(
      rows, [](const ordered_json& r) { return r["beyond_rad"].get<double>() > 0.0; });
  std::cout << fmt::format(
      "\n{} of {} rows with limits pass them in some pattern (blends: see motion_model.h)\n",
      beyond, rows.size());
  TextTable table({"nearest to limits", "beyond [rad]", "pattern", "phase [rad]"});
  for (std::size_t i = 0; i < std::min(kNearest, rows.size()); ++i) {
    table.row({rows[i]["row"], fmt::format("{:.4f}", rows[i]["beyond_rad"].get<double>()),
               rows[i]["pattern"].dump(),
               fmt::format("{:.2f}", rows[i]["phase_rad"].get<double>())});
  }
  table.print(std::cout, use_colour(STDOUT_FILENO));
}

// --- The verb

struct Options {
  std::vector<std::string> files, styles;
  TrialFileOptions trials;
  demix::SisaOptions sisa;
  int fixed = 0, smooth = 0;
  bool average = false, whole_clips = false, json = false, held_out = true;
  std::string out, name, map;
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
}

/// @param start  learned sources to start from (SisaOptions::start), or none
Mixture learn(const Options& o, const mocap::Trials& set, const Eigen::MatrixXd& start,
              const std::function<void(double)>& progress) {
  demix::SisaOptions options = o.sisa;
  options.start = start;
  options.progress = progress;
  Mixture mixture = demix::sisa(set, options).mixture;
  if (o.smooth == 0) return mixture;
  return demix::smooth_sources(set, mixture,
                               {.half_window = o.smooth, .nonnegative = o.sisa.nonnegative})
      .mixture;
}

/// Calls `work` with a function that shows the share done.
template <class Work>
auto with_progress(const char* what, const Work& work) {
  Progress bar(what, 1000, Progress::Unit::none);
  return work([&bar](double share) { bar.at(std::uint64_t(std::lround(1000.0 * share))); });
}

/// Everything is learned as for all clips, from where that has led.
demix::HeldOut hold_out(const Options& o, const mocap::Trials& set, const Mixture& whole) {
  const Eigen::MatrixXd start = whole.sources.bottomRows(whole.source_count() - whole.fixed);
  return with_progress("leaving out", [&](const auto& progress) {
    return demix::held_out(
        set, o.sisa.tied ? Delays::tied : Delays::free, o.sisa.nonnegative,
        [&](const mocap::Trials& others) { return learn(o, others, start, {}); }, progress);
  });
}

std::string command_line(const Options& o) {
  std::string text = fmt::format("mimesis demix {} --sources {}", MIMESIS_VERSION, o.sisa.sources);
  if (o.sisa.tied) text += " --tied";
  if (o.sisa.nonnegative) text += " --nonnegative";
  if (o.fixed > 0) text += fmt::format(" --fixed {}", o.fixed);
  if (o.smooth > 0) text += fmt::format(" --smooth {}", o.smooth);
  if (o.average) text += " --average";
  if (!o.trials.robot.file.empty()) {
    text += fmt::format(" --robot {} --limit-margin-rad {}",
                        fs::path(o.trials.robot.file).filename().string(),
                        o.trials.robot.limit_margin_rad);
  }
  return text;
}

motion::MotionModel save(const Options& o, const TrialFiles& files, const demix::Mixture& mixture) {
  motion::MotionModel model = motion::make_model(files.set, mixture, o.sisa.tied, files.body);
  if (o.average) model = motion::average_styles(model);
  model.name = o.name;
  model.created_by = command_line(o);
  model.learned_from = files.files;
  model.limits_rad = files.limits_rad;
  motion::save_motion_model(model, o.out);
  return model;
}

int run(Options& o) {
  const auto started = std::chrono::steady_clock::now();
  if (!o.map.empty()) read_map(o.map, o.trials.read, o.trials.markers);
  read_styles(o);
  check(o);
  if (o.whole_clips) o.trials.cut.cut = mocap::CycleOptions::Cut::whole_clip;
  if (o.name.empty()) {
    o.name = fs::path(o.out).filename().string();
    o.name = o.name.substr(0, o.name.find('.'));
  }
  const TrialFiles files = read_files(o);
  for (const std::string& note : files.notes) std::cerr << mocap::one_line(note) << '\n';
  for (const auto& [file, reason] : files.left_out) {
    std::cerr << file << ": left out: " << reason << '\n';
  }
  if (o.fixed > 0) o.sisa.fixed = demix::non_periodic(o.fixed, files.set.samples.cols());
  const auto seconds_since = [](std::chrono::steady_clock::time_point t) {
    return to_seconds(std::chrono::steady_clock::now() - t);
  };
  const auto learning = std::chrono::steady_clock::now();
  const Mixture mixture = with_progress(
      "demixing", [&](const auto& progress) { return learn(o, files.set, {}, progress); });
  const double learning_seconds = seconds_since(learning);
  if (files.standard_body) {
    std::cerr
        << "no clip tells the lengths of the figure's limbs: a standard one of 1.70 m is taken\n";
  }
  const motion::MotionModel model = save(o, files, mixture);
  std::optional<demix::HeldOut> held;
  const auto holding = std::chrono::steady_clock::now();
  if (o.held_out) held = hold_out(o, files.set, mixture);
  const double held_out_seconds = seconds_since(holding);
  ordered_json report = make_report(
      files.set, mixture, o.sisa.tied ? "anechoic, tied delays (SISA)" : "anechoic (SISA)",
      o.sisa.tied ? Delays::tied : Delays::free, held ? &*held : nullptr);
  report["learning_seconds"] = learning_seconds;
  if (held) {
    report["held_out"] = {{"by", held->by_clip ? "clip" : "trial"},
                          {"groups", held->groups},
                          {"reason", held->reason},
                          {"seconds", held_out_seconds}};
  }
  const double seconds = seconds_since(started);
  if (!o.json) {
    if (!files.retargeted.empty()) print_retargeting(files.retargeted);
    print(report);
    if (!model.limits_rad.empty()) print_limits(limits_json(model));
    std::cout << fmt::format("model: {} ({:.1f} s)\n", o.out, seconds);
    return 0;
  }
  report["model"] = o.out;
  if (!files.retargeted.empty()) {
    report["retargeting"] = retargeting_json(files.retargeted);
    report["limits"] = limits_json(model);
  }
  report["left_out"] = ordered_json::array();
  for (const auto& [file, reason] : files.left_out) {
    report["left_out"].push_back({{"file", file}, {"reason", reason}});
  }
  report["seconds"] = seconds;
  std::cout << json_text(report) << '\n';
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
  verb.add_flag("!--no-held-out", o.held_out,
                "Do not learn again without each clip: one run less per clip");
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
  verb.add_option("--unit-m", o.trials.read.unit_m,
                  "Length of the files' unit; 0: by the figure's height")
      ->check(number_not_below_zero);
  verb.add_option(
          "--map", o.map,
          "Joints or markers of the figure, as `mimesis motion map` prints them; otherwise found")
      ->type_name("YAML");
  verb.add_flag("--markers-legs-only", o.trials.markers.legs_only,
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
  verb->add_option("FILE...", o->files,
                   "Clips (.bvh .amc .c3d .fbx .glb .gltf .dae, of several animations "
                   "FILE#NAME) and sets of trials (.csv)")
      ->required();
  verb->add_option("-o,--out", o->out, "Model: NAME.motion.json")->required();
  add_learning_options(*verb, *o);
  add_reading_options(*verb, *o);
  add_robot_options(*verb, *o);
  verb->add_option("--name", o->name, "Name of the model; otherwise from --out");
  verb->add_flag("--json", o->json, "Print one JSON object at the end");
  verb->footer(
      "Q = 1 - |X - X'|/|X| and Q2 = 1 - |X - X'|^2/|X|^2 over all rows, means removed, of the\n"
      "trials that sources are learned from. Held out: of each clip (of one clip: each trial),\n"
      "sources and tied delays learned from the others alone, weights, means and free delays\n"
      "fitted to it.\n"
      "Exit codes: 0 done, 2 usage, or a file that cannot be used.\nExamples:\n"
      "  mimesis demix walks/*.bvh --sources 4 --out walk.motion.json\n"
      "  mimesis demix *.amc --tied --average --style 16_15.amc=slow -k 5 -o gaits.motion.json\n"
      "  mimesis motion map walk.bvh >map.yaml; mimesis demix walk.bvh --map map.yaml ...\n"
      "  mimesis demix *.bvh --robot models/biped.yaml --tied --average -k 6 -o b.motion.json");
  verb->callback([o, &exit_code] { exit_code = run(*o); });
}

}  // namespace mimesis::tool
