#include "common/reproduce/gnuplot.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace mimesis::reproduce {
namespace {

constexpr const char* kStyle = R"(
set linetype 1 lc rgb '#1f4e9c' lw 2.2
set linetype 2 lc rgb '#c8371e' lw 2.2
set linetype 3 lc rgb '#2b8c4a' lw 2.2
set linetype 4 lc rgb '#8a5bb0' lw 2.2
set linetype 5 lc rgb '#d08a10' lw 2.2
set linetype 6 lc rgb '#3aa6b9' lw 2.2
set linetype 7 lc rgb '#7a7a7a' lw 1.6
set linetype 8 lc rgb '#000000' lw 1.6
set border 3 lc rgb '#404040'
set tics nomirror out scale 0.6
set style fill transparent solid 0.25 noborder
set key samplen 2 spacing 1.1
)";

/// Exit status of `gnuplot FILE`.
int run_gnuplot(const std::string& file) {
  std::string program = "gnuplot", argument = file;
  char* const argv[] = {program.data(), argument.data(), nullptr};
  pid_t pid = 0;
  const int error = posix_spawnp(&pid, "gnuplot", nullptr, nullptr, argv, environ);
  if (error == ENOENT) {
    throw std::runtime_error(
        "plot: gnuplot is not installed (tools/setup docs, or apt install gnuplot-nox)");
  }
  if (error != 0) throw std::runtime_error("plot: gnuplot does not start");
  int status = 0;
  while (waitpid(pid, &status, 0) < 0) {
    if (errno != EINTR) return -1;
  }
  return status;
}

void write_data(std::ostream& out, const Data& data) {
  out << '$' << data.name << " << EOD\n";
  for (const auto& row : data.rows) {
    for (const double v : row) {
      if (std::isnan(v)) {
        out << "NaN ";
      } else {
        out << v << ' ';
      }
    }
    out << '\n';
  }
  out << "EOD\n";
}

}  // namespace

std::string quoted(const std::string& label) {
  std::string out = "'";
  for (const char c : label) {
    out += c;
    if (c == '\'') out += c;
  }
  return out + "'";
}

void plot_png(const std::filesystem::path& png, int width_px, int height_px,
              const std::vector<Data>& data, const std::string& script) {
  std::ostringstream all;
  all << "set encoding utf8\nset terminal pngcairo noenhanced size " << width_px << ',' << height_px
      << " font 'sans,11' background rgb 'white'\nset output " << quoted(png.string()) << '\n'
      << kStyle;
  for (const Data& d : data) write_data(all, d);
  all << script << '\n';

  std::error_code ignored;
  std::filesystem::create_directories(png.parent_path(), ignored);
  const std::filesystem::path file = png.string() + ".gp";
  std::ofstream out(file);
  out << all.str();
  out.close();
  if (!out) throw std::runtime_error("plot: cannot write " + file.string());
  const int status = run_gnuplot(file.string());
  std::filesystem::remove(file, ignored);
  if (status != 0) throw std::runtime_error("plot: gnuplot failed on " + png.string());
  if (!std::filesystem::exists(png, ignored)) {
    throw std::runtime_error("plot: cannot write " + png.string());
  }
}

}  // namespace mimesis::reproduce
