#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/testing/temporary_folder.h"
#include "tools/mimesis/launch/process.h"

namespace mimesis::launch {
namespace {

using namespace std::chrono_literals;

class Confined : public ::testing::Test {
 protected:
  /// Exit code of a line of bash, 0 or not.
  int run(const std::string& line) {
    const Confinement confinement(own_);
    OwnProcess process({{"/bin/bash", "-c", line}, {}}, -1, &confinement);
    EXPECT_TRUE(process.wait(30s)) << line;
    return process.ending()->exit_code();
  }

  const testing::TemporaryFolder own_folder_, other_folder_;
  const std::string own_ = own_folder_.path(), other_ = other_folder_.path();
};

TEST_F(Confined, WritesToItsFolderAlone) {
  EXPECT_EQ(run("echo a > " + own_ + "/a && mkdir " + own_ + "/b && echo > /dev/null"), 0);
  EXPECT_EQ(run("read line < /etc/passwd && head -c1 /dev/urandom > /dev/null"), 0);
  for (const std::string& line :
       std::vector<std::string>{"echo a > " + other_ + "/a", "mkdir " + other_ + "/a",
                                "rm -r " + other_, "mv " + own_ + "/a " + other_ + "/a",
                                "ln -s /etc " + other_ + "/a", std::string("echo a > /a")}) {
    EXPECT_NE(run(line), 0) << line;
  }
  EXPECT_TRUE(std::filesystem::is_empty(other_));
}

/// Neither contents nor attributes, of which Landlock knows nothing.
TEST_F(Confined, LeavesFilesOfOthersAsTheyAre) {
  const std::string file = other_ + "/file";
  std::ofstream(file) << "content";
  const auto permissions = std::filesystem::status(file).permissions();
  const auto time = std::filesystem::last_write_time(file);
  for (const char* command : {"chmod 777 ", "chown 1 ", "touch -d 2000-01-01 ", "truncate -s 1 ",
                              ": > ", "rm ", "ln -f /etc/passwd "}) {
    EXPECT_NE(run(command + file), 0) << command;
  }
  EXPECT_EQ(std::filesystem::status(file).permissions(), permissions);
  EXPECT_EQ(std::filesystem::last_write_time(file), time);
  EXPECT_EQ(std::filesystem::file_size(file), 7U);
}

TEST_F(Confined, HasNoNetworkAndNoDevices) {
  EXPECT_NE(run("(exec 3<>/dev/tcp/127.0.0.1/9) 2> " + own_ + "/why"), 0);
  EXPECT_EQ(run("grep -q 'Permission denied' " + own_ + "/why"), 0);
  EXPECT_NE(run("head -c1 /dev/tty0 || head -c1 /dev/mem || head -c1 /dev/kmsg || ls /dev"), 0);
}

TEST_F(Confined, SendsNoSignals) { EXPECT_NE(run("kill -CONT " + std::to_string(getpid())), 0); }

}  // namespace
}  // namespace mimesis::launch
