#pragma once
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tools/mimesis/launch/process.h"

namespace mimesis::launch {

/// One ssh connection to each of some hosts, which further calls of ssh share (ControlMaster), in
/// sockets of a folder of this process that is removed at the end. A host for which the user's
/// configuration names a ControlPath is left to that.
class SshMasters {
 public:
  /// Begins to connect. @param folder  parent of its folder, for instance of graphs
  SshMasters(const std::vector<const Host*>& hosts, const std::string& folder);
  ~SshMasters();
  SshMasters(const SshMasters&) = delete;
  SshMasters& operator=(const SshMasters&) = delete;

  /// Options by which ssh uses the connection, once it stands; none: it uses one of its own.
  std::vector<std::string> options(const Host& host);
  /// Why there is no connection; empty: there is, or nobody has asked for one.
  std::string failure(const Host& host);

 private:
  struct Master {
    std::string socket;
    std::unique_ptr<OwnProcess> ssh;
  };
  /// Waits until it stands or has failed.
  Master* find(const Host& host);

  std::string folder_;
  std::map<std::string, Master> masters_;  ///< by target
};

}  // namespace mimesis::launch
