#include "common/parallel/team.h"

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/error.h"

namespace mimesis::parallel {

struct Team::Shared {
  std::mutex mutex;
  std::condition_variable wake, done;
  std::vector<std::thread> helpers;
  Call call = nullptr;
  const void* task = nullptr;
  int count = 0;
  int working = 0;         // helpers that have not left the loop
  unsigned long loop = 0;  // counts the loops
  bool stop = false;
  std::atomic<int> next{0};  // task

  void take_tasks() {
    for (int i = next.fetch_add(1); i < count; i = next.fetch_add(1)) call(task, i);
  }

  void help() {
    unsigned long seen = 0;
    std::unique_lock lock(mutex);
    for (;;) {
      wake.wait(lock, [&] { return stop || loop != seen; });
      if (stop) return;
      seen = loop;
      lock.unlock();
      take_tasks();
      lock.lock();
      if (--working == 0) done.notify_one();
    }
  }
};

Team::Team(int threads) : shared_(std::make_unique<Shared>()) {
  if (threads < 1) throw ConfigError("a team of " + std::to_string(threads) + " threads");
  for (int i = 1; i < threads; ++i) {
    shared_->helpers.emplace_back([s = shared_.get()] { s->help(); });
  }
}

Team::~Team() {
  {
    const std::scoped_lock lock(shared_->mutex);
    shared_->stop = true;
  }
  shared_->wake.notify_all();
  for (std::thread& t : shared_->helpers) t.join();
}

int Team::threads() const { return static_cast<int>(shared_->helpers.size()) + 1; }

void Team::run_any(int count, Call call, const void* task) {
  Shared& s = *shared_;
  {
    const std::scoped_lock lock(s.mutex);
    s.call = call;
    s.task = task;
    s.count = count;
    s.next = 0;
    s.working = static_cast<int>(s.helpers.size());
    ++s.loop;
  }
  s.wake.notify_all();
  s.take_tasks();
  std::unique_lock lock(s.mutex);
  s.done.wait(lock, [&] { return s.working == 0; });
}

}  // namespace mimesis::parallel
