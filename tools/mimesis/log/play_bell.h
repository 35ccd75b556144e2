#pragma once

namespace mimesis::tool {

/// Readable from `ring` until `clear`; any thread may ring.
class PlayBell {
 public:
  PlayBell();
  ~PlayBell();
  PlayBell(const PlayBell&) = delete;
  PlayBell& operator=(const PlayBell&) = delete;
  int fd() const { return fd_; }
  void ring();
  void clear();

 private:
  int fd_;
};

}  // namespace mimesis::tool
