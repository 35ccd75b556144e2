#pragma once
#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "common/runtime/bus.h"
#include "common/time.h"
#include "proto/steps.pb.h"

namespace mimesis::runtime {

/// Collects inputs and actions of a node's steps, for NODE/steps. Allocates nothing once its
/// buffers have grown.
class StepRecorder {
 public:
  /// Events from now on belong to this step; those since the last step, too (services
  /// are answered between steps).
  void begin(v1::StepKind kind, Time now) {
    if (taken_) forget();
    open_.set_kind(kind);
    open_.set_time_ns(static_cast<std::uint64_t>(now.count()));
  }
  void end() {
    bytes_ += open_.ByteSizeLong();
    log_.add_steps()->Swap(&open_);
    open_.Clear();
    ++steps_;
  }

  void took(std::string_view port, std::string_view topic, const Received& message) {
    const auto& known = log_.sources();
    const auto it = std::ranges::find_if(known, [&](const v1::InputSource& source) {
      return source.start_id() == message.start_id && source.port() == port;
    });
    const auto index = static_cast<std::uint32_t>(it - known.begin());
    if (it == known.end()) {
      v1::InputSource& source = *log_.add_sources();
      source.set_port(std::string(port));
      source.set_topic(std::string(topic));
      source.set_node(message.source);
      source.set_start_id(message.start_id);
    }
    v1::TakenMessage& taken = *open_.add_taken();
    taken.set_source(index);
    taken.set_seq(message.seq);
  }
  void outside(std::string_view name, std::string_view bytes, bool written) {
    v1::OutsideBytes& entry = *open_.add_outside();
    entry.mutable_name()->assign(name);
    entry.mutable_data()->assign(bytes);
    entry.set_written(written);
  }
  void served(std::string_view service, const std::string& request,
              const tl::expected<std::string, Status>& response) {
    v1::ServedRequest& entry = *open_.add_requests();
    entry.mutable_service()->assign(service);
    entry.set_request(request);
    response ? entry.set_response(*response) : entry.set_failure(response.error().reason);
  }
  void published() { open_.set_published(open_.published() + 1); }

  /// Time to publish: 0.1 s of graph time since the first step in it, or many bytes.
  bool due(Time now) const {
    if (taken_ || log_.steps().empty()) return false;
    const auto oldest = static_cast<Time::rep>(log_.steps(0).time_ns());
    return bytes_ >= kManyBytes || now - Time(oldest) >= kLogPeriod || now < Time(oldest);
  }
  /// The steps since the last call; valid until the next `begin`. Not between begin and end.
  v1::StepLog& take() {
    if (taken_) forget();
    taken_ = true;
    return log_;
  }

 private:
  static constexpr Time kLogPeriod = std::chrono::milliseconds(100);  // a killed node loses no more
  static constexpr std::size_t kManyBytes = 256 * 1024;

  void forget() {
    log_.Clear();  // keeps its memory
    log_.set_first(steps_);
    bytes_ = 0;
    taken_ = false;
  }

  v1::StepLog log_;
  v1::StepRecord open_;
  std::size_t bytes_ = 0;
  std::uint64_t steps_ = 0;  // ended so far
  bool taken_ = false;       // log_ was given away
};

class RecordedIn final : public InChannel {
 public:
  RecordedIn(std::unique_ptr<InChannel> inner, StepRecorder& recorder, std::string port,
             std::string topic)
      : inner_(std::move(inner)),
        recorder_(recorder),
        port_(std::move(port)),
        topic_(std::move(topic)) {}
  std::optional<Received> pop() override {
    auto message = inner_->pop();
    if (message) recorder_.took(port_, topic_, *message);
    return message;
  }
  void reject(const Received& message, std::string_view why) override {
    inner_->reject(message, why);
  }
  const InCounters& counters() const override { return inner_->counters(); }

 private:
  std::unique_ptr<InChannel> inner_;
  StepRecorder& recorder_;
  std::string port_, topic_;
};

class RecordedOut final : public OutChannel {
 public:
  RecordedOut(std::unique_ptr<OutChannel> inner, StepRecorder& recorder)
      : inner_(std::move(inner)), recorder_(recorder) {}
  void send(const google::protobuf::Message& message, Time stamp) override {
    recorder_.published();
    inner_->send(message, stamp);
  }
  std::uint64_t next_seq() const override { return inner_->next_seq(); }
  std::size_t subscribers() const override { return inner_->subscribers(); }

 private:
  std::unique_ptr<OutChannel> inner_;
  StepRecorder& recorder_;
};

/// A call to another node as bytes for Outside: its answer or why there is none.
inline std::string encode_answer(const tl::expected<std::string, Status>& answer) {
  return answer ? "+" + *answer : "-" + answer.error().reason;
}

inline tl::expected<std::string, Status> decode_answer(const std::string& bytes) {
  if (bytes.starts_with('+')) return bytes.substr(1);
  return tl::unexpected(Status{bytes.empty() ? bytes : bytes.substr(1)});
}

/// The node's bus with all that passes it recorded.
class RecordedBus final : public Bus {
 public:
  /// `inner` and `recorder` outlive it. `inputs`: topic by port.
  RecordedBus(Bus& inner, StepRecorder& recorder,
              std::map<std::string, std::string, std::less<>> inputs)
      : inner_(inner), recorder_(recorder), outside_(recorder), inputs_(std::move(inputs)) {}

  std::unique_ptr<InChannel> subscribe(std::string_view port,
                                       const google::protobuf::Message& prototype,
                                       const InOptions& options) override {
    const auto topic = inputs_.find(port);
    return std::make_unique<RecordedIn>(inner_.subscribe(port, prototype, options), recorder_,
                                        std::string(port),
                                        topic == inputs_.end() ? std::string() : topic->second);
  }
  std::unique_ptr<OutChannel> advertise(std::string_view port,
                                        const google::protobuf::Message& prototype,
                                        const OutOptions& options) override {
    return std::make_unique<RecordedOut>(inner_.advertise(port, prototype, options), recorder_);
  }
  void serve(std::string_view name, const google::protobuf::Message& request,
             const google::protobuf::Message& response, Handler handler) override {
    inner_.serve(
        name, request, response,
        [this, service = std::string(name), inner = std::move(handler)](const std::string& asked) {
          auto answer = inner(asked);
          recorder_.served(service, asked, answer);
          return answer;
        });
  }
  tl::expected<std::string, Status> call(std::string_view service, const std::string& request,
                                         std::chrono::milliseconds timeout) override {
    outside_.written(service, request);
    auto answer = inner_.call(service, request, timeout);
    outside_.record(service, encode_answer(answer));
    return answer;
  }
  bool lockstep() const override { return inner_.lockstep(); }
  Outside& outside() override { return outside_; }
  const std::string& node() const override { return inner_.node(); }
  const std::string& directory() const override { return inner_.directory(); }

 private:
  class RecordingOutside final : public Outside {
   public:
    explicit RecordingOutside(StepRecorder& recorder) : recorder_(recorder) {}
    bool replaying() const override { return false; }
    void record(std::string_view name, std::string_view bytes) override {
      recorder_.outside(name, bytes, false);
    }
    std::string replay(std::string_view) override { return {}; }
    void written(std::string_view name, std::string_view bytes) override {
      recorder_.outside(name, bytes, true);
    }

   private:
    StepRecorder& recorder_;
  };

  Bus& inner_;
  StepRecorder& recorder_;
  RecordingOutside outside_;
  std::map<std::string, std::string, std::less<>> inputs_;
};

}  // namespace mimesis::runtime
