#include <algorithm>
#include <iostream>

#include "common/error.h"
#include "common/runtime/command_line.h"
#include "common/runtime/log.h"
#include "common/runtime/log_lines.h"
#include "common/runtime/node_clock.h"
#include "common/runtime/param_source.h"
#include "common/runtime/replay.h"
#include "common/runtime/run_node.h"
#include "common/runtime/self_report.h"
#include "common/runtime/step_report.h"
#include "common/runtime/stop_signal.h"

namespace mimesis::runtime {
namespace {

std::unique_ptr<NodeClock> make_clock(ClockKind kind, ZmqBus& bus, const AnyNode& node,
                                      int stop_fd) {
  switch (kind) {
    case ClockKind::wall:
      return make_wall_clock(bus, node.rate_hz(), node.offset_s(), stop_fd);
    case ClockKind::sim:
      return make_sim_clock(bus, node.rate_hz(), node.offset_s(), stop_fd);
    case ClockKind::lockstep:
      return make_lockstep_clock(bus, node.rate_hz(), node.offset_s(), stop_fd);
  }
  return nullptr;
}

/// How long a node that moves something may go on stepping after it was asked to stop.
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
  steps.begin(v1::STEP_KIND_STOP, clock.now());
  node.stop(clock.now());
  steps.end();
  steps.publish(clock.now());
  report.publish_log(clock.now());
  return exit_code;
}

struct EffectiveParams {
  std::string all;      ///< as YAML
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

/// What the node's own checks find names no place yet.
void create(AnyNode& node, Bus& bus) {
  try {
    node.create(bus);
  } catch (const ConfigError& e) {
    const std::string what = e.what();
    if (what.starts_with(bus.node() + ".")) throw;
    throw ConfigError(bus.node() + ": " + what);
  }
}

int run_configured(const NodeOptions& options, const EffectiveParams& effective, AnyNode& node) {
  StopSignal stop(node.comes_to_rest() ? kRestGrace : std::chrono::milliseconds(0));
  set_log_name(options.bus.name);
  BusOptions bus_options = options.bus;
  add_clock_wiring(bus_options);
  ZmqBus bus(std::move(bus_options));
  SelfReport report(bus);
  StepReport steps(bus, options.bus, effective.all);
  try {
    steps.begin(v1::STEP_KIND_CREATE, Time(0));
    create(node, steps.bus());
    steps.end();
    const auto clock = make_clock(options.bus.clock, bus, node, stop.fd());
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

int run(int argc, char** argv, const NodeAbout& about, AnyNode& node) {
  const auto visit = [&node](ParamVisitor& v) { node.visit(v); };
  NodeOptions options;
  if (const auto exit_code = parse_command_line(argc, argv, about, visit, options))
    return *exit_code;
  try {
    const std::vector<std::string> defaults = flat_params(visit);
    ParamSource(options.params, options.args, options.sets).read(about.name, visit);
    if (options.check) return 0;
    if (options.replay_fd >= 0) return run_replay(options.bus, options.replay_fd, node);
    return run_configured(options, effective_params(visit, defaults), node);
  } catch (const ConfigError& e) {
    std::cerr << e.what() << '\n';
    return 2;
  } catch (const std::exception& e) {
    std::cerr << options.bus.name << ": " << e.what() << '\n';
    return 1;
  }
}

}  // namespace mimesis::runtime
