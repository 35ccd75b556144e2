#include "common/runtime/conductor.h"

#include <algorithm>
#include <utility>

namespace mimesis::runtime {

Conductor::Conductor(std::vector<std::string> participants, Time until)
    : awaited_(participants.begin(), participants.end()), until_(until) {}

void Conductor::join(const v1::LockstepJoin& join) {
  if (!(join.rate_hz() > 0.0)) return;
  joining_[join.node()] = join;
  awaited_.erase(join.node());
  if (!begun_) time_ = std::max(time_, Time(static_cast<std::int64_t>(join.resume_ns())));
}

void Conductor::leave(std::uint64_t start_id) {
  std::erase_if(joining_, [&](const auto& entry) { return entry.second.start_id() == start_id; });
  std::erase_if(latched_, [&](const auto& entry) { return entry.first.second == start_id; });
  members_.erase(start_id);
}

void Conductor::report(std::uint64_t start_id, const v1::StepReport& report) {
  const auto it = members_.find(start_id);
  if (it == members_.end() || !it->second.stepping) return;
  it->second.stepping = false;
  if (report.next_ns() > 0) {
    it->second.next = std::max(Time(static_cast<std::int64_t>(report.next_ns())), time_ + Time(1));
  }
  reported_[it->second.name] = report.published();
}

std::vector<std::string> Conductor::missing() const { return {awaited_.begin(), awaited_.end()}; }

void Conductor::distribute(const Published& published) {
  for (const v1::Publication& publication : published) {
    if (publication.latched())
      latched_[{publication.topic(), publication.start_id()}] = publication;
    for (auto& [start_id, member] : members_) {
      if (member.inputs.contains(publication.topic())) *member.pending.Add() = publication;
    }
  }
}

void Conductor::admit() {
  for (const auto& [name, join] : joining_) {
    Member member{.name = name,
                  .schedule = Schedule(join.rate_hz(), join.offset_s(), Time(0)),
                  .inputs = {join.inputs().begin(), join.inputs().end()},
                  .pending = {}};
    if (begun_ || time_ > Time(0)) member.schedule.skip_past(time_);
    for (const auto& [key, publication] : latched_) {
      if (member.inputs.contains(key.first)) *member.pending.Add() = publication;
    }
    members_.insert_or_assign(join.start_id(), std::move(member));
  }
  if (!joining_.empty()) ++generation_;
  for (const auto& [name, join] : joining_) distribute(join.published());
  joining_.clear();
}

std::vector<Conductor::Go> Conductor::advance() {
  const auto stepping = [](const auto& entry) { return entry.second.stepping; };
  if (ended_ || !awaited_.empty() || std::any_of(members_.begin(), members_.end(), stepping))
    return {};
  for (const auto& [name, published] : reported_) distribute(published);
  reported_.clear();
  admit();
  if (members_.empty()) return {};
  begun_ = true;

  const auto earlier = [](const auto& a, const auto& b) { return a.second.due() < b.second.due(); };
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

}  // namespace mimesis::runtime
