#pragma once
#include <string>
#include <utility>
#include <vector>

#include "common/plot/gnuplot.h"
#include "experiments/harness/figure.h"
#include "nodes/planner/roadmap.h"

namespace mimesis::planner {

struct Panel {
  std::string title;
  std::vector<std::pair<plot::Data, std::string>> layers;  // rows, and how gnuplot draws them
  std::string settings;
};

/// Panels side by side, `columns` in a row, as NAME.png; nothing without a folder.
void draw(reproduce::Report& report, const reproduce::PlotDir& dir, const std::string& name,
          std::size_t columns, const std::vector<Panel>& panels);

inline constexpr const char* kRed = "#c8371e";
inline constexpr const char* kBlue = "#1f4e9c";
inline constexpr const char* kGreen = "#2b8c4a";
inline constexpr const char* kGrey = "#a0a0a0";
inline constexpr const char* kYellow = "#d08a10";

/// Columns of `nodes` whose mark is `wanted`, or all if there are no marks.
plot::Data points(const Eigen::MatrixXd& nodes, const std::vector<char>& marks = {},
                  char wanted = 1);
plot::Data link_lines(const Eigen::MatrixXd& nodes, const NeighbourLists& links);

// How gnuplot draws rows: x y; x y radius; x y, NaN between lines.
std::string dots(const char* color, double size = 0.35);
std::string rings(const char* color);
std::string lines(const char* color, double width);

/// Balls of the arm in W, and which of them are nearer to obstacles than they may be.
struct PlacedBalls {
  std::vector<kin::Ball> balls;
  std::vector<char> touches;
  double gap_m = INFINITY;  ///< least, to obstacles and among own pairs
};

/// Pair by pair, in double precision: not the kernel of the planner.
PlacedBalls place(const kin::ArmModel& arm, const Eigen::VectorXd& q, const Obstacles& obstacles);

/// The arm among its obstacles, seen along y (or, for planar arms, z).
Panel posture_panel(const std::string& title, const kin::ArmModel& arm, const Eigen::VectorXd& q,
                    const Obstacles& obstacles, Eigen::Index up, const std::string& settings);

}  // namespace mimesis::planner
