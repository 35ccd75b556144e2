// `mimesis doctor`: what on this computer keeps a graph from running well, and what to do about it.
#include <fmt/format.h>
#include <google/protobuf/stubs/common.h>
#include <linux/capability.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/timex.h>
#include <sys/utsname.h>
#include <unistd.h>
#include <zmq.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "common/error.h"
#include "common/json_text.h"
#include "tools/mimesis/graph_tools.h"
#include "tools/mimesis/log_folder.h"
#include "tools/mimesis/machine_state.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;

/// ok; information; warning: a graph runs, but not as well as it could; problem: it does not.
enum class State { ok, information, warning, problem };

struct Finding {
  std::string check;
  State state;
  std::string found, advice{};
};

std::string first_line(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

bool has_capability(int capability) {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  __user_cap_data_struct data[2] = {};
  if (syscall(SYS_capget, &header, data) != 0) return false;
  return (data[capability / 32].effective >> (capability % 32) & 1U) != 0;
}

Finding real_time_priority() {
  rlimit limit{};
  getrlimit(RLIMIT_RTPRIO, &limit);
  if (has_capability(CAP_SYS_NICE))
    return {"real-time priority", State::ok, "allowed (CAP_SYS_NICE)"};
  if (limit.rlim_cur >= 80) {
    return {"real-time priority", State::ok,
            limit.rlim_cur == RLIM_INFINITY ? "allowed" : fmt::format("up to {}", limit.rlim_cur)};
  }
  return {
      "real-time priority", State::warning, fmt::format("up to {}", limit.rlim_cur),
      "bridges with `sched: fifo` do not start; a file /etc/security/limits.d/mimesis.conf with "
      "'@GROUP - rtprio 95', then log in again"};
}

Finding locked_memory() {
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  if (limit.rlim_cur == RLIM_INFINITY || has_capability(CAP_IPC_LOCK))
    return {"locked memory", State::ok, "unlimited"};
  return {
      "locked memory", State::warning, "at most " + bytes_text(limit.rlim_cur),
      "'@GROUP - memlock unlimited' in /etc/security/limits.d/mimesis.conf: a page that is read "
      "from the disk stops a real-time node for milliseconds"};
}

Finding governor() {
  std::set<std::string> governors;
  std::error_code ignored;
  for (const auto& cpu : fs::directory_iterator("/sys/devices/system/cpu", ignored)) {
    const std::string line = first_line(cpu.path() / "cpufreq/scaling_governor");
    if (!line.empty()) governors.insert(line);
  }
  if (governors.empty())
    return {"CPU frequency", State::information, "the kernel does not scale it here"};
  const std::string found = fmt::format("{}", fmt::join(governors, ", "));
  if (governors == std::set<std::string>{"performance"}) return {"CPU frequency", State::ok, found};
  return {"CPU frequency", State::warning, "governor " + found,
          "steps begin late while a CPU wakes up: sudo cpupower frequency-set -g performance"};
}

Finding kernel() {
  utsname name{};
  uname(&name);
  const bool preempt_rt = std::string(name.version).find("PREEMPT_RT") != std::string::npos ||
                          first_line("/sys/kernel/realtime") == "1";
  return {"kernel", State::information,
          fmt::format("{} {}{}", name.sysname, name.release, preempt_rt ? ", PREEMPT_RT" : ""),
          preempt_rt ? "" : "for steps within 100 us of their time: package linux-image-rt-amd64"};
}

Finding clock_sync() {
  timex state{};
  const int result = adjtimex(&state);
  constexpr long kMost_us = 1000;
  const std::string how = "several hosts need clocks within 1 ms: package chrony, or linuxptp";
  if (result < 0 || result == TIME_ERROR || (state.status & STA_UNSYNC) != 0)
    return {"clock", State::warning, "not synchronised", how};
  const std::string found = fmt::format("synchronised, error {} us at most", state.maxerror);
  return state.esterror > kMost_us ? Finding{"clock", State::warning, found, how}
                                   : Finding{"clock", State::ok, found};
}

Finding sockets() {
  try {
    const std::string folder = runtime::graph_directory(runtime::graph_name());
    const std::string probe = folder + "/nodes/" + std::string(64, 'n') + ".s";
    constexpr std::size_t kSocketPath = 108;  // sockaddr_un::sun_path
    if (probe.size() >= kSocketPath) {
      return {"sockets", State::problem, folder + ": too long for the names of sockets",
              "a shorter XDG_RUNTIME_DIR"};
    }
    return {"sockets", State::ok, folder};
  } catch (const ConfigError& e) {
    return {"sockets", State::problem, e.what(),
            "a folder of your own, mode 0700, in MIMESIS_RUNTIME_DIR"};
  }
}

Finding open_files() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  const std::string found = fmt::format("up to {}", limit.rlim_cur);
  if (limit.rlim_cur >= 1024) return {"open files", State::ok, found};
  return {"open files", State::warning, found,
          "a node needs some three for each peer: ulimit -n 4096"};
}

Finding can_interfaces() {
  constexpr const char* kCan = "280";  // ARPHRD_CAN
  std::string up, down;
  std::error_code ignored;
  for (const auto& interface : fs::directory_iterator("/sys/class/net", ignored)) {
    if (first_line(interface.path() / "type") != kCan) continue;
    std::string& list = first_line(interface.path() / "operstate") == "down" ? down : up;
    list += (list.empty() ? "" : ", ") + interface.path().filename().string();
  }
  if (up.empty() && down.empty()) {
    return {"CAN", State::information, "no interface",
            "only for robots with CAN: sudo modprobe can_raw; simulated buses (embedded:NAME) need "
            "none"};
  }
  if (down.empty()) return {"CAN", State::ok, up};
  return {"CAN", State::warning, fmt::format("down: {}{}", down, up.empty() ? "" : "; up: " + up),
          "sudo ip link set INTERFACE up type can bitrate 1000000"};
}

Finding disk() {
  std::error_code error;
  fs::path folder = log_root();
  while (!folder.empty() && !fs::exists(folder, error)) folder = folder.parent_path();
  const fs::space_info space = fs::space(folder, error);
  if (error) return {"disk", State::warning, folder.string() + ": " + error.message()};
  std::uint64_t logs = 0;
  for (const RunFolder& run : run_folders()) logs += run.bytes;
  const std::string found =
      fmt::format("{} free for logs in {}, logs have {}", bytes_text(space.available),
                  log_root().string(), bytes_text(logs));
  constexpr std::uint64_t kLeast = 5'000'000'000;
  return space.available < kLeast
             ? Finding{"disk", State::warning, found, "mimesis log clean --max-size 1GB"}
             : Finding{"disk", State::ok, found};
}

Finding versions() {
  int major = 0, minor = 0, patch = 0;
  zmq_version(&major, &minor, &patch);
  const int p = GOOGLE_PROTOBUF_VERSION;
  return {"versions", State::information,
          fmt::format("mimesis {}, ZeroMQ {}.{}.{}, Protobuf {}.{}.{}", MIMESIS_VERSION, major,
                      minor, patch, p / 1'000'000, p / 1000 % 1000, p % 1000)};
}

Finding graphs() {
  const std::vector<std::string> running = running_graphs();
  return {"graphs", State::information,
          running.empty() ? "none runs" : fmt::format("{}", fmt::join(running, ", "))};
}

Finding load() {
  const MachineState state = measure_machine(std::chrono::seconds(1));
  if (!state.busy()) return {"load", State::ok, state.text()};
  return {"load", State::warning, state.text(),
          "wait, or end other programs: graphs on the wall clock miss cycles; sched: fifo of the "
          "launch file helps"};
}

int doctor(bool json, bool quick) {
  static const std::map<State, std::string> kWords{{State::ok, "ok"},
                                                   {State::information, "info"},
                                                   {State::warning, "warning"},
                                                   {State::problem, "problem"}};
  std::vector<Finding> findings{load()};
  if (!quick) {
    findings.insert(findings.end(),
                    {real_time_priority(), locked_memory(), governor(), kernel(), clock_sync(),
                     sockets(), open_files(), can_interfaces(), disk(), versions(), graphs()});
  }
  auto list = nlohmann::ordered_json::array();
  TextTable table({"CHECK", "STATE", "FOUND"});
  for (const Finding& f : findings) {
    list.push_back({{"check", f.check},
                    {"state", kWords.at(f.state)},
                    {"found", f.found},
                    {"advice", f.advice}});
    table.row({f.check, kWords.at(f.state), f.found});
  }
  if (json) {
    std::cout << json_text(list) << '\n';
  } else {
    table.print(std::cout, use_colour(STDOUT_FILENO));
    for (const Finding& f : findings) {
      if (!f.advice.empty()) std::cout << fmt::format("\n{}: {}", f.check, f.advice);
    }
    std::cout << '\n';
  }
  return std::ranges::any_of(findings, [](const Finding& f) { return f.state == State::problem; })
             ? 1
             : 0;
}

}  // namespace

void add_doctor(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("doctor");
  auto o = std::make_shared<GraphOptions>();
  verb->add_flag("--json", o->json, "Machine-readable output (tools/mimesis/README.md)");
  auto quick = std::make_shared<bool>(false);
  verb->add_flag("--quick", *quick, "Only whether the machine is too busy for the wall clock: 1 s");
  verb->footer(
      "Exit code 1 if a graph cannot run; warnings do not count.\n"
      "Examples:\n  mimesis doctor\n  mimesis doctor --json");
  verb->callback([=, &exit_code] { exit_code = doctor(o->json, *quick); });
}

}  // namespace mimesis::tool
