#include "experiments/motion/recorded_walks.h"

#include <filesystem>
#include <stdexcept>

#include "common/shared_data.h"
#include "common/motion/mocap/body_map.h"
#include "common/motion/mocap/cycles.h"
#include "common/motion/mocap/read_clip.h"

namespace mimesis::synthesizer {
namespace {

std::string folder() { return shared_data("data/mocap/").string(); }

}  // namespace

std::string absent_clip(const std::vector<std::string>& clips) {
  for (const std::string& clip : clips) {
    if (!std::filesystem::exists(folder() + clip)) return folder() + clip;
  }
  return "";
}

RecordedWalks recorded_walks(const std::vector<std::string>& clips) {
  RecordedWalks out;
  std::vector<mocap::Trials> sets;
  for (const std::string& name : clips) {
    const mocap::BodyClip clip = mocap::to_body(mocap::read_clip(folder() + name));
    if (sets.empty()) out.body = clip.body;
    auto cycles = mocap::cut_cycles(clip);
    if (!cycles) throw std::runtime_error(name + ": " + cycles.error().reason);
    sets.push_back(std::move(*cycles));
  }
  out.trials = mocap::merge(sets);
  return out;
}

reproduce::Report report_absent(const std::string& clip) {
  reproduce::Report report;
  report.rows = {reproduce::holds("the recordings are there", false)};
  report.rows.front().why = clip + " is absent; MIMESIS_SHARED names the folder";
  return report;
}

}  // namespace mimesis::synthesizer
