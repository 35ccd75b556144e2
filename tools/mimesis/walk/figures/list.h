#pragma once
#include <array>

#include "tools/mimesis/walk/figures/figures.h"

namespace mimesis::walk {

struct Title {
  const char *name, *title;
};
inline constexpr std::array kTitles = {
    Title{"power-law", "ellipses walked by power laws of speed and curvature [sec. 4.5.1]"},
    Title{"fig-3.41", "accuracy of step sizes and reach of resynthesized robot walks"},
    Title{"fig-3.44", "robot behaviours for the smallest and largest steps and reaches"},
    Title{"fig-3.46", "lateral spread of the ZMP: originals, resynthesis, novel goals"},
    Title{"table-3.1", "falls: learned joint angles beside our method"},
    Title{"fig-3.47", "peak ankle torques and ground forces: WPG, naive, ours"},
};

reproduce::Report power_law(const std::optional<std::filesystem::path>& plot_dir);
// The experiments of the drawer study, on shared runs: minutes each.
reproduce::Report accuracy(const std::optional<std::filesystem::path>& plot_dir);
reproduce::Report extremes(const std::optional<std::filesystem::path>& plot_dir);
std::vector<std::filesystem::path> extremes_film(const std::filesystem::path& dir);
reproduce::Report zmp_spread(const std::optional<std::filesystem::path>& plot_dir);
reproduce::Report naive_table(const std::optional<std::filesystem::path>& plot_dir);
reproduce::Report peaks(const std::optional<std::filesystem::path>& plot_dir);

}  // namespace mimesis::walk
