#include "common/plot/gnuplot.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace mimesis::plot {
namespace {

TEST(Gnuplot, QuotesLabels) { EXPECT_EQ(quoted("it's"), "'it''s'"); }

TEST(Gnuplot, SaysWhatItCannotDo) {
  const auto message = [](const std::filesystem::path& png, const std::string& script) {
    try {
      plot_png(png, 100, 100, {}, script);
    } catch (const std::runtime_error& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  const std::string bad =
      message(std::filesystem::temp_directory_path() / "x.png", "plot nonsense(");
  EXPECT_TRUE(bad.starts_with("plot: gnuplot")) << bad;  // absent, or fails on the script
  const std::string nowhere = message("/proc/none/x.png", "plot sin(x)");
  EXPECT_TRUE(nowhere.starts_with("plot: ")) << nowhere;
}

}  // namespace
}  // namespace mimesis::plot
