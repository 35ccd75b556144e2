#include <google/protobuf/descriptor.h>

#include "common/error.h"
#include "common/runtime/bus_core.h"
#include "common/runtime/graph_directory.h"
#include "common/runtime/type_info.h"

namespace mimesis::runtime {
namespace {
using namespace std::chrono_literals;

std::string within(std::chrono::milliseconds timeout) {
  return " within " + std::to_string(timeout.count()) + " ms";
}
}  // namespace

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
