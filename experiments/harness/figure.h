#pragma once
#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace mimesis::reproduce {

/// Whose word stands beside ours.
enum class Origin {
  published,    ///< a publication prints it
  closed_form,  ///< it follows from an equation, or was put into what is measured
  prototype,    ///< a prototype of ours measured it; no publication prints it
  goal,         ///< we ask for it
};
inline constexpr std::array kOriginNames = {"published", "closed form", "prototype", "goal"};

struct Source {
  Origin origin;
  std::string where;  ///< figure, table, equation or section; file in reference/ of the shared
                      ///< folder; else empty
};
struct Reference : Source {
  double value;
};

// Of a statement, see holds().
Source published(std::string where);
Source closed_form(std::string which);
Source prototype(std::string file);
Source goal();
// Of a number.
Reference published(double value, std::string where);
Reference closed_form(double value, std::string which);
Reference prototype(double value, std::string file);
Reference goal(double value);

/// A reference that is a goal unless told otherwise.
struct Bound : Reference {
  Bound(double x) : Reference(goal(x)) {}
  Bound(Reference reference) : Reference(std::move(reference)) {}
};

/// One number of a figure beside its reference.
struct Row {
  std::string what;
  double ours = 0.0;
  Reference reference;
  double tolerance = 0.0;  ///< NaN: nothing is asserted, see beside()
  std::string unit;        ///< "1" if dimensionless
  bool passed = false;
  std::string why;
};

/// |ours − reference| <= tolerance. `why`: of the tolerance.
Row near(std::string what, double ours, Reference reference, double tolerance, std::string unit,
         std::string why = {});
/// A statement that must hold; ours and reference are 1 or 0.
Row holds(std::string what, bool ours, Source source, std::string why = {});
/// `why` has the meaning of the bound.
Row at_least(std::string what, double ours, Bound bound, std::string unit, const std::string& why);
Row at_most(std::string what, double ours, Bound bound, std::string unit, const std::string& why);
/// A value to look at beside ours: nothing is asserted, `why` says why not. Fails for NaN only.
/// Another row has to check the claim of the figure.
Row beside(std::string what, double ours, Reference reference, std::string unit,
           const std::string& why);

/// How many rows there are of each origin, in the order of Origin.
using RowCounts = std::array<int, kOriginNames.size()>;
RowCounts count(const std::vector<Row>& rows);
/// As "2 published, 1 goal".
std::string to_text(const RowCounts& counts);

/// Declaration of a figure.
struct Declared {
  int published = 0, closed_form = 0, prototype = 0, goal = 0;
  RowCounts counts() const { return {published, closed_form, prototype, goal}; }
};

struct Report {
  std::vector<Row> rows;
  std::vector<std::filesystem::path> plots;
  bool passed() const;  ///< every row, and at least one

  // Each adds the row of its name.
  void near(std::string what, double ours, Reference reference, double tolerance, std::string unit,
            std::string why = {});
  void holds(std::string what, bool ours, Source source, std::string why = {});
  void at_least(std::string what, double ours, Bound bound, std::string unit,
                const std::string& why);
  void at_most(std::string what, double ours, Bound bound, std::string unit,
               const std::string& why);
  void beside(std::string what, double ours, Reference reference, std::string unit,
              const std::string& why);
  /// Adds a plot and returns where to draw it.
  const std::filesystem::path& picture(const std::filesystem::path& png) {
    return plots.emplace_back(png);
  }
};

/// Folder for plots, if they are wanted.
using PlotDir = std::optional<std::filesystem::path>;
/// Computes the rows; writes plots into the folder if one is given. @throws std::runtime_error if a
/// plot cannot be made.
using Compute = std::function<Report(const PlotDir& plot_dir)>;

/// A figure or table of a publication that we reproduce.
struct Figure {
  Figure(std::string name_, std::string title_, std::string source_, Declared rows_,
         Compute compute_, double cpu_minutes_ = 0.0)
      : name(std::move(name_)),
        title(std::move(title_)),
        source(std::move(source_)),
        rows(rows_),
        compute(std::move(compute_)),
        cpu_minutes(cpu_minutes_) {}

  std::string name;    ///< fig-CHAPTER.NUMBER, table-CHAPTER.NUMBER, or a word
  std::string title;   ///< one line
  std::string source;  ///< M18, M10, M13; own: not of a publication
  Declared rows;       ///< what `compute` returns, known before it runs
  Compute compute;
  /// CPU time on a processor of 2020, all threads, if it is a minute or more
  double cpu_minutes;

  /// compute(), and a row that fails if there are others than declared.
  Report run(const PlotDir& plot_dir) const;
};

}  // namespace mimesis::reproduce
