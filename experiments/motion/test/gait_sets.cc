#include "experiments/motion/test/gait_sets.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include "common/motion/demix/sisa.h"
#include "common/motion/mocap/trials.h"
#include "common/shared_data.h"

namespace mimesis::synthesizer::testing {
namespace {

constexpr double kCmuUnit_m = 0.0254 / 0.45;

std::vector<std::string> split(const std::string& line, char by) {
  std::vector<std::string> parts;
  std::istringstream in(line);
  for (std::string part; std::getline(in, part, by);) parts.push_back(part);
  return parts;
}

/// Horizontal travel of the root between two frames of a CMU BVH; 0 if there is no such file.
double travel_m(const std::string& file, long first, long last) {
  std::ifstream in(file);
  std::string line;
  while (std::getline(in, line) && line.find("Frame Time") == std::string::npos) {
  }
  Eigen::Vector3d from = Eigen::Vector3d::Zero(), p = from;
  for (long frame = 0; std::getline(in, line); ++frame) {
    std::istringstream numbers(line);
    numbers >> p.x() >> p.y() >> p.z();
    if (frame == first) from = p;
    if (frame == last) return kCmuUnit_m * std::hypot(p.x() - from.x(), p.z() - from.z());
  }
  return 0.0;
}

/// "dataset-1_walk_happy_001.bvh" -> "happy", "..walk-left_normal.." -> "left".
std::string style_of(const std::string& clip) {
  const auto words = split(clip, '_');
  if (words.size() < 4) return "walk";
  const auto dash = words[1].rfind('-');
  return dash == std::string::npos ? words[2] : words[1].substr(dash + 1);
}

}  // namespace

std::string shared_folder() {
  const std::string folder = shared_data("").string();
  return std::filesystem::exists(folder + "/data/mocap/sets/A.csv") ? folder : "";
}

mocap::Trials gait_set(const std::string& name, const std::string& clip) {
  const std::string folder = shared_folder() + "/data/mocap/";
  mocap::Trials set =
      subset(mocap::read_trials(folder + "sets/" + name + ".csv"),
             [&](const mocap::Trial& t) { return t.clip.find(clip) != t.clip.npos; });
  for (mocap::Trial& t : set.trials) {
    t.style = style_of(t.clip);
    t.step_length_m = travel_m(folder + "cmu_bvh/" + t.clip, t.first_frame, t.last_frame);
  }
  return set;
}

motion::MotionModel tied_model(const mocap::Trials& trials, int sources) {
  demix::SisaOptions options;
  options.sources = sources;
  options.tied = true;
  // enough to test control with: 0.002 of Q less, a fifth of the time
  options.turns = 12;
  options.finalists = 1;
  const demix::SisaResult result = demix::sisa(trials, options);
  motion::MotionModel model;
  model.rows = trials.rows;
  model.tied = true;
  model.sources = result.mixture.sources;
  model.quality = result.quality;
  model.quality_squared = result.quality_squared;
  const Eigen::Index rows = trials.rows_per_trial();
  for (std::size_t i = 0; i < trials.trials.size(); ++i) {
    const Eigen::Index at = static_cast<Eigen::Index>(i) * rows;
    model.patterns.push_back({trials.trials[i], result.mixture.means.segment(at, rows),
                              result.mixture.weights.middleRows(at, rows),
                              result.mixture.delay_rad.middleRows(at, rows)});
  }
  return model;
}

Eigen::MatrixXd synthesize(const motion::MotionModel& model, const Eigen::VectorXd& mean_rad,
                           const Eigen::MatrixXd& weight_rad, const Eigen::MatrixXd& delay_rad) {
  return demix::Mixture{model.sources, weight_rad, delay_rad, mean_rad, model.fixed}.reconstruct();
}

}  // namespace mimesis::synthesizer::testing
