#include "common/runtime/zmq_bus.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <climits>
#include <set>
#include <thread>
#include <tuple>

#include "common/error.h"
#include "common/runtime/log.h"
#include "common/runtime/message_limit.h"
#include "common/runtime/publisher.h"
#include "common/runtime/raw.h"
#include "common/runtime/registry.h"
#include "common/runtime/service_manager.h"
#include "common/runtime/services.h"
#include "common/runtime/subscriber.h"

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
  ZmqIn(std::string port, std::shared_ptr<Input> input, const Time& step)
      : port_(std::move(port)), input_(std::move(input)), step_(step) {}
  std::optional<Received> pop() override { return input_->pop(step_); }
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
  const Time& step_;
  Throttle throttle_{1s};
};

/// Serialises straight into the frame that is sent.
Frame serialised(const Message& message) {
  Frame frame(message.ByteSizeLong());
  serialise(message, frame.data(), frame.size());
  return frame;
}

constexpr auto kAfterDeath = 50ms;     // for bytes of a dead publisher that are still under way
constexpr auto kPatience = 5s;         // for a living one: then a message must have been lost
constexpr auto kLastPatience = 500ms;  // of a node that was asked to stop: it is killed after 3 s
constexpr auto kRetry = 100us;

/// How long a node waits for one that is alive.
std::chrono::milliseconds patience(int stop_fd) {
  pollfd stop{.fd = stop_fd, .events = POLLIN, .revents = 0};
  return poll(&stop, 1, 0) > 0 ? kLastPatience : kPatience;
}

std::string within(std::chrono::milliseconds timeout) {
  return " within " + std::to_string(timeout.count()) + " ms";
}

constexpr auto kGreetingPatience = 2s;
constexpr auto kDrainPeriod = 20ms;
constexpr auto kSettled = 1min;  // a registry more patient than this waits for its descriptor only

std::string_view clock_name(ClockKind clock) {
  constexpr std::array kNames = {"wall", "sim", "lockstep"};
  return kNames.at(static_cast<std::size_t>(clock));
}

bool readable(void* socket) {
  int events = 0;
  std::size_t size = sizeof events;
  return zmq_getsockopt(socket, ZMQ_EVENTS, &events, &size) == 0 && (events & ZMQ_POLLIN) != 0;
}

int zmq_fd(void* socket) {
  int fd = -1;
  std::size_t size = sizeof fd;
  zmq_getsockopt(socket, ZMQ_FD, &fd, &size);
  return fd;
}

v1::NodeInfo describe(const BusOptions& options) {
  v1::NodeInfo info;
  info.set_name(options.name);
  std::array<char, HOST_NAME_MAX + 1> host{};
  gethostname(host.data(), host.size() - 1);
  info.set_host(host.data());
  info.set_pid(static_cast<std::uint32_t>(getpid()));
  info.set_start_id(new_start_id());
  std::array<char, PATH_MAX> executable{};
  if (readlink("/proc/self/exe", executable.data(), executable.size() - 1) > 0) {
    info.set_executable(executable.data());
  }
  info.set_clock(std::string(clock_name(options.clock)));
  return info;
}

}  // namespace

/// The parts of ZmqBus put together: its sockets, its entry in the graph, the other nodes. Those of
/// other hosts are in the directory like ours (FarNodes).
struct ZmqBus::Impl {
  explicit Impl(BusOptions o);
  /// ZeroMQ leaves the files of its sockets; the lock of `entry` is still ours.
  ~Impl() {
    for (const auto* list :
         {&info.service_endpoints(), &info.data_endpoints(), &info.reliable_endpoints()}) {
      for (const std::string& endpoint : *list) {
        if (endpoint.starts_with("ipc://")) unlink(endpoint.c_str() + 6);
      }
    }
  }

  /// Serves all pending subscriptions and requests of other nodes.
  void serve();
  /// Waits for `deadline`, for a readable fd, or (`messages`) for a message to drain.
  enum class Woken { deadline, fd, message };
  /// How long one may sleep before looking again.
  std::chrono::nanoseconds patience(bool messages);
  void serve_arrived();
  void serve_publisher();
  Woken wait(WallTime deadline, std::span<const int> fds, bool messages, void* reply = nullptr);
  void discover();
  void meet(const v1::NodeInfo& node);
  /// Inputs of one author that have none, or whose author has ended, take the first publisher that
  /// is alive: the node that the topic names, else the one that started first.
  void choose_authors();
  /// Why `other` refuses messages of this node; empty: it does not.
  std::string refused_by(const v1::NodeInfo& other) const;
  /// One line for every topic that wires this node and `other` together with different types. Both
  /// nodes find the same.
  void tell_mismatches(const v1::NodeInfo& other);
  void forget(const v1::NodeInfo& node);
  void publish_info();
  /// Serves the gate, ends connections of hosts whose keys were taken back, tells of cut ones.
  void guard();
  /// Waits (at most 2 s) until all that `selects` chooses among the living have greeted the
  /// reliable socket.
  void await_greetings(const std::function<bool(const v1::NodeInfo&)>& selects);
  void check_wiring() const;
  std::string topic_of_output(std::string_view port) const;
  /// Tells the publisher who takes large payloads from memory.
  void find_mapping();
  /// @throws ConfigError if the node publishes the topic already.
  Publisher::Topic& add_output(std::string_view port, const std::string& topic,
                               const std::string& type, std::uint64_t hash, std::string descriptors,
                               bool latched);
  void send(Publisher::Topic& topic, Frame payload, Time stamp);
  const v1::NodeInfo* server_of(std::string_view service) const;

  BusOptions options;
  std::string directory;
  GraphTime time;
  RegistryEntry entry;
  v1::NodeInfo info;
  ZmqContext context;  // before the sockets: destroyed after them
  TcpGate gate;
  Publisher publisher;
  Subscriber subscriber;
  ServiceServer server;
  Registry registry;
  std::map<std::uint64_t, v1::NodeInfo> known;  ///< alive, without this one, by start_id
  std::map<std::uint64_t, std::unique_ptr<ServiceClient>> clients;
  std::map<std::string, std::shared_ptr<Input>, std::less<>> inputs;  ///< wired ones, by port
  std::set<std::string, std::less<>> in_ports, out_ports;
  std::set<std::pair<std::uint64_t, std::string>> said;  ///< mismatches, once per start
  std::vector<v1::Publication> published;
  Time tick{};
  Time step{};                     ///< time of the present step; 0: there are none
  std::vector<int> served_fds;     ///< file descriptors of the sockets that are always served
  std::vector<pollfd> waiting_on;  ///< of the current wait
  bool info_changed = true;
  std::uint64_t mapping_found = 0;    ///< data subscriptions at the last find_mapping; 0: due
  bool drains_while_waiting = false;  ///< a queue could overflow in the socket between slow steps
  bool behind = false;                ///< flush() gave up
  std::uint64_t told_overflow = 0;
  const std::uint64_t cut_before = cut_connections().count;
  Throttle overflow_throttle{1s};
};

ZmqBus::Impl::Impl(BusOptions o)
    : options(std::move(o).complete()),
      directory(graph_directory(options.graph)),
      time(directory),
      entry(directory, options.name),
      info(describe(options)),
      gate(context),
      publisher(context, info.start_id()),
      subscriber(context, gate, info.start_id(), options.clock == ClockKind::lockstep),
      server(context),
      registry(directory, false) {
  info.set_started_ns(static_cast<std::uint64_t>(time.now().count()));
  // Names of a start are unique: no process reconnects to the socket of a predecessor.
  const std::string stem = "ipc://" + directory + "/" + options.name + "-" +
                           std::to_string(info.start_id() % 100'000'000);
  const auto bind = [&](ZmqSocket& socket, const char* suffix, int port_offset, auto& endpoints) {
    served_fds.push_back(zmq_fd(socket.handle()));
    socket.bind(stem + suffix);
    *endpoints.Add() = stem + suffix;
    if (options.bind.empty()) return;
    gate.bind(socket, options.tcp_endpoint(port_offset));
    *endpoints.Add() = socket.bound_endpoint();
  };
  bind(server.socket(), ".s", 0, *info.mutable_service_endpoints());
  bind(publisher.data_socket(), ".d", 1, *info.mutable_data_endpoints());
  bind(publisher.reliable_socket(), ".r", 2, *info.mutable_reliable_endpoints());
  info.set_public_key(gate.public_key());
  info.set_maps_payloads(options.clock != ClockKind::lockstep);
}

void ZmqBus::Impl::tell_mismatches(const v1::NodeInfo& other) {
  for (const std::string& line : type_mismatches(info, other)) {
    if (said.emplace(other.start_id(), line).second)
      log(Level::error, line + "; its messages are ignored");
  }
}

void ZmqBus::Impl::publish_info() {
  if (info.maps_payloads() && !subscriber.maps()) {
    warn("the memory of a publisher cannot be mapped: large messages come as copies");
    info.set_maps_payloads(false);
    info_changed = true;
  }
  if (!info_changed) return;
  info_changed = false;
  entry.publish(info);
}

void ZmqBus::Impl::serve() {
  notify_alive();
  publish_info();
  discover();
  guard();
  serve_publisher();
  server.serve();
}

void ZmqBus::Impl::guard() {
  gate.serve();
  if (const Cut cut = cut_connections(); cut.count > cut_before && said.emplace(0, "cut").second)
    warn("a connection of {} was closed: a message beyond {} MB, or not of ZMTP 3",
         cut.pid == 0 ? "tcp" : fmt::format("process {}", cut.pid), kLargestWhole >> 20U);
  for (const std::string& key : gate.revoked()) {
    publisher.end_connections(key);
    server.end_connections(key);
    std::vector<v1::NodeInfo> gone;
    for (const auto& [start_id, node] : known) {
      if (node.public_key() == key) gone.push_back(node);
    }
    for (const v1::NodeInfo& node : gone) {
      subscriber.drop(node);
      clients.erase(node.start_id());
      known.erase(node.start_id());
    }
    choose_authors();
  }
}

void ZmqBus::Impl::serve_publisher() {
  publisher.serve();
  if (publisher.overflow() == told_overflow || !overflow_throttle.pass()) return;
  told_overflow = publisher.overflow();
  warn("reliable subscribers that took nothing have missed {} messages", told_overflow);
}

void ZmqBus::Impl::discover() {
  for (const RegistryChange& change : registry.poll()) {
    const v1::NodeInfo& node = change.node;
    if (node.start_id() == info.start_id()) continue;
    if (!change.alive || !known.contains(node.start_id())) {
      log(Level::debug, fmt::format("node {} of host {} (process {}) is {}", node.name(),
                                    node.host(), node.pid(), change.alive ? "there" : "gone"));
    }
    change.alive ? meet(node) : forget(node);
  }
}

void ZmqBus::Impl::meet(const v1::NodeInfo& node) {
  known[node.start_id()] = node;
  mapping_found = 0;
  tell_mismatches(node);
  subscriber.meet(node);
  choose_authors();
  if (!info.ready()) return;  // ready() refuses to go on
  const std::string why = refused_by(node);
  if (!why.empty() && said.emplace(node.start_id(), why).second) warn("{}", why);
}

void ZmqBus::Impl::choose_authors() {
  for (const auto& [port, each] : inputs) {
    const auto& input = each;  // clang 14 lets no lambda use a binding
    if (!input->takes_first()) continue;
    const std::string& topic = input->topic();
    const std::string named = topic.substr(0, topic.find('/'));
    const auto rank = [&](const v1::NodeInfo& node) {
      return std::tuple(node.name() != input->owner(), node.name() != named, node.started_ns(),
                        node.start_id());
    };
    const v1::NodeInfo* first = nullptr;
    for (const auto& [start_id, node] : known) {
      if (!node.ready()) continue;  // it may be refused
      if (std::ranges::find(node.outputs(), topic, &v1::TopicInfo::topic) == node.outputs().end())
        continue;
      if (first == nullptr || rank(node) < rank(*first)) first = &node;
    }
    const std::string author = first != nullptr ? first->name() : "";
    if (author == input->owner()) continue;
    if (!input->owner().empty() && !author.empty()) {
      warn("topic {}: node {} has ended, messages are taken from node {}", topic, input->owner(),
           author);
    }
    input->set_owner(author);
    for (v1::TopicInfo& told : *info.mutable_inputs()) {
      if (told.port() == port) told.set_obeys(author);
    }
    info_changed = true;
  }
}

std::string ZmqBus::Impl::refused_by(const v1::NodeInfo& other) const {
  for (const v1::TopicInfo& input : other.inputs()) {
    if (input.obeys().empty() || input.obeys() == options.name || !publisher.has(input.topic()) ||
        options.into_live.contains(input.topic()))
      continue;
    return fmt::format("node {} takes topic {} from node {} alone: it refuses messages of node {}",
                       other.name(), input.topic(), input.obeys(), options.name);
  }
  return {};
}

void ZmqBus::Impl::forget(const v1::NodeInfo& node) {
  subscriber.forget(node);
  clients.erase(node.start_id());
  known.erase(node.start_id());
  mapping_found = 0;
  choose_authors();
}

void ZmqBus::Impl::find_mapping() {
  mapping_found = publisher.data_subscriptions();
  std::map<std::string, std::vector<int>, std::less<>> mapping;
  for (const auto& [start_id, node] : known) {
    if (!node.maps_payloads() || node.data_endpoints().empty() ||
        !node.data_endpoints(0).starts_with("ipc://"))
      continue;
    // One connection for all inputs of a topic: another policy wants copies.
    std::map<std::string, bool, std::less<>> latest;
    for (const v1::TopicInfo& input : node.inputs()) {
      const auto [it, added] = latest.emplace(input.topic(), true);
      it->second = it->second && input.policy() == policy_name(Policy::latest);
    }
    for (const auto& [topic, all] : latest) {
      if (all) mapping[topic].push_back(static_cast<int>(node.pid()));
    }
  }
  publisher.map_for(mapping);
}

void ZmqBus::Impl::serve_arrived() {
  publish_info();
  guard();
  if (readable(publisher.data_socket().handle()) ||
      readable(publisher.reliable_socket().handle()) || publisher.backlog() > 0) {
    serve_publisher();
  }
  if (readable(server.socket().handle())) server.serve();
}

// ZeroMQ's descriptors tell only that something has changed since its events were last looked at:
// so look before every sleep. Cheaper than zmq_poll, and with a deadline in nanoseconds.
ZmqBus::Impl::Woken ZmqBus::Impl::wait(WallTime deadline, std::span<const int> fds, bool messages,
                                       void* reply) {
  waiting_on.clear();
  const auto watch = [this](int fd) { waiting_on.push_back({fd, POLLIN, 0}); };
  for (const int fd : fds) watch(fd);
  watch(registry.fd());  // -1 is ignored
  for (const int fd : served_fds) watch(fd);
  for (const int fd : gate.fds()) watch(fd);
  if (messages) {
    watch(zmq_fd(subscriber.data_handle()));
    watch(zmq_fd(subscriber.reliable_handle()));
  }
  if (reply != nullptr) watch(zmq_fd(reply));
  const auto arrived = [&] {
    return (messages &&
            (readable(subscriber.data_handle()) || readable(subscriber.reliable_handle()))) ||
           (reply != nullptr && readable(reply));
  };
  for (;;) {
    notify_alive();
    serve_arrived();
    if (arrived()) return Woken::message;
    const auto left = std::chrono::nanoseconds(deadline - std::chrono::steady_clock::now());
    const auto pause = std::clamp(left, std::chrono::nanoseconds(0), patience(messages));
    const timespec ts{pause.count() / 1'000'000'000, pause.count() % 1'000'000'000};
    const int ready = ppoll(waiting_on.data(), waiting_on.size(), &ts, nullptr);
    if ((ready > 0 && waiting_on[fds.size()].revents != 0) || registry.patience() < kSettled)
      discover();
    for (std::size_t i = 0; ready > 0 && i < fds.size(); ++i) {
      if (waiting_on[i].revents != 0) return Woken::fd;
    }
    if (left.count() <= 0) return Woken::deadline;
  }
}

std::chrono::nanoseconds ZmqBus::Impl::patience(bool messages) {
  auto patience = std::min<std::chrono::nanoseconds>(registry.patience(), alive_period());
  if (publisher.backlog() > 0) patience = std::min<std::chrono::nanoseconds>(patience, 1ms);
  if (drains_while_waiting && !messages) {
    subscriber.drain();
    patience = std::min<std::chrono::nanoseconds>(patience, kDrainPeriod);
  }
  return patience;
}

void ZmqBus::Impl::await_greetings(const std::function<bool(const v1::NodeInfo&)>& selects) {
  const auto deadline = std::chrono::steady_clock::now() + kGreetingPatience;
  for (;;) {
    serve();
    std::string missing;
    for (const auto& [start_id, node] : known) {
      if (!publisher.greeted_by(start_id) && selects(node)) missing += " " + node.name();
    }
    if (missing.empty()) return;
    if (std::chrono::steady_clock::now() >= deadline) {
      warn("still without a connection to{}: first messages may be missing there", missing);
      return;
    }
    wait(std::min(deadline, std::chrono::steady_clock::now() + 1ms), {}, false);
  }
}

/// Both kinds of sending ends.
template <class Base>
struct ZmqOut : Base {
  ZmqOut(ZmqBus::Impl& b, Publisher::Topic& t) : bus(b), topic(t) {}
  std::size_t subscribers() const override { return Publisher::subscribers(topic); }
  ZmqBus::Impl& bus;
  Publisher::Topic& topic;
};

struct ZmqTypedOut final : ZmqOut<OutChannel> {
  using ZmqOut::ZmqOut;
  void send(const Message& message, Time stamp) override {
    bus.send(topic, serialised(message), stamp);
  }
  std::uint64_t next_seq() const override { return topic.seq + 1; }
};

struct ZmqRawOut final : ZmqOut<RawOut> {
  using ZmqOut::ZmqOut;
  void send_raw(std::string_view payload, Time stamp) override {
    bus.send(topic, Frame(payload), stamp);
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
    return std::make_unique<ZmqIn>(
        std::string(port), std::make_shared<Input>("", type_hash(type), options, ""), impl_->step);
  }
  const std::string obeyed = impl_->options.obeyed(port, options.author);
  auto input = impl_->subscriber.add(wired->second, type_hash(type), options, obeyed);
  if (options.policy != Policy::latest) impl_->drains_while_waiting = !lockstep();
  v1::TopicInfo& entry = *impl_->info.add_inputs();
  entry.set_topic(wired->second);
  entry.set_port(std::string(port));
  entry.set_type(type.full_name());
  entry.set_type_hash(input->type_hash());
  entry.set_policy(std::string(policy_name(options.policy)));
  entry.set_obeys(obeyed);
  entry.set_one_author(options.author != Author::any);
  // Perhaps no node publishes it: people who do must know its type.
  if (options.optional)
    (*impl_->info.mutable_descriptors())[type.full_name()] = descriptor_set(type);
  impl_->info_changed = true;
  impl_->inputs.emplace(port, input);
  impl_->choose_authors();
  for (const auto& [start_id, node] : impl_->known) impl_->meet(v1::NodeInfo(node));
  return std::make_unique<ZmqIn>(std::string(port), std::move(input), impl_->step);
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
  return std::make_unique<ZmqTypedOut>(*impl_, added);
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
  return std::make_unique<ZmqRawOut>(*impl_, added);
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

void ZmqBus::Impl::send(Publisher::Topic& topic, Frame payload, Time stamp) {
  if (payload.size() >= kMappedPayload && mapping_found != publisher.data_subscriptions())
    find_mapping();
  const bool lockstep = options.clock == ClockKind::lockstep;
  const std::uint64_t seq = publisher.send(topic, std::move(payload), stamp,
                                           lockstep ? static_cast<std::uint64_t>(tick.count()) : 0);
  if (!lockstep || seq == 0) return;
  v1::Publication& publication = published.emplace_back();
  publication.set_topic(topic.name);
  publication.set_start_id(info.start_id());
  publication.set_seq(seq);
  publication.set_latched(topic.latched);
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
  check("input", options.from, in_ports);
  check("output", options.out, out_ports);
}

void ZmqBus::ready() {
  impl_->check_wiring();
  impl_->serve();
  for (const auto& [start_id, node] : impl_->known) {
    if (const std::string why = impl_->refused_by(node); !why.empty()) throw ConfigError(why);
  }
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
const GraphTime& ZmqBus::time() const { return impl_->time; }
const v1::NodeInfo& ZmqBus::info() const { return impl_->info; }
std::uint64_t ZmqBus::sent() const { return impl_->publisher.sent(); }
std::uint64_t ZmqBus::backlog() const { return impl_->publisher.backlog(); }
std::uint64_t ZmqBus::backlog_bytes() const { return impl_->publisher.backlog_bytes(); }
std::uint64_t ZmqBus::overflow() const { return impl_->publisher.overflow(); }
std::uint64_t ZmqBus::malformed() const {
  return impl_->subscriber.malformed() + impl_->publisher.refused() + cut_connections().count -
         impl_->cut_before;
}

std::vector<v1::NodeInfo> ZmqBus::known_nodes() const {
  std::map<std::string, v1::NodeInfo> by_name;
  for (const auto& [start_id, node] : impl_->known) by_name.emplace(node.name(), node);
  std::vector<v1::NodeInfo> nodes;
  for (auto& [name, node] : by_name) nodes.push_back(std::move(node));
  return nodes;
}

std::vector<v1::InputHealth> ZmqBus::report_inputs(Time now) {
  std::vector<v1::InputHealth> list;
  for (const auto& [port, input] : impl_->inputs) input->report(now, list.emplace_back());
  return list;
}

std::vector<std::string> ZmqBus::awaited() const {
  std::vector<std::string> topics;
  for (const auto& [port, input] : impl_->inputs) {
    if (input->awaited()) topics.push_back(input->topic());
  }
  return topics;
}

void ZmqBus::step_begins(Time now) { impl_->step = now; }

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

void ZmqBus::deliver(Time tick, const google::protobuf::RepeatedPtrField<v1::Publication>& visible,
                     int stop_fd) {
  impl_->tick = tick;
  impl_->subscriber.drain();
  using Clock = std::chrono::steady_clock;
  auto since = Clock::now();
  /// False: it is given up.
  const auto arrives = [&](const v1::Publication& publication) {
    for (bool dying = false;;) {
      if (!dying && !impl_->known.contains(publication.start_id())) {
        dying = true;
        since = Clock::now();
      }
      if (Clock::now() - since >= (dying ? kAfterDeath : patience(stop_fd))) {
        impl_->subscriber.give_up(publication);
        if (!dying)
          error("message {} on topic {} did not arrive", publication.seq(), publication.topic());
        return false;
      }
      impl_->wait(Clock::now() + 20ms, {}, true);
      impl_->subscriber.drain();
      if (impl_->subscriber.deliver(publication)) return true;
    }
  };
  for (const v1::Publication& publication : visible) {
    // Not since the call for each: who stands still holds more than one message back.
    if (!impl_->subscriber.deliver(publication) && arrives(publication)) since = Clock::now();
  }
}

std::vector<v1::Publication> ZmqBus::take_published() {
  return std::exchange(impl_->published, {});
}

void ZmqBus::flush(int stop_fd) {
  std::uint64_t waiting = impl_->publisher.backlog();
  if (waiting == 0) {
    impl_->behind = false;
    return;
  }
  auto since = std::chrono::steady_clock::now();
  while (waiting > 0 && !impl_->behind) {
    std::this_thread::sleep_for(kRetry);
    impl_->serve();
    impl_->publisher.cut_stopped();  // in lock-step all wait
    const std::uint64_t now_waiting = impl_->publisher.backlog();
    if (now_waiting < waiting) since = std::chrono::steady_clock::now();
    waiting = now_waiting;
    if (std::chrono::steady_clock::now() - since >= patience(stop_fd)) {
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
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  const auto left = [&] { return std::chrono::steady_clock::now() < deadline; };
  const auto next_look = [&] {  // a wait ends at its deadline only, and news come in between
    return std::min(deadline, std::chrono::steady_clock::now() + 2ms);
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
  try {
    if (!client)
      client = std::make_unique<ServiceClient>(impl_->context, impl_->gate,
                                               server->service_endpoints(0), server->public_key());
  } catch (const ConfigError& e) {  // another process wrote the endpoint, or no key is trusted
    return tl::unexpected(Status{"service " + name + ": " + e.what()});
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
