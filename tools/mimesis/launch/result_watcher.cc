#include "tools/mimesis/launch/result_watcher.h"

#include <fmt/format.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <stdexcept>

#include "common/error.h"
#include "common/runtime/own_topics.h"

namespace mimesis::launch {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kTurn{50};
// A rare topic need not speak again after the end: this long, messages from before it may still
// arrive.
constexpr std::chrono::milliseconds kLastMessages{300};

double to_s(std::chrono::nanoseconds t) { return std::chrono::duration<double>(t).count(); }

}  // namespace

ResultWatcher::ResultWatcher(const ResultSpec& spec, const std::string& graph,
                             std::chrono::nanoseconds epoch)
    : spec_(spec),
      epoch_(epoch),
      newest_(epoch),
      collector_(spec),
      tap_(
          graph,
          // Every node says once a second that it lives: this shows graph time though nothing else
          // happens.
          [this](const std::string& topic) {
            return collector_.wants(topic) || runtime::is_own_topic(topic, runtime::kHealthPort);
          },
          runtime::Policy::reliable),
      event_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (!event_.open()) throw std::runtime_error("eventfd failed");
  thread_ = std::thread([this] { follow(); });
}

ResultWatcher::~ResultWatcher() { stop(); }

void ResultWatcher::stop() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

double ResultWatcher::graph_s() const { return to_s(collector_.end().value_or(newest_) - epoch_); }

void ResultWatcher::take(const runtime::Tapped& tapped) {
  newest_ = std::max(newest_, tapped.message.stamp);
  if (!collector_.wants(tapped.topic)) return;
  const auto message = types_.make(tapped.type, tap_.descriptors(tapped.type));
  if (message == nullptr || !message->ParseFromString(tapped.message.payload)) {
    failure_ = fmt::format("a message on {} cannot be read as {}", tapped.topic, tapped.type);
    return;
  }
  collector_.add(tapped.topic, tapped.message.stamp, *message);
}

void ResultWatcher::follow() {
  const auto give_up = Clock::now() + spec_.wall_timeout;
  auto last_messages = Clock::time_point::max();
  while (!stop_ && failure_.empty() && !collector_.complete() && Clock::now() < last_messages) {
    try {
      if (const auto tapped = tap_.next(kTurn)) take(*tapped);
    } catch (const ConfigError& e) {
      failure_ = e.what();
      misconfigured_ = true;
    }
    if (collector_.end()) {
      last_messages = std::min(last_messages, Clock::now() + kLastMessages);
    } else if (newest_ - epoch_ > spec_.timeout) {
      failure_ = fmt::format("nothing on {} within {:g} s of graph time", spec_.until.text,
                             to_s(spec_.timeout));
    } else if (Clock::now() > give_up) {
      failure_ = fmt::format("nothing on {} within {:g} s of wall time", spec_.until.text,
                             to_s(spec_.wall_timeout));
    }
  }
  const std::uint64_t one = 1;
  if (write(event_.get(), &one, sizeof one) != sizeof one) failure_ = "eventfd failed";
}

}  // namespace mimesis::launch
