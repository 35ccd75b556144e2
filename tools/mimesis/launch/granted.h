#pragma once
#include <sys/types.h>

#include <string>

#include "tools/mimesis/launch/graph_file.h"

namespace mimesis::launch {

/// What the system did not grant a process of `sched`, in one line; empty: it has all. Policy,
/// priority and CPUs of each of its threads are read back, a CPU that a container withholds is
/// left out without an error. `locked`: whether memory must be locked by now.
std::string not_granted(pid_t pid, const Sched& sched, bool locked);

}  // namespace mimesis::launch
