#include "common/runtime/run_node.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <map>
#include <utility>

#include "common/error.h"
#include "common/runtime/command_line.h"
#include "common/runtime/describe.h"
#include "common/runtime/log.h"
#include "common/runtime/node_clock.h"
#include "common/runtime/own_topics.h"
#include "common/runtime/param_source.h"
#include "common/runtime/ports.h"
#include "common/runtime/replay.h"
#include "common/runtime/service_manager.h"
#include "common/runtime/step_recorder.h"
#include "common/runtime/value_text.h"
#include "proto/foxglove/log.pb.h"

namespace mimesis::runtime {
namespace {

/// PORT=TOPIC or PORT=NODE.
void wire(const std::vector<std::string>& pairs, const char* option,
          std::map<std::string, std::string, std::less<>>& wiring) {
  for (const std::string& pair : pairs) {
    const std::size_t equals = pair.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == pair.size()) {
      throw ConfigError(std::string(option) + " '" + pair + "': expected PORT=NAME");
    }
    if (!wiring.emplace(pair.substr(0, equals), pair.substr(equals + 1)).second) {
      throw ConfigError(std::string(option) + " " + pair.substr(0, equals) + " is given twice");
    }
  }
}

int report(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) return app.exit(error);
  std::string line = error.what();
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr && !app.remaining().empty()) {
    const std::string word = app.remaining().front();
    std::vector<std::string> known;
    for (const CLI::Option* option : app.get_options()) {
      for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
    }
    line = word.starts_with('-') ? "unknown option '" + word + "'" +
                                       did_you_mean(word.substr(0, word.find('=')), known)
                                 : "unexpected argument '" + word + "'";
  }
  std::cerr << app.get_name() << ": " << line << "; see --help\n";
  return 2;
}

constexpr Time kPeriod = std::chrono::seconds(1);

foxglove::Log::Level to_foxglove(Level level) {
  constexpr std::array kLevels{foxglove::Log::DEBUG, foxglove::Log::INFO, foxglove::Log::WARNING,
                               foxglove::Log::ERROR};
  return kLevels.at(static_cast<std::size_t>(level));
}

/// A node's report about itself: NODE/health once per second of graph time, its log lines on
/// NODE/log.
class SelfReport {
 public:
  explicit SelfReport(ZmqBus& bus) : bus_(bus), health_(bus, kHealthPort), log_(bus, kLogPort) {}

  void step_begins() { began_ = std::chrono::steady_clock::now(); }
  /// Publishes reports that are due. `overruns`: since the start.
  void step_ended(Time now, std::uint64_t overruns) {
    const double took_s = to_seconds(std::chrono::steady_clock::now() - began_);
    ++steps_;
    ++steps_in_period_;
    worst_s_ = std::max(worst_s_, took_s);
    sum_s_ += took_s;
    publish_log(now);
    if (next_ == Time(0) || now < next_ - 2 * kPeriod) {  // first, or the clock went back
      first_ = now;
      next_ = now + kPeriod;
    }
    if (now >= next_) publish_health(now, overruns);
  }
  /// The lines logged since the last step.
  void publish_log(Time now) {
    for (LogLine& line : take_log_lines()) {
      foxglove::Log message;
      message.set_level(to_foxglove(line.level));
      message.set_message(std::move(line.text));
      message.set_name(bus_.node());
      log_.send(message, now);
    }
  }

 private:
  void publish_health(Time now, std::uint64_t overruns) {
    v1::Health health;
    health.set_node(bus_.node());
    health.set_steps(steps_);
    health.set_overruns(overruns);
    health.set_worst_step_s(worst_s_);
    health.set_mean_step_s(sum_s_ / static_cast<double>(steps_in_period_));
    for (v1::InputHealth& input : bus_.report_inputs(now)) *health.add_inputs() = std::move(input);
    health.set_sent(bus_.sent());
    health.set_backlog(bus_.backlog());
    health.set_overflow(bus_.overflow());
    health.set_malformed(bus_.malformed());
    health_.send(health, now);
    const std::string waits = waits_for(now);
    notify_status([&health, &waits] {
      return fmt::format("{}{} steps, worst {:.1f} ms, {} overruns", waits, health.steps(),
                         health.worst_step_s() * 1e3, health.overruns());
    });
    worst_s_ = sum_s_ = 0.0;
    steps_in_period_ = 0;
    while (next_ <= now) next_ += kPeriod;
  }

  /// Inputs that the node does not work without and that have been silent since its start: for the
  /// status, and in the log once that is long, and again when they have come.
  std::string waits_for(Time now) {
    constexpr Time kLong = std::chrono::seconds(5);
    const std::vector<std::string> topics = bus_.awaited();
    const Time waited = now - first_;
    if (topics.empty()) {
      if (std::exchange(told_, false))
        info("waits no longer: something has come on all inputs, {:.0f} s after the start",
             to_seconds(waited));
      return {};
    }
    const std::string line =
        fmt::format("waits for {}, {:.0f} s so far", fmt::join(topics, ", "), to_seconds(waited));
    if (waited >= kLong && !std::exchange(told_, true)) info("{}", line);
    return line + "; ";
  }

  ZmqBus& bus_;
  Out<v1::Health> health_;
  Out<foxglove::Log> log_;
  std::chrono::steady_clock::time_point began_{};
  std::uint64_t steps_ = 0, steps_in_period_ = 0;
  double worst_s_ = 0.0, sum_s_ = 0.0;
  Time next_{}, first_{};  ///< report; step
  bool told_ = false;      ///< that it waits
};

/// Records that make a node's run replayable: NODE/start (latched) at its first step, NODE/steps
/// ten times a second of graph time.
class StepReport {
 public:
  /// @param parameters  effective ones, YAML
  StepReport(ZmqBus& bus, const BusOptions& options, const std::string& parameters)
      : bus_(bus),
        parameters_(parameters),
        recorded_bus_(bus, recorder_, options.in),
        start_(bus, kStartPort, {.latched = true}),
        steps_(bus, kStepsPort) {}

  /// For the node.
  Bus& bus() { return recorded_bus_; }
  void begin(v1::StepKind kind, Time now) {
    if (kind == v1::STEP_KIND_STEP && !started_) publish_start(now);
    bus_.step_begins(now);
    recorder_.begin(kind, now);
    open_ = now;
  }
  void end() {
    if (!open_) return;
    recorder_.end();
    if (recorder_.due(*open_)) publish(*open_);
    open_.reset();
  }
  /// Publishes the steps that are still held.
  void publish(Time now) {
    v1::StepLog& log = recorder_.take();
    if (!log.steps().empty()) steps_.send(log, now);
  }

 private:
  void publish_start(Time now) {
    started_ = true;
    const v1::NodeInfo& info = bus_.info();
    v1::NodeStart start;
    start.set_node(info.name());
    start.set_executable(std::filesystem::path(info.executable()).filename());
    start.set_start_id(info.start_id());
    start.set_clock(info.clock());
    start.set_parameters(parameters_);
    *start.mutable_inputs() = info.inputs();
    *start.mutable_outputs() = info.outputs();
    start.set_version(MIMESIS_VERSION);
    start_.send(start, now);
  }

  ZmqBus& bus_;
  std::string parameters_;
  StepRecorder recorder_;
  RecordedBus recorded_bus_;
  Out<v1::NodeStart> start_;
  Out<v1::StepLog> steps_;
  bool started_ = false;
  std::optional<Time> open_;  ///< time of the step that runs
};

/// Longest time that a node that moves something may continue to step after it was asked to stop.
constexpr std::chrono::milliseconds kRestGrace(1500);

/// Steps until asked to stop and at rest; the exit code.
int step_until_stopped(AnyNode& node, NodeClock& clock, SelfReport& report, StepReport& steps,
                       const StopSignal& stop) {
  int exit_code = 0;
  try {
    while (const auto now = clock.wait()) {
      report.step_begins();
      steps.begin(v1::STEP_KIND_STEP, *now);
      node.step(*now);
      steps.end();
      report.step_ended(*now, clock.overruns());
      clock.done();
      if (stop.requested() && node.at_rest()) break;
    }
  } catch (const std::exception& e) {
    error("step failed: {}", e.what());
    steps.end();
    exit_code = 1;
  }
  notify_stopping();
  steps.begin(v1::STEP_KIND_STOP, clock.now());
  node.stop(clock.now());
  steps.end();
  steps.publish(clock.now());
  report.publish_log(clock.now());
  return exit_code;
}

struct EffectiveParams {
  std::string all;      ///< all parameters as YAML
  std::string changed;  ///< one line: what differs from the defaults
};

EffectiveParams effective_params(const VisitParams& visit,
                                 const std::vector<std::string>& defaults) {
  std::string changed;
  for (const std::string& entry : flat_params(visit)) {
    if (std::ranges::find(defaults, entry) == defaults.end()) {
      changed += (changed.empty() ? "" : " ") + entry;
    }
  }
  return {dump_params(visit), changed.empty() ? "all parameters at their defaults" : changed};
}

/// Puts before errors of the node's own checks, which name no place, that of the parameter.
class Named {
 public:
  Named(std::string_view owner, const std::vector<ParamInfo>& defaults, const VisitParams& visit,
        const ParamSource& source)
      : owner_(owner), defaults_(defaults), visit_(visit), source_(source) {}

  template <class Check>
  auto operator()(const Check& check) const {
    try {
      return check();
    } catch (const ConfigError& e) {
      throw ConfigError(placed(e.what(), owner_, defaults_, visit_, source_));
    }
  }

 private:
  std::string owner_;
  const std::vector<ParamInfo>& defaults_;
  const VisitParams& visit_;
  const ParamSource& source_;
};

/// A node that moves a robot steps at the robot's rate, whether or not its parameters repeat it.
void take_robot_rate(AnyNode& node, const ParamSource& source, const Named& named,
                     std::string_view owner) {
  const double robot_hz = named([&] { return node.robot_rate_hz(); });
  if (robot_hz == 0.0) return;
  if (source.gives("rate_hz") && std::abs(node.rate_hz() / robot_hz - 1.0) > 1e-9) {
    throw ConfigError(fmt::format("{}: {}.rate_hz: {} contradicts the robot's file, which says {}",
                                  to_string(source.place_of("rate_hz")), owner, node.rate_hz(),
                                  robot_hz));
  }
  node.set_rate_hz(robot_hz);
}

/// All memory of the process, what it has and what it will have, stays in RAM.
void lock_memory() {
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  limit.rlim_cur = limit.rlim_max;
  if (setrlimit(RLIMIT_MEMLOCK, &limit) == 0 && mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return;
  throw ConfigError(
      fmt::format("--mlock: memory cannot be locked: {}; at most {} kB may be (ulimit -l)",
                  std::strerror(errno), limit.rlim_max / 1024));
}

int run_configured(const NodeOptions& options, const EffectiveParams& effective, const Named& named,
                   AnyNode& node) {
  StopSignal stop(node.comes_to_rest() ? kRestGrace : std::chrono::milliseconds(0));
  set_log_name(options.bus.name);
  if (options.lock_memory) lock_memory();
  BusOptions bus_options = options.bus;
  add_clock_wiring(bus_options);
  ZmqBus bus(std::move(bus_options));
  SelfReport report(bus);
  StepReport steps(bus, options.bus, effective.all);
  serve_params(steps.bus(), node);
  try {
    steps.begin(v1::STEP_KIND_CREATE, Time(0));
    named([&] { node.create(steps.bus()); });
    steps.end();
    const auto clock =
        make_clock(options.bus.clock, bus, node.rate_hz(), node.offset_s(), stop.fd());
    bus.ready();
    info("ready: {}", effective.changed);
    record("parameters:\n" + effective.all);
    notify_ready();
    return step_until_stopped(node, *clock, report, steps, stop);
  } catch (...) {
    node.stop(Time(0));  // before the bus that its ports refer to
    throw;
  }
}

}  // namespace

int show_node(const NodeOptions& options, const NodeAbout& about, const CreateNode& create,
              const VisitParams& visit, const std::vector<ParamInfo>& defaults,
              const ParamSource& source) {
  set_log_level(Level::error);
  const bool lockstep = options.bus.clock == ClockKind::lockstep;
  const Named named(about.name, defaults, visit, source);
  Declared declared;
  int exit_code = 0;
  try {
    named([&] { declare(create, options.bus.name, lockstep, options.check, declared); });
  } catch (const ConfigError& e) {
    std::cerr << printable(e.what(), "\n") << '\n';
    exit_code = 2;
  }
  if (options.describe) {
    std::cout << description(about, declared, defaults, param_infos(visit), flat_params(visit),
                             source)
              << std::endl;
  }
  return exit_code;
}

std::optional<int> parse_command_line(int argc, char** argv, const NodeAbout& about,
                                      const std::function<void(ParamVisitor&)>& visit,
                                      const std::function<void(Bus&)>& create,
                                      NodeOptions& options) {
  const std::string program = "mimesis_" + std::string(about.name);
  CLI::App app(std::string(about.about), program);
  app.set_version_flag("--version", program + " " MIMESIS_VERSION);
  options.bus.name = about.name;
  std::vector<std::string> in, out, from;
  const std::map<std::string, ClockKind> clocks{
      {"wall", ClockKind::wall}, {"sim", ClockKind::sim}, {"lockstep", ClockKind::lockstep}};
  std::string clock = "wall";
  const auto repeated = [&app](const char* name, std::vector<std::string>& values, const char* help,
                               const char* metavar) {
    app.add_option(name, values, help)->type_name(metavar)->allow_extra_args(false);
  };
  app.add_option("--name", options.bus.name, "Name of the node in its graph")
      ->capture_default_str();
  app.add_option("--graph", options.bus.graph,
                 "Graph to join (default: $MIMESIS_GRAPH, or 'default')");
  app.add_option("--clock", clock, "wall, sim (topic clock/time) or lockstep (node clock conducts)")
      ->capture_default_str();
  app.add_option("--params", options.params, "Parameters: a YAML file, or a section of one")
      ->type_name("FILE[#PATH]");
  repeated("--set", options.sets, "Sets one parameter; wins over the file", "KEY=VALUE");
  repeated("--arg", options.args, "Replaces the default of an argument that the file declares",
           "NAME=VALUE");
  repeated("--in", in, "Wires an input to a topic; unwired inputs receive nothing", "PORT=TOPIC");
  repeated("--from", from,
           "Publisher of an input's topic (default: the node that it names), for inputs that obey "
           "one node",
           "PORT=NODE");
  repeated("--out", out, "Wires an output to a topic (default: NAME/PORT)", "PORT=TOPIC");
  app.add_option(
         "--bind", options.bus.bind,
         "Reachable from other hosts (the launcher's business): services on PORT, data on PORT+1, "
         "reliable data on PORT+2; PORT *: any")
      ->type_name("tcp://ADDRESS:PORT");
  app.add_flag("--mlock", options.lock_memory, "Locks all its memory in RAM (mlockall)");
  app.add_flag("--check", options.check,
               "Makes the node without sockets and devices and stops: exit code 0 or 2");
  app.add_flag("--describe", options.describe,
               "Prints ports, services, parameters and files as JSON and stops");
  app.add_option("--replay", options.replay_fd,
                 "Runs recorded steps that `mimesis log replay` sends over this socket")
      ->type_name("FD");
  app.footer([&] {
    Declared declared;
    set_log_level(Level::error);
    try {
      declare(create, options.bus.name, true, false, declared);
    } catch (const std::exception&) {  // its defaults do not make a node: what is known is shown
    }
    return "Ports (name, message, policy):\n" + ports_text(declared) +
           "\nParameters (key, default, range):\n" + params_text(param_infos(visit)) +
           "\nExamples:\n  " + program + " --params launch/imitation.yaml#nodes." +
           std::string(about.name) + ".params\n  " + program +
           " --name other --graph trial --set rate_hz=50 --in PORT=node/topic\n";
  });
  try {
    app.parse(argc, argv);
    const auto chosen = clocks.find(clock);
    if (chosen == clocks.end()) {
      throw ConfigError("--clock '" + clock + "': expected wall, sim or lockstep" +
                        did_you_mean(clock, {"wall", "sim", "lockstep"}));
    }
    options.bus.clock = chosen->second;
    wire(in, "--in", options.bus.in);
    wire(out, "--out", options.bus.out);
    wire(from, "--from", options.bus.from);
  } catch (const CLI::ParseError& e) {
    return report(app, e);
  } catch (const ConfigError& e) {
    std::cerr << program << ": " << printable(e.what(), "\n") << '\n';
    return 2;
  }
  return std::nullopt;
}

int run(int argc, char** argv, const NodeAbout& about, AnyNode& node) {
  const VisitParams visit = [&node](ParamVisitor& v) { node.visit(v); };
  const CreateNode create = [&node](Bus& bus) { node.create(bus); };
  NodeOptions options;
  if (const auto exit_code = parse_command_line(argc, argv, about, visit, create, options))
    return *exit_code;
  try {
    const std::vector<std::string> defaults = flat_params(visit);
    const std::vector<ParamInfo> infos = param_infos(visit);
    const ParamSource source(options.params, options.args, options.sets);
    const bool replays = options.replay_fd >= 0;
    std::vector<std::string> went;
    source.read(about.name, visit, replays ? &went : nullptr);
    if (!went.empty()) {
      std::cerr << fmt::format("{}: parameters of the log that this version does not have: {}\n",
                               options.bus.name,
                               printable(fmt::format("{}", fmt::join(went, ", "))));
    }
    const Named named(about.name, infos, visit, source);
    take_robot_rate(node, source, named, about.name);
    if (options.check || options.describe)
      return show_node(options, about, create, visit, infos, source);
    if (replays) return run_replay(options.bus, options.replay_fd, node);
    return run_configured(options, effective_params(visit, defaults), named, node);
  } catch (const ConfigError& e) {
    std::cerr << printable(e.what(), "\n") << '\n';
    return 2;
  } catch (const std::exception& e) {
    std::cerr << options.bus.name << ": " << printable(e.what(), "\n") << '\n';
    return 1;
  }
}

}  // namespace mimesis::runtime
