#include "experiments/walk/mujoco/engine.h"

#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "common/error.h"

namespace mimesis::walk {

std::string mujoco_package() {
  const char* node_path = std::getenv("NODE_PATH");
  for (const char* modules : {node_path, MIMESIS_PEER_MODULES}) {
    if (modules == nullptr) continue;
    const std::string file = std::string(modules) + "/@mujoco/mujoco/mujoco.js";
    if (std::filesystem::is_regular_file(file)) return file;
  }
  return {};
}

MujocoEngine::MujocoEngine(const std::string& xml) {
  const std::string package = mujoco_package();
  if (package.empty()) {
    throw ConfigError("no MuJoCo: `cmake --build build --target peers` fetches it from npm");
  }
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    throw std::runtime_error(std::string("MuJoCo: no socket: ") + std::strerror(errno));
  }
  socket_ = ends[0];
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  const char* arguments[] = {"node", MIMESIS_MUJOCO_SCRIPT, package.c_str(), nullptr};
  const int failed =
      posix_spawnp(&child_, "node", &actions, nullptr, const_cast<char**>(arguments), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  if (failed != 0) {
    ::close(socket_);
    throw ConfigError(std::string("no MuJoCo: node did not start: ") + std::strerror(failed));
  }
  const auto bytes = static_cast<double>(xml.size());
  send(&bytes, sizeof bytes);
  send(xml.data(), xml.size());
  double width = 0.0;
  receive({&width, 1});
  start_.resize(static_cast<std::size_t>(width));
  receive(start_);
}

MujocoEngine::~MujocoEngine() {
  ::close(socket_);  // it ends when nobody is at the other end
  while (::waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

std::span<const double> MujocoEngine::step(std::span<const double> wishes, int steps) {
  const double count = steps;
  send(&count, sizeof count);
  send(wishes.data(), wishes.size_bytes());
  rows_.resize(static_cast<std::size_t>(steps + 1) * start_.size());
  receive(rows_);
  return rows_;
}

void MujocoEngine::send(const void* data, std::size_t bytes) {
  const auto* at = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t n = ::send(socket_, at, bytes, MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) throw std::runtime_error("MuJoCo ended; what it said is above");
    at += n;
    bytes -= static_cast<std::size_t>(n);
  }
}

void MujocoEngine::receive(std::span<double> numbers) {
  auto* at = reinterpret_cast<char*>(numbers.data());
  for (std::size_t bytes = numbers.size_bytes(); bytes > 0;) {
    const ssize_t n = ::recv(socket_, at, bytes, 0);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) throw std::runtime_error("MuJoCo ended; what it said is above");
    at += n;
    bytes -= static_cast<std::size_t>(n);
  }
}

}  // namespace mimesis::walk
