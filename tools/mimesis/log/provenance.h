#pragma once
#include <algorithm>
#include <cctype>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/log/records.h"

namespace mimesis::tool {

/// Where a recording comes from: enough to run it again.
struct Provenance {
  log::Metadata run;                        ///< "mimesis.run"
  std::optional<log::Metadata> launch;      ///< "mimesis.launch"
  std::vector<std::string> launch_files{};  ///< with those included; to be attached
};

/// `run`: version, host, graph, command (as a shell takes it), started (ISO 8601, UTC), started_ns,
/// arithmetic (arithmetic.h).
/// `launch`, from the JSON text that `mimesis launch` gives its children in MIMESIS_LAUNCH: file,
/// graph, clock, args (lines NAME=VALUE, effective values), sets (lines NODE.KEY=VALUE), and the
/// files `included`; nothing if the text is empty or not of that form.
Provenance provenance(const std::string& graph, const std::vector<std::string>& command,
                      std::uint64_t started_ns, const std::string& launch_json);

/// Properties that decide the last bits of floating-point results: the machine, whether glibc takes
/// its variants of sin, exp, pow with FMA (as GLIBC_TUNABLES leaves it), the version of glibc and
/// the compiler. "x86_64, FMA AVX2, glibc 2.36, g++ 12.2.0"
std::string arithmetic();

inline constexpr const char* kCountsName = "mimesis.counts";

/// What a recorder received of one topic of one node, and how many did not come.
struct LossCount {
  std::uint64_t received = 0, lost = 0;
  bool operator==(const LossCount&) const = default;
};

/// The content of metadata "mimesis.counts" of one log or the sum of several: by "TOPIC (NODE)",
/// without the total.
using LossCounts = std::map<std::string, LossCount>;

/// As the recorder writes it, with the total.
log::Metadata losses_metadata(const LossCounts& counts, const std::string& name = kCountsName);

/// Whether this is the name of a file in a folder that somebody else chose: no path, nothing that a
/// shell would read.
inline bool is_file_name(std::string_view name) {
  return !name.empty() && name.size() <= 64 && name.front() != '.' && name.front() != '-' &&
         std::ranges::all_of(name, [](char c) {
           return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' ||
                  c == '.';
         });
}

/// Whether a log may name this program: a node of Mimesis, which stands beside this program.
inline bool is_program_name(std::string_view name) {
  return is_file_name(name) && name.starts_with("mimesis_");
}

}  // namespace mimesis::tool
