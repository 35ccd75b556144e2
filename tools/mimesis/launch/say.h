#pragma once
#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <utility>

#include "tools/mimesis/progress.h"

namespace mimesis::launch {

/// The status line of this process: other lines take it away first.
inline tool::StatusLine& status_line() {
  static tool::StatusLine line;
  return line;
}

template <class... Args>
void say(fmt::format_string<Args...> format, Args&&... args) {
  const std::string line = fmt::format(format, std::forward<Args>(args)...);
  status_line().clear();
  std::fprintf(stderr, "mimesis: %s\n", line.c_str());
}

}  // namespace mimesis::launch
