#pragma once
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "tools/mimesis/launch/process.h"

namespace mimesis::launch {

/// Protobuf messages through a pair of pipes, each behind its length in 4 bytes. Never blocks.
class HostLink {
 public:
  static constexpr std::string_view kHello = "mimesis-host 1\n";

  HostLink() = default;
  HostLink(Fd in, Fd out) : in_(std::move(in)), out_(std::move(out)) {
    for (const Fd* fd : {&in_, &out_}) fcntl(fd->get(), F_SETFL, O_NONBLOCK);
  }

  void put_raw(std::string_view bytes) { waiting_ += bytes; }
  template <class M>
  void put(const M& message) {
    const std::string body = message.SerializeAsString();
    const auto size = static_cast<std::uint32_t>(body.size());
    put_raw({reinterpret_cast<const char*>(&size), sizeof size});
    put_raw(body);
  }
  std::size_t waiting() const { return waiting_.size(); }
  /// Sends and receives what is possible now. False once the other end is gone.
  bool move() {
    while (!waiting_.empty()) {
      const ssize_t n = write(out_.get(), waiting_.data(), waiting_.size());
      if (n < 0 && errno != EAGAIN && errno != EINTR) return false;
      if (n <= 0) break;
      waiting_.erase(0, static_cast<std::size_t>(n));
    }
    std::array<char, 65536> bytes;
    for (;;) {
      const ssize_t n = read(in_.get(), bytes.data(), bytes.size());
      if (n > 0) arrived_.append(bytes.data(), static_cast<std::size_t>(n));
      if (n == static_cast<ssize_t>(bytes.size())) continue;
      return n > 0 || (n < 0 && (errno == EAGAIN || errno == EINTR));
    }
  }
  /// Removes the greeting and what a login script has said before it; false: it has not come yet.
  bool greeted() {
    const std::size_t at = arrived_.find(kHello);
    if (at == std::string::npos) return false;
    arrived_.erase(0, at + kHello.size());
    return true;
  }
  template <class M>
  std::optional<M> take() {
    std::uint32_t size = 0;
    if (arrived_.size() < sizeof size) return std::nullopt;
    std::memcpy(&size, arrived_.data(), sizeof size);
    if (arrived_.size() < sizeof size + size) return std::nullopt;
    M message;
    const bool whole =
        message.ParseFromArray(arrived_.data() + sizeof size, static_cast<int>(size));
    arrived_.erase(0, sizeof size + size);
    return whole ? std::optional(std::move(message)) : std::nullopt;
  }
  int in() const { return in_.get(); }
  int out() const { return out_.get(); }

 private:
  Fd in_, out_;
  std::string arrived_, waiting_;
};

}  // namespace mimesis::launch
