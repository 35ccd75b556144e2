// Any bytes as a scenario file, or as what others tell the node: states of external agents,
// characters, a style. It must continue, every agent at a finite place. The first byte chooses.
//   cmake --preset fuzz && ninja -C build-fuzz crowd_fuzz crowd_fuzz_seeds
//   build-fuzz/bin/crowd_fuzz_seeds CORPUS && build-fuzz/bin/crowd_fuzz -rss_limit_mb=1024 \
//     -close_fd_mask=2 CORPUS       (what a node says of bad input is no news)
#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>

#include "common/testing/loopback.h"
#include "nodes/crowd/certificate/certificate.h"
#include "nodes/crowd/crowd_node.h"
#include "nodes/crowd/fuzz/scenarios.h"
#include "nodes/crowd/scenario_file/scenario_file.h"
#include "nodes/crowd/test/scenario_file.h"

namespace {

using namespace mimesis;
using namespace mimesis::crowd;

constexpr int kMostAgents = 200;  // limit for a scenario that is run here
constexpr runtime::Time kPeriod = std::chrono::milliseconds(20);

/// Text as a file without a place.
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view text) : fd_(memfd_create("scenario", MFD_CLOEXEC)) {
    MIMESIS_ASSERT(fd_ >= 0);
    MIMESIS_ASSERT(write(fd_, text.data(), text.size()) == static_cast<ssize_t>(text.size()));
  }
  ~MemoryFile() { close(fd_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  std::string path() const { return "/proc/self/fd/" + std::to_string(fd_); }

 private:
  int fd_;
};

void check(const Crowd& c) {
  for (const double x : c.x_m()) MIMESIS_ASSERT(std::isfinite(x));
  for (const double y : c.y_m()) MIMESIS_ASSERT(std::isfinite(y));
  for (const double phase : c.phase_rad()) MIMESIS_ASSERT(std::isfinite(phase));
  for (const double heading : c.heading_rad()) MIMESIS_ASSERT(std::isfinite(heading));
}

void run(std::string_view text) {
  const MemoryFile file(text);
  Scenario scenario;
  try {
    scenario = read_scenario(file.path());
  } catch (const ConfigError& error) {
    MIMESIS_ASSERT(!std::string(error.what()).empty());
    return;
  }
  std::size_t agents = scenario.externals.size();
  for (const Group& group : scenario.groups) agents += static_cast<std::size_t>(group.count);
  if (agents > kMostAgents) return;
  try {
    static_cast<void>(certify(scenario));
    ScenarioRun one(scenario);
    for (int k = 0; k < 5; ++k) {
      try {
        one.step();
      } catch (const ConfigError&) {  // an agent cannot join a group
      }
      check(one.crowd());
    }
  } catch (const ConfigError&) {
  }
}

class FuzzedNode {
 public:
  FuzzedNode() : file_(kFuzzScenario), node_(file_.params(), bus_) {
    for (int k = 0; k < 3; ++k) step();
  }

  template <class Message>
  void hear(std::string_view port, std::string_view bytes) {
    Message message;
    if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return;
    for (int k = 0; k < 2; ++k) {  // rates come from two
      bus_.send(port, message, now_);
      step();
    }
    for (int k = 0; k < 3; ++k) step();
    const auto states = bus_.take_last<v1::CrowdStates>("states");
    MIMESIS_ASSERT(states.has_value());
    for (const double x : states->position_in_world_m()) MIMESIS_ASSERT(std::isfinite(x));
    for (const double phase : states->phase_rad()) MIMESIS_ASSERT(std::isfinite(phase));
    for (const double heading : states->heading_rad()) MIMESIS_ASSERT(std::isfinite(heading));
  }

 private:
  void step() {
    now_ += kPeriod;
    node_.step(now_);
  }

  crowd::testing::ScenarioFile file_;
  mimesis::testing::Loopback bus_;
  CrowdNode node_;
  runtime::Time now_ = std::chrono::seconds(100);
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0] % 4) {
    case 0:
      run(bytes);
      break;
    case 1:
      FuzzedNode().hear<v1::CrowdStates>("agents", bytes);
      break;
    case 2:
      FuzzedNode().hear<v1::MotionBatch>("characters", bytes);
      break;
    default:
      FuzzedNode().hear<v1::StyleWish>("style", bytes);
  }
  return 0;
}
