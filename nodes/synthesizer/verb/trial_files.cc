#include "nodes/synthesizer/verb/trial_files.h"

#include <fmt/format.h>
#include <sodium/crypto_hash_sha256.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "common/error.h"
#include "common/model/files.h"
#include "common/motion/mocap/body_from_markers.h"
#include "common/motion/mocap/body_map.h"
#include "common/motion/mocap/markers.h"
#include "common/motion/mocap/trials.h"
#include "common/runtime/param_source.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;

void add(const mocap::Body& body, double share, mocap::Body& mean) {
  for (std::size_t j = 0; j < mocap::kBodyJoints; ++j) {
    mean.offset_m[j] += share * body.offset_m[j];
  }
  for (std::size_t side = 0; side < 2; ++side) {
    mean.toe_m[side] += share * body.toe_m[side];
    mean.heel_m[side] += share * body.heel_m[side];
    mean.hand_m[side] += share * body.hand_m[side];
  }
  mean.head_top_m += share * body.head_top_m;
}

mocap::Body mean_of(const std::vector<mocap::Body>& bodies) {
  if (bodies.size() == 1) return bodies.front();
  mocap::Body mean;
  mean.name = fmt::format("mean of {} figures", bodies.size());
  for (const mocap::Body& body : bodies) add(body, 1.0 / static_cast<double>(bodies.size()), mean);
  return mean;
}

bool ends_with(const std::string& name, const std::string& ending) {
  const std::size_t from = name.size() - std::min(name.size(), ending.size());
  return std::ranges::equal(name.substr(from), ending, {}, [](char c) { return std::tolower(c); });
}

void visit(runtime::ParamVisitor& v, mocap::BodyMap& map) {
  v.group("joints", [&](runtime::ParamVisitor& joints) {
    for (std::size_t j = 0; j < mocap::kBodyJoints; ++j) {
      joints(mocap::kBodyJointNames[j], map.joints[j]);
    }
    joints("ltoe", map.toes[mocap::kLeft]);
    joints("rtoe", map.toes[mocap::kRight]);
  });
  v.group("axes", [&](runtime::ParamVisitor& axes) {
    for (std::size_t j = 0; j < mocap::kBodyJoints; ++j) {
      axes(mocap::kBodyJointNames[j], map.axes[j]);
    }
  });
  v("sole_rad", map.sole_rad, -1.6, 0.3);
}

void visit(runtime::ParamVisitor& v, mocap::MarkerLabels& labels) {
  v.group("markers", [&](runtime::ParamVisitor& markers) {
    for (std::size_t i = 0; i < mocap::kGaitMarkers; ++i) {
      markers(mocap::kGaitMarkerNames[i], labels[i]);
    }
  });
}

/// @throws ConfigError if the set of `file` has other rows than the first one
void check_rows(const mocap::Trials& set, const mocap::Trials& first, const std::string& file) {
  const auto [ours, theirs] = std::ranges::mismatch(set.rows, first.rows);
  if (ours == set.rows.end() && theirs == first.rows.end()) return;
  throw ConfigError(fmt::format("{}: row {} is {}, expected {} as in the first file", file,
                                ours - set.rows.begin() + 1,
                                ours == set.rows.end() ? "missing" : *ours,
                                theirs == first.rows.end() ? "no more rows" : *theirs));
}

/// The robot with limits moved inwards.
robot::RobotTree narrowed(const robot::RobotTree& tree, double margin_rad) {
  std::vector<robot::Link> links = tree.links();
  for (robot::Link& link : links) {
    if (link.type == robot::JointType::prismatic) {
      throw ConfigError(tree.name() + ": joint " + link.joint + " slides, expected joints that " +
                        "turn: a motion model holds angles");
    }
    if (link.type != robot::JointType::revolute || !std::isfinite(link.upper - link.lower)) {
      continue;
    }
    const double margin = std::min(margin_rad, 0.25 * (link.upper - link.lower));
    link.lower += margin;
    link.upper -= margin;
  }
  return {tree.name(), std::move(links)};
}

/// A robot that clips are retargeted to.
class Robot {
 public:
  /// @throws ConfigError as model::load_biped(), retarget::figure_of(); for a joint that slides
  explicit Robot(const RobotChoice& choice)
      : biped_(model::load_biped(choice.file)),
        narrow_(narrowed(biped_.tree, choice.limit_margin_rad)),
        figure_(retarget::figure_of(biped_)) {}

  /// Trials of the robot's figure (its rows move the pelvis by the standing foot), then of its
  /// joints by name. Adds to `clips`.
  tl::expected<mocap::Trials, Status> cut(const mocap::BodyClip& recorded,
                                          const mocap::CycleOptions& options,
                                          std::vector<RetargetedClip>& clips) const {
    const retarget::RobotClip motion = retarget::retarget(recorded, narrow_, figure_);
    const retarget::FigureClip figure =
        retarget::figure_clip(motion, recorded, biped_.tree, figure_);
    clips.push_back({.file = recorded.name,
                     .frames = static_cast<long>(motion.frames()),
                     .report = motion.report,
                     .ankle_m = figure.ankle_m,
                     .wrist_m = figure.wrist_m});
    return mocap::cut_cycles(figure.clip, options, {motion.joints, motion.q});
  }
  mocap::Body body() const { return retarget::robot_body(biped_.tree, figure_); }
  /// Limits of the robot's joints for the rows named as they are; empty for other rows.
  std::vector<std::optional<motion::RowLimits>> limits(const std::vector<std::string>& rows) const {
    std::vector<std::optional<motion::RowLimits>> out;
    for (const std::string& row : rows) {
      const int joint = biped_.tree.find_joint(row);
      out.emplace_back();
      if (joint < 0) continue;
      const robot::Link& link = biped_.tree.moved(joint);
      if (std::isfinite(link.lower) && std::isfinite(link.upper))
        out.back() = {link.lower, link.upper};
    }
    return out;
  }

 private:
  robot::Biped biped_;
  robot::RobotTree narrow_;  ///< with the margin
  retarget::RobotFigure figure_;
};

}  // namespace

tl::expected<mocap::BodyClip, Status> read_figure(const std::string& file,
                                                  const mocap::ReadOptions& options,
                                                  const MarkerReading& how,
                                                  std::vector<std::string>& notes) {
  if (!ends_with(file, ".c3d")) {
    const mocap::Clip clip = mocap::read_clip(file, options);
    for (const std::string& note : clip.notes) notes.push_back(file + ": " + note);
    return options.map ? mocap::to_body(clip, *options.map) : mocap::to_body(clip);
  }
  const mocap::Markers markers = mocap::read_c3d(file);
  try {
    return mocap::body_from_markers(markers, how.legs_only, how.labels);
  } catch (const ConfigError& e) {
    return tl::unexpected(Status{e.what()});
  }
}

std::string map_text(const std::string& file, const mocap::ReadOptions& options) {
  if (ends_with(file, ".c3d")) {
    mocap::MarkerLabels labels = mocap::find_marker_labels(mocap::read_c3d(file));
    return runtime::dump_params([&labels](runtime::ParamVisitor& v) { visit(v, labels); });
  }
  auto map = mocap::find_body_map(mocap::read_clip(file, options));
  if (!map) throw ConfigError(map.error().reason);
  return runtime::dump_params([&map](runtime::ParamVisitor& v) { visit(v, *map); });
}

void read_map(const std::string& file, mocap::ReadOptions& joints, MarkerReading& markers) {
  const runtime::ParamSource source(file, {}, {});
  const bool of_markers = source.gives("markers");
  if (of_markers) {
    source.read("map", [&markers](runtime::ParamVisitor& v) { visit(v, markers.labels); });
    return;
  }
  mocap::BodyMap map;
  map.axes.fill("+x+y+z");
  source.read("map", [&map](runtime::ParamVisitor& v) { visit(v, map); });
  joints.map = map;
}

std::string sha256_of(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  crypto_hash_sha256_state state;
  crypto_hash_sha256_init(&state);
  std::array<char, 65536> buffer;
  while (in) {
    in.read(buffer.data(), buffer.size());
    crypto_hash_sha256_update(&state, reinterpret_cast<const unsigned char*>(buffer.data()),
                              static_cast<unsigned long long>(in.gcount()));
  }
  if (!in.eof()) throw ConfigError(file + ": cannot be read");
  std::array<unsigned char, crypto_hash_sha256_BYTES> digest;
  crypto_hash_sha256_final(&state, digest.data());
  return fmt::format("{:02x}", fmt::join(digest, ""));
}

TrialFiles read_trial_files(const std::vector<std::string>& files, const TrialFileOptions& options,
                            const std::function<void(std::size_t)>& progress) {
  TrialFiles out;
  std::vector<mocap::Trials> sets;
  std::vector<mocap::Body> bodies;
  std::optional<Robot> robot;
  if (!options.robot.file.empty()) robot.emplace(options.robot);
  for (const std::string& file : files) {
    const std::string name = fs::path(file).filename().string();
    out.files.push_back({name, sha256_of(mocap::split_take(file).first), options.licence});
    progress(out.files.size());
    if (ends_with(name, ".csv")) {
      if (robot)
        throw ConfigError(file + ": trials have no feet on the ground, --robot needs clips");
      sets.push_back(mocap::read_trials(file));
    } else {
      const auto clip = read_figure(file, options.read, options.markers, out.notes);
      auto trials = !clip   ? tl::unexpected(clip.error())
                    : robot ? robot->cut(*clip, options.cut, out.retargeted)
                            : mocap::cut_cycles(*clip, options.cut);
      if (!trials) {
        out.left_out.push_back({file, trials.error().reason});
        continue;
      }
      bodies.push_back(robot ? robot->body() : clip->body);
      sets.push_back(std::move(*trials));
    }
    check_rows(sets.back(), sets.front(), file);
    if (const auto style = options.styles.find(name); style != options.styles.end()) {
      for (mocap::Trial& trial : sets.back().trials) trial.style = style->second;
    }
  }
  if (sets.empty()) {
    throw ConfigError(fmt::format("{}: no trial is left: {}", out.left_out.front().file,
                                  out.left_out.front().reason));
  }
  out.set = mocap::merge(sets);
  out.standard_body = bodies.empty();
  out.body = bodies.empty() ? mocap::standard_body() : robot ? bodies[0] : mean_of(bodies);
  if (robot) out.limits_rad = robot->limits(out.set.rows);
  return out;
}

}  // namespace mimesis::tool
