#pragma once
#include <fmt/format.h>

#include <fstream>

#include "common/motion/mocap/trials.h"

namespace mimesis::mocap {

/// A set of trials as read_trials() reads it, with the line of axes and all columns.
inline void write_trials(const Trials& set, const std::string& file) {
  std::string text =
      "# axes: x forward, y left, z up\nclip,cycle,start_frame,end_frame,duration_s,style,"
      "step_length_m,turn_rad";
  for (const std::string& name : set.task_names) text += ',' + name;
  text += ",joint,axis";
  for (Eigen::Index t = 0; t < set.samples.cols(); ++t) text += fmt::format(",t{}", t);
  text += '\n';
  const Eigen::Index rows = set.rows_per_trial();
  for (Eigen::Index n = 0; n < set.samples.rows(); ++n) {
    const Trial& trial = set.trials[static_cast<std::size_t>(n / rows)];
    const std::string& name = set.rows[static_cast<std::size_t>(n % rows)];
    const std::size_t dot = name.rfind('.');
    text += fmt::format("{},{},{},{},{},{},{},{}", trial.clip, trial.cycle, trial.first_frame,
                        trial.last_frame, trial.duration_s, trial.style, trial.step_length_m,
                        trial.turn_rad);
    for (const double value : trial.task) text += fmt::format(",{}", value);
    text += fmt::format(",{},{}", name.substr(0, dot),
                        dot == std::string::npos ? "" : name.substr(dot + 1));
    for (Eigen::Index t = 0; t < set.samples.cols(); ++t)
      text += fmt::format(",{}", set.samples(n, t));
    text += '\n';
  }
  std::ofstream(file) << text;
}

}  // namespace mimesis::mocap
