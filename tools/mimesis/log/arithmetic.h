#pragma once
#include <string>
#include <vector>

#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// What decides the last bits of floating-point results here: the machine, whether glibc takes its
/// variants of sin, exp, pow with FMA (as GLIBC_TUNABLES leaves it), the version of glibc and the
/// compiler. "x86_64, FMA AVX2, glibc 2.36, g++ 12.2.0"
std::string arithmetic();

/// The same of the machine that recorded, by metadata "mimesis.run"; empty if the logs do not tell
/// (older ones) or do not agree.
std::string recorded_arithmetic(const std::vector<OpenLog>& logs);

}  // namespace mimesis::tool
