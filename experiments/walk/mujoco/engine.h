#pragma once
#include <sys/types.h>

#include <span>
#include <string>
#include <vector>

namespace mimesis::walk {

/// Where npm's package of MuJoCo is: in NODE_PATH, else where `cmake --build build --target peers`
/// puts it. Empty: nowhere.
std::string mujoco_package();

/// MuJoCo in a process of its own: engine.mjs, which says what goes to and fro.
class MujocoEngine {
 public:
  /// @throws ConfigError without package or node, std::runtime_error if MuJoCo refuses the model
  explicit MujocoEngine(const std::string& xml);
  ~MujocoEngine();
  MujocoEngine(const MujocoEngine&) = delete;
  MujocoEngine& operator=(const MujocoEngine&) = delete;

  /// One row of wishes a step. @return one row of measures a step and one of the state after them,
  /// valid until the next call
  std::span<const double> step(std::span<const double> wishes, int steps);
  /// The first row of measures, before any step.
  std::span<const double> start() const { return start_; }

 private:
  void send(const void* data, std::size_t bytes);
  void receive(std::span<double> numbers);

  int socket_ = -1;
  pid_t child_ = -1;
  std::vector<double> start_, rows_;
};

}  // namespace mimesis::walk
