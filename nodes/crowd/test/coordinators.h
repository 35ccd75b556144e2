#pragma once
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/testing/loopback.h"
#include "nodes/crowd/crowd_node.h"

namespace mimesis::crowd::testing {

using runtime::Time;

/// Several coordinators in lock-step: what one publishes at a time, the others have in their next
/// step.
class Coordinators {
 public:
  struct One {
    mimesis::testing::Loopback bus;
    std::unique_ptr<CrowdNode> node;
    std::map<std::uint64_t, std::array<double, 4>> agents;  // id -> x, y, heading, phase
    v1::CrowdStatus status;
    std::string voided;
    bool alive = true;
  };

  Coordinators(CrowdParams params, std::vector<double> x_m, std::vector<double> y_m) {
    params.regions.x_m = std::move(x_m);
    params.regions.y_m = std::move(y_m);
    regions_ = params.regions;
    period_ = runtime::from_seconds(1.0 / params.rate_hz);
    for (int c = 0; c < params.regions.map().count(); ++c) {
      params.regions.own = c + 1;
      all_.push_back(std::make_unique<One>());
      all_.back()->node = std::make_unique<CrowdNode>(params, all_.back()->bus);
    }
  }

  /// Steps all of them once.
  void step() {
    now_ += period_;
    for (auto& one : all_) {
      if (one->alive) one->node->step(now_);
    }
    for (auto& from : all_) {
      if (!from->alive) continue;
      while (const auto states = from->bus.take<v1::CrowdStates>("states")) {
        remember(*from, *states);
        for (auto& to : all_) {
          if (connected_) to->bus.send("peers", *states, now_);
        }
      }
      while (const auto handover = from->bus.take<v1::CrowdHandover>("handover")) {
        ++handovers_;
        for (auto& to : all_) to->bus.send("handovers", *handover, now_);
      }
      while (const auto c = from->bus.take<v1::CrowdCertificate>("certificate")) {
        from->voided += c->voided();
      }
      if (const auto status = from->bus.take_last<v1::CrowdStatus>("status"))
        from->status = *status;
    }
  }
  void until(double s) {
    while (now_ < runtime::from_seconds(s)) step();
  }

  One& operator[](std::size_t c) { return *all_[c]; }
  std::size_t size() const { return all_.size(); }
  Time now() const { return now_; }
  int handovers() const { return handovers_; }
  /// Kills a coordinator's process; `start` starts it again.
  void kill(std::size_t c) {
    all_[c]->alive = false;
    all_[c]->agents.clear();
  }
  void start(std::size_t c, CrowdParams params) {
    params.regions = regions_;
    params.regions.own = static_cast<int>(c) + 1;
    all_[c] = std::make_unique<One>();
    all_[c]->node = std::make_unique<CrowdNode>(params, all_[c]->bus);
  }
  void connect(bool on) { connected_ = on; }

  /// Everybody, each once.
  std::map<std::uint64_t, std::array<double, 4>> agents() const {
    std::map<std::uint64_t, std::array<double, 4>> found;
    for (const auto& one : all_) {
      for (const auto& [id, state] : one->agents) {
        EXPECT_TRUE(found.emplace(id, state).second) << "agent " << id << " is moved twice";
      }
    }
    return found;
  }

 private:
  static void remember(One& one, const v1::CrowdStates& states) {
    one.agents.clear();
    for (int i = 0; i < states.id_size(); ++i) {
      one.agents[states.id(i)] = {states.position_in_world_m(2 * i),
                                  states.position_in_world_m(2 * i + 1), states.heading_rad(i),
                                  states.phase_rad(i)};
    }
  }

  std::vector<std::unique_ptr<One>> all_;
  RegionParams regions_;
  Time period_{}, now_{std::chrono::seconds(100)};
  int handovers_ = 0;
  bool connected_ = true;
};

}  // namespace mimesis::crowd::testing
