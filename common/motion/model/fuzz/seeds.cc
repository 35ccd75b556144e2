// model_fuzz_seeds FOLDER: a small set of trials and two small models to begin with.
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>

#include "common/motion/mocap/trials.h"
#include "common/motion/model/motion_model.h"

namespace {

using namespace mimesis;
namespace fs = std::filesystem;

mocap::Trials small_set() {
  mocap::Trials set;
  set.rows = {"lhip.x", "lhip.y"};
  set.task_names = {"distance_m"};
  for (int i = 0; i < 2; ++i) {
    mocap::Trial trial;
    trial.clip = "walk";
    trial.cycle = i;
    trial.first_frame = 10 * i;
    trial.last_frame = 10 * i + 9;
    trial.duration_s = 1.1;
    trial.task = {0.5};
    set.trials.push_back(trial);
  }
  set.samples = Eigen::MatrixXd::Random(4, 5);
  return set;
}

motion::MotionModel small_model(bool tied) {
  motion::MotionModel model;
  model.name = "walk";
  model.created_by = "seeds";
  model.learned_from = {{"walk.csv", "00", "own"}};
  model.body = mocap::standard_body();
  model.rows = {"lhip.x", "lhip.y"};
  model.task_names = {"distance_m"};
  model.sources = Eigen::MatrixXd::Random(2, 6);
  model.fixed = tied ? 1 : 0;
  model.tied = tied;
  for (const mocap::Trial& trial : small_set().trials) {
    model.patterns.push_back({trial, Eigen::VectorXd::Random(2), Eigen::MatrixXd::Random(2, 2),
                              Eigen::MatrixXd::Random(2, 2)});
  }
  return model;
}

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: model_fuzz_seeds FOLDER\n";
    return 2;
  }
  const fs::path folder(argv[1]), file = folder / "seed";
  fs::create_directories(folder);
  int n = 0;
  const auto put = [&](char kind, const std::string& text) {
    std::ofstream(folder / ("seed" + std::to_string(n++)), std::ios::binary) << kind << text;
  };
  mocap::write_trials(small_set(), file);
  const std::string trials = text_of(file);
  put(0, trials);
  put(0, trials.substr(trials.find('\n') + 1));  // without the line of axes: a set of shared/
  for (const bool tied : {true, false}) {
    motion::save_motion_model(small_model(tied), file);
    put(1, text_of(file));
  }
  fs::remove(file);
  return 0;
}
