#pragma once
#include <array>

#include "tools/mimesis/walk/figures/figures.h"

namespace mimesis::walk {

struct Title {
  const char *name, *title;
};
inline constexpr std::array kTitles = {
    Title{"power-law", "ellipses walked by power laws of speed and curvature [sec. 4.5.1]"},
};

reproduce::Report power_law(const std::optional<std::filesystem::path>& plot_dir);

}  // namespace mimesis::walk
