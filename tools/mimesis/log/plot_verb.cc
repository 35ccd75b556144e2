#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <filesystem>
#include <map>
#include <memory>

#include "common/error.h"
#include "tools/mimesis/log/plot.h"
#include "tools/mimesis/log/subverbs.h"
#include "tools/mimesis/log/verb_options.h"

namespace mimesis::tool {
namespace {

struct Options {
  std::vector<std::string> words;  ///< files, then fields
  PlotOptions plot;
  std::string style = "lines";
  bool json = false;
};

int run(Options& o) {
  const std::string extension = std::filesystem::path(o.plot.output).extension().string();
  if (extension != ".png" && extension != ".svg") {
    throw ConfigError("-o " + o.plot.output + ": expected a name that ends in .png or .svg");
  }
  std::vector<std::string> files;
  for (const std::string& word : o.words) {
    std::error_code ignored;
    const bool is_file = word.ends_with(".mcap") || std::filesystem::exists(word, ignored);
    (o.plot.fields.empty() && is_file ? files : o.plot.fields).push_back(word);
  }
  if (files.empty() || o.plot.fields.empty()) {
    throw ConfigError("expected FILE... TOPIC.FIELD..., as in run.mcap bridge/arm.position_rad[*]");
  }
  static const std::map<std::string, PlotStyle> kStyles{
      {"lines", PlotStyle::lines}, {"steps", PlotStyle::steps}, {"dots", PlotStyle::dots}};
  o.plot.style = kStyles.at(o.style);
  return log_plot(files, o.plot, o.json);
}

}  // namespace

void add_plot(CLI::App& verb, int& exit_code) {
  CLI::App* sub = verb.add_subcommand("plot", "Fields over time as a picture (as rqt_plot)");
  auto o = std::make_shared<Options>();
  sub->add_option("FILE... TOPIC.FIELD...", o->words,
                  "MCAP files (bags), then fields; FIELD[2] is one element, FIELD[*] a curve for "
                  "each")
      ->required();
  sub->add_option("-o,--output", o->plot.output, "Picture: NAME.png or NAME.svg")->required();
  add_time_options(*sub, o->plot.range);
  sub->add_option("--title", o->plot.title, "Above the picture");
  sub->add_option("--width", o->plot.width_px, "[px]")
      ->check(CLI::Range(100, 10'000))
      ->capture_default_str();
  sub->add_option("--height", o->plot.height_px, "[px]; by the number of panels")
      ->check(CLI::Range(100, 10'000));
  sub->add_option("--style", o->style, "lines, steps or dots")
      ->check(CLI::IsMember({"lines", "steps", "dots"}))
      ->capture_default_str();
  sub->add_flag("--derivative", o->plot.derivative, "Change per second instead of the value");
  sub->add_flag("--json", o->json, "Print one JSON object at the end");
  sub->footer(
      "Fields of different units get a panel each, with a common axis of time. Needs gnuplot.\n"
      "Example: mimesis log plot run.mcap bridge/arm.position_rad[*] planner/status.state -o "
      "arm.svg");
  sub->callback([o, &exit_code] { exit_code = run(*o); });
}

}  // namespace mimesis::tool
