#include "tools/mimesis/topic_echo.h"

#include <fmt/format.h>
#include <google/protobuf/message.h>

#include <chrono>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/runtime/raw.h"
#include "tools/mimesis/message_json.h"
#include "tools/mimesis/rate_window.h"

namespace mimesis::tool {
namespace {

using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;

constexpr int kTimedOut = 3;

Clock::time_point deadline(double timeout_s) {
  return timeout_s > 0.0 ? Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                              std::chrono::duration<double>(timeout_s))
                         : Clock::time_point::max();
}

/// Time until `limit`, at most a second.
std::chrono::milliseconds turn(Clock::time_point limit) {
  using std::chrono::milliseconds;
  const auto now = Clock::now();
  if (limit - now > milliseconds(1000)) return milliseconds(1000);
  return std::max(milliseconds(0), std::chrono::ceil<milliseconds>(limit - now));
}

int timed_out(const std::string& topic, double timeout_s) {
  std::cerr << fmt::format("no message on {} within {:g} s\n", topic, timeout_s);
  return kTimedOut;
}

void print(const runtime::Tapped& tapped, const Json& value, bool field, bool json) {
  if (json) {
    std::cout << Json{{"topic", tapped.topic},
                      {"seq", tapped.message.seq},
                      {"stamp_ns", tapped.message.stamp.count()},
                      {"source", tapped.message.source},
                      {field ? "value" : "message", value}}
                     .dump()
              << std::endl;
  } else if (field) {
    std::cout << (value.is_string() ? value.get<std::string>() : value.dump()) << std::endl;
  } else {
    std::cout << value.dump(2) << "\n---" << std::endl;
  }
}

}  // namespace

int echo_topic(const std::string& graph, const EchoOptions& options, bool json) {
  runtime::Tap tap(
      graph, [&](const std::string& topic) { return topic == options.topic; },
      options.reliable ? runtime::Policy::reliable : runtime::Policy::latest);
  runtime::TypePool types;
  const int count = options.once ? 1 : options.count;
  auto limit = deadline(options.timeout_s);
  for (int printed = 0; count == 0 || printed < count;) {
    const auto tapped = tap.next(turn(limit));
    if (!tapped) {
      if (Clock::now() >= limit) return timed_out(options.topic, options.timeout_s);
      continue;
    }
    const auto message = types.make(tapped->type, tap.descriptors(tapped->type));
    if (message == nullptr || !message->ParseFromString(tapped->message.payload)) {
      std::cerr << options.topic << ": a message is not a valid " << tapped->type << '\n';
      return 1;
    }
    const bool field = !options.field.empty();
    print(*tapped, field ? field_json(*message, options.field) : to_json(*message), field, json);
    ++printed;
    limit = deadline(options.timeout_s);
  }
  return 0;
}

int topic_rate(const std::string& graph, const HzOptions& options, bool json) {
  runtime::Tap tap(
      graph, [&](const std::string& topic) { return topic == options.topic; },
      runtime::Policy::latest);
  RateWindow window(static_cast<std::size_t>(options.window));
  auto report = Clock::now() + std::chrono::seconds(1);
  auto limit = deadline(options.timeout_s);
  for (int reports = 0; options.reports == 0 || reports < options.reports;) {
    if (const auto tapped = tap.next(turn(std::min(limit, report)))) {
      window.add(Clock::now(), tapped->message.seq);
      limit = deadline(options.timeout_s);
    }
    if (Clock::now() >= limit) return timed_out(options.topic, options.timeout_s);
    if (Clock::now() < report) continue;
    report += std::chrono::seconds(1);
    const auto rate = window.rate();
    if (!rate) continue;
    if (json) {
      std::cout << Json{{"topic", options.topic},
                        {"rate_hz", rate->hz},
                        {"min_s", rate->min_s},
                        {"max_s", rate->max_s},
                        {"messages", rate->messages}}
                       .dump()
                << std::endl;
    } else {
      std::cout << fmt::format("{:.3f} Hz   between messages {:.4f} .. {:.4f} s   {} messages\n",
                               rate->hz, rate->min_s, rate->max_s, rate->messages)
                << std::flush;
    }
    ++reports;
  }
  return 0;
}

}  // namespace mimesis::tool
