#include "common/plot/gnuplot.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace mimesis::plot {
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

/// Removed when done, however that ends.
struct ScriptFile {
  std::filesystem::path path;
  ~ScriptFile() {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  }
};

/// Exit status of `gnuplot FILE`. Where the locale's characters are not UTF-8 it warns of its own
/// degree sign.
int run_gnuplot(const std::string& file) {
  std::string locale = "LC_ALL=C.UTF-8";
  std::vector<char*> environment{locale.data()};
  for (char** entry = environ; *entry != nullptr; ++entry)
    if (!std::string_view(*entry).starts_with("LC_ALL=")) environment.push_back(*entry);
  environment.push_back(nullptr);
  std::string program = "gnuplot", argument = file;
  char* const argv[] = {program.data(), argument.data(), nullptr};
  pid_t pid = 0;
  const int error = posix_spawnp(&pid, "gnuplot", nullptr, nullptr, argv, environment.data());
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

std::string terminal(const std::string& name, int width_px, int height_px) {
  return "set terminal " + name + " noenhanced size " + std::to_string(width_px) + "," +
         std::to_string(height_px) + " font 'sans,11'";
}

void plot(const std::filesystem::path& picture, const std::string& terminal,
          const std::vector<Data>& data, const std::string& script) {
  std::ostringstream all;
  all.precision(12);
  all << "set encoding utf8\n"
      << terminal << "\nset output " << quoted(picture.string()) << '\n'
      << kStyle;
  for (const Data& d : data) write_data(all, d);
  all << script << '\n';

  std::error_code ignored;
  std::filesystem::create_directories(picture.parent_path(), ignored);
  const ScriptFile file{picture.string() + ".gp"};
  std::ofstream out(file.path);
  out << all.str();
  out.close();
  if (!out) throw std::runtime_error("plot: cannot write " + file.path.string());
  const int status = run_gnuplot(file.path.string());
  if (status != 0) throw std::runtime_error("plot: gnuplot failed on " + picture.string());
  if (!std::filesystem::exists(picture, ignored)) {
    throw std::runtime_error("plot: cannot write " + picture.string());
  }
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
  plot(png, terminal("pngcairo", width_px, height_px) + " background rgb 'white'", data, script);
}

void plot_svg(const std::filesystem::path& svg, int width_px, int height_px,
              const std::vector<Data>& data, const std::string& script) {
  plot(svg, terminal("svg", width_px, height_px) + " background 'white'", data, script);
}

}  // namespace mimesis::plot
