#pragma once
#include <algorithm>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "common/runtime/bus.h"

namespace mimesis::runtime {

/// Untyped half of the input ports: parses, rejects malformed and non-finite messages, remembers
/// the newest.
class InPort {
 public:
  InPort(Bus& bus, std::string_view port, const google::protobuf::Message& prototype,
         const InOptions& options);
  ~InPort();
  InPort(const InPort&) = delete;
  InPort& operator=(const InPort&) = delete;

 protected:
  /// Newest valid message received up to this step; null before the first.
  const google::protobuf::Message* newest();
  /// Next valid message in order of arrival, moved into `out`; false if there is none.
  bool next(google::protobuf::Message& out);
  Time newest_stamp_{};        ///< stamp of newest()
  std::string newest_source_;  ///< node that published it
  bool unseen_ = false;        ///< newest() changed since the last take
  std::uint64_t valid_ = 0;    ///< valid messages so far

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// State: only the newest message matters.
template <class M>
class Latest : private InPort {
 public:
  Latest(Bus& bus, std::string_view port, const InOptions& options = {})
      : InPort(bus, port, M::default_instance(), options) {}

  /// Newest message, or null before the first.
  const M* get() { return static_cast<const M*>(newest()); }
  /// Newest message if its stamp is at most `max_age` from `now`, else null. A stamp ahead of `now`
  /// counts as the time of the first call that saw the message, so that no sender, whatever its
  /// clock says, stays fresh for longer than `max_age` after it fell silent. To be called in every
  /// step.
  const M* fresh(Time now, Time max_age) {
    const M* m = get();
    if (m == nullptr || newest_stamp_ - now > max_age) return nullptr;
    if (aged_ != valid_) since_ = std::min(newest_stamp_, now);
    aged_ = valid_;
    return now - since_ <= max_age ? m : nullptr;
  }
  /// Newest message if it was not taken before, else null.
  const M* take() {
    const M* m = get();
    if (!unseen_) return nullptr;
    unseen_ = false;
    return m;
  }
  /// Stamp of get() [graph time].
  Time stamp() {
    get();
    return newest_stamp_;
  }
  /// Node that published get().
  const std::string& source() {
    get();
    return newest_source_;
  }

 private:
  std::uint64_t aged_ = 0;  ///< message whose age counts since
  Time since_{};
};

/// Events: each message is popped once, in order of arrival.
template <class M>
class EventPort : private InPort {
 public:
  EventPort(Bus& bus, std::string_view port, const InOptions& options)
      : InPort(bus, port, M::default_instance(), options) {}
  /// Oldest message not yet popped.
  std::optional<M> pop() {
    M m;
    if (!next(m)) return std::nullopt;
    return m;
  }
  /// Node that published the message popped last.
  const std::string& source() const { return newest_source_; }
};

/// Events: up to N between two steps, the oldest are dropped and counted.
template <class M, std::size_t N>
struct Queue : EventPort<M> {
  Queue(Bus& bus, std::string_view port, bool optional = false, Author author = Author::any)
      : EventPort<M>(
            bus, port,
            {.policy = Policy::queue, .depth = N, .author = author, .optional = optional}) {}
};

/// Events that must not be lost.
template <class M>
struct Reliable : EventPort<M> {
  Reliable(Bus& bus, std::string_view port, bool optional = false, Author author = Author::any)
      : EventPort<M>(bus, port,
                     {.policy = Policy::reliable, .author = author, .optional = optional}) {}
};

/// Output port. Fills `header` (or the `timestamp` of foxglove.* messages) and publishes.
template <class M>
class Out {
 public:
  Out(Bus& bus, std::string_view port, const OutOptions& options = {})
      : channel_(bus.advertise(port, M::default_instance(), options)) {}

  /// `stamp`: graph time the content refers to.
  void send(M& message, Time stamp) {
    if constexpr (requires { message.mutable_header()->set_stamp_ns(0); }) {
      message.mutable_header()->set_stamp_ns(static_cast<std::uint64_t>(stamp.count()));
      message.mutable_header()->set_seq(channel_->next_seq());
    } else if constexpr (requires { message.mutable_timestamp()->set_seconds(0); }) {
      message.mutable_timestamp()->set_seconds(stamp.count() / 1'000'000'000);
      message.mutable_timestamp()->set_nanos(static_cast<int>(stamp.count() % 1'000'000'000));
    }
    channel_->send(message, stamp);
  }
  std::size_t subscribers() const { return channel_->subscribers(); }

 private:
  std::unique_ptr<OutChannel> channel_;
};

/// Offers service NODE/`name`: `act(const Request&)` gives a tl::expected<Answer, Status>, between
/// two steps.
template <class Request, class Answer, class Act>
void offer(Bus& bus, std::string_view name, Act act) {
  bus.serve(name, Request::default_instance(), Answer::default_instance(),
            [act = std::move(act)](const std::string& bytes) -> tl::expected<std::string, Status> {
              Request request;
              if (!request.ParseFromString(bytes))
                return tl::unexpected(Status{"expected a " + request.GetTypeName()});
              const tl::expected<Answer, Status> answer = act(request);
              if (!answer) return tl::unexpected(answer.error());
              return answer->SerializeAsString();
            });
}

/// Member behind the ports of a node that takes long to construct: `--describe` stops there, so the
/// ports come before what costs time.
struct PortsEnd {
  explicit PortsEnd(Bus& bus) { bus.ports_end(); }
};

}  // namespace mimesis::runtime
