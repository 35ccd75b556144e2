#include <thread>

#include "common/runtime/bus_core.h"
#include "common/runtime/log.h"

namespace mimesis::runtime {
namespace {
using namespace std::chrono_literals;
constexpr auto kAfterDeath = 50ms;  // for bytes of a dead publisher that are still under way
constexpr auto kPatience = 5s;      // for a living one: then a message must have been lost
constexpr auto kRetry = 100us;
}  // namespace

void ZmqBus::connect_members() {
  const auto wired_here = [this](const v1::NodeInfo& node) {
    if (node.clock() != "lockstep") return false;
    for (const v1::TopicInfo& input : node.inputs()) {
      if (impl_->publisher.has(input.topic())) return true;
    }
    return false;
  };
  impl_->await_greetings(wired_here);
  impl_->publisher.release();
}

void ZmqBus::deliver(Time tick,
                     const google::protobuf::RepeatedPtrField<v1::Publication>& visible) {
  impl_->tick = tick;
  impl_->subscriber.drain();
  for (const v1::Publication& publication : visible) {
    auto give_up = std::chrono::steady_clock::now() + kPatience;
    bool dying = false;
    while (!impl_->subscriber.deliver(publication)) {
      if (!dying && !impl_->known.contains(publication.start_id())) {
        dying = true;
        give_up = std::chrono::steady_clock::now() + kAfterDeath;
      }
      if (std::chrono::steady_clock::now() >= give_up) {
        impl_->subscriber.give_up(publication);
        if (!dying)
          error("message {} on topic {} did not arrive", publication.seq(), publication.topic());
        break;
      }
      impl_->wait(std::chrono::system_clock::now() + 20ms, {}, true);
      impl_->subscriber.drain();
    }
  }
}

std::vector<v1::Publication> ZmqBus::take_published() {
  return std::exchange(impl_->published, {});
}

void ZmqBus::flush() {
  std::uint64_t waiting = impl_->publisher.backlog();
  if (waiting == 0) {
    impl_->behind = false;
    return;
  }
  auto give_up = std::chrono::steady_clock::now() + kPatience;
  while (waiting > 0 && !impl_->behind) {
    std::this_thread::sleep_for(kRetry);
    impl_->serve();
    const std::uint64_t now_waiting = impl_->publisher.backlog();
    if (now_waiting < waiting) give_up = std::chrono::steady_clock::now() + kPatience;
    waiting = now_waiting;
    if (std::chrono::steady_clock::now() >= give_up) {
      impl_->behind = true;
      warn("a reliable subscriber takes nothing; {} messages wait for it", waiting);
    }
  }
}

}  // namespace mimesis::runtime
