#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/runtime/bus.h"
#include "proto/runtime.pb.h"

namespace google::protobuf {
class Descriptor;
}

namespace mimesis::runtime {

/// FNV-1a over the descriptors of `type` and of all types it uses, by name; other types in the same
/// files do not count. Equal hashes: both ends read the bytes alike.
std::uint64_t type_hash(const google::protobuf::Descriptor& type);

/// Serialised FileDescriptorSet with the file of `type` and its imports, imports first.
std::string descriptor_set(const google::protobuf::Descriptor& type);

/// $MIMESIS_GRAPH, or "default".
std::string graph_name();
/// $MIMESIS_RUNTIME_DIR/GRAPH, $XDG_RUNTIME_DIR/mimesis/GRAPH, else mimesis-UID/GRAPH in $TMPDIR,
/// /dev/shm or /tmp; created with mode 0700 if absent.
/// @throws ConfigError if it cannot be, or if other users could write there.
std::string graph_directory(const std::string& graph);

/// The nodes that run in a graph now, read from its directory. No daemon, no cache.
class GraphView {
 public:
  explicit GraphView(const std::string& graph = graph_name());
  ~GraphView();
  std::vector<v1::NodeInfo> nodes() const;  ///< alive, by name
  /// Until the directory changes or `timeout` of wall time has passed; true on a change.
  bool wait(std::chrono::milliseconds timeout);

 private:
  std::unique_ptr<class Registry> registry_;
  mutable bool changed_ = false;  ///< since the last wait
};

/// A message of any topic with the data needed to decode it.
struct Tapped {
  std::string topic;
  std::string type;  ///< full Protobuf name
  std::uint64_t type_hash = 0;
  Received message;
  Time tick{};  ///< graph time of the publishing step; 0 outside lock-step
  const v1::NodeInfo* publisher =
      nullptr;  ///< the node's latest description; valid until the next call
};

/// Receives topics without compiled types: tools, recorder, results of a launch. Follows nodes that
/// come, go and restart. A reliable tap is an entry of the graph (input "*"): nodes that start
/// afterwards wait for it, so that it misses no first message; its owner must keep calling `next`.
class Tap {
 public:
  /// `accept(topic)` chooses the topics; `policy` reliable or latest (per topic).
  Tap(const std::string& graph, std::function<bool(const std::string& topic)> accept,
      Policy policy);
  ~Tap();
  /// Other topics from now on. What is chosen anew comes with the last message of latched topics.
  void choose(std::function<bool(const std::string& topic)> accept);
  /// Next message in order of arrival; nothing after `timeout` of wall time.
  std::optional<Tapped> next(std::chrono::milliseconds timeout);
  /// Serialised FileDescriptorSet of a type seen on this graph, empty if nobody announced one that
  /// has this hash.
  std::string descriptors(std::uint64_t type_hash) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Makes messages from descriptor sets.
class TypePool {
 public:
  TypePool();
  ~TypePool();
  /// A new empty message of `type`; null if the set does not define it. Owned by the pool's factory
  /// types: the pool must outlive the message.
  std::unique_ptr<google::protobuf::Message> make(const std::string& type,
                                                  const std::string& descriptor_set);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mimesis::runtime
