#include "nodes/crowd/external/external_agents.h"

#include <fmt/core.h>

#include <cmath>

#include "common/math/circle.h"
#include "common/time.h"

namespace mimesis::crowd {
namespace {

std::string text(double number) { return fmt::format("{:.3g}", number); }

}  // namespace

ExternalAgents::ExternalAgents(int count, const TrustSettings& settings)
    : settings_(settings), agents_(static_cast<std::size_t>(count)) {}

std::string ExternalAgents::fault(const Agent& agent, const AgentReport& report, Time stamp) const {
  const double numbers = report.p_W_m.sum() + report.heading_rad + report.phase_rad +
                         report.phase_rate_rad_s + report.speed_m_s;
  if (!std::isfinite(numbers)) return "its state is no number";
  if (report.p_W_m.cwiseAbs().maxCoeff() > settings_.far_m) {
    return "it is at (" + text(report.p_W_m.x()) + ", " + text(report.p_W_m.y()) + ") m";
  }
  if (std::abs(report.speed_m_s) > settings_.most_m_s) {
    return "its speed of " + text(report.speed_m_s) + " m/s is no walker's";
  }
  if (std::abs(report.phase_rate_rad_s) > settings_.most_rad_s) {
    return "its phase rate of " + text(report.phase_rate_rad_s) + " rad/s is no gait's";
  }
  if (agent.trust != Trust::trusted) return {};
  const double apart_s = to_seconds(stamp - agent.stamp);
  const double moved_m = (report.p_W_m - agent.report.p_W_m).norm();
  if (moved_m > settings_.slack_m + settings_.most_m_s * apart_s) {
    return "it moved by " + text(moved_m) + " m within " + text(apart_s) + " s";
  }
  return {};
}

std::string ExternalAgents::hear(int index, const AgentReport& report, Time stamp, Time now) {
  Agent& agent = agents_[static_cast<std::size_t>(index)];
  const bool known = agent.trust != Trust::absent;
  if (known && stamp <= agent.stamp) return {};
  const double age_s = to_seconds(now - stamp);
  if (age_s > settings_.stale_s || age_s < -settings_.stale_s) {
    return agent.reason = "its state is " + text(age_s) + " s old, at most " +
                          text(settings_.stale_s) + " are trusted";
  }
  if (std::string why = fault(agent, report, stamp); !why.empty()) {
    if (agent.trust == Trust::trusted) {
      agent.trust = Trust::lagging;
      agent.in_time_since = now;
    }
    return agent.reason = why;
  }
  // Gaps restart the time that a lagging agent has to be timely.
  if (!known || to_seconds(stamp - agent.stamp) > settings_.stale_s) agent.in_time_since = now;
  agent.report = report;
  agent.stamp = stamp;
  agent.fresh = true;
  agent.left = false;
  if (!known) agent.trust = Trust::trusted;
  return {};
}

void ExternalAgents::leave(int index) {
  Agent& agent = agents_[static_cast<std::size_t>(index)];
  agent.left = agent.trust != Trust::absent;
}

void ExternalAgents::judge(Agent& agent, Time now) const {
  if (agent.trust == Trust::absent) return;
  const double age_s = to_seconds(now - agent.stamp);
  if (agent.left) {
    agent.trust = Trust::absent;
    agent.reason = "it left";
  } else if (age_s > settings_.forget_s) {
    agent.trust = Trust::absent;
    agent.reason = "nothing believable for " + text(age_s) + " s";
  } else if (age_s > settings_.stale_s) {
    if (agent.trust == Trust::trusted) {
      agent.reason = "its last state is " + text(age_s) + " s old, at most " +
                     text(settings_.stale_s) + " are trusted";
    }
    agent.trust = Trust::lagging;
  } else if (agent.trust == Trust::lagging &&
             to_seconds(now - agent.in_time_since) >= settings_.return_s) {
    agent.trust = Trust::trusted;
    agent.reason = "it is in time again";
  }
}

const std::vector<ExternalAgents::Change>& ExternalAgents::update(Time now) {
  changes_.clear();
  for (int i = 0; i < size(); ++i) {
    Agent& agent = agents_[static_cast<std::size_t>(i)];
    judge(agent, now);
    if (agent.trust != agent.told) {
      const bool came = agent.told == Trust::absent && agent.trust == Trust::trusted;
      changes_.push_back({i, agent.told, agent.trust, came ? "it came" : agent.reason});
      agent.told = agent.trust;
    }
    if (agent.trust == Trust::absent) agent.left = agent.fresh = false;
  }
  return changes_;
}

/// Goes straight on at its rates.
AgentReport ExternalAgents::believed(int agent, Time now) const {
  const double ahead_s = age_s(agent, now);
  AgentReport report = at(agent).report;
  report.p_W_m += ahead_s * report.speed_m_s *
                  Eigen::Vector2d(std::cos(report.heading_rad), std::sin(report.heading_rad));
  report.phase_rad = math::wrap_two_pi(report.phase_rad + ahead_s * report.phase_rate_rad_s);
  return report;
}

double ExternalAgents::age_s(int agent, Time now) const {
  return to_seconds(now - at(agent).stamp);
}

}  // namespace mimesis::crowd
