// Coordinators on a network that loses, doubles, delays and reorders messages, is cut in parts, one
// way and both ways, while coordinators are killed and start again. The judge knows nothing of the
// protocol: it is told who moves an agent, and when.
#include "nodes/crowd/regions/ownership.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <map>
#include <memory>
#include <queue>
#include <random>
#include <variant>

namespace mimesis::crowd {
namespace {

using namespace std::chrono_literals;

constexpr Time kPeriod = 20ms, kEvery = 100ms;

class Chance {
 public:
  explicit Chance(unsigned seed) : random_(seed) {}
  double in(double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(random_);
  }
  int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(random_); }
  bool is(double p) { return in(0.0, 1.0) < p; }
  Time time(double least_s, double most_s) { return from_seconds(in(least_s, most_s)); }
  Time next(double mean_s) {
    return from_seconds(std::exponential_distribution(1 / mean_s)(random_));
  }

 private:
  std::mt19937 random_;
};

/// Records which coordinator moves an agent from when until when, in true time.
class Judge {
 public:
  explicit Judge(int agents) : moves_(static_cast<std::size_t>(agents) + 1) {}

  /// c moves the agent in a step at `from`, and no longer than `until`.
  void moves(int c, AgentId id, Time from, Time until) {
    Move& last = moves_[id];
    if (last.until > from && last.by != c) ++twice_;
    if (last.by >= 0 && from > last.until) {
      const double stood = to_seconds(from - last.until);
      if (last.by != c) changes_.push_back(stood);
      most_ = std::max(most_, stood);
      if (calm_since_ + 3s < last.until) calm_.push_back(stood);
    }
    last = {c, std::max(until, last.until)};
  }
  void dies(int c, Time now) {
    for (Move& move : moves_) {
      if (move.by == c) move.until = std::min(move.until, now);
    }
  }
  /// No partition, and all coordinators are there, since.
  void calm_since(Time t) { calm_since_ = t; }
  int standing(Time now) const {
    return static_cast<int>(std::count_if(moves_.begin() + 1, moves_.end(), [&](const Move& m) {
      return m.until < now - 2 * kPeriod;
    }));
  }
  int twice() const { return twice_; }
  double most_s() const { return most_; }
  std::vector<double> changes() const { return changes_; }
  std::vector<double> calm() const { return calm_; }

 private:
  struct Move {
    int by = -1;
    Time until{};
  };
  std::vector<Move> moves_;
  int twice_ = 0;
  double most_ = 0.0;
  Time calm_since_{};
  std::vector<double> changes_, calm_;
};

struct Faults {
  double loss = 0.0, twice = 0.0, delay_s = 0.0, offset_s = 0.0;
  double cut_every_s = 0.0, restart_every_s = 0.0;  // 0: never
};

class Network {
 public:
  using Message = std::variant<std::shared_ptr<const OwnershipReport>, Offer>;

  Network(int coordinators, int agents, const Faults& faults, unsigned seed)
      : judge(agents), faults_(faults), chance_(seed), agents_(agents) {
    for (int c = 0; c < coordinators; ++c) {
      all_.push_back({.offset = chance_.time(0.0, faults.offset_s)});
      at(chance_.time(0.0, faults.offset_s > 0.0 ? 0.02 : 0.0), [this, c] { start(c); });
    }
    if (faults.cut_every_s > 0.0)
      at(Time(2s) + chance_.next(faults.cut_every_s), [this] { cut(); });
    if (faults.restart_every_s > 0.0) {
      at(Time(2s) + chance_.next(faults.restart_every_s), [this] { restart(); });
    }
  }

  void until(Time end) {
    while (!events_.empty() && events_.top().at <= end) {
      const auto event = events_.top();
      events_.pop();
      now_ = event.at;
      event.act();
    }
    now_ = end;
  }
  /// From now on nothing is cut and nobody dies.
  void heal() { healed_ = true; }
  /// Nobody is handed over any more, and every message arrives.
  void rest() {
    rests_ = true;
    faults_ = {.offset_s = faults_.offset_s};
  }
  /// Agents that not exactly one coordinator owns.
  int lost() const {
    int lost = 0;
    for (AgentId id = 1; id <= static_cast<AgentId>(agents_); ++id) {
      lost += std::ranges::count_if(all_, [&](const One& o) {
                return o.self && (o.self->owns(id) || o.self->offered(id));
              }) != 1;
    }
    return lost;
  }
  const Ownership& operator[](int c) const { return *all_[static_cast<std::size_t>(c)].self; }

  Judge judge;
  int handovers = 0, adopted = 0, taken_back = 0, cuts = 0, restarts = 0;

  /// Cuts messages from one to another, for good.
  void separate(int from, int to) { separated_.insert({{from, to}, 1}); }
  void join() { separated_.clear(); }
  void kill(int c) {
    all_[static_cast<std::size_t>(c)].self.reset();
    ++all_[static_cast<std::size_t>(c)].life;
    judge.dies(c, now_);
  }
  void start(int c) {
    One& one = all_[static_cast<std::size_t>(c)];
    std::vector<AgentId> mine;
    for (int id = 1; id <= agents_; ++id) {
      if (id % size() == c) mine.push_back(static_cast<AgentId>(id));
    }
    one.self = std::make_unique<Ownership>(OwnershipSettings{.coordinators = size(), .own = c},
                                           agents_, mine);
    one.again.clear();
    step(c, one.life);
  }

 private:
  struct One {
    Time offset{};
    std::unique_ptr<Ownership> self{};
    int life = 0;
    std::vector<Message> inbox{};
    std::map<AgentId, Time> again{};  // offers, sent last
  };
  struct Event {
    Time at;
    std::uint64_t number;
    std::function<void()> act;
    bool operator<(const Event& other) const {
      return std::pair(at, number) > std::pair(other.at, other.number);
    }
  };

  int size() const { return static_cast<int>(all_.size()); }
  void at(Time when, std::function<void()> act) { events_.push({when, ++number_, std::move(act)}); }

  void send(int from, int to, const Message& message) {
    if (separated_.contains({from, to})) return;
    const int copies = chance_.is(faults_.loss) ? 0 : chance_.is(faults_.twice) ? 2 : 1;
    for (int k = 0; k < copies; ++k) {
      at(now_ + chance_.time(1e-4, 1e-4 + faults_.delay_s), [this, to, message] {
        One& one = all_[static_cast<std::size_t>(to)];
        if (one.self) one.inbox.push_back(message);
      });
    }
  }

  void step(int c, int life) {
    One& one = all_[static_cast<std::size_t>(c)];
    if (!one.self || one.life != life) return;
    at(now_ + kPeriod, [this, c, life] { step(c, life); });
    Ownership& self = *one.self;
    self.begin_step(now_ + one.offset);
    const std::vector<Message> inbox = std::move(one.inbox);
    one.inbox.clear();
    for (const Message& message : inbox) {
      if (const auto* report = std::get_if<0>(&message)) {
        self.hear(**report);
      } else if (self.acceptable(std::get<Offer>(message))) {
        self.take(std::get<Offer>(message));
        ++handovers;
      }
    }
    self.decide();
    for (const AgentId id : std::vector(self.orphans())) self.adopt(id), ++adopted;
    for (AgentId id = 1; id <= static_cast<AgentId>(agents_); ++id) {
      if (self.refused(id)) self.take_back(id), ++taken_back;
      const bool moved = self.owns(id);
      if (moved && !rests_ && chance_.is(0.02)) {
        const int to = chance_.below(size());
        if (self.can_offer(id, to)) {
          send(c, to, self.offer(id, to));
          one.again[id] = now_;
        }
      } else if (self.offered(id) && now_ - one.again[id] >= kEvery) {
        const Offer offer = self.repeat(id);
        send(c, offer.to, offer);
        one.again[id] = now_;
      }
      if (moved) judge.moves(c, id, now_, self.owns(id) ? now_ + kPeriod : now_);
    }
    const auto report = std::make_shared<const OwnershipReport>(self.report());
    for (int to = 0; to < size(); ++to) {
      if (to != c) send(c, to, report);
    }
  }

  void calm() {
    const bool here = std::ranges::all_of(all_, [](const One& o) { return o.self != nullptr; });
    judge.calm_since(here && separated_.empty() ? now_ : Time::max() - Time(10s));
  }

  void cut() {
    if (healed_) return;
    at(now_ + chance_.next(faults_.cut_every_s), [this] { cut(); });
    const int kind = chance_.below(3);
    std::vector<bool> side;
    for (int c = 0; c < size(); ++c) side.push_back(chance_.is(0.5));
    std::vector<std::pair<int, int>> links;
    for (int a = 0; a < size(); ++a) {
      for (int b = 0; b < size(); ++b) {
        const auto sa = side[static_cast<std::size_t>(a)], sb = side[static_cast<std::size_t>(b)];
        if (kind == 0 ? sa != sb : sa && !sb) links.emplace_back(a, b);
      }
    }
    if (kind == 2 && links.size() > 1) {  // one link, one way
      links = {links[static_cast<std::size_t>(chance_.below(static_cast<int>(links.size())))]};
    }
    if (links.empty()) return;
    for (const auto& link : links) ++separated_[link];
    ++cuts;
    calm();
    at(now_ + chance_.time(0.05, 3.0), [this, links] {
      for (const auto& link : links) {
        if (--separated_[link] == 0) separated_.erase(link);
      }
      calm();
    });
  }

  void restart() {
    if (healed_) return;
    at(now_ + chance_.next(faults_.restart_every_s), [this] { restart(); });
    const int c = chance_.below(size());
    if (!all_[static_cast<std::size_t>(c)].self) return;
    kill(c);
    ++restarts;
    calm();
    at(now_ + chance_.time(0.005, 2.0), [this, c] {
      start(c);
      calm();
    });
  }

  Faults faults_;
  Chance chance_;
  int agents_;
  Time now_{};
  bool healed_ = false, rests_ = false;
  std::uint64_t number_ = 0;
  std::priority_queue<Event> events_;
  std::vector<One> all_;
  std::map<std::pair<int, int>, int> separated_;
};

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values.empty() ? 0.0 : values[values.size() / 2];
}
double largest(const std::vector<double>& values) {
  return values.empty() ? 0.0 : *std::ranges::max_element(values);
}

TEST(Ownership, OfAQuietNetworkIsAsGoodAsAtOnce) {
  Network net(4, 24, {.delay_s = 0.001}, 1);
  net.until(60s);
  EXPECT_GT(net.handovers, 500);
  EXPECT_EQ(net.judge.twice(), 0);
  EXPECT_EQ(net.adopted, 0);
  EXPECT_EQ(net.taken_back, 0);
  EXPECT_LE(net.judge.most_s(), 0.041);
  EXPECT_EQ(net.lost(), 0);
}

TEST(Ownership, WithoutAMajorityAgentsStandAndNobodyElseMovesThem) {
  Network net(2, 8, {}, 2);
  net.until(3s);
  net.separate(0, 1), net.separate(1, 0);
  net.rest();
  net.until(5s);
  EXPECT_TRUE(net[0].may_own()) << "the half with the first coordinator";
  EXPECT_FALSE(net[1].may_own());
  for (AgentId id = 1; id <= 8; ++id) EXPECT_TRUE(net[0].owns(id));
  EXPECT_EQ(net.judge.twice(), 0);
  net.join();
  net.until(6s);
  EXPECT_TRUE(net[1].may_own());
  EXPECT_EQ(net.lost(), 0);
}

/// One way alone: those who do not hear it, or whom it does not hear, go on without it, and not
/// before it has stopped.
TEST(Ownership, WhoIsNotHeardOrDoesNotHearGivesUpItsAgents) {
  for (const bool heard : {false, true}) {
    Network net(3, 12, {}, 3);
    net.until(3s);
    for (const int to : {0, 1}) heard ? net.separate(to, 2) : net.separate(2, to);
    net.until(6s);
    EXPECT_FALSE(net[2].may_own());
    EXPECT_EQ(net.judge.twice(), 0);
    EXPECT_EQ(net.judge.standing(6s), 0);
    EXPECT_LT(net.judge.most_s(), 1.2);
  }
}

TEST(Ownership, AllMayRestartAtOnce) {
  Network net(3, 12, {}, 4);
  net.until(3s);
  for (int c = 0; c < 3; ++c) net.kill(c);
  net.until(4s);
  for (int c = 0; c < 3; ++c) net.start(c);
  net.until(6s);
  EXPECT_EQ(net.judge.standing(6s), 0);
  EXPECT_EQ(net.judge.twice(), 0);
  for (int c = 0; c < 2; ++c) net.kill(c), net.start(c);  // the third one alone remembers
  net.until(9s);
  EXPECT_EQ(net.judge.standing(9s), 0);
  EXPECT_EQ(net.lost(), 0);
}

/// Or its leader would take the receiver's word that the view is settled, and never look for agents
/// that nobody has.
TEST(Ownership, AnOfferOfAnEarlierViewWaitsUntilThisOneIsSettled) {
  Ownership self({.coordinators = 3, .own = 1}, 1, {});
  self.begin_step(1s);
  OwnershipReport report{.from = 0, .stamp = 1s, .since = 1ms};
  report.view = {.stamp = 1s, .leader = 0, .since = {1ms, self.since(), Time{}}};
  report.heard = {{}, {self.since(), 1s}, {}};
  self.hear(report);  // ends a life that began before any view
  report.stamp += 1ms, report.view.stamp += 1s;
  report.view.since[1] = report.heard[1].since = self.since();
  self.hear(report);
  report.stamp += 1ms;
  self.hear(report);
  const Offer offer{.from = 0, .to = 1, .claim = {1, 1}, .view = report.view.id(), .until = 2s};
  ASSERT_TRUE(self.may_own());
  EXPECT_FALSE(self.acceptable(offer));
  report.stamp += 1ms, report.settled = true;
  self.hear(report);
  EXPECT_TRUE(self.acceptable(offer));
}

/// MIMESIS_HANDOVERS of them, on networks of all kinds, from seed MIMESIS_SEED on.
TEST(Ownership, NobodyIsLostOrMovedTwice) {
  const char* asked = std::getenv("MIMESIS_HANDOVERS");
  const int wanted = asked != nullptr ? std::atoi(asked) : 10'000;
  const char* begin = std::getenv("MIMESIS_SEED");
  int handovers = 0, adopted = 0, taken_back = 0, cuts = 0, restarts = 0, runs = 0;
  double most = 0.0;
  std::vector<double> changes, calm;
  for (unsigned seed = begin != nullptr ? static_cast<unsigned>(std::atoi(begin)) : 1;
       handovers < wanted; ++seed, ++runs) {
    Chance chance(1000 + seed);
    const Faults faults{.loss = chance.in(0.0, 0.3),
                        .twice = chance.in(0.0, 0.3),
                        .delay_s = chance.is(0.3) ? 0.001 : chance.in(0.0, 0.4),
                        .offset_s = 0.001,
                        .cut_every_s = chance.is(0.2) ? 0.0 : chance.in(1.0, 10.0),
                        .restart_every_s = chance.is(0.2) ? 0.0 : chance.in(2.0, 20.0)};
    const int coordinators = 2 + chance.below(4), agents = 24;
    Network net(coordinators, agents, faults, seed);
    net.until(60s);
    net.heal();
    net.until(66s);
    net.rest();
    net.until(69s);
    const auto what = [&] {
      return "seed " + std::to_string(seed) + ", " + std::to_string(coordinators) +
             " coordinators, loss " + std::to_string(faults.loss) + ", delay " +
             std::to_string(faults.delay_s);
    };
    EXPECT_EQ(net.judge.twice(), 0) << what();
    EXPECT_EQ(net.lost(), 0) << what();
    EXPECT_EQ(net.judge.standing(69s), 0) << what();
    handovers += net.handovers, adopted += net.adopted, taken_back += net.taken_back;
    cuts += net.cuts, restarts += net.restarts;
    most = std::max(most, net.judge.most_s());
    for (const double stood : net.judge.changes()) changes.push_back(stood);
    for (const double stood : net.judge.calm()) calm.push_back(stood);
  }
  std::cout << handovers << " hand-overs in " << runs << " runs, " << cuts << " cuts, " << restarts
            << " restarts: " << adopted << " agents adopted, " << taken_back
            << " taken back; stood at a change of owner: median " << median(changes)
            << " s, largest " << largest(changes)
            << " s; while nothing was cut and all were there: median " << median(calm)
            << " s, largest " << largest(calm) << " s; ever: " << most << " s\n";
  EXPECT_GT(cuts, 0);
  EXPECT_GT(restarts, 0);
}

}  // namespace
}  // namespace mimesis::crowd
