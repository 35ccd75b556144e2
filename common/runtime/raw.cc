#include "common/runtime/raw.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <deque>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "common/runtime/registry.h"
#include "common/runtime/service_manager.h"
#include "common/runtime/sub_socket.h"

namespace mimesis::runtime {

GraphView::GraphView(const std::string& graph)
    : registry_(std::make_unique<Registry>(graph_directory(graph), true)) {
  registry_->poll();
}
GraphView::~GraphView() = default;

std::vector<v1::NodeInfo> GraphView::nodes() const {
  if (!registry_->poll().empty()) changed_ = true;
  std::vector<v1::NodeInfo> nodes;
  for (const auto& [name, node] : registry_->nodes()) nodes.push_back(node);
  return nodes;
}

bool GraphView::wait(std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  for (;;) {
    if (!registry_->poll().empty() || std::exchange(changed_, false)) return true;
    const auto left =
        std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    if (left.count() <= 0) return false;
    pollfd item{registry_->fd(), POLLIN, 0};
    const auto patience = std::min(left, registry_->patience());
    poll(&item, item.fd >= 0 ? 1 : 0, static_cast<int>(patience.count()));
  }
}

namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::FileDescriptor;

void collect(const Descriptor& type, std::map<std::string, std::string>& parts) {
  google::protobuf::DescriptorProto proto;
  type.CopyTo(&proto);
  if (!parts.emplace(type.full_name(), proto.SerializeAsString()).second) return;
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor* field = type.field(i);
    if (field->message_type() != nullptr) collect(*field->message_type(), parts);
    if (field->enum_type() != nullptr) {
      google::protobuf::EnumDescriptorProto values;
      field->enum_type()->CopyTo(&values);
      parts.emplace(field->enum_type()->full_name(), values.SerializeAsString());
    }
  }
}

void collect(const FileDescriptor& file, std::set<std::string>& seen,
             google::protobuf::FileDescriptorSet& set) {
  if (!seen.insert(file.name()).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) collect(*file.dependency(i), seen, set);
  file.CopyTo(set.add_file());
}

/// Protobuf ends a program that reads such a field.
bool is_weak(const google::protobuf::FieldDescriptorProto& field) { return field.options().weak(); }
bool has_weak_field(const google::protobuf::DescriptorProto& type) {
  return std::ranges::any_of(type.field(), is_weak) ||
         std::ranges::any_of(type.extension(), is_weak) ||
         std::ranges::any_of(type.nested_type(), has_weak_field);
}

/// The type as a set defines it, null if it does not.
const Descriptor* find(google::protobuf::DescriptorPool& pool, const std::string& type,
                       const std::string& descriptor_set) {
  google::protobuf::FileDescriptorSet files;
  if (files.ParseFromString(descriptor_set)) {
    for (const auto& file : files.file()) {
      if (std::ranges::any_of(file.message_type(), has_weak_field) ||
          std::ranges::any_of(file.extension(), is_weak)) {
        continue;
      }
      pool.BuildFile(file);
    }
  }
  return pool.FindMessageTypeByName(type);
}

constexpr int kLatestTapHighWater = 32;
constexpr int kReliableTapHighWater = 64;  // the rest waits at the publishers, bounded in bytes

/// Unlike any node's name that a person would choose.
std::string tap_name() {
  static std::atomic<int> count{0};
  return "tap-" + std::to_string(getpid()) + "-" + std::to_string(++count);
}

}  // namespace

std::uint64_t type_hash(const Descriptor& type) {
  std::map<std::string, std::string> parts;
  collect(type, parts);
  std::uint64_t hash = 0xcbf29ce484222325U;
  const auto add = [&](std::string_view bytes) {
    for (const char c : bytes) {
      hash ^= static_cast<unsigned char>(c);
      hash *= 0x100000001b3U;
    }
  };
  add(type.full_name());
  for (const auto& [name, bytes] : parts) {
    add(name);
    add(bytes);
  }
  return hash;
}

std::string descriptor_set(const Descriptor& type) {
  google::protobuf::FileDescriptorSet set;
  std::set<std::string> seen;
  collect(*type.file(), seen, set);
  return set.SerializeAsString();
}

struct Tap::Impl {
  Impl(const std::string& graph, std::function<bool(const std::string&)> a, Policy p)
      : accept(std::move(a)),
        reliable(p == Policy::reliable),
        start_id(new_start_id()),
        socket(context, gate, reliable ? kReliableTapHighWater : kLatestTapHighWater, start_id),
        registry(graph_directory(graph), true) {
    if (reliable) {
      v1::NodeInfo info;
      info.set_name(tap_name());
      info.set_pid(static_cast<std::uint32_t>(getpid()));
      info.set_start_id(start_id);
      info.set_ready(true);
      v1::TopicInfo& all = *info.add_inputs();
      all.set_topic("*");
      all.set_policy("reliable");
      entry = std::make_unique<RegistryEntry>(graph_directory(graph), info.name());
      entry->publish(info);
    }
    follow();
  }

  void follow() {
    for (const RegistryChange& change : registry.poll()) {
      change.alive ? meet(change.node) : socket.retire(change.node.start_id());
    }
  }

  void choose(std::function<bool(const std::string&)> chosen) {
    accept = std::move(chosen);
    const std::set<std::string> before = socket.topics();
    for (const std::string& topic : before) {
      if (accept(topic)) continue;
      socket.unsubscribe(topic);
      std::erase_if(order, [&](const auto& one) { return one.first.second == topic; });
      std::erase_if(pending, [&](const Tapped& message) { return message.topic == topic; });
    }
    for (const auto& [name, node] : registry.nodes()) meet(node);
  }

  void meet(const v1::NodeInfo& node) {
    nodes[node.start_id()] = node;
    bool wanted = false;
    for (const v1::TopicInfo& output : node.outputs()) {
      learn(output, node);
      if (!accept(output.topic())) continue;
      wanted = true;
      socket.subscribe(output.topic());
    }
    // A reliable tap connects to all: a node that starts waits for its greeting.
    const auto& endpoints = reliable ? node.reliable_endpoints() : node.data_endpoints();
    if ((wanted || reliable) && !endpoints.empty()) socket.connect(node, endpoints[0]);
  }

  void drop_revoked() {
    for (const std::string& key : gate.revoked()) {
      for (const auto& [start, node] : nodes) {
        if (node.public_key() == key) socket.drop(start);
      }
    }
  }

  /// A set that does not define the type with this hash is no one's: a stranger may say anything.
  void learn(const v1::TopicInfo& output, const v1::NodeInfo& node) {
    const auto set = node.descriptors().find(output.type());
    if (types.contains(output.type_hash()) || set == node.descriptors().end()) return;
    google::protobuf::DescriptorPool pool;
    const Descriptor* type = find(pool, output.type(), set->second);
    if (type != nullptr && type_hash(*type) == output.type_hash()) {
      types.emplace(output.type_hash(), std::pair(output.type(), set->second));
    }
  }

  std::optional<Tapped> receive() {
    Incoming incoming;
    while (socket.receive(incoming)) {
      if (incoming.place) continue;  // for those who map; the publisher learns of this tap just now
      const WireHeader& header = incoming.message.header;
      std::string topic(incoming.message.topic);
      std::uint64_t lost = 0;
      if (order[{header.start_id, topic}].place(header.seq, lost) != SeqOrder::Place::next)
        continue;
      if (reliable && lost > 0) socket.tell_missed(header.start_id, lost);
      const v1::NodeInfo& node = nodes[header.start_id];
      return Tapped{.topic = std::move(topic),
                    .type = types[header.type_hash].first,
                    .type_hash = header.type_hash,
                    .message = {.payload = std::string(incoming.payload.view()),
                                .stamp = header.stamp,
                                .seq = header.seq,
                                .source = node.name(),
                                .start_id = header.start_id},
                    .tick = Time(static_cast<std::int64_t>(header.tick)),
                    .publisher = &node};
    }
    return std::nullopt;
  }

  void keep(Tapped message) {
    if (!reliable) {
      std::erase_if(pending, [&](const Tapped& older) { return older.topic == message.topic; });
    }
    pending.push_back(std::move(message));
  }

  std::optional<Tapped> take() {
    if (!reliable) {
      while (auto message = receive()) keep(*std::move(message));
    }
    if (pending.empty()) return receive();
    Tapped oldest = std::move(pending.front());
    pending.pop_front();
    return oldest;
  }

  std::function<bool(const std::string&)> accept;
  bool reliable;
  std::uint64_t start_id;
  ZmqContext context;
  TcpGate gate{context};
  SubSocket socket;
  std::unique_ptr<RegistryEntry> entry;
  Registry registry;
  std::map<std::uint64_t, v1::NodeInfo> nodes;  ///< ever met, by start_id
  /// Name and FileDescriptorSet, by hash.
  std::map<std::uint64_t, std::pair<std::string, std::string>> types;
  std::map<std::pair<std::uint64_t, std::string>, SeqOrder> order;
  std::deque<Tapped> pending;
};

Tap::Tap(const std::string& graph, std::function<bool(const std::string& topic)> accept,
         Policy policy)
    : impl_(std::make_unique<Impl>(graph, std::move(accept), policy)) {}
Tap::~Tap() = default;

void Tap::choose(std::function<bool(const std::string& topic)> accept) {
  impl_->choose(std::move(accept));
}

std::optional<Tapped> Tap::next(std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  for (;;) {
    notify_alive();
    impl_->follow();
    impl_->gate.serve();
    impl_->drop_revoked();
    if (auto message = impl_->take()) return message;
    const auto left =
        std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    if (left.count() <= 0) return std::nullopt;
    std::array<zmq_pollitem_t, 2> items{{{impl_->socket.handle(), 0, ZMQ_POLLIN, 0},
                                         {nullptr, impl_->registry.fd(), ZMQ_POLLIN, 0}}};
    zmq_poll(items.data(), impl_->registry.fd() >= 0 ? 2 : 1,
             std::min(left, impl_->registry.patience()).count());
  }
}

std::string Tap::descriptors(std::uint64_t type_hash) const {
  const auto it = impl_->types.find(type_hash);
  return it == impl_->types.end() ? std::string() : it->second.second;
}

struct TypePool::Impl {
  struct Set {
    google::protobuf::DescriptorPool pool;
    google::protobuf::DynamicMessageFactory factory{&pool};
  };
  /// One pool per descriptor set: two builds may define a type differently.
  std::map<std::string, std::unique_ptr<Set>> sets;
};

TypePool::TypePool() : impl_(std::make_unique<Impl>()) {}
TypePool::~TypePool() = default;

std::unique_ptr<google::protobuf::Message> TypePool::make(const std::string& type,
                                                          const std::string& descriptor_set) {
  std::unique_ptr<Impl::Set>& set = impl_->sets[descriptor_set];
  if (!set) {
    set = std::make_unique<Impl::Set>();
    find(set->pool, type, descriptor_set);
  }
  const Descriptor* descriptor = set->pool.FindMessageTypeByName(type);
  if (descriptor == nullptr) return nullptr;
  return std::unique_ptr<google::protobuf::Message>(set->factory.GetPrototype(descriptor)->New());
}

}  // namespace mimesis::runtime
