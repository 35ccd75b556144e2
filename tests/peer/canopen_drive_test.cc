// The bridge's master and a drive that nobody here wrote the CANopen of: npm's `canopen`
// (canopen_drive.js) on a wire of lines, which needs no CAN in the kernel. The wall clock drives
// the peer, cycles of 5 ms the master. MIMESIS_TRANSCRIPT=FILE keeps all frames in candump's
// format.
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fstream>

#include "hw/cia402/canopen.h"
#include "hw/cia402/joint_driver.h"
#include "tests/peer/foreign.h"

namespace mimesis::hw::cia402 {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr int kNode = 3;

/// A child process whose standard input and output is a bus; its standard error are words.
class Peer {
 public:
  Peer() {
    int wire[2], words[2];
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, wire) != 0 || pipe(words) != 0) return;
    pid_ = fork();
    if (pid_ == 0) {
      dup2(wire[1], 0);
      dup2(wire[1], 1);
      dup2(words[1], 2);
      close(wire[0]);
      execlp("node", "node", MIMESIS_SOURCE_DIR "/tests/peer/canopen_drive.js",
             std::to_string(kNode).c_str(), nullptr);
      _exit(127);
    }
    close(wire[1]);
    close(words[1]);
    wire_ = wire[0];
    words_ = words[0];
    fcntl(wire_, F_SETFL, O_NONBLOCK);
    fcntl(words_, F_SETFL, O_NONBLOCK);
  }
  ~Peer() {
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    close(wire_);
    close(words_);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  void tell(const std::string& line) {
    const std::string text = line + "\n";
    if (write(wire_, text.data(), text.size()) != static_cast<ssize_t>(text.size())) lost_ = errno;
  }
  int lost() const { return lost_; }  ///< errno of a write that failed
  int wire() const { return wire_; }
  /// What it has said since its start: "ready enabled ...".
  const std::string& words() {
    char buffer[4096];
    for (ssize_t n; (n = read(words_, buffer, sizeof(buffer))) > 0;)
      words_said_.append(buffer, static_cast<std::size_t>(n));
    return words_said_;
  }
  bool said(const std::string& word, std::size_t from = 0) {
    return words().find(word + "\n", from) != std::string::npos;
  }

 private:
  pid_t pid_ = -1;
  int wire_ = -1, words_ = -1, lost_ = 0;
  std::string words_said_;
};

std::string line_of(const can::Frame& f) {
  std::string line = fmt::format("{:03X}#", f.id);
  for (int i = 0; i < f.length; ++i)
    line += fmt::format("{:02X}", f.data[static_cast<std::size_t>(i)]);
  return line;
}

class WireOfLines final : public can::Bus {
 public:
  explicit WireOfLines(Peer& peer) : peer_(peer) {
    if (const char* file = std::getenv("MIMESIS_TRANSCRIPT")) transcript_.open(file, std::ios::app);
  }
  void send(std::span<const can::Frame> frames) override {
    for (const can::Frame& f : frames) {
      peer_.tell(line_of(f));
      keep(line_of(f), "bridge");
    }
  }
  std::size_t receive(std::span<can::Frame> frames) override {
    char buffer[4096];
    for (ssize_t n; (n = read(peer_.wire(), buffer, sizeof(buffer))) > 0;)
      text_.append(buffer, static_cast<std::size_t>(n));
    std::size_t filled = 0;
    for (std::size_t end;
         filled < frames.size() && (end = text_.find('\n')) != std::string::npos;) {
      const std::string line = text_.substr(0, end);
      text_.erase(0, end + 1);
      can::Frame f{.id = static_cast<std::uint32_t>(std::stoul(line.substr(0, 3), nullptr, 16))};
      for (std::size_t i = 4; i + 1 < line.size(); i += 2)
        f.data[f.length++] = static_cast<std::uint8_t>(std::stoul(line.substr(i, 2), nullptr, 16));
      keep(line_of(f), "peer");
      frames[filled++] = f;
    }
    return filled;
  }

 private:
  void keep(const std::string& line, const char* whose) {
    if (!transcript_.is_open()) return;
    const std::chrono::duration<double> t = Clock::now() - begin_;
    transcript_ << fmt::format("({:017.6f}) {} {}\n", t.count(), whose, line);
  }
  Peer& peer_;
  std::string text_;
  std::ofstream transcript_;
  Clock::time_point begin_ = Clock::now();
};

class CanopenPeer : public peer::Foreign {
 protected:
  void SetUp() override {
    Foreign::SetUp();
    if (IsSkipped()) return;
    signal(SIGPIPE, SIG_IGN);
    slave.emplace();
  }
  void connect() {
    const auto one = [](double x) { return Eigen::VectorXd::Constant(1, x); };
    // Patience: the machine may be busy.
    driver.emplace(
        JointDriverOptions{
            .axes = {{.node_id = kNode, .sign = -1}},
            .limits = {.q_min = one(-1), .q_max = one(1), .v_max = one(0.5), .a_max = one(2)},
            .boot_timeout_s = 20.0,
            .feedback_timeout_s = 0.2},
        std::make_unique<WireOfLines>(*slave));
  }
  /// Cycles until `done`; false after 20 s of the wall clock.
  template <class Done>
  bool until(Mode mode, const Done& done) {
    const Clock::time_point give_up = Clock::now() + 20s;
    while (!done()) {
      if (Clock::now() > give_up) return false;
      const std::array q{target};
      driver->read(now);
      driver->write(now, {.mode = mode, .position_rad = q});
      now += 5ms;
      next = std::max(next + 5ms, Clock::now());
      while (Clock::now() < next) poll(nullptr, 0, 1);
    }
    return true;
  }
  bool reaches(Mode mode, Phase phase) {
    return until(mode, [&] { return driver->reading().phase == phase; });
  }
  const JointReading& joint() { return driver->reading().joints[0]; }
  const std::string& reason() { return driver->reading().reason; }

  std::optional<Peer> slave;
  std::optional<JointDriver> driver;
  double target = 0.0;
  Time now = 1s;
  Clock::time_point next = Clock::now();
};

TEST_F(CanopenPeer, BootsIsEnabledMovesFaultsIsResetAndIsLost) {
  connect();
  ASSERT_TRUE(reaches(Mode::idle, Phase::idle)) << reason();
  ASSERT_TRUE(until(Mode::idle, [&] { return driver->reading().posture_known; }));
  EXPECT_NEAR(joint().position_rad, -0.1, 1e-5) << "16000 increments, counted against the joint";
  ASSERT_EQ(driver->notes().size(), 1u);
  EXPECT_NE(
      driver->notes()[0].find("1400:05 (watch over our set-points): sub-index does not exist"),
      std::string::npos)
      << driver->notes()[0];

  target = joint().position_rad;
  ASSERT_TRUE(reaches(Mode::follow, Phase::following)) << reason();
  EXPECT_EQ(slave->words(), "ready\nswitched on\nenabled\n");
  target = 0.05;
  ASSERT_TRUE(until(Mode::follow, [&] { return std::abs(joint().position_rad - 0.05) < 1e-4; }));

  slave->tell("fault");
  ASSERT_TRUE(reaches(Mode::follow, Phase::fault));
  ASSERT_TRUE(until(Mode::idle, [&] { return joint().drive == DriveState::fault; }));
  EXPECT_EQ(reason(),
            "A1 (node 3): expected operation enabled, is fault (statusword 0x0218): "
            "continuous over-current (0x2310)");
  target = joint().position_rad;
  const std::size_t before = slave->words().size();
  EXPECT_EQ(driver->reset_faults(), "");
  ASSERT_TRUE(reaches(Mode::idle, Phase::idle)) << reason();
  ASSERT_TRUE(reaches(Mode::follow, Phase::following)) << reason();
  EXPECT_EQ(slave->words().substr(before), "disabled\nready\nswitched on\nenabled\n");

  const std::size_t muted = slave->words().size();
  slave->tell("mute");
  ASSERT_TRUE(reaches(Mode::follow, Phase::fault));
  // On a busy machine a step may see both at once.
  EXPECT_TRUE(reason() == "A1 (node 3): no feedback for 0.2 s" ||
              reason() == "A1 (node 3): no heartbeat for 0.25 s")
      << reason();
  EXPECT_TRUE(until(Mode::follow, [&] { return slave->said("quick stop", muted - 1); }))
      << "by its own consumer of our heartbeat: " << slave->words();
  slave->tell("hear");
  ASSERT_TRUE(reaches(Mode::idle, Phase::idle)) << reason();
  ASSERT_TRUE(until(Mode::idle, [&] { return driver->reading().posture_known; }));
  target = joint().position_rad;
  ASSERT_TRUE(reaches(Mode::follow, Phase::following)) << reason();

  const std::size_t alone = slave->words().size();
  driver.reset();  // the bridge dies
  const Clock::time_point died = Clock::now();
  while (!slave->said("quick stop", alone - 1) && Clock::now() < died + 20s) poll(nullptr, 0, 1);
  EXPECT_TRUE(slave->said("master lost", alone - 1));
  EXPECT_TRUE(slave->said("quick stop", alone - 1)) << slave->words();
  RecordProperty("stopped_ms", static_cast<int>((Clock::now() - died) / 1ms));
}

TEST_F(CanopenPeer, SegmentedTransfersBothWays) {
  WireOfLines bus(*slave);
  const auto run = [&](SdoTransfer transfer) {
    bus.send(std::array{transfer.first()});
    const Clock::time_point give_up = Clock::now() + 20s;
    while (!transfer.done() && Clock::now() < give_up) {
      std::array<can::Frame, 16> frames;
      const std::size_t count = bus.receive(frames);
      for (const can::Frame& f : std::span(frames).first(count)) {
        if (const auto answer = transfer.handle(f)) bus.send(std::array{*answer});
      }
      poll(nullptr, 0, 1);
    }
    EXPECT_TRUE(transfer.done());
    return transfer;
  };
  const auto text = [](const std::vector<std::uint8_t>& d) {
    return std::string(d.begin(), d.end());
  };
  EXPECT_EQ(text(run(SdoTransfer::upload(kNode, {0x1008, 0})).data()),
            "a drive on canopen from npm");
  const std::string name = "an axis with a long name";
  EXPECT_EQ(run(SdoTransfer::download(kNode, {0x2000, 0}, {name.begin(), name.end()})).failure(),
            "");
  EXPECT_EQ(text(run(SdoTransfer::upload(kNode, {0x2000, 0})).data()), name);
  EXPECT_EQ(run(SdoTransfer::upload(kNode, {0x1009, 0})).failure(),
            "object does not exist (0x06020000)");
  EXPECT_EQ(run(SdoTransfer::download(kNode, {0x6041, 0}, {1, 2})).failure(),
            "object is read-only (0x06010002)");
}

}  // namespace
}  // namespace mimesis::hw::cia402
