#include "tools/mimesis/log/arithmetic.h"

#include <fmt/format.h>
#include <gnu/libc-version.h>
#include <sys/utsname.h>
#if defined(__x86_64__)
#include <sys/platform/x86.h>
#endif

namespace mimesis::tool {
namespace {

std::string libm_variant() {
#if defined(__x86_64__)
  const bool fma = CPU_FEATURE_ACTIVE(FMA), avx2 = CPU_FEATURE_ACTIVE(AVX2);
  return std::string(fma ? ", FMA" : ", no FMA") + (avx2 ? " AVX2" : ", no AVX2");
#else
  return "";
#endif
}

std::string compiler() {
#if defined(__clang__)
  return "clang " __clang_version__;
#else
  return "g++ " __VERSION__;
#endif
}

}  // namespace

std::string arithmetic() {
  utsname machine{};
  uname(&machine);
  return fmt::format("{}{}, glibc {}, {}", machine.machine, libm_variant(), gnu_get_libc_version(),
                     compiler());
}

std::string recorded_arithmetic(const std::vector<OpenLog>& logs) {
  std::string found;
  for (const OpenLog& log : logs) {
    for (const log::MetadataIndex& index : log.summary.metadata) {
      if (index.name != "mimesis.run") continue;
      const auto record = log::read_metadata(*log.source, index);
      if (!record) continue;
      const auto it = record->metadata.find("arithmetic");
      if (it == record->metadata.end() || (!found.empty() && found != it->second)) return "";
      found = it->second;
    }
  }
  return found;
}

}  // namespace mimesis::tool
