#pragma once
#include <string>
#include <string_view>

#include "common/motion/mocap/trials.h"

namespace mimesis::mocap {

/// Reads trials from CSV: `clip,cycle,start_frame,end_frame,duration_s,joint,axis,t0,t1,...`, one
/// line per trial and row, a trial's lines together, the same rows in the same order in every
/// trial. The axes are those of its first line if that is `# axes: x forward, y left, z up`; else
/// the file is one of shared/data/mocap/sets (z forward, x left, y up): joints 0..16 get the body's
/// names, axes are turned (x → y, y → z, z → x) and sorted so that a joint's rows are x, y, z
/// again. Row names are "joint.axis", or the joint's where the axis is empty. Styles, step lengths
/// and turns are not in the file.
/// @throws ConfigError "file:line: what, expected ...": no trials, other columns, a number that is
/// not finite, rows that are missing, twice, or of another trial
Trials read_trials(const std::string& file);
/// Parses text in memory; `file` names it in errors.
Trials parse_trials(std::string_view text, const std::string& file);

/// Writes the same form, with the line of axes. Numbers are read back as the same bits.
/// @throws ConfigError if the file cannot be written
void write_trials(const Trials& set, const std::string& file);

}  // namespace mimesis::mocap
