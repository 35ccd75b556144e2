// Any bytes as a plan, an arm or a scene: the readers must survive them, and say what is wrong. The
// first byte chooses; a plan is judged for the planar arm.
//   cmake --preset fuzz && ninja -C build-fuzz plan_fuzz
//   mkdir corpus; for i in 0 1 2; do printf "\\$i" > corpus/$i; done  (and files of models/ behind
//   it) build-fuzz/bin/plan_fuzz -rss_limit_mb=1024 corpus
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <string>

#include "common/error.h"
#include "common/model/files.h"
#include "nodes/planner/verb/plan_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace mimesis;
  static const kin::ArmModel arm = model::load_arm("planar2.yaml");
  if (size == 0) return 0;
  const int fd = memfd_create("fuzz", MFD_CLOEXEC);
  MIMESIS_ASSERT(write(fd, data + 1, size - 1) == static_cast<ssize_t>(size - 1));
  const std::string file = "/proc/self/fd/" + std::to_string(fd);
  try {
    if (data[0] % 3 == 0) {
      tool::verify_plan(tool::load_plan(file), arm);
    } else if (data[0] % 3 == 1) {
      const kin::ArmModel read = model::load_arm(file);
      MIMESIS_ASSERT(read.dof() > 0 && kin::end_effector(read, read.home).matrix().allFinite());
    } else {
      model::load_scene(file);
    }
  } catch (const ConfigError& e) {
    MIMESIS_ASSERT(std::string(e.what()).find(file.substr(0, 5)) != std::string::npos ||
                   data[0] % 3 == 0);
  }
  close(fd);
  return 0;
}
