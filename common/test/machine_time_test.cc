#include "common/machine_time.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <stop_token>
#include <thread>
#include <vector>

namespace mimesis {
namespace {

using namespace std::chrono_literals;

TEST(MachineTime, PassesSlowerWhileMoreTasksWantToRunThanThereAreProcessors) {
  EXPECT_GT(processor_share(), 0.0);
  EXPECT_LE(processor_share(), 1.0);

  std::vector<std::jthread> busy;
  for (unsigned i = 0; i < 4 * std::max(1u, std::thread::hardware_concurrency()); ++i) {
    busy.emplace_back([](const std::stop_token& end) {
      while (!end.stop_requested()) {
      }
    });
  }
  auto begin = std::chrono::steady_clock::now();
  while (processor_share() > 0.3) {  // until all of them run
    ASSERT_LT(std::chrono::steady_clock::now() - begin, 20s);
    std::this_thread::yield();
  }
  begin = std::chrono::steady_clock::now();
  MachineTime time;
  auto wall = 0ns;
  auto passed = 0ns;
  while (passed < 20ms) {
    passed = time.passed();
    wall = std::chrono::steady_clock::now() - begin;
    ASSERT_LE(passed, wall);
    ASSERT_LT(wall, 20s) << "it does not stand";
  }
  EXPECT_GE(wall, 2 * passed);
}

}  // namespace
}  // namespace mimesis
