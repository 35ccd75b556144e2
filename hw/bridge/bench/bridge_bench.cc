// Full cycles on the embedded bus: set-points and SYNC out, the drives answer in the same thread,
// feedback in. With and without the drives' own work. Seven axes of an arm on one bus; thirty of a
// biped on four. `paced`: on the wall clock, the drives in another process, which asks the bus
// every 50 us; MIMESIS_BENCH_S seconds (10). `paced_udp`: the same with seven joints of a
// controller that takes datagrams.
#include <benchmark/benchmark.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/sysinfo.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <bitset>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "common/time.h"
#include "hw/cia402/joint_driver.h"
#include "hw/sim/cia402/drive.h"
#include "hw/sim/udp/controller.h"
#include "hw/udp/driver.h"

namespace mimesis::hw {
namespace {

using namespace std::chrono_literals;

constexpr Time kCycle = 5ms;

enum class Part { both, driver, drives };

/// Driver and drives of `on_bus[i]` axes on bus i, or one of them.
class Bench {
 public:
  Bench(const std::vector<int>& on_bus, const std::string& directory, Part part = Part::both,
        double rate_hz = 200.0) {
    std::vector<std::unique_ptr<cia402::JointDriver>> parts;
    int node = 0;
    for (std::size_t bus = 0; bus < on_bus.size(); ++bus) {
      const std::string address = "embedded:bench" + std::to_string(bus);
      const auto all = [&](double x) { return Eigen::VectorXd::Constant(on_bus[bus], x); };
      std::vector<sim::DriveConfig> drives;
      cia402::JointDriverOptions options;
      for (int i = 0; i < on_bus[bus]; ++i) {
        options.axes.push_back({.node_id = ++node});
        drives.push_back({.axis = options.axes.back()});
      }
      options.limits = {.q_min = all(-2), .q_max = all(2), .v_max = all(2), .a_max = all(10)};
      options.rate_hz = rate_hz;
      if (part != Part::driver)
        racks.push_back(std::make_unique<sim::Rack>(drives, can::open(address, directory)));
      if (part == Part::drives) continue;
      parts.push_back(
          std::make_unique<cia402::JointDriver>(options, can::open(address, directory)));
    }
    q.resize(static_cast<std::size_t>(node), 0.0);
    if (part != Part::drives) driver.emplace(std::move(parts));
  }
  Phase cycle(Mode mode) {
    const Phase phase = driver->read(now).phase;
    driver->write(now, {.mode = mode, .position_rad = q});
    return phase;
  }
  void answer() {
    for (const auto& rack : racks) rack->step(now + kCycle / 2);
    now += kCycle;
  }

  std::vector<std::unique_ptr<sim::Rack>> racks;
  std::optional<cia402::GroupDriver> driver;
  std::vector<double> q;
  Time now = 1s;
};

/// A folder in memory: a bus does not wait for a disk.
std::string new_folder() {
  std::string name = "/dev/shm/mimesis-bench-XXXXXX";
  return mkdtemp(name.data()) != nullptr ? name : "";
}

void run(benchmark::State& state, const std::vector<int>& on_bus) {
  const std::string directory = new_folder();
  if (directory.empty()) return state.SkipWithError("no folder in /dev/shm");
  {
    Bench bench(on_bus, directory);
    Phase phase = Phase::starting;
    while (bench.now < 3s) {
      phase = bench.cycle(bench.now < 2s ? Mode::idle : Mode::follow);
      bench.answer();
    }
    if (phase != Phase::following) state.SkipWithError("the robot does not follow");
    const bool driver_only = state.range(0) != 0;
    for (auto _ : state) {
      phase = bench.cycle(Mode::follow);
      if (driver_only) state.PauseTiming();
      bench.answer();
      if (driver_only) state.ResumeTiming();
    }
    if (phase != Phase::following) state.SkipWithError("the robot has stopped following");
    state.counters["frames"] = benchmark::Counter(
        static_cast<double>(bench.driver->traffic().received), benchmark::Counter::kIsRate);
  }
  std::filesystem::remove_all(directory);
}

Time wall() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
}
void sleep_until(Time time) {
  const auto whole = std::chrono::floor<std::chrono::seconds>(time);
  const timespec at{.tv_sec = whole.count(), .tv_nsec = (time - whole).count()};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr) == EINTR) {
  }
}
/// Memory in place, ahead of everything else, on a processor of its own.
bool real_time(int processor) {
  const sched_param param{.sched_priority = 50};
  cpu_set_t own;
  CPU_ZERO(&own);
  CPU_SET(processor % get_nprocs(), &own);
  return mlockall(MCL_CURRENT | MCL_FUTURE) == 0 && sched_setaffinity(0, sizeof own, &own) == 0 &&
         sched_setscheduler(0, SCHED_FIFO, &param) == 0;
}

void usual_time() {
  const sched_param usual{};
  cpu_set_t all;
  CPU_ZERO(&all);
  for (int i = 0; i < get_nprocs(); ++i) CPU_SET(i, &all);
  munlockall();
  sched_setaffinity(0, sizeof all, &all);
  sched_setscheduler(0, SCHED_OTHER, &usual);
}

/// Time for which the processors of this guest had to wait for their host, all together.
double stolen_s() {
  std::ifstream stat("/proc/stat");
  std::string word;
  double ticks = 0.0;
  for (int i = 0; i < 9 && stat >> word; ++i) ticks = std::atof(word.c_str());  // the eighth number
  return ticks / static_cast<double>(sysconf(_SC_CLK_TCK));
}

/// The drives of a biped in a process of their own, until this one ends.
pid_t fork_drives(const std::vector<int>& on_bus, const std::string& directory, bool fifo) {
  const pid_t child = fork();
  if (child != 0) return child;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (fifo) real_time(1);
  Bench drives(on_bus, directory, Part::drives);
  for (;;) {
    for (const auto& rack : drives.racks) rack->step(wall());
    sleep_until(wall() + 50us);
  }
}

double microseconds_at(std::vector<Time>& times, double share) {
  const auto at =
      times.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(times.size() - 1));
  std::nth_element(times.begin(), at, times.end());
  return 1e6 * to_seconds(*at);
}

double wanted_s() {
  const char* asked = std::getenv("MIMESIS_BENCH_S");
  return asked != nullptr ? std::atof(asked) : 10.0;
}

/// Times of cycles: how late this process woke, and until all was answered.
struct Cycles {
  std::vector<Time> late{}, whole{};
  std::uint64_t slept = 0, unanswered = 0;  ///< cycles

  void show(benchmark::State& state) {
    if (late.empty() || whole.empty()) return;
    state.counters["wake_p50_us"] = microseconds_at(late, 0.5);
    state.counters["wake_p99_us"] = microseconds_at(late, 0.99);
    state.counters["wake_max_us"] = microseconds_at(late, 1.0);
    state.counters["cycle_p50_us"] = microseconds_at(whole, 0.5);
    state.counters["cycle_p99_us"] = microseconds_at(whole, 0.99);
    state.counters["cycles"] = static_cast<double>(late.size());
    state.counters["incomplete"] = static_cast<double>(unanswered + slept);
    state.counters["left_out"] = static_cast<double>(slept);  // because this process slept
  }
};

/// A cycle: from the time it is due until thirty drives have answered its SYNC, as another
/// participant of the buses sees it. Incomplete: not all have until the next is due, or this
/// process slept over it.
void paced(benchmark::State& state) {
  const std::vector<int> on_bus{6, 6, 9, 9};
  const std::string directory = new_folder();
  if (directory.empty()) return state.SkipWithError("no folder in /dev/shm");
  const double seconds = wanted_s();
  const double rate_hz = static_cast<double>(state.range(0));
  const Time period = from_seconds(1.0 / rate_hz);
  const bool fifo = state.range(1) != 0;
  if (fifo && !real_time(0)) return state.SkipWithError("no right to SCHED_FIFO");
  const pid_t child = fork_drives(on_bus, directory, fifo);
  Cycles cycles;
  cycles.late.reserve(static_cast<std::size_t>(seconds * rate_hz) + 1);
  cycles.whole.reserve(cycles.late.capacity());
  const double stolen_before_s = stolen_s();
  for (auto _ : state) {
    Bench bench(on_bus, directory, Part::driver, rate_hz);
    std::vector<std::unique_ptr<can::Bus>> observers;
    for (std::size_t b = 0; b < on_bus.size(); ++b)
      observers.push_back(can::open("embedded:bench" + std::to_string(b), directory));
    std::vector<can::Frame> frames(256);
    std::bitset<128> answered;  // by node
    const auto look = [&] {
      for (const auto& observer : observers) {
        const std::size_t n = observer->receive(frames);
        for (const can::Frame& f : std::span(frames).first(n)) {
          if (f.id - 0x181 < 0x7F) answered.set(f.id - 0x180);
        }
      }
    };
    Phase phase = Phase::starting;
    Time due = wall() + 10ms;
    const Time enabled_after = due + 3s, end = enabled_after + 1s + from_seconds(seconds);
    for (; due < end; due += period) {
      sleep_until(due);
      const Time woken = wall();
      look();  // answers that came too late for the cycle before
      answered.reset();
      bench.now = woken;
      phase = bench.cycle(due < enabled_after ? Mode::idle : Mode::follow);
      while (answered.count() < 30 && wall() < due + period - 20us) look();
      if (due < end - from_seconds(seconds)) continue;
      cycles.late.push_back(woken - due);
      answered.count() == 30 ? cycles.whole.push_back(wall() - due) : (void)++cycles.unanswered;
      while (wall() > due + period) due += period, ++cycles.slept;  // left out
    }
    if (phase != Phase::following) state.SkipWithError(bench.driver->read(wall()).reason.c_str());
  }
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  const double stolen_ms = 1e3 * (stolen_s() - stolen_before_s);
  usual_time();
  std::filesystem::remove_all(directory);
  cycles.show(state);
  state.counters["stolen_ms"] = stolen_ms;
}

/// Shows the newest state on the way to the driver.
class WatchedLink final : public udp::Link {
 public:
  WatchedLink(std::unique_ptr<udp::Link> link, std::uint32_t& heard)
      : link_(std::move(link)), heard_(heard) {}
  bool send(std::string_view datagram) override { return link_->send(datagram); }
  std::vector<std::string> receive() override {
    take();
    return std::exchange(kept_, {});
  }
  void take() {
    for (std::string& datagram : link_->receive()) {
      if (const auto state = udp::decode_state(datagram)) heard_ = state->header.heard;
      kept_.push_back(std::move(datagram));
    }
  }

 private:
  std::unique_ptr<udp::Link> link_;
  std::uint32_t& heard_;
  std::vector<std::string> kept_;
};

pid_t fork_controller(const std::string& address, bool fifo) {
  const pid_t child = fork();
  if (child != 0) return child;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (fifo) real_time(1);
  udp::Endpoint endpoint(address);
  sim::Controller controller({.home_rad = std::vector<double>(7, 0.0),
                              .v_max_rad_s = std::vector<double>(7, 2.0),
                              .a_max_rad_s2 = std::vector<double>(7, 10.0)});
  for (;;) {
    for (const auto& [from, bytes] : endpoint.receive()) {
      controller.handle(from, bytes, wall());
      controller.advance(wall());
      endpoint.send(from, controller.state());
    }
    sleep_until(wall() + 50us);
  }
}

/// A cycle: from the time it is due until the controller's state answers its command.
void paced_udp(benchmark::State& state) {
  const std::string address = "127.0.0.1:27219";
  const double seconds = wanted_s(), rate_hz = static_cast<double>(state.range(0));
  const Time period = from_seconds(1.0 / rate_hz);
  const bool fifo = state.range(1) != 0;
  if (fifo && !real_time(0)) return state.SkipWithError("no right to SCHED_FIFO");
  const pid_t child = fork_controller(address, fifo);
  Cycles cycles;
  for (auto _ : state) {
    const auto all = [](double x) { return Eigen::VectorXd::Constant(7, x); };
    std::uint32_t heard = 0;
    auto link = std::make_unique<WatchedLink>(udp::connect(address), heard);
    WatchedLink& watched = *link;
    udp::Driver driver(
        {.address = address,
         .names = std::vector<std::string>(7, "joint"),
         .limits = {.q_min = all(-2), .q_max = all(2), .v_max = all(2), .a_max = all(10)},
         .rate_hz = rate_hz},
        std::move(link));
    const std::vector<double> q(7, 0.0);
    Phase phase = Phase::starting;
    Time due = wall() + 10ms;
    const Time enabled_after = due + 1s, begin = due + 2s, end = begin + from_seconds(seconds);
    for (; due < end; due += period) {
      sleep_until(due);
      const Time woken = wall();
      phase = driver.read(woken).phase;
      driver.write(woken,
                   {.mode = due < enabled_after ? Mode::idle : Mode::follow, .position_rad = q});
      const auto sent = static_cast<std::uint32_t>(driver.traffic().sent);
      while (heard != sent && wall() < due + period - 20us) watched.take();
      if (due < begin) continue;
      cycles.late.push_back(woken - due);
      heard == sent ? cycles.whole.push_back(wall() - due) : (void)++cycles.unanswered;
      while (wall() > due + period) due += period, ++cycles.slept;
    }
    if (phase != Phase::following) state.SkipWithError(driver.read(wall()).reason.c_str());
  }
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  usual_time();
  cycles.show(state);
}
BENCHMARK(paced_udp)
    ->ArgNames({"hz", "fifo"})
    ->Args({1000, 0})
    ->Args({1000, 1})
    ->Iterations(1)
    ->Unit(benchmark::kSecond);

BENCHMARK(paced)
    ->ArgNames({"hz", "fifo"})
    ->Args({200, 0})
    ->Args({1000, 0})
    ->Args({200, 1})
    ->Args({1000, 1})
    ->Iterations(1)
    ->Unit(benchmark::kSecond);

void full_cycle(benchmark::State& state) { run(state, {7}); }
void biped_cycle(benchmark::State& state) { run(state, {6, 6, 9, 9}); }
BENCHMARK(full_cycle)->ArgName("driver_only")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);
BENCHMARK(biped_cycle)->ArgName("driver_only")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace mimesis::hw
