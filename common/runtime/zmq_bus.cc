#include "common/runtime/zmq_bus.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <array>
#include <thread>

#include "common/error.h"
#include "common/runtime/bus_core.h"
#include "common/runtime/log.h"
#include "common/runtime/raw.h"
#include "common/runtime/registry.h"

namespace mimesis::runtime {
namespace {

using namespace std::chrono_literals;
using google::protobuf::Message;

std::string_view policy_name(Policy policy) {
  constexpr std::array kNames = {"latest", "queue", "reliable"};
  return kNames.at(static_cast<std::size_t>(policy));
}

class ZmqIn final : public InChannel {
 public:
  ZmqIn(std::string port, std::shared_ptr<Input> input)
      : port_(std::move(port)), input_(std::move(input)) {}
  std::optional<Received> pop() override { return input_->pop(); }
  void reject(const Received& message, std::string_view why) override {
    ++input_->counters.rejected;
    if (!throttle_.pass()) return;
    warn("input {} (topic {}): message {} of node {} rejected: {}{}", port_, input_->topic(),
         message.seq, message.source, why,
         throttle_.held_back() > 0 ? fmt::format(" ({} more)", throttle_.held_back()) : "");
  }
  const InCounters& counters() const override { return input_->counters; }

 private:
  std::string port_;
  std::shared_ptr<Input> input_;
  Throttle throttle_{1s};
};

/// Serialises straight into the frame that is sent.
Frame serialised(const Message& message) {
  Frame frame(message.ByteSizeLong());
  serialise(message, frame.data(), frame.size());
  return frame;
}

constexpr auto kAfterDeath = 50ms;  // for bytes of a dead publisher that are still under way
constexpr auto kPatience = 5s;      // for a living one: then a message must have been lost
constexpr auto kRetry = 100us;

std::string within(std::chrono::milliseconds timeout) {
  return " within " + std::to_string(timeout.count()) + " ms";
}

}  // namespace

/// Both kinds of sending ends.
template <class Base>
class ZmqOut : public Base {
 public:
  ZmqOut(ZmqBus::Impl& bus, Publisher::Topic& topic, std::string name, bool latched)
      : bus_(bus), topic_(topic), name_(std::move(name)), latched_(latched) {}
  std::size_t subscribers() const override { return Publisher::subscribers(topic_); }

 protected:
  ZmqBus::Impl& bus_;
  Publisher::Topic& topic_;
  std::string name_;
  bool latched_;
};

class ZmqTypedOut final : public ZmqOut<OutChannel> {
 public:
  using ZmqOut::ZmqOut;
  void send(const Message& message, Time stamp) override {
    bus_.send(topic_, name_, latched_, serialised(message), stamp);
  }
  std::uint64_t next_seq() const override { return Publisher::next_seq(topic_); }
};

class ZmqRawOut final : public ZmqOut<RawOut> {
 public:
  using ZmqOut::ZmqOut;
  void send_raw(std::string_view payload, Time stamp) override {
    bus_.send(topic_, name_, latched_, Frame(payload), stamp);
  }
};

ZmqBus::ZmqBus(BusOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}

ZmqBus::~ZmqBus() = default;

std::unique_ptr<InChannel> ZmqBus::subscribe(std::string_view port, const Message& prototype,
                                             const InOptions& options) {
  if (!impl_->in_ports.emplace(port).second) {
    throw ConfigError("input port '" + std::string(port) + "' exists already");
  }
  const google::protobuf::Descriptor& type = *prototype.GetDescriptor();
  const auto wired = impl_->options.in.find(port);
  if (wired == impl_->options.in.end()) {
    runtime::info("input {} ({}) is not wired: it will receive nothing", port, type.full_name());
    return std::make_unique<ZmqIn>(std::string(port),
                                   std::make_shared<Input>("", type_hash(type), options));
  }
  auto input = impl_->subscriber.add(wired->second, type_hash(type), options);
  if (options.policy != Policy::latest) impl_->drains_while_waiting = !lockstep();
  v1::TopicInfo& entry = *impl_->info.add_inputs();
  entry.set_topic(wired->second);
  entry.set_port(std::string(port));
  entry.set_type(type.full_name());
  entry.set_type_hash(input->type_hash());
  entry.set_policy(std::string(policy_name(options.policy)));
  impl_->info_changed = true;
  impl_->inputs.emplace(port, input);
  for (const auto& [start_id, node] : impl_->known) impl_->meet(v1::NodeInfo(node));
  return std::make_unique<ZmqIn>(std::string(port), std::move(input));
}

std::unique_ptr<OutChannel> ZmqBus::advertise(std::string_view port, const Message& prototype,
                                              const OutOptions& options) {
  if (impl_->out_ports.contains(port)) {
    throw ConfigError("output port '" + std::string(port) + "' exists already");
  }
  const google::protobuf::Descriptor& type = *prototype.GetDescriptor();
  const std::string topic = impl_->topic_of_output(port);
  Publisher::Topic& added = impl_->add_output(port, topic, type.full_name(), type_hash(type),
                                              descriptor_set(type), options.latched);
  return std::make_unique<ZmqTypedOut>(*impl_, added, topic, options.latched);
}

std::unique_ptr<RawOut> ZmqBus::advertise_raw(std::string_view topic, std::string_view type,
                                              std::string_view descriptor_set,
                                              const OutOptions& options) {
  google::protobuf::FileDescriptorSet files;
  google::protobuf::DescriptorPool pool;
  const google::protobuf::Descriptor* descriptor = nullptr;
  if (files.ParseFromArray(descriptor_set.data(), static_cast<int>(descriptor_set.size()))) {
    for (const auto& file : files.file()) pool.BuildFile(file);
    descriptor = pool.FindMessageTypeByName(std::string(type));
  }
  if (descriptor == nullptr) {
    throw ConfigError("topic " + std::string(topic) + ": its descriptors do not define type '" +
                      std::string(type) + "'");
  }
  Publisher::Topic& added =
      impl_->add_output(topic, std::string(topic), std::string(type), type_hash(*descriptor),
                        std::string(descriptor_set), options.latched);
  return std::make_unique<ZmqRawOut>(*impl_, added, std::string(topic), options.latched);
}

std::string ZmqBus::Impl::topic_of_output(std::string_view port) const {
  const auto wired = options.out.find(port);
  return wired != options.out.end() ? wired->second : options.name + "/" + std::string(port);
}

Publisher::Topic& ZmqBus::Impl::add_output(std::string_view port, const std::string& topic,
                                           const std::string& type, std::uint64_t hash,
                                           std::string descriptors, bool latched) {
  check_topic(topic);
  if (publisher.has(topic))
    throw ConfigError("topic " + topic + " has two outputs in node " + options.name);
  out_ports.emplace(port);
  v1::TopicInfo& added = *info.add_outputs();
  added.set_topic(topic);
  added.set_port(std::string(port));
  added.set_type(type);
  added.set_type_hash(hash);
  added.set_latched(latched);
  (*info.mutable_descriptors())[type] = std::move(descriptors);
  info_changed = true;
  return publisher.add(topic, hash, latched);
}

void ZmqBus::Impl::send(Publisher::Topic& topic, const std::string& name, bool latched,
                        Frame payload, Time stamp) {
  const bool lockstep = options.clock == ClockKind::lockstep;
  const std::uint64_t seq = publisher.send(topic, std::move(payload), stamp,
                                           lockstep ? static_cast<std::uint64_t>(tick.count()) : 0);
  if (!lockstep) return;
  v1::Publication& publication = published.emplace_back();
  publication.set_topic(name);
  publication.set_start_id(info.start_id());
  publication.set_seq(seq);
  publication.set_latched(latched);
}

void ZmqBus::Impl::check_wiring() const {
  const auto check = [this](std::string_view kind, const auto& wiring, const auto& ports) {
    for (const auto& [port, topic] : wiring) {
      if (ports.contains(port)) continue;
      std::string line =
          "node " + options.name + " has no " + std::string(kind) + " '" + port + "'; it has";
      for (const std::string& p : ports) line += " " + p;
      throw ConfigError(ports.empty() ? line + " none" : line);
    }
  };
  check("input", options.in, in_ports);
  check("output", options.out, out_ports);
}

void ZmqBus::ready() {
  impl_->check_wiring();
  // The clock is lock-step's only when its conductor runs: `connect_members` lets messages go then.
  impl_->await_greetings([](const v1::NodeInfo& node) {
    for (const v1::TopicInfo& input : node.inputs()) {
      if (input.topic() == "*" && input.policy() == "reliable") return true;
    }
    return false;
  });
  if (!lockstep()) impl_->publisher.release();
  impl_->info.set_ready(true);
  impl_->info_changed = true;
  impl_->serve();
}

bool ZmqBus::wait(WallTime deadline, std::span<const int> fds) {
  return impl_->wait(deadline, fds, false) == Impl::Woken::fd;
}
bool ZmqBus::wait_message(WallTime deadline) {
  return impl_->wait(deadline, {}, true) == Impl::Woken::message;
}
void ZmqBus::drain() { impl_->subscriber.drain(); }

bool ZmqBus::lockstep() const { return impl_->options.clock == ClockKind::lockstep; }
const std::string& ZmqBus::node() const { return impl_->options.name; }
const std::string& ZmqBus::directory() const { return impl_->directory; }
const v1::NodeInfo& ZmqBus::info() const { return impl_->info; }
std::uint64_t ZmqBus::sent() const { return impl_->publisher.sent(); }
std::uint64_t ZmqBus::backlog() const { return impl_->publisher.backlog(); }
std::uint64_t ZmqBus::backlog_bytes() const { return impl_->publisher.backlog_bytes(); }
std::uint64_t ZmqBus::overflow() const { return impl_->publisher.overflow(); }
std::uint64_t ZmqBus::malformed() const { return impl_->subscriber.malformed(); }

std::vector<v1::NodeInfo> ZmqBus::known_nodes() const {
  std::map<std::string, v1::NodeInfo> by_name;
  for (const auto& [start_id, node] : impl_->known) by_name.emplace(node.name(), node);
  std::vector<v1::NodeInfo> nodes;
  for (auto& [name, node] : by_name) nodes.push_back(std::move(node));
  return nodes;
}

std::vector<v1::InputHealth> ZmqBus::input_health(Time now) const {
  std::vector<v1::InputHealth> list;
  for (const auto& [port, input] : impl_->inputs) {
    v1::InputHealth& health = list.emplace_back();
    health.set_topic(input->topic());
    health.set_received(input->counters.received);
    health.set_lost(input->counters.lost);
    health.set_dropped(input->counters.dropped);
    health.set_rejected(input->counters.rejected);
    if (input->counters.received > 0) health.set_age_s(to_seconds(now - input->newest));
  }
  return list;
}

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

void ZmqBus::serve(std::string_view name, const google::protobuf::Message& request,
                   const google::protobuf::Message& response, Handler handler) {
  check_name("service", name);
  const std::string service = node() + "/" + std::string(name);
  for (const v1::ServiceInfo& other : impl_->info.services()) {
    if (other.service() == service) throw ConfigError("service " + service + " exists already");
  }
  v1::ServiceInfo& added = *impl_->info.add_services();
  added.set_service(service);
  for (const auto& [message, set] :
       {std::pair(&request, &v1::ServiceInfo::set_request_type<const std::string&>),
        std::pair(&response, &v1::ServiceInfo::set_response_type<const std::string&>)}) {
    const google::protobuf::Descriptor& type = *message->GetDescriptor();
    (added.*set)(type.full_name());
    (*impl_->info.mutable_descriptors())[type.full_name()] = descriptor_set(type);
    added.set_type_hash(added.type_hash() * 31 + type_hash(type));
  }
  impl_->info_changed = true;
  impl_->server.add(service, std::move(handler));
}

const v1::NodeInfo* ZmqBus::Impl::server_of(std::string_view service) const {
  for (const auto& [start_id, node] : known) {
    for (const v1::ServiceInfo& offered : node.services()) {
      if (offered.service() == service && !node.service_endpoints().empty()) return &node;
    }
  }
  return nullptr;
}

tl::expected<std::string, Status> ZmqBus::call(std::string_view service, const std::string& request,
                                               std::chrono::milliseconds timeout) {
  const std::string name(service);
  const auto deadline = std::chrono::system_clock::now() + timeout;
  const auto left = [&] { return std::chrono::system_clock::now() < deadline; };
  const auto next_look = [&] {  // a wait ends at its deadline only, and news come in between
    return std::min(deadline, std::chrono::system_clock::now() + 2ms);
  };
  impl_->serve();
  const v1::NodeInfo* server = impl_->server_of(service);
  while (server == nullptr && left()) {
    impl_->wait(next_look(), {}, false);
    server = impl_->server_of(service);
  }
  if (server == nullptr)
    return tl::unexpected(Status{"no node offers service " + name + within(timeout)});

  const std::uint64_t start_id = server->start_id();
  const std::string server_name = server->name();
  // Out of the bus's hands during the call: it closes the clients of nodes that die.
  std::unique_ptr<ServiceClient> client = std::move(impl_->clients[start_id]);
  if (!client) {
    client = std::make_unique<ServiceClient>(impl_->context, server->service_endpoints(0), true);
  }
  const std::uint64_t number = client->send(name, request);
  for (;;) {
    if (auto answer = client->receive(number)) {
      impl_->clients[start_id] = std::move(client);
      return *std::move(answer);
    }
    if (!left()) {
      return tl::unexpected(
          Status{"service " + name + ": no answer from node " + server_name + within(timeout)});
    }
    impl_->wait(next_look(), {}, false, client->handle());
    if (!impl_->known.contains(start_id)) {
      return tl::unexpected(Status{"service " + name + ": node " + server_name + " died"});
    }
  }
}

}  // namespace mimesis::runtime
