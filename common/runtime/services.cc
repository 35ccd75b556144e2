#include "common/runtime/services.h"

#include <cstring>

namespace mimesis::runtime {
namespace {
constexpr char kDone = 0, kFailed = 1;
}  // namespace

tl::expected<std::string, Status> ServiceServer::answer(const std::string& service,
                                                        const std::string& request) {
  const auto it = handlers_.find(service);
  if (it == handlers_.end()) return tl::unexpected(Status{"no service " + service + " here"});
  try {
    return it->second(request);
  } catch (const std::exception& e) {
    return tl::unexpected(Status{e.what()});
  }
}

void ServiceServer::serve() {
  for (Frame identity; socket_.receive(identity);) {
    Frame number, service, request;
    if (!identity.more() || !socket_.receive(number)) continue;
    if (!number.more() || !socket_.receive(service)) continue;
    if (!service.more() || !socket_.receive(request)) continue;
    if (request.more()) {
      socket_.skip_rest(request);
      continue;
    }
    const auto result = answer(std::string(service.view()), std::string(request.view()));
    const char status = result ? kDone : kFailed;
    Frame kind(std::string_view(&status, 1));
    Frame body(std::string_view(result ? *result : result.error().reason));
    // A client that is gone takes nothing; ROUTER drops the answer.
    if (socket_.send(identity, true) && socket_.send(number, true) && socket_.send(kind, true)) {
      socket_.send(body, false);
    }
  }
}

ServiceClient::ServiceClient(ZmqContext& context, const std::string& endpoint, bool wait_for_server)
    : socket_(context, ZMQ_DEALER) {
  socket_.set(ZMQ_IMMEDIATE, wait_for_server ? 0 : 1);
  socket_.connect(endpoint);
}

std::uint64_t ServiceClient::send(const std::string& service, const std::string& request) {
  ++number_;
  Frame number(sizeof number_);
  std::memcpy(number.data(), &number_, sizeof number_);
  Frame name{std::string_view(service)};
  Frame body{std::string_view(request)};
  if (socket_.send(number, true) && socket_.send(name, true)) socket_.send(body, false);
  return number_;
}

std::optional<tl::expected<std::string, Status>> ServiceClient::receive(std::uint64_t expected) {
  for (Frame number; socket_.receive(number);) {
    Frame kind, body;
    if (!number.more() || !socket_.receive(kind) || !kind.more() || !socket_.receive(body))
      continue;
    socket_.skip_rest(body);
    std::uint64_t n = 0;
    if (number.size() != sizeof n || kind.size() != 1) continue;
    std::memcpy(&n, number.data(), sizeof n);
    if (n != expected) continue;
    std::string text(body.view());
    if (kind.data()[0] == kDone) return text;
    return tl::unexpected(Status{std::move(text)});
  }
  return std::nullopt;
}

}  // namespace mimesis::runtime
