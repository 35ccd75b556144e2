#include "common/runtime/registry.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>

#include "common/testing/process.h"

namespace mimesis::runtime {
namespace {

using testing::TestGraph;

/// By its pidfd: what it left in the directory has not changed.
TEST(Registry, AKilledNodeIsKnownToBeDeadAtOnce) {
  const TestGraph graph;
  std::array<int, 2> ready{};
  ASSERT_EQ(pipe(ready.data()), 0);
  const pid_t child = fork();
  if (child == 0) {
    RegistryEntry entry(graph.directory(), "n");
    v1::NodeInfo info;
    info.set_name("n");
    info.set_start_id(1);
    info.set_pid(static_cast<std::uint32_t>(getpid()));
    entry.publish(info);
    if (write(ready[1], "!", 1) == 1) pause();
    _exit(1);
  }
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  Registry registry(graph.directory(), true);
  ASSERT_EQ(registry.poll().size(), 1U);
  pollfd death{registry.fd(), POLLIN, 0};
  EXPECT_EQ(poll(&death, 1, 0), 0) << "it lives";
  kill(child, SIGKILL);
  ASSERT_EQ(poll(&death, 1, 10'000), 1);
  const auto changes = registry.poll();
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_FALSE(changes[0].alive);
  EXPECT_EQ(poll(&death, 1, 0), 0) << "it is told once";
  waitpid(child, nullptr, 0);
  for (const int fd : ready) close(fd);
}

TEST(Registry, SkipsEntriesThatAreNoSmallFiles) {
  TestGraph graph;
  const std::string nodes = graph.directory() + "/nodes/";
  const RegistryEntry fifo(graph.directory(), "fifo"), large(graph.directory(), "large"),
      empty(graph.directory(), "empty");  // names are taken, as by a node that runs
  ASSERT_EQ(mkfifo((nodes + "fifo").c_str(), 0600), 0);
  ASSERT_EQ(mkfifo((nodes + ".lock").c_str(), 0600), 0);
  ASSERT_EQ(mkfifo((nodes + "lock").c_str(), 0600), 0);
  std::ofstream(nodes + "large").close();
  ASSERT_EQ(truncate((nodes + "large").c_str(), 1 << 30), 0);
  std::ofstream(nodes + "empty").close();
  std::ofstream(nodes + std::string(120, 'n')).close();
  ::testing::internal::CaptureStderr();
  for (int k = 0; k < 3; ++k) {
    Registry registry(graph.directory(), true);
    EXPECT_TRUE(registry.poll().empty());
    EXPECT_TRUE(registry.nodes().empty());
  }
  const std::string said = ::testing::internal::GetCapturedStderr();
  for (const std::string name : {"fifo", ".lock", "large", "empty"}) {
    const std::size_t at = said.find(nodes + name + ": expected");
    ASSERT_NE(at, std::string::npos) << name << ": " << said;
  }
  EXPECT_NE(said.find("a name that no node can have"), std::string::npos) << said;
  EXPECT_EQ(std::ranges::count(said, '\n'), 5) << "each is said once: " << said;
}

}  // namespace
}  // namespace mimesis::runtime
