#include <poll.h>

#include "common/runtime/raw.h"
#include "common/runtime/registry.h"

namespace mimesis::runtime {

struct GraphView::Impl {
  explicit Impl(const std::string& graph) : registry(graph_directory(graph)) {}
  Registry registry;
  bool changed = false;  ///< since the last wait
};

GraphView::GraphView(std::string graph) : impl_(std::make_unique<Impl>(graph)) {
  impl_->registry.poll();
}
GraphView::~GraphView() = default;

std::vector<v1::NodeInfo> GraphView::nodes() const {
  if (!impl_->registry.poll().empty()) impl_->changed = true;
  std::vector<v1::NodeInfo> nodes;
  for (const auto& [name, node] : impl_->registry.nodes()) nodes.push_back(node);
  return nodes;
}

bool GraphView::wait(std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  for (;;) {
    if (!impl_->registry.poll().empty() || std::exchange(impl_->changed, false)) return true;
    const auto left =
        std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    if (left.count() <= 0) return false;
    pollfd item{impl_->registry.fd(), POLLIN, 0};
    const auto patience = std::min(left, impl_->registry.patience());
    poll(&item, item.fd >= 0 ? 1 : 0, static_cast<int>(patience.count()));
  }
}

}  // namespace mimesis::runtime
