#include "nodes/clock/clock_node.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>

#include "common/error.h"
#include "common/runtime/command_line.h"
#include "common/runtime/log.h"
#include "common/runtime/param_source.h"
#include "common/runtime/ports.h"
#include "common/runtime/service_manager.h"
#include "proto/runtime.pb.h"

// Free-running simulated time: t = factor·(wall − start), from when all participants are ready.

namespace mimesis::clock {
namespace {

using namespace std::chrono_literals;
using runtime::Time;

constexpr auto kPeriod = 100ms;
constexpr auto kFarewell = 1s;  // for nodes to hear that time has ended

bool all_ready(const runtime::ZmqBus& bus, const std::vector<std::string>& names) {
  const auto nodes = bus.known_nodes();
  return std::all_of(names.begin(), names.end(), [&](const std::string& name) {
    return std::any_of(nodes.begin(), nodes.end(), [&](const v1::NodeInfo& node) {
      return node.name() == name && node.ready();
    });
  });
}

}  // namespace

runtime::Out<v1::ClockTime> time_port(runtime::Bus& bus) {
  return runtime::Out<v1::ClockTime>(bus, "time", {.latched = true});
}

void publish_time(const ClockParams& params, runtime::ZmqBus& bus, int stop_fd) {
  if (params.factor <= 0.0) throw ConfigError("clock.factor: sim needs a factor above 0");
  auto out = time_port(bus);
  bus.ready();
  runtime::notify_ready();
  const std::array<int, 1> stop{stop_fd};
  while (!all_ready(bus, params.participants)) {
    if (bus.wait(std::chrono::steady_clock::now() + kPeriod, stop)) return;
  }
  const Time start = bus.time().now();
  for (;;) {
    const Time wall = bus.time().now();
    const Time time(std::llround(params.factor * static_cast<double>((wall - start).count())));
    v1::ClockTime message;
    message.set_time_ns(static_cast<std::uint64_t>(time.count()));
    message.set_wall_ns(static_cast<std::uint64_t>(wall.count()));
    message.set_factor(params.factor);
    message.set_ended(params.until_s > 0.0 && runtime::to_seconds(time) >= params.until_s);
    out.send(message, time);
    if (message.ended()) break;
    Time next = wall + kPeriod;
    if (params.until_s > 0.0)
      next = std::min(next, start + runtime::from_seconds(params.until_s / params.factor));
    if (bus.wait(bus.time().when(next), stop)) return;
  }
  runtime::info("simulated time ends at {} s", params.until_s);
  bus.wait(std::chrono::steady_clock::now() + kFarewell, stop);
}

int run_clock(int argc, char** argv) {
  ClockParams params;
  const auto visit = [&params](runtime::ParamVisitor& v) { params.visit(v); };
  runtime::NodeOptions options;
  const runtime::NodeAbout about{
      .name = "clock", .about = "Simulated time: conducts lock-step, or publishes clock/time"};
  const auto create = [](runtime::Bus& bus) { time_port(bus); };
  if (const auto code = runtime::parse_command_line(argc, argv, about, visit, create, options))
    return *code;
  try {
    const auto defaults = runtime::param_infos(visit);
    const runtime::ParamSource source(options.params, options.args, options.sets);
    source.read(about.name, visit);
    if (options.check || options.describe)
      return runtime::show_node(options, about, create, visit, defaults, source);
    runtime::StopSignal stop;
    runtime::set_log_name(options.bus.name);
    options.bus.clock = runtime::ClockKind::wall;  // it waits for no participant
    options.bus.out.emplace("time", "clock/time");
    runtime::ZmqBus bus(options.bus);
    params.mode == "sim" ? publish_time(params, bus, stop.fd()) : conduct(params, bus, stop.fd());
  } catch (const ConfigError& e) {
    std::cerr << e.what() << '\n';
    return 2;
  } catch (const std::exception& e) {
    std::cerr << options.bus.name << ": " << e.what() << '\n';
    return 1;
  }
  return 0;
}

}  // namespace mimesis::clock
