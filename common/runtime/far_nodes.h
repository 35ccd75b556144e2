#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "common/runtime/registry.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {

/// A node as other hosts see it: its tcp endpoints alone, with `address` in the place of any
/// (0.0.0.0, [::]).
v1::NodeInfo seen_from_afar(v1::NodeInfo node, const std::string& address);

/// The nodes of other hosts in the directory of this one: entries as its own nodes have them, but
/// seen from afar, held by this process. So nodes and tools of every host see the whole graph
/// and need to know of no other host.
class FarNodes {
 public:
  explicit FarNodes(std::string directory) : directory_(std::move(directory)) {}

  /// Shows a node, or what has changed about it. A name that a node of this host has is left to it
  /// and said once.
  void show(const v1::NodeInfo& node);
  void hide(const std::string& name) { shown_.erase(name); }
  bool shows(std::uint64_t start_id) const;

 private:
  struct Shown {
    std::uint64_t start_id = 0;
    std::unique_ptr<RegistryEntry> entry;
  };
  std::string directory_;
  std::map<std::string, Shown> shown_;
  std::set<std::uint64_t> refused_;
};

}  // namespace mimesis::runtime
