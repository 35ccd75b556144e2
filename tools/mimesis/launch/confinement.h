#pragma once
#include <string>

#include "tools/mimesis/launch/fd.h"

namespace mimesis::launch {

/// Keeps a program from changing anything: for programs that a log names, with parameters that the
/// log holds. Files are read-only, but for those below one folder; there are no devices but
/// /dev/null, /dev/zero and /dev/urandom, no sockets but those that are open, no other process to
/// send signals to or to look into. By Landlock (files; Linux 5.13, in Debian 12 on by default) and
/// seccomp (sockets), because both need neither privileges nor a further program, which
/// bubblewrap is, and work in containers, where namespaces are often refused.
class Confinement {
 public:
  /// `writable`: a folder. @throws ConfigError if the kernel has no Landlock
  explicit Confinement(const std::string& writable);
  /// For the child, between fork and exec: async-signal-safe. False: errno says why.
  bool enter() const;

 private:
  Fd rules_;
};

}  // namespace mimesis::launch
