#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hw/actuators.h"
#include "hw/bridge/command_track.h"

namespace mimesis::hw::bridge {

struct GateLimits {
  Time hold_after{};   ///< older: come to rest, powered
  Time brake_after{};  ///< the same, where the last command told its path; `hold_after` if less
  Time silence{};      ///< older: the stream has ended
  double start_tolerance_rad =
      0.0;                ///< largest distance of a stream's start from the actual posture
  double jump_rad = 0.0;  ///< largest jump beyond what v_max explains
  std::vector<double> v_max_rad_s;   ///< one per joint
  std::vector<double> a_max_rad_s2;  ///< one per joint
  std::vector<std::string> names{};  ///< names of the joints, for reasons; empty: A1, A2 ...
  bool hold_on_silence = false;      ///< instead of a quick stop: come to rest, powered
  Time cycle = std::chrono::milliseconds(5);  ///< period of `decide`
  int extrapolated_cycles = 0;  ///< that may be left out: the drives go on at their rate
  bool enables_itself = true;   ///< else no stream is obeyed before enable()
};

/// Decides in every cycle whether the stream of commands is obeyed. A stream needs enabled joints
/// and starts with a command at the actual posture; it ends by silence. A fault, an emergency stop
/// and disable() disable them. Late or silent commands stop the arm: on its path, if the last
/// command said how it goes on, else joint by joint. After a fault only a new stream counts: one
/// that comes after silence. Pure: knows graph time as argument.
class CommandGate {
 public:
  explicit CommandGate(GateLimits limits);

  /// A command that has arrived. One that is older than `silence` or stamped more than `hold_after`
  /// ahead of `now` is refused. Both times are those of the graph, since its start. `ahead`: see
  /// CommandTrack.
  /// @return empty, or why it is refused: one line
  std::string offer(Time now, Time stamp, std::span<const double> position_rad, const Reading& arm,
                    std::span<const double> ahead = {});

  /// Streams are obeyed from now on. @return empty, or why not: axis, state, statusword
  std::string enable(const Reading& arm);
  bool enabled() const { return enabled_; }
  /// Quick stop; no stream is obeyed until enable().
  void disable(const std::string& why);
  /// Quick stop; nothing is obeyed until release(), then enable().
  void emergency_stop(const std::string& why);
  bool stopped() const { return !emergency_.empty(); }
  /// Ends an emergency stop; the joints stay where they are.
  void release();

  /// Set-point of this cycle; valid until the next call of either function.
  Setpoint decide(Time now, const Reading& arm);

  /// Why the arm is not following, or empty.
  const std::string& reason() const { return reason_; }

 private:
  std::string name_of(std::size_t joint) const;
  void close(const std::string& why);
  std::string why_not(Time now, Time stamp, std::span<const double> position_rad,
                      const Reading& arm, std::span<const double> ahead) const;
  bool runs_wild(std::span<const double> position_rad, std::span<const double> ahead) const;
  int missed(Time now);
  Setpoint follow(int missed, bool brake);

  static constexpr Time kLongestStop =
      std::chrono::milliseconds(200);  // on the path, after silence
  GateLimits limits_;
  std::vector<double> command_;  // accepted last
  CommandTrack track_;           // all accepted ones
  Time accepted_{};              // its stamp
  Time heard_{};                 // stamp of any command, also refused ones
  std::optional<Time> decided_;  // last
  bool open_ = false;
  bool ending_ = false;  // silent: comes to rest on its path
  bool needs_silence_ = false;
  bool enabled_;
  std::string emergency_;   // why; empty: none
  Mode rest_ = Mode::idle;  // without a stream
  std::string reason_;
};

}  // namespace mimesis::hw::bridge
