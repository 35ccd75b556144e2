#include "tools/mimesis/launch/hosts.h"

#include <fmt/format.h>

#include <algorithm>
#include <thread>

#include "common/runtime/keys.h"
#include "tools/mimesis/launch/subreaper.h"

namespace mimesis::launch {
namespace {

constexpr std::chrono::milliseconds kStatus{500};

struct Keys {
  std::string host, key;
  std::vector<std::string> trusted;
};

Keys keys_here() {
  Keys keys{.host = "this host", .key = {}, .trusted = {}};
  if (const auto own = runtime::own_key()) keys.key = own->public_key;
  for (const auto& [key, name] : runtime::trusted_keys()) keys.trusted.push_back(key);
  return keys;
}

/// Why `a` does not talk to `b`; empty: it does.
std::string distrust(const Keys& a, const Keys& b) {
  if (a.key.empty()) return fmt::format("{} has no key; there: mimesis key new", a.host);
  if (b.key.empty() || a.key == b.key || std::ranges::find(a.trusted, b.key) != a.trusted.end())
    return {};
  return fmt::format("{} does not trust {}; there: mimesis key trust {} '{}'", a.host, b.host,
                     b.host == "this host" ? "NAME" : b.host.substr(b.host.find(' ') + 1), b.key);
}

}  // namespace

Hosts::Hosts(const GraphFile& graph, const Run& run, const std::string& directory)
    : time_(directory), shown_(directory), here_(directory) {
  if (!graph.several_hosts()) return;
  NodeSpec self;
  self.name.text = "launcher";
  node_.emplace(run.graph, bind_address(graph, self));
  for (const Host& host : graph.hosts) {
    const bool used = std::ranges::any_of(
        graph.nodes, [&](const NodeSpec& node) { return graph.far(node) == &host; });
    if (used) far_.push_back(std::make_unique<FarHost>(host, run.graph, time_));
  }
}

FarHost* Hosts::far(const NodeSpec& node) const {
  for (const auto& host : far_) {
    if (node.host && node.host->text == host->name()) return host.get();
  }
  return nullptr;
}

NodeHost& Hosts::of(const NodeSpec& node) {
  FarHost* const host = far(node);
  return host != nullptr ? static_cast<NodeHost&>(*host) : here_;
}

bool Hosts::runs(const NodeSpec& node, const v1::NodeInfo& info) const {
  const FarHost* host = far(node);
  if (host == nullptr)
    return static_cast<pid_t>(info.pid()) == here_.pid(node.name.text) &&
           !shown_.shows(info.start_id());
  return info.host() == host->name() && static_cast<pid_t>(info.pid()) == host->pid(node.name.text);
}

bool Hosts::ready(const NodeSpec& node) {
  FarHost* host = far(node);
  if (host != nullptr && !host->up()) host->reconnect();
  return host == nullptr || host->up();
}

std::vector<HostEvent> Hosts::poll() {
  std::vector<HostEvent> events = here_.poll();
  for (const auto& host : far_) {
    for (HostEvent& event : host->poll()) events.push_back(std::move(event));
  }
  exchange();
  if (node_) publish();
  return events;
}

void Hosts::exchange() {
  for (const auto& host : far_) {
    for (const runtime::RegistryChange& change : host->news()) {
      change.alive ? shown_.show(change.node) : shown_.hide(change.node.name());
      for (const auto& other : far_) {
        if (other == host) continue;
        change.alive ? other->show(change.node)
                     : other->hide(change.node.name(), change.node.start_id());
      }
    }
  }
}

void Hosts::tell(const std::vector<runtime::RegistryChange>& news) {
  for (const runtime::RegistryChange& change : news) {
    if (shown_.shows(change.node.start_id())) continue;
    for (const auto& host : far_) {
      change.alive ? host->show(change.node)
                   : host->hide(change.node.name(), change.node.start_id());
    }
  }
}

void Hosts::publish() {
  node_->bus.wait(std::chrono::steady_clock::now());
  if (std::chrono::steady_clock::now() < next_status_) return;
  next_status_ = std::chrono::steady_clock::now() + kStatus;
  for (const auto& host : far_) {
    v1::HostStatus status = host->status();
    node_->out.send(status, time_.now());
  }
}

void Hosts::disconnect() {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(2);
  for (const auto& host : far_) {
    while (!host->disconnect(std::chrono::steady_clock::now() < end))
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

void Hosts::watch(std::vector<pollfd>& fds) const {
  here_.watch(fds);
  for (const auto& host : far_) host->watch(fds);
}

std::string Hosts::failure() {
  std::vector<Keys> all;
  for (const auto& host : far_) {
    if (!host->failure().empty()) return host->failure();
    const v1::HostReport* hello = host->hello();
    if (hello == nullptr || trust_checked_) return {};
    if (!runtime::leaves_host(runtime::tcp_at(host->address()))) continue;
    all.push_back({"host " + host->name(),
                   hello->public_key(),
                   {hello->trusted().begin(), hello->trusted().end()}});
  }
  trust_checked_ = true;
  if (!all.empty()) all.push_back(keys_here());
  for (const Keys& a : all) {
    for (const Keys& b : all) {
      if (const std::string why = distrust(a, b); !why.empty()) return why;
    }
  }
  return {};
}

}  // namespace mimesis::launch
