#include "common/runtime/replay.h"

#include <fmt/format.h>
#include <google/protobuf/message_lite.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "common/error.h"
#include "common/runtime/describe.h"
#include "common/runtime/log.h"
#include "common/runtime/step_recorder.h"
#include "common/runtime/wire.h"

namespace mimesis::runtime {
namespace {

constexpr std::uint32_t kLargestPacket = 1U << 30U;

/// Calls `pass(data, size)` until all of it has passed.
template <class Pass>
bool all_passes(char* data, std::size_t size, const Pass& pass) {
  while (size > 0) {
    const ssize_t n = pass(data, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    data += n;
    size -= static_cast<std::size_t>(n);
  }
  return true;
}

void play(const v1::StepRecord& step, ReplayBus& bus, AnyNode& node) {
  const Time now(static_cast<Time::rep>(step.time_ns()));
  switch (step.kind()) {
    case v1::STEP_KIND_CREATE:
      return node.create(bus);
    case v1::STEP_KIND_STEP:
      return node.step(now);
    case v1::STEP_KIND_STOP:
      return node.stop(now);
    default:
      throw ConfigError("a step of unknown kind");
  }
}

using google::protobuf::Message;

class ReplayIn final : public InChannel {
 public:
  explicit ReplayIn(std::shared_ptr<ReplayBus::Pending> pending) : pending_(std::move(pending)) {}
  std::optional<Received> pop() override {
    if (pending_->empty()) return std::nullopt;
    Received message = std::move(pending_->front());
    pending_->pop_front();
    ++counters_.received;
    return message;
  }
  void reject(const Received&, std::string_view) override { ++counters_.rejected; }
  const InCounters& counters() const override { return counters_; }

 private:
  std::shared_ptr<ReplayBus::Pending> pending_;
  InCounters counters_;
};

class ReplayOut final : public OutChannel {
 public:
  ReplayOut(v1::ReplayOutcome& outcome, std::string topic)
      : outcome_(outcome), topic_(std::move(topic)) {}
  void send(const Message& message, Time stamp) override {
    v1::ReplayMessage& out = *outcome_.add_outputs();
    out.set_topic(topic_);
    out.set_seq(++seq_);
    out.set_stamp_ns(static_cast<std::uint64_t>(stamp.count()));
    std::string& payload = *out.mutable_payload();
    payload.resize(message.ByteSizeLong());
    serialise(message, payload.data(), payload.size());
  }
  std::uint64_t next_seq() const override { return seq_ + 1; }
  std::size_t subscribers() const override { return 1; }

 private:
  v1::ReplayOutcome& outcome_;
  std::string topic_;
  std::uint64_t seq_ = 0;
};

}  // namespace

bool write_packet(int fd, const google::protobuf::MessageLite& message) {
  const auto size = static_cast<std::uint32_t>(message.ByteSizeLong());
  std::string bytes(sizeof size, '\0');
  std::memcpy(bytes.data(), &size, sizeof size);
  return message.AppendToString(&bytes) &&
         all_passes(bytes.data(), bytes.size(),
                    [fd](char* data, std::size_t n) { return ::send(fd, data, n, MSG_NOSIGNAL); });
}

bool read_packet(int fd, google::protobuf::MessageLite& message) {
  const auto receive = [fd](char* data, std::size_t n) { return ::recv(fd, data, n, 0); };
  std::uint32_t size = 0;
  std::array<char, sizeof size> head{};
  if (!all_passes(head.data(), head.size(), receive)) return false;
  std::memcpy(&size, head.data(), sizeof size);
  if (size > kLargestPacket) return false;
  std::string bytes(size, '\0');
  return all_passes(bytes.data(), bytes.size(), receive) && message.ParseFromString(bytes);
}

int run_replay(const BusOptions& options, int fd, AnyNode& node) {
  set_log_name(options.name);
  ReplayBus bus(options.name, options.clock == ClockKind::lockstep, options.out);
  serve_params(bus, node);
  v1::ReplayStep step;
  int exit_code = 0;
  while (exit_code == 0 && read_packet(fd, step)) {
    bool failed = false;
    std::string failure;
    bus.begin(step);
    try {
      play(step.step(), bus, node);
    } catch (const std::exception& e) {
      failed = true;
      failure = e.what();
      exit_code = dynamic_cast<const ConfigError*>(&e) != nullptr ? 2 : 1;
    }
    v1::ReplayOutcome outcome = bus.end();
    outcome.set_failed(failed);
    if (failed) outcome.set_problem(failure);
    take_log_lines();  // not published here
    if (!write_packet(fd, outcome)) break;
  }
  node.stop(Time(0));  // before the bus that its ports refer to
  return exit_code;
}

ReplayBus::ReplayBus(std::string node, bool lockstep,
                     std::map<std::string, std::string, std::less<>> outputs)
    : node_(std::move(node)), lockstep_(lockstep), outputs_(std::move(outputs)), outside_(*this) {}
ReplayBus::~ReplayBus() = default;

void ReplayBus::problem(std::string what) {
  if (outcome_.problem().empty()) outcome_.set_problem(std::move(what));
}

void ReplayBus::begin(const v1::ReplayStep& step) {
  outcome_.Clear();
  reads_.clear();
  for (const v1::OutsideBytes& bytes : step.step().outside()) {
    if (!bytes.written()) reads_.push_back(bytes);
  }
  for (const v1::ReplayMessage& input : step.inputs()) {
    const auto it = inputs_.find(input.port());
    if (it == inputs_.end()) {
      problem(fmt::format("the node has no input '{}'", input.port()));
      continue;
    }
    it->second->push_back({.payload = input.payload(),
                           .stamp = Time(static_cast<Time::rep>(input.stamp_ns())),
                           .seq = input.seq(),
                           .source = input.node()});
  }
  for (const v1::ServedRequest& asked : step.step().requests()) {
    const auto it = services_.find(asked.service());
    if (it == services_.end()) {
      problem(fmt::format("the node has no service '{}'", asked.service()));
      continue;
    }
    v1::ServedRequest& served = *outcome_.add_served();
    served.set_service(asked.service());
    served.set_request(asked.request());
    const auto answer = it->second(asked.request());
    answer ? served.set_response(*answer) : served.set_failure(answer.error().reason);
  }
}

v1::ReplayOutcome ReplayBus::end() {
  for (const auto& [port, pending] : inputs_) {
    if (pending->empty()) continue;
    problem(fmt::format("the recorded step took {} more message(s) from input '{}'",
                        pending->size(), port));
    pending->clear();
  }
  if (!reads_.empty())
    problem(fmt::format("the recorded step also read '{}' from outside", reads_.front().name()));
  return std::move(outcome_);
}

std::unique_ptr<InChannel> ReplayBus::subscribe(std::string_view port, const Message&,
                                                const InOptions&) {
  const auto [it, fresh] = inputs_.emplace(port, std::make_shared<Pending>());
  if (!fresh) throw ConfigError("input port '" + std::string(port) + "' exists already");
  return std::make_unique<ReplayIn>(it->second);
}

std::unique_ptr<OutChannel> ReplayBus::advertise(std::string_view port, const Message&,
                                                 const OutOptions&) {
  const auto wired = outputs_.find(port);
  return std::make_unique<ReplayOut>(
      outcome_, wired != outputs_.end() ? wired->second : node_ + "/" + std::string(port));
}

void ReplayBus::serve(std::string_view name, const Message&, const Message&, Handler handler) {
  services_.emplace(name, std::move(handler));
}

tl::expected<std::string, Status> ReplayBus::call(std::string_view service,
                                                  const std::string& request,
                                                  std::chrono::milliseconds) {
  outside_.written(service, request);
  return decode_answer(outside_.replay(service));
}

std::string ReplayBus::ReplayedOutside::replay(std::string_view name) {
  if (bus_.reads_.empty() || bus_.reads_.front().name() != name) {
    bus_.problem(
        bus_.reads_.empty()
            ? fmt::format("the step reads '{}' from outside, the log has no more of it", name)
            : fmt::format("the step reads '{}' from outside, the log has '{}' here", name,
                          bus_.reads_.front().name()));
    return {};
  }
  std::string bytes = std::move(*bus_.reads_.front().mutable_data());
  bus_.reads_.pop_front();
  return bytes;
}

void ReplayBus::ReplayedOutside::written(std::string_view name, std::string_view bytes) {
  v1::OutsideBytes& entry = *bus_.outcome_.add_written();
  entry.set_name(std::string(name));
  entry.set_data(std::string(bytes));
  entry.set_written(true);
}

}  // namespace mimesis::runtime
