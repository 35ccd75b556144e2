#pragma once
#include <array>
#include <string>
#include <vector>

#include "nodes/synthesizer/sequence/trials.h"

namespace mimesis::synthesizer {

/// Files of a folder of drawer trials: one set of trials for each action, CSV as
/// mocap::read_trials() reads it, with its line of axes. Recorded sequences and generated ones have
/// the same form. A trial (clip, cycle) is in all three files, in the same order; cycles of one
/// clip, such as the same recording at other paces, are left out together where maps are learned.
///
/// Columns: step_length_m is the travel of the pelvis in the action [m], 0 for standing; the task's
/// are kTaskNames (distance_m: pelvis to the closed front at the start of the action) and the
/// drawer's, which are the same everywhere. Rows: of a figure drawer_rows(), of a robot
/// robot_rows(), samples at the even phases of the action, t0 at its start.
inline constexpr std::array<const char*, kActions> kActionFiles = {
    "normal_step.csv", "reaching_step.csv", "standing.csv"};

/// Rows of a figure's trials: 51 of the body [rad], then the pelvis: progress less the even one,
/// distance to the left of the way, height [m].
std::vector<std::string> drawer_rows();

/// Training data of three such sets. `folder` names them in errors.
/// @throws ConfigError "folder/file: which trial: what, expected ...": other rows, columns or
/// numbers of samples, fewer than 4 trials or not the same ones, angles beyond 2π, lengths and
/// distances that contradict each other by more than 5 cm, two drawers
DrawerData join_actions(std::array<mocap::Trials, kActions> sets,
                        const std::vector<std::string>& rows, const mocap::Body& body,
                        const std::string& folder);

/// The sets to write. Cycles are numbered within each clip.
std::array<mocap::Trials, kActions> split_actions(const DrawerData& data);

}  // namespace mimesis::synthesizer
