#include "nodes/clock/clock_node.h"

#include <iostream>

#include "common/error.h"
#include "common/runtime/command_line.h"
#include "common/runtime/log.h"
#include "common/runtime/log_lines.h"
#include "common/runtime/param_source.h"
#include "common/runtime/stop_signal.h"

namespace mimesis::clock {

int run_clock(int argc, char** argv) {
  ClockParams params;
  const auto visit = [&params](runtime::ParamVisitor& v) { params.visit(v); };
  runtime::NodeOptions options;
  const runtime::NodeAbout about{
      .name = "clock", .about = "Simulated time: conducts lock-step, or publishes clock/time"};
  if (const auto code = runtime::parse_command_line(argc, argv, about, visit, options))
    return *code;
  try {
    runtime::ParamSource(options.params, options.args, options.sets).read(about.name, visit);
    if (options.check) return 0;
    runtime::StopSignal stop;
    runtime::set_log_name(options.bus.name);
    options.bus.clock = runtime::ClockKind::wall;  // it waits for nobody's time
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
