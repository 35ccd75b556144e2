#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <memory>

#include "tools/mimesis/log/play.h"
#include "tools/mimesis/log/subverbs.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/number_check.h"

namespace mimesis::tool {
namespace {

constexpr double kMegabyte = 1e6;

struct Options {
  PlayOptions play;
  TopicOptions topics;
  std::vector<std::string> remaps;
  bool no_keys = false;
  double read_ahead_mb = 0.0;
};

void add_what(CLI::App& play, Options& o) {
  play.add_option("FILE", o.play.files, "MCAP files: one log, or its parts")->required();
  add_topic_options(play, o.topics);
  play.add_flag("--all-topics", o.play.playback.about_nodes,
                "Also what the recorded nodes said about themselves: NODE/start, steps, health, "
                "log");
  play.add_option("--remap", o.remaps,
                  "OLD:=NEW publishes topic OLD as NEW, OLD/:=NEW/ all below OLD/ (repeatable)")
      ->allow_extra_args(false);
  TimeRange& range = o.play.playback.range;
  play.add_option("--start", range.start,
                  "From this log time on: seconds from the first message (12.5), absolute "
                  "(12500000000ns) or UTC (2026-11-21T15:40:00.5Z)");
  CLI::Option* duration = play.add_option("--duration", range.duration, "So many recorded seconds");
  play.add_option("--end", range.end, "To this log time")->excludes(duration);
}

void add_how(CLI::App& play, Options& o) {
  CLI::Option* rate = play.add_option("--rate", o.play.rate, "Recorded seconds per second")
                          ->check(CLI::Range(kSlowestPlay, kFastestPlay))
                          ->capture_default_str();
  CLI::Option* loop = play.add_option("--loop", o.play.loops, "So many times; 0: until stopped")
                          ->check(number_not_below_zero)
                          ->capture_default_str();
  CLI::Option* paused = play.add_flag("--paused", o.play.paused, "Start paused");
  play.add_flag("--stay", o.play.stay,
                "At the end: stay, paused, for seeks and late subscribers; in lock-step: stay a "
                "member");
  CLI::Option* clock = play.add_flag("--clock", o.play.clock,
                                     "Drive the clock of a graph that runs on simulated time");
  play.add_flag("--lockstep", o.play.lockstep,
                "Step with a lock-step graph, in it at the recorded times; leaves it at the end")
      ->excludes(clock)
      ->excludes(loop)
      ->excludes(paused)
      ->excludes(rate);
  play.add_option("--read-ahead", o.play.ahead.seconds,
                  "Read so many recorded seconds ahead [s]; default: 0.5, more when that is too "
                  "little")
      ->check(number_above_zero);
  play.add_option("--read-ahead-mb", o.read_ahead_mb, "But not more than this [MB]; default: 134")
      ->check(number_above_zero);
  play.add_option("--name", o.play.name, "Name of the player in the graph")->capture_default_str();
  play.add_flag("--no-keys", o.no_keys, "Leave the keyboard alone");
  play.add_flag("--json", o.play.json, "Print one JSON object at the end");
}

constexpr const char* kFooter =
    "Positions are seconds from the first message of the log. Latched topics come first, with the\n"
    "last value before the start. clock/time is not played.\n"
    "Keys: space pauses, s steps, left and right seek by 5 s (right while paused: step),\n"
    "      up and down change the rate by 10 %, q quits.\n"
    "Services: NAME/pause, resume, step, seek, rate, status (proto/player.proto).\n"
    "Messages leave at their recorded times; who subscribes reliably and is too slow is waited "
    "for,\n"
    "recorded time with it; all others get the newest.\n"
    "Exit code 1 if something could not be read, or a reliable subscriber missed something.\n"
    "Examples:\n"
    "  mimesis log play run.mcap --rate 0.5 --topic camera/image --topic planner/status\n"
    "  mimesis log play run_0.mcap run_1.mcap --start 12.5 --duration 10 --loop 0\n"
    "  mimesis log play run.mcap --remap camera/:=recorded/camera/ --exclude 'world/.*'\n"
    "  mimesis log play run.mcap --clock --paused";

}  // namespace

void add_play(CLI::App& verb, int& exit_code) {
  CLI::App* play = verb.add_subcommand("play", "Publishes the messages of a log again");
  auto o = std::make_shared<Options>();
  add_what(*play, *o);
  add_how(*play, *o);
  play->footer(kFooter);
  play->callback([o, &exit_code] {
    o->play.playback.filter = filter_of(o->topics);
    o->play.playback.remap = PlayRemap(o->remaps);
    o->play.keys = !o->no_keys;
    if (o->read_ahead_mb > 0.0) {
      o->play.ahead.bytes = static_cast<std::size_t>(o->read_ahead_mb * kMegabyte);
    }
    exit_code = log_play(o->play);
  });
}

}  // namespace mimesis::tool
