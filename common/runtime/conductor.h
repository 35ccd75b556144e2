#pragma once
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/time.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {

/// Due times base + offset + k/rate, k = 0, 1, ...: rounded each for itself, so that they do not
/// drift.
class Schedule {
 public:
  Schedule(double rate_hz, double offset_s, Time base)
      : period_ns_(1e9 / rate_hz), first_(base + from_seconds(offset_s)) {}

  Time due() const { return at(k_); }
  void advance() { ++k_; }
  /// Goes on to the first due time after `now`; the number of due times left out.
  std::int64_t skip_past(Time now) {
    const std::int64_t before = k_;
    const double periods = static_cast<double>((now - first_).count()) / period_ns_;
    if (const auto k = static_cast<std::int64_t>(periods); k > k_) k_ = k;
    while (due() <= now) ++k_;
    return k_ - before;
  }

 private:
  Time at(std::int64_t k) const {
    return first_ + Time(std::llround(static_cast<double>(k) * period_ns_));
  }

  double period_ns_;
  Time first_;
  std::int64_t k_ = 0;
};

/// Decides in lock-step which node steps when, and which messages the step sees. Time stands still
/// until every participant has joined; then it advances to the earliest due time, all nodes due
/// then step in parallel, and only when all have reported does it go on. Messages published at time
/// t are visible to steps after t, in the order (t, name of the publisher, publication): a function
/// of the nodes alone, whatever the machine's speed. Pure: no sockets, no clock.
class Conductor {
 public:
  /// @param participants  names of the nodes without which time does not begin
  /// @param until         last time of a step; later than any due time: no end
  Conductor(std::vector<std::string> participants, Time until)
      : awaited_(participants.begin(), participants.end()),
        named_(!awaited_.empty()),
        until_(until) {}

  struct Go {
    std::uint64_t start_id = 0;  ///< id of the node it is for
    v1::StepGo message;
  };

  /// A node joins; it takes part from the next `advance` on.
  /// @return empty, or why it is refused
  std::string join(const v1::LockstepJoin& join) {
    const auto between = [](double x, double low, double high) { return x >= low && x <= high; };
    if (!between(join.rate_hz(), 1.0 / kLongest_s, kFastest_hz)) {
      return fmt::format("its rate is {} Hz, expected {} to {}", join.rate_hz(), 1.0 / kLongest_s,
                         kFastest_hz);
    }
    if (!between(join.offset_s(), 0.0, kLongest_s))
      return fmt::format("its offset is {} s, expected 0 to {}", join.offset_s(), kLongest_s);
    if (join.resume_ns() > kLatest_ns)
      return fmt::format("it resumes at {} ns, expected at most {}", join.resume_ns(), kLatest_ns);
    const auto resume = Time(static_cast<std::int64_t>(join.resume_ns()));
    if (!begun_ && resume > time_ && named_ && !awaited_.contains(join.node())) {
      return fmt::format("it resumes at {} s, but is no participant: time begins without it",
                         to_seconds(resume));
    }
    if (!all_of(join.published(), join.start_id())) return "it reports messages of another node";
    const bool taken = members_.contains(join.start_id()) || joining_.contains(join.node()) ||
                       std::ranges::any_of(
                           members_, [&](const auto& m) { return m.second.name == join.node(); }) ||
                       std::ranges::any_of(joining_, [&](const auto& j) {
                         return j.second.start_id() == join.start_id();
                       });
    if (taken) return "a node with its name or start id takes part already";
    joining_[join.node()] = join;
    awaited_.erase(join.node());
    if (!begun_) time_ = std::max(time_, resume);
    return {};
  }
  /// A node has gone: the conductor no longer waits for it.
  void leave(std::uint64_t start_id) {
    std::erase_if(joining_, [&](const auto& entry) { return entry.second.start_id() == start_id; });
    std::erase_if(latched_, [&](const auto& entry) { return entry.first.second == start_id; });
    members_.erase(start_id);
  }
  enum class Reported {
    done,
    foreign,  ///< it names messages of another node: nothing is done
    hurried,  ///< done; for the first time the node asks for more steps than are given
  };
  /// A step is done.
  Reported report(std::uint64_t start_id, const v1::StepReport& report) {
    if (!all_of(report.published(), start_id)) return Reported::foreign;
    const auto it = members_.find(start_id);
    if (it == members_.end() || !it->second.stepping) return Reported::done;
    Member& member = it->second;
    member.stepping = false;
    reported_[member.name] = report.published();
    if (report.next_ns() == 0) return Reported::done;
    // Steps that are asked for cost kShortest each, and no more than kBurst is on credit.
    member.paid = std::max(member.paid, time_) + kShortest;
    const Time asked = std::max(
        Time(static_cast<std::int64_t>(std::min(report.next_ns(), kLatest_ns))), time_ + Time(1));
    member.next = std::max(asked, member.paid - kBurst);
    return *member.next > asked && !std::exchange(member.hurried, true) ? Reported::hurried
                                                                        : Reported::done;
  }

  /// The next steps; none while a step is running, a participant is missing or there is no
  /// participant.
  std::vector<Go> advance() {
    const auto stepping = [](const auto& entry) { return entry.second.stepping; };
    if (ended_ || !awaited_.empty() || std::any_of(members_.begin(), members_.end(), stepping))
      return {};
    for (const auto& [name, published] : reported_) distribute(published);
    reported_.clear();
    admit();
    if (members_.empty()) return {};
    begun_ = true;

    const auto earlier = [](const auto& a, const auto& b) {
      return a.second.due() < b.second.due();
    };
    const Time due = std::min_element(members_.begin(), members_.end(), earlier)->second.due();
    ended_ = due > until_;
    if (!ended_) time_ = due;
    std::vector<Go> gos;
    for (auto& [start_id, member] : members_) {
      if (!ended_ && member.due() != due) continue;
      Go& go = gos.emplace_back();
      go.start_id = start_id;
      go.message.set_time_ns(static_cast<std::uint64_t>(time_.count()));
      go.message.set_generation(generation_);
      go.message.set_ended(ended_);
      go.message.mutable_visible()->Swap(&member.pending);
      member.pending.Clear();
      if (std::exchange(member.next, std::nullopt)) {
        member.schedule.skip_past(time_);
      } else {
        member.schedule.advance();
      }
      member.stepping = true;
    }
    return gos;
  }

  Time time() const { return time_; }  ///< time of the steps last released
  bool ended() const { return ended_; }
  /// True if time waits for this node's report.
  bool awaits(std::uint64_t start_id) const {
    const auto it = members_.find(start_id);
    return it != members_.end() && it->second.stepping;
  }

 private:
  static constexpr double kFastest_hz = 1e5, kLongest_s = 1e6;
  static constexpr Time kShortest = std::chrono::microseconds(10);  // 1 / kFastest_hz
  static constexpr Time kBurst = std::chrono::milliseconds(100);
  static constexpr std::uint64_t kLatest_ns = 1'000'000'000'000'000'000;  // far from an overflow

  using Published = google::protobuf::RepeatedPtrField<v1::Publication>;
  static bool all_of(const Published& published, std::uint64_t start_id) {
    return std::ranges::all_of(published,
                               [start_id](const auto& p) { return p.start_id() == start_id; });
  }
  struct Member {
    std::string name;
    Schedule schedule;
    std::optional<Time> next = {};  ///< as reported, instead of the schedule
    Time paid{};                    ///< time that its steps so far are worth
    bool hurried = false;           ///< has asked for more steps than are given
    std::set<std::string> inputs;
    bool stepping = false;
    Published pending;  ///< for its next step
    Time due() const { return next ? *next : schedule.due(); }
  };

  void admit() {
    for (const auto& [name, join] : joining_) {
      Member member{.name = name,
                    .schedule = Schedule(join.rate_hz(), join.offset_s(), Time(0)),
                    .inputs = {join.inputs().begin(), join.inputs().end()},
                    .pending = {}};
      const Time from = std::max(time_, Time(static_cast<std::int64_t>(join.resume_ns())));
      if (begun_ || from > Time(0)) member.schedule.skip_past(from);
      for (const auto& [key, publication] : latched_) {
        if (member.inputs.contains(key.first)) *member.pending.Add() = publication;
      }
      members_.insert_or_assign(join.start_id(), std::move(member));
    }
    if (!joining_.empty()) ++generation_;
    for (const auto& [name, join] : joining_) distribute(join.published());
    joining_.clear();
  }
  void distribute(const Published& published) {
    for (const v1::Publication& publication : published) {
      if (publication.latched())
        latched_[{publication.topic(), publication.start_id()}] = publication;
      for (auto& [start_id, member] : members_) {
        if (member.inputs.contains(publication.topic())) *member.pending.Add() = publication;
      }
    }
  }

  std::set<std::string> awaited_;
  bool named_;  ///< participants are
  Time until_, time_{};
  bool begun_ = false, ended_ = false;
  std::uint64_t generation_ = 0;
  std::map<std::string, v1::LockstepJoin> joining_;  // by name
  std::map<std::uint64_t, Member> members_;          // by start_id
  std::map<std::string, Published> reported_;        // reports of the running step, by name
  std::map<std::pair<std::string, std::uint64_t>, v1::Publication> latched_;  // by topic, publisher
};

}  // namespace mimesis::runtime
