#include <gtest/gtest.h>
#include <sys/mman.h>

#include <thread>

#include "tools/mimesis/launch/process.h"

namespace mimesis::launch {
namespace {

TEST(Granted, WhatWasAskedForIsReadBack) {
  const Command sleep{{"/bin/sleep", "10"}, {}};
  Sched sched;
  sched.cpus = {0};
  const Child child = spawn(sleep, sched);
  EXPECT_EQ(not_granted(child.pid, sched, false), "");
  sched.cpus = {0, 63};
  EXPECT_EQ(not_granted(child.pid, sched, false), "sched.cpus: expected 0, 63, the system gave 0");
  sched.cpus.clear();
  sched.policy = "fifo";
  sched.priority = 20;
  EXPECT_EQ(not_granted(child.pid, sched, false),
            "sched.policy: expected fifo 20, the system gave other 0");
  sched.policy = "other";
  sched.mlock = true;
  EXPECT_EQ(not_granted(child.pid, sched, false), "");  // it has not had the time
  EXPECT_EQ(not_granted(child.pid, sched, true),
            "sched.mlock: expected locked memory, the system says VmLck 0 kB");
  child.send(SIGKILL);
}

// Linux leaves out CPUs that are not there without an error.
TEST(Granted, ACpuThatIsNotThereIsNoticed) {
  Sched sched;
  sched.cpus = {0, 1000};
  const Child child = spawn({{"/bin/sleep", "10"}, {}}, sched);
  EXPECT_EQ(not_granted(child.pid, sched, false),
            "sched.cpus: expected 0, 1000, the system gave 0");
  child.send(SIGKILL);
}

TEST(Granted, RealTimePriorityOfRoot) {
  if (geteuid() != 0) GTEST_SKIP() << "not here: needs root";
  Sched sched;
  sched.policy = "rr";
  sched.priority = 7;
  const Child child = spawn({{"/bin/sleep", "10"}, {}}, sched);
  EXPECT_EQ(not_granted(child.pid, sched, false), "");
  sched.priority = 8;
  EXPECT_EQ(not_granted(child.pid, sched, false),
            "sched.policy: expected rr 8, the system gave rr 7");
  child.send(SIGKILL);
}

TEST(Granted, LooksAtEveryThread) {
  cpu_set_t all;
  ASSERT_EQ(sched_getaffinity(0, sizeof all, &all), 0);
  if (CPU_COUNT(&all) < 2) GTEST_SKIP() << "not here: needs two CPUs";
  Sched sched;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &all)) sched.cpus.push_back(cpu);
  }
  EXPECT_EQ(not_granted(getpid(), sched, false), "");
  std::jthread other([&](const std::stop_token& stop) {
    pthread_setname_np(pthread_self(), "other");
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(static_cast<std::size_t>(sched.cpus[0]), &one);
    sched_setaffinity(0, sizeof one, &one);
    while (!stop.stop_requested()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  std::string lacks;
  for (int n = 0; n < 5000 && lacks.empty(); ++n) {
    lacks = not_granted(getpid(), sched, false);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_TRUE(lacks.ends_with(" (its thread 'other')")) << lacks;
}

}  // namespace
}  // namespace mimesis::launch
