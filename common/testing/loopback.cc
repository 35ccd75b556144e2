#include "common/testing/loopback.h"

#include <stdlib.h>

#include <filesystem>

namespace mimesis::testing {
namespace {

class LoopbackIn final : public runtime::InChannel {
 public:
  explicit LoopbackIn(std::shared_ptr<Loopback::Input> input) : input_(std::move(input)) {}
  std::optional<runtime::Received> pop() override {
    if (input_->pending.empty()) return std::nullopt;
    runtime::Received r = std::move(input_->pending.front());
    input_->pending.pop_front();
    return r;
  }
  void reject(const runtime::Received&, std::string_view why) override {
    ++input_->counters.rejected;
    input_->last_reject = why;
  }
  const runtime::InCounters& counters() const override { return input_->counters; }

 private:
  std::shared_ptr<Loopback::Input> input_;
};

class LoopbackOut final : public runtime::OutChannel {
 public:
  explicit LoopbackOut(std::shared_ptr<Loopback::Output> output) : output_(std::move(output)) {}
  void send(const google::protobuf::Message& message, runtime::Time) override {
    ++output_->seq;
    output_->sent.push_back(message.SerializeAsString());
  }
  std::uint64_t next_seq() const override { return output_->seq + 1; }
  std::size_t subscribers() const override { return 1; }

 private:
  std::shared_ptr<Loopback::Output> output_;
};

}  // namespace

Loopback::Loopback(const Options& options)
    : lockstep_(options.lockstep), outside_(options.outside ? *options.outside : live_) {
  std::string name = (std::filesystem::temp_directory_path() / "mimesis-test-XXXXXX").string();
  MIMESIS_ASSERT(mkdtemp(name.data()) != nullptr);
  directory_ = name;
}

Loopback::~Loopback() {
  std::error_code ignored;
  std::filesystem::remove_all(directory_, ignored);
}

void Loopback::send_raw(std::string_view port, std::string payload, runtime::Time stamp,
                        std::string_view source) {
  const auto it = inputs_.find(port);
  if (it == inputs_.end())
    throw ConfigError("loopback: the node has no input " + std::string(port));
  Input& in = *it->second;
  ++in.counters.received;
  in.pending.push_back({std::move(payload), stamp, ++in.seq, std::string(source)});
  const std::size_t depth = in.options.policy == runtime::Policy::latest  ? 1
                            : in.options.policy == runtime::Policy::queue ? in.options.depth
                                                                          : in.pending.size();
  while (in.pending.size() > depth) {
    in.pending.pop_front();
    ++in.counters.dropped;
  }
}

bool Loopback::take_raw(std::string_view port, google::protobuf::Message& out) {
  const auto it = outputs_.find(port);
  if (it == outputs_.end())
    throw ConfigError("loopback: the node has no output " + std::string(port));
  if (it->second->sent.empty()) return false;
  MIMESIS_ASSERT(it->second->type == out.GetTypeName());
  MIMESIS_ASSERT(out.ParseFromString(it->second->sent.front()));
  it->second->sent.pop_front();
  return true;
}

std::map<std::string, std::vector<std::string>> Loopback::take_all() {
  std::map<std::string, std::vector<std::string>> all;
  for (auto& [port, output] : outputs_) {
    all[port].assign(output->sent.begin(), output->sent.end());
    output->sent.clear();
  }
  return all;
}

runtime::InCounters Loopback::counters(std::string_view port) const {
  const auto it = inputs_.find(port);
  return it == inputs_.end() ? runtime::InCounters{} : it->second->counters;
}

std::unique_ptr<runtime::InChannel> Loopback::subscribe(std::string_view port,
                                                        const google::protobuf::Message&,
                                                        const runtime::InOptions& options) {
  auto [it, fresh] = inputs_.try_emplace(std::string(port), std::make_shared<Input>());
  if (!fresh) throw ConfigError("input port '" + std::string(port) + "' exists already");
  it->second->options = options;
  return std::make_unique<LoopbackIn>(it->second);
}

std::unique_ptr<runtime::OutChannel> Loopback::advertise(std::string_view port,
                                                         const google::protobuf::Message& prototype,
                                                         const runtime::OutOptions&) {
  auto [it, fresh] = outputs_.try_emplace(std::string(port), std::make_shared<Output>());
  if (!fresh) throw ConfigError("output port '" + std::string(port) + "' exists already");
  it->second->type = prototype.GetTypeName();
  return std::make_unique<LoopbackOut>(it->second);
}

void Loopback::serve(std::string_view name, const google::protobuf::Message&,
                     const google::protobuf::Message&, runtime::Handler handler) {
  services_[node_ + "/" + std::string(name)] = std::move(handler);
}

tl::expected<std::string, Status> Loopback::call(std::string_view service,
                                                 const std::string& request,
                                                 std::chrono::milliseconds) {
  const auto it = services_.find(service);
  if (it == services_.end()) {
    return tl::unexpected(Status{"no node offers service " + std::string(service)});
  }
  return it->second(request);
}

}  // namespace mimesis::testing
