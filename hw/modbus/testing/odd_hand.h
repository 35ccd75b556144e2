#pragma once
#include <sys/socket.h>
#include <unistd.h>

#include <string>
#include <thread>
#include <utility>

#include "hw/modbus/stream.h"

namespace mimesis::hw::modbus {

/// A hand that answers whatever it likes: listens, reads, and gives `answer`.
class OddHand {
 public:
  OddHand(const Address& address, std::string answer)
      : listener_(listen(address)), answer_(std::move(answer)), thread_([this] { serve(); }) {}
  ~OddHand() {
    shutdown(listener_, SHUT_RDWR);
    thread_.join();
    close(listener_);
  }

 private:
  void serve() {
    for (int client; (client = accept(listener_, nullptr, nullptr)) >= 0; close(client)) {
      char request[300];
      while (recv(client, request, sizeof(request), 0) > 0 &&
             send(client, answer_.data(), answer_.size(), MSG_NOSIGNAL) >= 0) {
      }
    }
  }
  int listener_;
  std::string answer_;
  std::thread thread_;
};

}  // namespace mimesis::hw::modbus
