#pragma once
#include <string>
#include <vector>

namespace mimesis::tool {

enum class PlayKey { pause, step, back, forward, faster, slower, quit };

/// Takes the keys off the front of what a terminal sent; an unfinished escape sequence stays,
/// unknown keys are dropped.
std::vector<PlayKey> take_keys(std::string& typed);

/// While one lives, the terminal on standard input gives single keys without echo. It is restored
/// however the process ends, and while it is suspended. One per process.
class PlayKeys {
 public:
  PlayKeys();
  ~PlayKeys();
  PlayKeys(const PlayKeys&) = delete;
  PlayKeys& operator=(const PlayKeys&) = delete;

  /// Standard input; -1 if it is no terminal, belongs to another job now, or is at its end.
  int fd() const;
  std::vector<PlayKey> read();

 private:
  bool ours_ = false, gone_ = false;
  std::string typed_;
};

}  // namespace mimesis::tool
