#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/math/so3.h"
#include "common/model/drawing.h"
#include "common/motion/demix/sisa.h"
#include "common/motion/mocap/clip_writers.h"
#include "common/motion/mocap/cycles.h"
#include "common/runtime/raw.h"
#include "nodes/synthesizer/synthesizer_messages.h"
#include "nodes/synthesizer/verb/figure_files.h"
#include "nodes/synthesizer/verb/trial_files.h"
#include "tools/mimesis/log/new_log.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

/// How recordings are read.
struct Reading {
  mocap::ReadOptions read;
  std::string map;
  MarkerReading markers;

  void add_to(CLI::App& verb) {
    verb.add_option("--asf", read.asf, "Skeleton of AMC files; otherwise the one beside them");
    verb.add_option("--unit-m", read.unit_m, "Length of the file's unit; 0: by the figure's height")
        ->check(number_not_below_zero);
    verb.add_option("--map", map, "Joints or markers of the figure, as `motion map` prints them")
        ->type_name("YAML");
    verb.add_flag("--markers-legs-only", markers.legs_only,
                  "C3D: markers of pelvis and legs are enough, the rest stands stiff");
  }
  mocap::BodyClip figure(const std::string& file) {
    if (!map.empty()) read_map(map, read, markers);
    std::vector<std::string> notes;
    auto clip = read_figure(file, read, markers, notes);
    for (const std::string& note : notes) std::cerr << mocap::one_line(note) << '\n';
    if (!clip) throw ConfigError(clip.error().reason);
    return std::move(*clip);
  }
};

// --- map

/// The map of each file's joints, as --map takes it.
int print_maps(const std::vector<std::string>& files, const Reading& reading) {
  for (const std::string& file : files) {
    std::cout << "# " << mocap::one_line(file) << '\n' << map_text(file, reading.read);
  }
  return 0;
}

// --- export

struct ExportMotion {
  std::string input, bvh, gltf, style;
  CharacterOptions character;
  Reading reading;
  bool in_place = false, force = false, json = false;
};

mocap::BodyClip motion_of(ExportMotion& o) {
  constexpr double kRate_hz = 60.0;
  if (o.input.ends_with(".motion.json")) {
    const double rate_hz = o.character.rate_hz > 0.0 ? o.character.rate_hz : kRate_hz;
    return style_cycle(o.input, o.style, rate_hz, o.in_place);
  }
  if (o.in_place || !o.style.empty()) {
    throw ConfigError("--style and --in-place: " + o.input + " is no model (NAME.motion.json)");
  }
  if (!o.input.ends_with(".mcap")) return o.reading.figure(o.input);
  std::vector<std::string> notes;
  mocap::BodyClip clip = read_character(open_logs({o.input}), o.character, notes);
  for (const std::string& note : notes) std::cerr << mocap::one_line(note) << '\n';
  return clip;
}

void write_file(const std::string& path, const std::string& bytes, bool force) {
  std::error_code error;
  if (!force && fs::exists(path, error)) {
    throw ConfigError(path + ": is there already; --force replaces it");
  }
  errno = 0;
  std::ofstream out(path, std::ios::binary);
  out << bytes;
  out.close();
  if (!out) throw ConfigError(path + ": cannot be written: " + std::strerror(errno));
}

int run_export(ExportMotion& o) {
  if (o.bvh.empty() && o.gltf.empty())
    throw ConfigError("say where to: --bvh FILE or --gltf FILE.glb");
  if (!o.gltf.empty() && !o.gltf.ends_with(".glb")) {
    throw ConfigError("--gltf " + o.gltf + ": expected the ending .glb, of binary glTF");
  }
  const mocap::BodyClip clip = motion_of(o);
  ordered_json files = ordered_json::array();
  const auto put = [&](const std::string& path, const std::string& bytes) {
    write_file(path, bytes, o.force);
    files.push_back(path);
  };
  if (!o.bvh.empty()) put(o.bvh, bvh_text(clip));
  if (!o.gltf.empty()) put(o.gltf, glb_bytes(clip));
  if (o.json) {
    print_json({{"files", files},
                {"motion", clip.name},
                {"frames", clip.frames()},
                {"rate_hz", clip.rate_hz},
                {"seconds", static_cast<double>(clip.frames()) / clip.rate_hz}});
  } else {
    std::cerr << fmt::format("{}: {} frames at {:g} Hz, {:.2f} s\n", mocap::one_line(clip.name),
                             clip.frames(), clip.rate_hz,
                             static_cast<double>(clip.frames()) / clip.rate_hz);
  }
  return 0;
}

// --- view

struct ViewMotion {
  std::string input, out;
  Reading reading;
  int sources = 4;
  bool whole_clip = false, force = false;
};

/// The clip's frames as a mixture of sources learned from it makes them, 51 x frames; frames that
/// belong to no trial stay NaN.
Eigen::MatrixXd resynthesized(const mocap::BodyClip& clip, const ViewMotion& o) {
  mocap::CycleOptions cut;
  if (o.whole_clip) cut.cut = mocap::CycleOptions::Cut::whole_clip;
  const auto set = mocap::cut_cycles(clip, cut);
  if (!set) {
    throw ConfigError(
        fmt::format("{}: {}; --whole-clips takes it as one", o.input, set.error().reason));
  }
  demix::SisaOptions options;
  options.sources = static_cast<int>(std::min<Eigen::Index>(o.sources, demix::rank(*set)));
  const demix::SisaResult learned = demix::sisa(*set, options);
  std::cerr << fmt::format("{} trials, {} sources: Q = {:.3f}, Q2 = {:.4f}\n", set->trials.size(),
                           options.sources, learned.quality, learned.quality_squared);
  const Eigen::MatrixXd made = learned.mixture.reconstruct();
  const Eigen::VectorXd heading = mocap::heading_rad(clip);
  const Eigen::Index samples = made.cols(), rows = mocap::kBodyRows;
  Eigen::MatrixXd out = Eigen::MatrixXd::Constant(rows, clip.frames(), NAN);
  for (std::size_t i = 0; i < set->trials.size(); ++i) {
    const mocap::Trial& trial = set->trials[i];
    const Eigen::Index first = trial.first_frame - clip.first_frame,
                       last = trial.last_frame - clip.first_frame;
    const auto block = made.middleRows(static_cast<Eigen::Index>(i) * rows, rows);
    for (Eigen::Index t = std::max<Eigen::Index>(first, 0); t <= last && t < clip.frames(); ++t) {
      const double place = static_cast<double>(t - first) / static_cast<double>(last - first) *
                           static_cast<double>(samples);
      const auto low = static_cast<Eigen::Index>(place);
      const double share = place - static_cast<double>(low);
      Eigen::VectorXd angles =
          (1.0 - share) * block.col(low % samples) + share * block.col((low + 1) % samples);
      const Eigen::Matrix3d R_WR =
          Eigen::AngleAxisd(heading[t], Eigen::Vector3d::UnitZ()) * math::exp_so3(angles.head<3>());
      angles.head<3>() = math::log_so3(R_WR);
      out.col(t) = angles;
    }
  }
  return out;
}

void write_scene(const mocap::BodyClip& clip, const Eigen::MatrixXd& made, const ViewMotion& o) {
  constexpr double kAside_m = 1.2;
  NewLog log({.path = o.out, .force = o.force}, {o.input});
  const auto& type = *foxglove::SceneUpdate::descriptor();
  const log::Schema schema{.name = std::string(type.full_name()),
                           .encoding = "protobuf",
                           .data = runtime::descriptor_set(type)};
  const auto draw = [&](const std::string& topic, const Eigen::MatrixXd& angles, double aside_m) {
    const std::uint16_t channel = log.channel({0, 0, topic, "protobuf", {}}, &schema);
    std::uint32_t seq = 0;
    for (Eigen::Index t = 0; t < clip.frames(); ++t) {
      const auto now =
          std::chrono::nanoseconds(std::llround(1e9 * static_cast<double>(t) / clip.rate_hz));
      foxglove::SceneUpdate update;
      foxglove::SceneEntity& entity = model::add_entity(update, topic, "world", now);
      if (angles.col(t).allFinite()) {
        const Eigen::VectorXd column = angles.col(t);
        const auto pose = forward_kinematics(
            clip.body, std::span<const double, mocap::kBodyRows>(column.data(), mocap::kBodyRows),
            clip.root_position_W_m.col(t) + Eigen::Vector3d(0.0, aside_m, 0.0));
        synthesizer::add_figure(clip.body, pose, entity);
      }
      const std::string data = update.SerializeAsString();
      const auto ns = static_cast<std::uint64_t>(now.count());
      log.write({channel, ++seq, ns, ns, data});
    }
  };
  draw("recorded", clip.angles_rad, 0.0);
  draw("resynthesized", made, -kAside_m);
  log.finish();
}

/// `mimesis view LOG`, until it ends.
int show(const std::string& log) {
  std::error_code error;
  const std::string program =
      (fs::read_symlink("/proc/self/exe", error).parent_path() / "mimesis-view").string();
  std::string words[] = {program, log};
  char* arguments[] = {words[0].data(), words[1].data(), nullptr};
  signal(SIGINT, SIG_IGN);  // it is the viewer's
  pid_t pid = 0;
  if (const int failed = posix_spawn(&pid, program.c_str(), nullptr, nullptr, arguments, environ)) {
    throw VerbEnd{program + ": " + std::strerror(failed), 1};
  }
  int status = 0;
  while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

int run_view(ViewMotion& o) {
  const mocap::BodyClip clip = o.reading.figure(o.input);
  const Eigen::MatrixXd made = resynthesized(clip, o);
  if (!o.out.empty()) {
    write_scene(clip, made, o);
    return 0;
  }
  std::string folder = (fs::temp_directory_path() / "mimesis-motion-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) throw ConfigError(folder + ": " + std::strerror(errno));
  o.out = folder + "/motion.mcap";
  write_scene(clip, made, o);
  const int exit_code = show(o.out);
  std::error_code ignored;
  fs::remove_all(folder, ignored);
  return exit_code;
}

void add_motion_map(CLI::App& verb, int& exit_code) {
  struct Options {
    std::vector<std::string> files;
    Reading reading;
  };
  auto o = std::make_shared<Options>();
  CLI::App* map =
      verb.add_subcommand("map", "Prints which joints or markers of files are those of the figure");
  map->add_option("FILE...", o->files, "Recordings: .bvh .amc .c3d .fbx .glb .gltf .dae")
      ->required();
  map->add_option("--asf", o->reading.read.asf,
                  "Skeleton of AMC files; otherwise the one beside them");
  map->footer(
      "Exit codes: 0 done, 2 usage, or a file without a person's skeleton.\nExamples:\n"
      "  mimesis motion map walk.bvh >map.yaml\n"
      "  mimesis demix walk.bvh --map map.yaml -o walk.motion.json");
  map->callback([o, &exit_code] { exit_code = print_maps(o->files, o->reading); });
}

void add_motion_export(CLI::App& verb, int& exit_code) {
  auto o = std::make_shared<ExportMotion>();
  CLI::App* sub = verb.add_subcommand("export", "Writes a figure's motion as BVH or glTF");
  sub->add_option("INPUT", o->input, "A log of a run, a model (its style's cycle), or a recording")
      ->required();
  sub->add_option("--bvh", o->bvh, "File to write: y up, cm, joints as Mixamo names them");
  sub->add_option("--gltf", o->gltf, "File to write, .glb: the joints, and a wedge for each bone");
  sub->add_option("--character", o->character.character, "Of a log: which of several, from 0")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  sub->add_option("--topic", o->character.topic, "Of a log: its motion, if there are several");
  sub->add_option("--model", o->character.model,
                  "Of a log: the model's file; otherwise that of its node's start");
  sub->add_option("--start", o->character.range.start, "Of a log: from here on, as in log cat");
  sub->add_option("--end", o->character.range.end, "Of a log: up to here");
  sub->add_option("--rate-hz", o->character.rate_hz,
                  "Frames a second; 0: the log's, 60 for a model's cycle")
      ->check(CLI::Range(0.0, 1000.0));
  sub->add_option("--style", o->style, "Of a model; otherwise its first");
  sub->add_flag("--in-place", o->in_place, "Of a model: the cycle without its way");
  o->reading.add_to(*sub);
  sub->add_flag("--force", o->force, "Replaces files that are there");
  sub->add_flag("--json", o->json, "Print one JSON object");
  sub->footer(
      "Exit codes: 0 done, 2 usage, or a file that cannot be used.\nExamples:\n"
      "  mimesis motion export run.mcap --bvh walk.bvh\n"
      "  mimesis motion export models/walk.motion.json --style brisk --in-place --gltf brisk.glb\n"
      "  mimesis motion export 16_15.amc --bvh walk.bvh");
  sub->callback([o, &exit_code] { exit_code = run_export(*o); });
}

void add_motion_view(CLI::App& verb, int& exit_code) {
  auto o = std::make_shared<ViewMotion>();
  CLI::App* sub = verb.add_subcommand(
      "view", "Shows a recording beside what primitives learned from it make of it");
  sub->add_option("FILE", o->input, "A recording")->required();
  sub->add_option("-k,--sources", o->sources, "Number of sources")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  sub->add_flag("--whole-clips", o->whole_clip,
                "The clip is one trial; otherwise gait cycles are cut");
  sub->add_option("-o,--out", o->out, "Write the log of both figures instead, for mimesis view");
  o->reading.add_to(*sub);
  sub->add_flag("--force", o->force, "Replaces a log that is there");
  sub->footer(
      "Exit codes: 0 done, 2 usage, or a file that cannot be used.\nExamples:\n"
      "  mimesis motion view walk.bvh --sources 3");
  sub->callback([o, &exit_code] { exit_code = run_view(*o); });
}

}  // namespace

void add_motion(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("motion", "Recordings and motion of figures as files");
  verb->require_subcommand(1);
  add_motion_map(*verb, exit_code);
  add_motion_export(*verb, exit_code);
  add_motion_view(*verb, exit_code);
}

}  // namespace mimesis::tool
