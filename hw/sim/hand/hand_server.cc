#include "hw/sim/hand/hand_server.h"

#include <modbus/modbus.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <mutex>
#include <thread>
#include <vector>

namespace mimesis::hw::sim {
namespace {

using modbus::kInputAddress;
using modbus::kOutputAddress;
using modbus::kRegisters;
using modbus::Registers;

constexpr std::size_t kMostClients = 8;
constexpr unsigned kIndex =
    kInputAddress - kOutputAddress;  // of the input within the holding registers

struct Free {
  void operator()(modbus_t* context) const { modbus_free(context); }
  void operator()(modbus_mapping_t* mapping) const { modbus_mapping_free(mapping); }
};

}  // namespace

struct HandServer::Impl {
  explicit Impl(const modbus::Address& address)
      : context(modbus_new_tcp(nullptr, 0)),
        // Holding registers from the output to the end of the input, the input also as input
        // registers.
        mapping(modbus_mapping_new_start_address(0, 0, 0, 0, kOutputAddress, kIndex + kRegisters,
                                                 kInputAddress, kRegisters)),
        path(address.path),
        listener(modbus::listen(address)),
        wake(eventfd(0, EFD_CLOEXEC)) {
    MIMESIS_ASSERT(context && mapping && wake >= 0);
    thread = std::thread([this] { serve(); });
  }

  ~Impl() {
    eventfd_write(wake, 1);
    thread.join();
    for (const int client : clients) close(client);
    close(listener);
    close(wake);
    if (!path.empty()) unlink(path.c_str());
  }

  void serve() {
    for (;;) {
      std::vector<pollfd> waiting = {{wake, POLLIN, 0}, {listener, POLLIN, 0}};
      for (const int client : clients) waiting.push_back({client, POLLIN, 0});
      if (poll(waiting.data(), waiting.size(), -1) < 0) continue;
      if (waiting[0].revents != 0) return;
      for (std::size_t i = 2; i < waiting.size(); ++i) {
        if (waiting[i].revents != 0) answer(waiting[i].fd);
      }
      if (waiting[1].revents != 0) accept_client();
    }
  }

  void accept_client() {
    const int client = accept4(listener, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0) return;
    if (clients.size() < kMostClients) {
      clients.push_back(client);
    } else {
      close(client);
    }
  }

  void answer(int client) {
    std::uint8_t request[MODBUS_TCP_MAX_ADU_LENGTH];
    modbus_set_socket(context.get(), client);
    const int length = modbus_receive(context.get(), request);
    if (length >= 0) {
      const std::lock_guard lock(mutex);  // modbus_reply reads and writes the mapping
      if (length == 0 || modbus_reply(context.get(), request, length, mapping.get()) >= 0) return;
    }
    close(client);  // gone, or not Modbus
    std::erase(clients, client);
  }

  std::unique_ptr<modbus_t, Free> context;
  std::unique_ptr<modbus_mapping_t, Free> mapping;
  std::string path;
  int listener, wake;
  std::vector<int> clients;
  std::mutex mutex;
  std::thread thread;
};

HandServer::HandServer(const modbus::Address& address) : impl_(std::make_unique<Impl>(address)) {}
HandServer::~HandServer() = default;

modbus::HandOutput HandServer::exchange(const modbus::HandInput& input) {
  const Registers shown = encode(input);
  Registers written{};
  const std::lock_guard lock(impl_->mutex);
  std::uint16_t* holding = impl_->mapping->tab_registers;
  std::copy_n(holding, kRegisters, written.begin());
  std::ranges::copy(shown, holding + kIndex);
  std::ranges::copy(shown, impl_->mapping->tab_input_registers);
  return modbus::decode_output(written);
}

}  // namespace mimesis::hw::sim
