#include "tools/mimesis/log/play_report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace mimesis::tool {
namespace {

using runtime::to_seconds;

double mb_s(const PlayReport& r) {
  return r.going.count() > 0 ? static_cast<double>(r.bytes) * 1e-6 / to_seconds(r.going) : 0.0;
}

double quantile_s(const PlayReport& r, double share) {
  return to_seconds(r.lateness->quantile(share));
}

}  // namespace

std::string play_json(const PlayReport& r) {
  return nlohmann::ordered_json{{"files", r.files},
                                {"messages", r.messages},
                                {"bytes", r.bytes},
                                {"passes", r.passes},
                                {"seconds", to_seconds(r.going)},
                                {"mb_s", mb_s(r)},
                                {"late_p50_s", quantile_s(r, 0.5)},
                                {"late_p99_s", quantile_s(r, 0.99)},
                                {"late_max_s", to_seconds(r.lateness->worst())},
                                {"held_s", to_seconds(r.held)},
                                {"missed", r.missed}}
      .dump();
}

std::string play_text(const PlayReport& r) {
  constexpr double kMs = 1e3;
  std::string text = fmt::format(
      "{} messages played, {:.1f} MB in {:.3f} s: {:.1f} MB/s; late by {:.3f} ms (median), {:.3f} "
      "ms (99 %), {:.3f} ms (most)\n",
      r.messages, static_cast<double>(r.bytes) * 1e-6, to_seconds(r.going), mb_s(r),
      quantile_s(r, 0.5) * kMs, quantile_s(r, 0.99) * kMs, to_seconds(r.lateness->worst()) * kMs);
  if (r.held.count() > 0) {
    text += fmt::format("recorded time stood for {:.3f} s: slow subscribers were waited for\n",
                        to_seconds(r.held));
  }
  if (r.missed > 0) text += fmt::format("subscribers missed {} messages\n", r.missed);
  return text;
}

}  // namespace mimesis::tool
