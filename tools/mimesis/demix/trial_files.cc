#include "tools/mimesis/demix/trial_files.h"

#include <fmt/format.h>
#include <sodium/crypto_hash_sha256.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>

#include "common/error.h"
#include "common/motion/mocap/body_from_markers.h"
#include "common/motion/mocap/body_map.h"
#include "common/motion/mocap/c3d.h"
#include "common/motion/mocap/trials.h"

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

/// The clip of a file; of markers that are no person, why.
tl::expected<mocap::BodyClip, Status> read_body(const std::string& file,
                                                const TrialFileOptions& options) {
  if (!ends_with(file, ".c3d")) return mocap::to_body(mocap::read_clip(file, options.read));
  const mocap::Markers markers = mocap::read_c3d(file);
  try {
    return mocap::body_from_markers(markers, options.markers_legs_only);
  } catch (const ConfigError& e) {
    return tl::unexpected(Status{e.what()});
  }
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

}  // namespace

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
  std::string hex;
  for (const unsigned char byte : digest) hex += fmt::format("{:02x}", byte);
  return hex;
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
    out.files.push_back({name, sha256_of(file), options.licence});
    progress(out.files.size());
    if (ends_with(name, ".csv")) {
      if (robot)
        throw ConfigError(file + ": trials have no feet on the ground, --robot needs clips");
      sets.push_back(mocap::read_trials(file));
    } else {
      const auto clip = read_body(file, options);
      auto trials = !clip   ? tl::unexpected(clip.error())
                    : robot ? robot->cut(*clip, options.cut)
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
  if (robot) {
    out.retargeted = robot->clips();
    out.limits_rad = robot->limits(out.set.rows);
  }
  return out;
}

}  // namespace mimesis::tool
