// Any bytes as a CSV of trials or as a motion model: both readers must survive them, and accepted
// data must be consistent. The first byte chooses the reader.
//   cmake --preset fuzz && ninja -C build-fuzz model_fuzz
//   mkdir CORPUS && (printf '\1'; cat models/walk.motion.json) >CORPUS/model     (\0: CSV)
//   build-fuzz/bin/model_fuzz -rss_limit_mb=512 CORPUS
#include <algorithm>
#include <cstdint>

#include "common/error.h"
#include "common/motion/mocap/trials.h"
#include "common/motion/model/motion_model.h"

namespace {

using namespace mimesis;

bool one_line(const std::string& message) {
  return !message.empty() &&
         std::all_of(message.begin(), message.end(), [](char c) { return c != '\n' && c != '\r'; });
}

void check(const mocap::Trials& set) {
  MIMESIS_ASSERT(!set.trials.empty() && !set.rows.empty());
  MIMESIS_ASSERT(set.samples.rows() ==
                 static_cast<Eigen::Index>(set.trials.size() * set.rows.size()));
  MIMESIS_ASSERT(set.samples.cols() >= 4 && set.samples.allFinite());
  for (const mocap::Trial& trial : set.trials) {
    MIMESIS_ASSERT(trial.duration_s > 0.0 && trial.task.size() == set.task_names.size());
  }
}

void check(const motion::MotionModel& model) {
  const auto rows = static_cast<Eigen::Index>(model.rows.size());
  const Eigen::Index sources = model.sources.rows();
  MIMESIS_ASSERT(sources >= 1 && model.sources.cols() >= 2 && model.sources.allFinite());
  MIMESIS_ASSERT(model.fixed >= 0 && model.fixed <= sources && !model.patterns.empty());
  for (const motion::Pattern& p : model.patterns) {
    MIMESIS_ASSERT(p.trial.duration_s > 0.0);
    MIMESIS_ASSERT(p.trial.task.size() == model.task_names.size());
    MIMESIS_ASSERT(p.mean_rad.size() == rows && p.mean_rad.allFinite());
    MIMESIS_ASSERT(p.weight_rad.rows() == rows && p.weight_rad.cols() == sources);
    MIMESIS_ASSERT(p.delay_rad.rows() == rows && p.delay_rad.cols() == sources);
    MIMESIS_ASSERT(p.weight_rad.allFinite() && p.delay_rad.allFinite());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    if (data[0] % 2 == 0) {
      check(mocap::parse_trials(text, "fuzz"));
    } else {
      check(motion::parse_motion_model(text, "fuzz"));
    }
  } catch (const ConfigError& error) {
    MIMESIS_ASSERT(one_line(error.what()));
  }
  return 0;
}
