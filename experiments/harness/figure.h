#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace mimesis::reproduce {

/// One number of a figure beside its reference.
struct Row {
  std::string what;
  double ours = 0.0;
  std::optional<double> reference;  ///< unset: `why` has the reason
  double tolerance = 0.0;           ///< NaN: nothing is asserted, see beside()
  std::string unit;                 ///< "1" if dimensionless
  bool passed = false;
  std::string why;
};

/// |ours − reference| <= tolerance. `why`: of the tolerance.
Row near(std::string what, double ours, double reference, double tolerance, std::string unit,
         std::string why = {});
/// A statement that must hold; ours and reference are 1 or 0.
Row holds(std::string what, bool ours, std::string why = {});
/// A bound that is published: ours <= reference.
Row within(std::string what, double ours, double published, std::string unit,
           const std::string& why);
/// A published value to look at beside ours: nothing is asserted, `why` says why not. Fails for NaN
/// only. Another row has to check the claim of the figure.
Row beside(std::string what, double ours, double published, std::string unit,
           const std::string& why);
/// A bound of our own where nothing is published; `why` has the meaning of the bound.
Row at_least(std::string what, double ours, double bound, std::string unit, const std::string& why);
Row at_most(std::string what, double ours, double bound, std::string unit, const std::string& why);

struct Report {
  std::vector<Row> rows;
  std::vector<std::filesystem::path> plots;
  bool passed() const;  ///< every row, and at least one
};

/// A figure or table of a publication that we reproduce.
struct Figure {
  std::string name;    ///< fig-CHAPTER.NUMBER, table-CHAPTER.NUMBER, or a word
  std::string title;   ///< one line
  std::string source;  ///< M18, M10, M13; own: not of a publication
  /// Computes the rows; writes plots into the folder if one is given. @throws std::runtime_error if
  /// a plot cannot be made.
  std::function<Report(const std::optional<std::filesystem::path>& plot_dir)> run;
  /// Optional: draws the motion as a film into the folder. Returns what to look at. @throws
  /// std::runtime_error if a picture cannot be written.
  std::function<std::vector<std::filesystem::path>(const std::filesystem::path& dir)> film{};
  /// CPU time on a processor of 2020, all threads, if it is a minute or more
  double cpu_minutes = 0.0;
};

}  // namespace mimesis::reproduce
