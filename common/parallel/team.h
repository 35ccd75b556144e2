#pragma once
#include <memory>

namespace mimesis::parallel {

/// Threads that share the tasks of a loop. They are started once and sleep between loops; a loop
/// does not allocate. Which thread runs which task is open: results must not depend on it.
class Team {
 public:
  /// @param threads  at least 1; the caller of `run` is one of them
  /// @throws ConfigError for fewer
  explicit Team(int threads);
  ~Team();
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;

  int threads() const;

  /// Calls task(0) ... task(count − 1), each once, and returns when all have returned. The task
  /// must not throw. One loop at a time.
  template <class F>
  void run(int count, const F& task) {
    run_any(
        count, [](const void* f, int i) { (*static_cast<const F*>(f))(i); }, &task);
  }

 private:
  using Call = void (*)(const void* task, int i);
  void run_any(int count, Call call, const void* task);

  struct Shared;
  std::unique_ptr<Shared> shared_;
};

/// Runs the loop on the caller's thread if there is no team.
template <class F>
void for_each(Team* team, int count, const F& task) {
  if (team != nullptr && count > 1) {
    team->run(count, task);
  } else {
    for (int i = 0; i < count; ++i) task(i);
  }
}

}  // namespace mimesis::parallel
