#include "tools/mimesis/log/story.h"

#include <fmt/format.h>

#include "common/runtime/own_topics.h"
#include "proto/foxglove/log.pb.h"
#include "proto/params.pb.h"
#include "proto/planner.pb.h"
#include "proto/steps.pb.h"
#include "proto/vision.pb.h"
#include "tools/mimesis/field_text.h"

namespace mimesis::tool {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

constexpr std::uint32_t kInfo = 2, kWarning = 3, kError = 4;  // as in foxglove.Log

v1::PlayerMark line(v1::PlayerMark::Kind kind, std::string text, std::uint32_t level = kInfo) {
  v1::PlayerMark mark;
  mark.set_kind(kind);
  mark.set_text(std::move(text));
  mark.set_level(level);
  return mark;
}

/// "quick stop" of a field that is a text or an enumerator; empty: there is none.
std::string text_of(const Message& message, const char* name) {
  const FieldDescriptor* field = message.GetDescriptor()->FindFieldByName(name);
  if (field == nullptr || field->is_repeated()) return {};
  std::string text = field_text(message, *field);
  if (field->cpp_type() == FieldDescriptor::CPPTYPE_ENUM) {
    // TaskState: TASK_STATE_PLANNING
    std::size_t prefix = 1;
    for (const char c : field->enum_type()->name()) prefix += std::isupper(c) != 0 ? 2 : 1;
    text = word(std::move(text), prefix - 1);
  }
  std::ranges::replace(text, '_', ' ');
  return text == "-" ? "" : text;
}

v1::PlayerMark explained(const v1::Explanation& e) {
  const v1::Decision& d = e.decision();
  auto mark = d.settled()
                  ? line(v1::PlayerMark::KIND_DECISION,
                         fmt::format("decides {}, {:.2f} s after it was seen, confidence {:.2f}",
                                     words(d), e.deciding_s(), e.confidence()))
                  : line(v1::PlayerMark::KIND_DECISION, "decides nothing: " + d.reason(), kWarning);
  for (const v1::FieldReason& f : e.fields()) {
    mark.add_details(fmt::format("{} {} after {:.0f} ms: {}", f.field(), f.site(),
                                 1000.0 * f.onset_s(), carried_by(f)));
  }
  return mark;
}

v1::PlayerMark planned(const v1::TaskStatus& s) {
  using Mark = v1::PlayerMark;
  switch (s.state()) {
    case v1::TASK_STATE_PLANNING:
      if (!s.plan_succeeded()) return line(Mark::KIND_PLAN, "plans " + words(s));
      return line(Mark::KIND_PLAN, fmt::format("has a plan of {:.2f} rad, roadmap of {} nodes",
                                               s.path_length_rad(), s.roadmap_nodes()));
    case v1::TASK_STATE_EXECUTING:
      return line(Mark::KIND_MOTION, "moves: " + text_of(s, "phase"));
    case v1::TASK_STATE_DONE:
      return line(Mark::KIND_PLAN, "is done: " + words(s));
    case v1::TASK_STATE_FAILED:
      return line(Mark::KIND_STOP, "fails at " + words(s) + ": " + s.reason(), kError);
    default:
      return line(Mark::KIND_PLAN, "waits for a decision");
  }
}

/// What a node was asked between two steps: parameters that were set, other services.
v1::PlayerMark asked(const v1::StepLog& steps) {
  std::vector<std::string> acts;
  for (const v1::StepRecord& step : steps.steps()) {
    for (const v1::ServedRequest& served : step.requests()) {
      v1::ParamRequest params;
      if (!served.service().ends_with("params")) {
        acts.push_back("is asked: " + served.service());
      } else if (params.ParseFromString(served.request())) {
        for (const v1::ParamValue& p : params.set()) acts.push_back(p.key() + " = " + p.value());
      }
      if (!acts.empty() && !served.failure().empty())
        acts.back() += ", refused: " + served.failure();
    }
  }
  if (acts.empty()) return {};
  auto mark = line(v1::PlayerMark::KIND_PARAMETER, acts.front());
  for (std::size_t i = 1; i < acts.size(); ++i) mark.add_details(acts[i]);
  return mark;
}

template <class T>
const T* parsed(const Message& message, T& out) {
  const bool same = message.GetDescriptor()->full_name() == out.GetTypeName();
  return same && out.ParseFromString(message.SerializeAsString()) ? &out : nullptr;
}

}  // namespace

std::string carried_by(const v1::FieldReason& reason) {
  constexpr double kNothing = 0.005;
  std::string by;
  for (const v1::Influence& i : reason.influences()) {
    if (i.input() < kNothing && i.input() > -kNothing) continue;
    by += fmt::format("{}{} {:.2f}", by.empty() ? "" : " + ", i.from(), i.input());
  }
  return by;
}

bool Story::follows(const log::Channel& channel) {
  const std::string name = channel.topic.substr(channel.topic.rfind('/') + 1);
  for (const char* told : {"log", "explanation", "observation", "status", "proposal", "steps",
                           "emergency_stop", "outcome", "answer"})
    if (name == told) return true;
  return false;
}

bool Story::changed(const std::string& topic, const std::string& text) {
  std::string& last = last_[topic];
  if (last == text) return false;
  last = text;
  return true;
}

v1::PlayerMark Story::tell(const Item& item) {
  const Message* message = decoder_.decode(item);
  if (message == nullptr) return {};
  const std::string& topic = item.channel->topic;
  v1::PlayerMark mark = tell(topic, *message);
  if (mark.kind() == v1::PlayerMark::KIND_UNSPECIFIED) return {};
  const bool repeats =
      mark.kind() != v1::PlayerMark::KIND_LOG && mark.kind() != v1::PlayerMark::KIND_PARAMETER;
  if (repeats && !changed(topic, mark.text())) return {};
  if (mark.node().empty()) {
    const std::string sender = sender_of(*item.channel);
    mark.set_node(sender.empty() ? topic.substr(0, topic.rfind('/')) : sender);
  }
  return mark;
}

v1::PlayerMark Story::tell(const std::string& topic, const Message& message) {
  using Mark = v1::PlayerMark;
  foxglove::Log log;
  if (parsed(message, log) != nullptr) {
    if (log.level() < foxglove::Log::INFO) return {};
    auto mark = line(Mark::KIND_LOG, log.message(), static_cast<std::uint32_t>(log.level()));
    mark.set_node(log.name());
    return mark;
  }
  v1::Observation observation;
  if (parsed(message, observation) != nullptr) {
    if (words(observation) == "-, -, -") return {};  // nobody acts, or the robot's own eyes
    const std::string color = text_of(message, "color");
    return line(Mark::KIND_SEEN,
                "sees " + words(observation) + (color.empty() ? "" : ", a " + color + " object"));
  }
  v1::Explanation explanation;
  if (parsed(message, explanation) != nullptr) return explained(explanation);
  v1::TaskStatus task;
  if (parsed(message, task) != nullptr) return planned(task);
  v1::StepLog steps;
  if (parsed(message, steps) != nullptr) return asked(steps);
  v1::Decision proposal;
  if (topic.ends_with("/proposal") && parsed(message, proposal) != nullptr)
    return line(Mark::KIND_PLAN, "asks for a test plan: " + words(proposal));
  v1::PlanAnswer answer;
  if (parsed(message, answer) != nullptr) {
    return answer.succeeded()
               ? line(Mark::KIND_PLAN, fmt::format("answers {}: a plan of {:.2f} rad",
                                                   answer.client(), answer.length_rad()))
               : line(Mark::KIND_STOP,
                      "cannot do what " + answer.client() + " asks: " + answer.reason(), kWarning);
  }
  // All others with a state and a reason: bridges, walkers, emergency stops.
  const std::string state = text_of(message, "state"), reason = text_of(message, "reason");
  const bool stop = topic.ends_with("/emergency_stop");
  if (state.empty() && (reason.empty() || !stop)) return {};
  const bool halts = stop || state.find("stop") != std::string::npos || state == "fault" ||
                     state == "holding" || state == "safe";
  return line(halts ? Mark::KIND_STOP : Mark::KIND_MOTION,
              stop ? "asks for a stop: " + reason : state + (reason.empty() ? "" : ": " + reason),
              halts ? kWarning : kInfo);
}

}  // namespace mimesis::tool
