#include "hw/sim/hand/hand.h"

#include <modbus/modbus.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <thread>
#include <vector>

namespace mimesis::hw::sim {
namespace {

using modbus::Contact;
using modbus::HandOutput;
using modbus::Initialisation;
using modbus::Motion;

constexpr double kSlowest = 0.2;             // share of full speed at register 0
constexpr std::uint8_t kNotActivated = 0x7;  // fault codes of the hand
constexpr double kGripCurrent = 100.0;       // at full force, in tenths of mA

using modbus::kInputAddress;
using modbus::kOutputAddress;
using modbus::kRegisters;
using modbus::Registers;

constexpr std::size_t kMostClients = 8;
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
      : context(modbus_new_tcp(nullptr, 0), &modbus_free),
        // Holding registers from the output to the end of the input, the input also as input
        // registers.
        mapping(modbus_mapping_new_start_address(0, 0, 0, 0, kOutputAddress, kIndex + kRegisters,
                                                 kInputAddress, kRegisters),
                &modbus_mapping_free),
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

  std::unique_ptr<modbus_t, decltype(&modbus_free)> context;
  std::unique_ptr<modbus_mapping_t, decltype(&modbus_mapping_free)> mapping;
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
