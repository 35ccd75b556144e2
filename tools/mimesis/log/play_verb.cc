#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <memory>

#include "tools/mimesis/log/play.h"
#include "tools/mimesis/log/subverbs.h"
#include "tools/mimesis/number_check.h"
#include "tools/mimesis/topic_filter.h"

namespace mimesis::tool {

void add_play(CLI::App& verb, int& exit_code) {
  CLI::App* play = verb.add_subcommand("play", "Publishes the messages of a log again");
  struct Options {
    PlayOptions play;
    std::vector<std::string> topics;
    std::string regex, exclude;
  };
  auto o = std::make_shared<Options>();
  play->add_option("FILE", o->play.file, "An MCAP file")->required();
  play->add_option("--topic", o->topics, "Only this topic (repeatable)")->allow_extra_args(false);
  play->add_option("--regex", o->regex, "Only topics that match as a whole");
  play->add_option("--exclude", o->exclude, "Not those that match as a whole");
  play->add_option("--rate", o->play.rate, "Recorded seconds per second")
      ->check(CLI::Range(1e-3, 1e3))
      ->capture_default_str();
  CLI::Option* loop = play->add_option("--loop", o->play.loops, "So many times; 0: until stopped")
                          ->check(number_not_below_zero)
                          ->capture_default_str();
  play->add_option("--start", o->play.playback.start_s, "Skip so many recorded seconds")
      ->check(number_not_below_zero);
  play->add_option("--duration", o->play.playback.duration_s, "Play so many recorded seconds")
      ->check(number_not_below_zero);
  play->add_option("--name", o->play.name, "Name of the player in the graph")
      ->capture_default_str();
  CLI::Option* clock = play->add_flag("--clock", o->play.clock,
                                      "Drive the clock of a graph that runs on simulated time");
  CLI::Option* lockstep = play->add_flag("--lockstep", o->play.lockstep,
                                         "Step with a lock-step graph; stays until it is stopped");
  play->add_option("--step-rate", o->play.step_rate_hz, "Of the player in lock-step [Hz]")
      ->check(CLI::Range(1.0, 1e5))
      ->needs(lockstep)
      ->capture_default_str();
  lockstep->excludes(clock)->excludes(loop);
  play->add_flag("--json", o->play.json, "Print one JSON object at the end");
  play->footer(
      "Latched topics come first, with the last value before the start. clock/time is not played.\n"
      "Example: mimesis log play run.mcap --topic camera/image --rate 0.5");
  play->callback([o, &exit_code] {
    o->play.playback.topic = TopicFilter(o->topics, o->regex, o->exclude);
    exit_code = log_play(o->play);
  });
}

}  // namespace mimesis::tool
