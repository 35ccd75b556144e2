#pragma once
#include <memory>
#include <string>

#include "common/testing/process.h"

namespace mimesis::testing {

/// A host of a test: a network namespace that lives as long as this, with the address
/// 10.97.0.NUMBER and fd97::NUMBER (1 to 9), and wires (veth) to others. Needs root.
class NetHost {
 public:
  /// Empty, or why there are no network namespaces here.
  static std::string missing();

  /// @param own  a namespace of its own, else that of this process
  explicit NetHost(int number, bool own = true);
  bool made() const { return made_; }
  std::string address() const { return "10.97.0." + std::to_string(number_); }
  std::string address6() const { return "fd97::" + std::to_string(number_); }
  /// Empty, or why there is no wire.
  std::string wire(const NetHost& other);
  /// Runs a line of shell there; the shell is replaced by what it starts with `exec`.
  std::unique_ptr<Process> start(const std::string& line) const;

  /// Sends what is for another host to a station that is not there: it does not hear us, we hear
  /// it.
  bool mute(const NetHost& other) const;
  bool unmute(const NetHost& other) const;
  bool cut(const NetHost& other) const;
  bool up(const NetHost& other) const;

 private:
  std::string device(const NetHost& other) const { return "to" + std::to_string(other.number_); }
  bool runs(const std::string& line) const;

  int number_;
  std::unique_ptr<Process> keeper_;  ///< of a namespace
  pid_t pid_;                        ///< of a process in it
  bool made_ = false;
};

}  // namespace mimesis::testing
