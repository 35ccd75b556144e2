#include "hw/sim/hand/hand.h"

#include <modbus/modbus.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace mimesis::hw::sim {
namespace {

constexpr double kSlowest = 0.2;             // share of full speed at register 0
constexpr std::uint8_t kNotActivated = 0x7;  // fault codes of the hand
constexpr double kGripCurrent = 100.0;       // at full force, in tenths of mA

using Clock = std::chrono::steady_clock;
constexpr std::size_t kMostClients = 8;
constexpr std::chrono::milliseconds kPatience(500);  ///< with a request that has begun
constexpr int kLook_ms = 100;
constexpr unsigned kIndex =
    kInputAddress - kOutputAddress;  // offset of the input within the holding registers

}  // namespace

void HandPlant::initialise(double dt, const HandOutput& output) {
  Initialisation& phase = input_.initialisation;
  if (!output.activate) {
    phase = Initialisation::reset;
    return;
  }
  if (phase == Initialisation::reset) {
    phase = Initialisation::activating;
    left_s_ = params_.activation_time_s;
  } else if (phase == Initialisation::done && output.mode != input_.mode) {
    phase = Initialisation::changing_mode;
    left_s_ = params_.mode_time_s;
  } else if (phase != Initialisation::done && (left_s_ -= dt) <= 0.0) {
    phase = Initialisation::done;
    input_.mode = output.mode;
  }
}

void HandPlant::move(double dt, const HandOutput& output, std::optional<double> contact) {
  const double request = output.position / 255.0;
  const double speed =
      (kSlowest + (1.0 - kSlowest) * output.speed / 255.0) / params_.closing_time_s;
  const bool closing = request > closure_;
  double target = request;
  const bool meets = closing && contact && *contact < request;
  if (meets) target = std::max(closure_, *contact);
  closure_ += std::clamp(target - closure_, -speed * dt, speed * dt);

  const bool arrived = std::abs(closure_ - target) < 1e-9;
  input_.motion = !arrived ? Motion::moving : meets ? Motion::all_stopped : Motion::at_request;
  input_.contact = !arrived ? Contact::none : meets ? Contact::while_closing : Contact::at_request;
  const double current = meets && arrived ? kGripCurrent * output.force / 255.0 : 0.0;
  input_.current = static_cast<std::uint8_t>(current);
}

void HandPlant::step(double dt, const HandOutput& output, std::optional<double> contact) {
  initialise(dt, output);
  const bool ready = input_.initialisation == Initialisation::done;
  input_.activated = output.activate;
  input_.go = output.go;
  input_.requested = output.position;
  input_.fault = output.go && !output.activate ? kNotActivated : 0;
  if (ready && output.go) {
    move(dt, output, contact);
  } else {
    input_.current = 0;
  }
  input_.position = static_cast<std::uint8_t>(std::lround(255.0 * closure_));
}

struct HandServer::Impl {
  explicit Impl(const modbus::Address& address)
      : context(address.device.empty() ? modbus_new_tcp(nullptr, 0)
                                       : modbus_new_rtu(address.device.c_str(), 115'200, 'N', 8, 1),
                &modbus_free),
        // Holding registers from the output to the end of the input, the input also as input
        // registers.
        mapping(modbus_mapping_new_start_address(0, 0, 0, 0, kOutputAddress, kIndex + kRegisters,
                                                 kInputAddress, kRegisters),
                &modbus_mapping_free),
        path(address.path),
        listener(address.device.empty() ? modbus::listen(address) : -1),
        wake(eventfd(0, EFD_CLOEXEC)) {
    MIMESIS_ASSERT(context && mapping && wake >= 0);
    const bool line = listener < 0;
    if (line && (modbus_set_slave(context.get(), kUnit) != 0 || modbus_connect(context.get()) != 0))
      throw ConfigError("Modbus server at " + address.text + ": " + modbus_strerror(errno));
    thread = std::thread([this, line] { line ? serve_line() : serve(); });
  }

  ~Impl() {
    eventfd_write(wake, 1);
    thread.join();
    for (const Client& client : clients) close(client.socket);
    if (listener >= 0) close(listener);
    modbus_close(context.get());
    close(wake);
    if (!path.empty()) unlink(path.c_str());
  }

  /// One connection; its request may come in pieces, and nobody waits for them.
  struct Client {
    int socket;
    std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> request{};
    std::size_t size = 0;  ///< bytes of the request that have come
    Clock::time_point begun{};
  };

  void serve() {
    for (;;) {
      std::vector<pollfd> waiting = {{wake, POLLIN, 0}, {listener, POLLIN, 0}};
      for (const Client& client : clients) waiting.push_back({client.socket, POLLIN, 0});
      const bool partial = std::ranges::any_of(clients, [](const Client& c) { return c.size > 0; });
      if (poll(waiting.data(), waiting.size(), partial ? kLook_ms : -1) < 0) continue;
      if (waiting[0].revents != 0) return;
      std::size_t i = 2;
      std::erase_if(clients, [&](Client& client) {
        const bool stays = waiting[i++].revents == 0 ? in_time(client) : answer(client);
        if (!stays) close(client.socket);
        return !stays;
      });
      if (waiting[1].revents != 0) accept_client();
    }
  }

  /// Requests on a serial line; libmodbus drops what is damaged or for another unit.
  void serve_line() {
    std::array<std::uint8_t, MODBUS_RTU_MAX_ADU_LENGTH> request{};
    bool quiet = false;  // after an error, so that a line that is gone does not keep us busy
    for (;;) {
      std::array<pollfd, 2> waiting = {
          {{wake, POLLIN, 0}, {quiet ? -1 : modbus_get_socket(context.get()), POLLIN, 0}}};
      if (poll(waiting.data(), waiting.size(), quiet ? kLook_ms : -1) < 0) continue;
      if (waiting[0].revents != 0) return;
      if (std::exchange(quiet, false)) continue;
      const int length = modbus_receive(context.get(), request.data());
      quiet = length < 0;
      if (length <= 0) continue;
      const std::lock_guard lock(mutex);
      modbus_reply(context.get(), request.data(), length, mapping.get());
    }
  }

  void accept_client() {
    const int client = accept4(listener, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (client < 0) return;
    if (clients.size() < kMostClients) {
      clients.push_back({.socket = client});
    } else {
      close(client);
    }
  }

  static bool in_time(const Client& client) {
    return client.size == 0 || Clock::now() - client.begun < kPatience;
  }

  /// Takes what has come of the request, and answers it once it is whole. False if the connection
  /// is to be closed: gone, not Modbus, or not reading its answers.
  bool answer(Client& client) {
    // MBAP header: transaction, protocol 0, number of bytes that follow (unit, function, data)
    constexpr std::size_t kHead = 6, kLeast = 2;
    auto& request = client.request;
    if (client.size == 0) client.begun = Clock::now();
    const auto whole = [&] {
      return client.size < kHead ? kHead
                                 : kHead + 256 * std::size_t{request[4]} + std::size_t{request[5]};
    };
    while (client.size < whole()) {
      const ssize_t n = recv(client.socket, request.data() + client.size, whole() - client.size, 0);
      if (n < 0 && errno == EAGAIN) return in_time(client);
      if (n <= 0) return false;
      client.size += static_cast<std::size_t>(n);
      if (client.size < kHead) continue;
      if (request[2] != 0 || request[3] != 0 || whole() < kHead + kLeast ||
          whole() > request.size())
        return false;
    }
    const auto length = static_cast<int>(std::exchange(client.size, 0));
    modbus_set_socket(context.get(), client.socket);
    const std::lock_guard lock(mutex);  // modbus_reply reads and writes the mapping
    return modbus_reply(context.get(), request.data(), length, mapping.get()) >= 0;
  }

  std::unique_ptr<modbus_t, decltype(&modbus_free)> context;
  std::unique_ptr<modbus_mapping_t, decltype(&modbus_mapping_free)> mapping;
  std::string path;
  int listener, wake;
  std::vector<Client> clients;
  std::mutex mutex;
  std::thread thread;
};

HandServer::HandServer(const modbus::Address& address) : impl_(std::make_unique<Impl>(address)) {}
HandServer::~HandServer() = default;

HandOutput HandServer::exchange(const HandInput& input) {
  const Registers shown = encode(input);
  Registers written{};
  const std::lock_guard lock(impl_->mutex);
  std::uint16_t* holding = impl_->mapping->tab_registers;
  std::copy_n(holding, kRegisters, written.begin());
  std::ranges::copy(shown, holding + kIndex);
  std::ranges::copy(shown, impl_->mapping->tab_input_registers);
  return decode_output(written);
}

}  // namespace mimesis::hw::sim
