#include "nodes/planner/planner_requests.h"

#include <fmt/format.h>
#include <google/protobuf/empty.pb.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "common/model/messages.h"
#include "nodes/planner/planner_node.h"

namespace mimesis::planner {
namespace {

constexpr std::size_t kMostWaiting = 32, kKept = 64;  // requests, answers
constexpr int kMostPlaces = 64;
constexpr std::size_t kMostLetters = 64;
constexpr double kMostDeadline_s = 3600.0;

Eigen::VectorXd vector(const google::protobuf::RepeatedField<double>& v) {
  return Eigen::VectorXd::Map(v.data(), v.size());
}

std::string fault(const kin::ArmModel& arm, const std::string& what, const Eigen::VectorXd& q,
                  double tolerance = 0.0) {
  if (q.size() != arm.dof())
    return fmt::format("{}: {} joints, expected {} ({})", what, q.size(), arm.dof(), arm.name);
  const std::string why = beyond_limits(arm, q, tolerance);
  return why.empty() ? why : what + ": " + why;
}

Place to_place(const v1::MotionPlace& place) {
  return {vector(place.position_rad()), model::to_eigen(place.hand_in_world_m())};
}

std::string fault(const kin::ArmModel& arm, const std::string& what, const v1::MotionPlace& place) {
  if (place.has_hand_in_world_m() != place.position_rad().empty())
    return what + ": expected position_rad or hand_in_world_m";
  if (!place.position_rad().empty()) return fault(arm, what, vector(place.position_rad()));
  return to_place(place).hand.allFinite() ? "" : what + ": hand_in_world_m is not finite";
}

/// Why a request cannot be taken; empty if it can.
std::string fault(const kin::ArmModel& arm, Requests::Kind kind, const v1::PlanRequest& asked) {
  const bool symbols = asked.grip() != 0 || asked.transport() != 0 || asked.goal() != 0;
  if (symbols + (asked.to_size() > 0) + asked.home() + (asked.tool_size() > 0) != 1)
    return "expected one of a task (grip, transport, goal), `to`, `home` and `tool`";
  if (symbols) {
    const bool known = v1::Grip_IsValid(asked.grip()) && v1::Transport_IsValid(asked.transport()) &&
                       v1::Goal_IsValid(asked.goal());
    if (!known || asked.grip() == 0 || asked.transport() == 0 || asked.goal() == 0)
      return "a task needs grip, transport and goal, each one of proto/task.proto";
    if (asked.via_size() > 0) return "via: expected with `to` or `home` alone";
  }
  if (asked.tool_size() > 0 && asked.via_size() > 0) return "via: a tool's way has its own";
  if (!(asked.tool_off_m() == 0.0 || (asked.tool_off_m() >= 2e-4 && asked.tool_off_m() <= 0.1)))
    return fmt::format("tool_off_m: {:g}, expected 0.0002 .. 0.1", asked.tool_off_m());
  if (asked.via_size() + asked.to_size() + asked.preselected_size() + asked.tool_size() >
      kMostPlaces)
    return fmt::format("more than {} places", kMostPlaces);
  if (asked.client().size() > kMostLetters)
    return fmt::format("client: more than {} bytes", kMostLetters);
  if (asked.has_start() && kind == Requests::Kind::execute)
    return "start: the arm starts where it is";
  if (!(asked.deadline_s() >= 0.0 && asked.deadline_s() <= kMostDeadline_s))
    return fmt::format("deadline_s: {:g}, expected 0 .. {:g}", asked.deadline_s(), kMostDeadline_s);
  std::string why;
  if (asked.has_start()) why = fault(arm, "start", vector(asked.start().position_rad()), kAtLimit);
  const auto check = [&](const char* what, const auto& all, const auto& part) {
    for (int i = 0; i < all.size() && why.empty(); ++i)
      why = fault(arm, fmt::format("{}[{}]", what, i), part(all[i]));
  };
  const auto itself = [](const v1::MotionPlace& place) { return place; };
  check("via", asked.via(), itself);
  check("to", asked.to(), itself);
  for (int i = 0; i < asked.tool_size() && why.empty(); ++i) {
    const v1::ToolPiece& piece = asked.tool(i);
    if (!piece.has_to_in_world_m() || !model::to_eigen(piece.to_in_world_m()).allFinite() ||
        !model::to_eigen(piece.via_in_world_m()).allFinite())
      why = fmt::format("tool[{}]: expected finite to_in_world_m", i);
  }
  check("preselected", asked.preselected(),
        [](const v1::Posture& p) { return vector(p.position_rad()); });
  return why;
}

std::variant<Task, Move> what(const kin::ArmModel& arm, const v1::PlanRequest& asked) {
  if (asked.grip() != v1::GRIP_UNSPECIFIED) {
    Task task = to_task(asked.grip(), asked.transport(), asked.goal());
    for (const v1::Posture& p : asked.preselected())
      task.preselected.push_back(vector(p.position_rad()));
    return task;
  }
  Move move;
  for (const v1::MotionPlace& place : asked.via()) move.via.push_back(to_place(place));
  for (const v1::MotionPlace& place : asked.to()) move.goals.push_back(to_place(place));
  if (asked.home()) move.goals.push_back({arm.home});
  for (const v1::ToolPiece& piece : asked.tool()) {
    ToolPiece& next = move.tool.emplace_back();
    next.to = model::to_eigen(piece.to_in_world_m());
    if (piece.has_via_in_world_m()) next.via = model::to_eigen(piece.via_in_world_m());
  }
  if (asked.tool_off_m() > 0.0) move.tolerance.position_m = asked.tool_off_m();
  return move;
}

using WallClock = std::chrono::steady_clock;

}  // namespace

PlanningJob::PlanningJob(runtime::Bus& bus, kin::ArmModel arm, TaskSettings settings)
    : bus_(bus), arm_(std::move(arm)), settings_(std::move(settings)), job_(bus) {}

void PlanningJob::start(PlanRequest request, std::shared_ptr<const Roadmap> known,
                        double deadline_s) {
  cancelled_ = std::make_shared<std::atomic<bool>>(false);
  timed_ = deadline_s > 0.0 && !bus_.lockstep();
  job_.start([arm = arm_, settings = settings_, known = std::move(known), cancelled = cancelled_,
              request = std::move(request), timed = timed_, deadline_s, &bus = bus_]() mutable {
    const auto begin = WallClock::now();
    const auto end = begin + std::chrono::duration_cast<WallClock::duration>(
                                 std::chrono::duration<double>(deadline_s - kLongestPart_s));
    const std::string why = fmt::format("the deadline of {:g} s passed", deadline_s);
    if (timed && bus.outside().replaying()) {  // then the work is done in a step
      const auto told_at = runtime::read_outside_value<std::uint64_t>(
          bus, "stopped_at", [] { return std::uint64_t{}; });
      settings.interrupt = Interrupt(
          why, [told_at, asked = std::uint64_t{}]() mutable { return ++asked >= told_at; });
    } else {
      settings.interrupt = Interrupt(
          why, [=] { return *cancelled || (timed && WallClock::now() >= end); }, kQuestionsPerLook);
    }
    auto roadmap =
        known ? refreshed_roadmap(known, arm, request.table, settings)
              : std::make_shared<const Roadmap>(prepare_roadmap(arm, request.table, settings));
    if (settings.interrupt.told()) roadmap.reset();
    auto plan = settings.interrupt.told() ? tl::unexpected(settings.interrupt.reason())
                                          : plan_request(arm, *roadmap, request, settings);
    const std::chrono::duration<double> spent = WallClock::now() - begin;
    return Work{{std::move(roadmap), std::move(plan), spent.count()}, settings.interrupt.told_at()};
  });
}

std::optional<PlanningJob::Done> PlanningJob::take() {
  auto work = job_.take();
  if (!work) return std::nullopt;
  if (timed_ && !bus_.outside().replaying()) {
    runtime::read_outside_value<std::uint64_t>(bus_, "stopped_at", [&] { return work->told_at; });
  }
  work->done.compute_s =
      runtime::read_outside_value<double>(bus_, "compute_s", [&] { return work->done.compute_s; });
  if (*cancelled_ && !bus_.lockstep()) {  // how far it came depends on the machine
    work->done.roadmap.reset();
    work->done.plan = tl::unexpected(Status{"cancelled"});
  }
  return std::move(work->done);
}

Requests::Requests(runtime::Bus& bus, const kin::ArmModel& arm, const TaskSettings& settings,
                   double ready_s)
    : arm_(arm),
      ready_s_(ready_s),
      job_(bus, arm, settings),
      proposal_in_(bus, "proposal", {.author = runtime::Author::first, .optional = true}),
      trial_(bus, "trial", {.latched = true}),
      answer_(bus, "answer") {
  serve(bus);
}

void Requests::serve(runtime::Bus& bus) {
  using google::protobuf::Empty;
  using runtime::offer;
  for (const auto& [name, kind] :
       {std::pair("plan", Kind::plan), {"test", Kind::test}, {"do", Kind::execute}}) {
    offer<v1::PlanRequest, v1::PlanTicket>(
        bus, name, [this, kind = kind](const v1::PlanRequest& asked) { return add(kind, asked); });
  }
  offer<Empty, v1::PlanTicket>(bus, "home", [this](const Empty&) {
    v1::PlanRequest asked;
    asked.set_home(true);
    return add(Kind::execute, asked);
  });
  offer<v1::PlanTicket, Empty>(bus, "abort",
                               [this](const v1::PlanTicket& asked) -> tl::expected<Empty, Status> {
                                 if (std::string why = end(asked.ticket()); !why.empty())
                                   return tl::unexpected(Status{std::move(why)});
                                 return Empty();
                               });
  offer<v1::PlanTicket, v1::PlanAnswer>(
      bus, "answer", [this](const v1::PlanTicket& asked) { return answer_to(asked.ticket()); });
}

tl::expected<v1::PlanTicket, Status> Requests::add(Kind kind, const v1::PlanRequest& asked) {
  if (std::string why = fault(arm_, kind, asked); !why.empty())
    return tl::unexpected(Status{std::move(why)});
  auto& queue = kind == Kind::execute ? orders_ : tests_;
  if (queue.size() >= kMostWaiting)
    return tl::unexpected(Status{fmt::format("{} requests wait already", queue.size())});
  Waiting request{++tickets_, kind, {what(arm_, asked), kOfTicket | tickets_}, asked.client()};
  if (asked.has_start()) request.start = vector(asked.start().position_rad());
  request.deadline_s = asked.deadline_s();
  v1::PlanTicket ticket;
  ticket.set_ticket(tickets_);
  ticket.set_before(static_cast<std::uint32_t>(
      queue.size() + (kind != Kind::execute && tested_ && !useless_ ? 1 : 0)));
  queue.push_back(std::move(request));
  return ticket;
}

tl::expected<v1::PlanAnswer, Status> Requests::answer_to(std::uint64_t ticket) const {
  const auto found = std::ranges::find(answers_, ticket, &v1::PlanAnswer::ticket);
  if (found != answers_.end()) return *found;
  return tl::unexpected(
      Status{ticket == 0 || ticket > tickets_
                 ? fmt::format("no ticket {}", ticket)
                 : fmt::format("ticket {}: no answer yet, or forgotten", ticket)});
}

/// @param ticket  0: all
std::string Requests::end(std::uint64_t ticket) {
  const auto meant = [&](const Waiting& request) {
    return !request.proposal && (ticket == 0 || request.ticket == ticket);
  };
  const tl::expected<TaskPlan, Status> aborted = tl::unexpected(Status{"aborted"});
  bool found = ticket == 0;
  const auto remove = [&](std::deque<Waiting>& queue, std::size_t first) {
    for (std::size_t i = first; i < queue.size();) {
      if (!meant(queue[i])) {
        ++i;
        continue;
      }
      answer(queue[i], aborted);
      queue.erase(queue.begin() + static_cast<std::ptrdiff_t>(i));
      found = true;
    }
  };
  remove(tests_, 0);
  remove(orders_, begun_ ? 1 : 0);
  if (tested_ && !useless_ && meant(*tested_)) {
    answer(*tested_, aborted);
    useless_ = found = true;
    job_.cancel();
  }
  const bool at_work = begun_ && meant(orders_.front());
  if (ticket == 0) {
    abort_ = Abort::all;
  } else if (at_work && abort_ == Abort::nothing) {
    abort_ = Abort::order;
  }
  return found || at_work ? "" : fmt::format("ticket {} neither waits nor is done", ticket);
}

double Requests::deadline_s(std::uint64_t order_id) const {
  return begun_ && orders_.front().order.id == order_id ? orders_.front().deadline_s : 0.0;
}

void Requests::hear_proposal() {
  const v1::Decision* message = proposal_in_.take();
  if (message == nullptr) return;
  auto order = to_decided(*message);
  if (!order || order->id == proposed_) return;
  proposed_ = order->id;
  std::erase_if(tests_, [](const Waiting& request) { return request.proposal.has_value(); });
  if (tested_ && tested_->proposal) {
    useless_ = true;
    job_.cancel();
  }
  // A decision waits for it.
  tests_.push_front({0, Kind::test, *std::move(order), "", {}, 0.0, *message});
}

void Requests::step(runtime::Time now, const kin::Table* table, const ArmReading* arm,
                    std::shared_ptr<const Roadmap>& roadmap) {
  hear_proposal();
  if (auto done = job_.take()) {
    if (done->roadmap) roadmap = done->roadmap;
    if (!std::exchange(useless_, false)) answer(*tested_, done->plan, done->compute_s);
    tested_.reset();
  }
  start_next(now, table, arm, roadmap);
}

void Requests::start_next(runtime::Time now, const kin::Table* table, const ArmReading* arm,
                          const std::shared_ptr<const Roadmap>& roadmap) {
  if (job_.running() || tests_.empty()) return;
  Waiting& first = tests_.front();
  const char* missing = table == nullptr                 ? "the scene"
                        : arm == nullptr && !first.start ? "the state of the arm"
                                                         : nullptr;
  if (missing != nullptr) {
    if (!first.since) first.since = now;
    if (now - *first.since < runtime::from_seconds(ready_s_)) return;
    answer(first, tl::unexpected(Status{std::string("waited in vain for ") + missing}));
    tests_.pop_front();
    return;
  }
  tested_ = std::move(first);
  tests_.pop_front();
  job_.start({*table, tested_->start ? *tested_->start : arm->q, tested_->order.what}, roadmap,
             tested_->deadline_s);
}

void Requests::follow(runtime::Time now, const TaskSequence& sequence, double compute_s) {
  if (!orders_.empty() && sequence.order_id() == orders_.front().order.id) {
    begun_ = true;
    if (sequence.at_rest()) {
      const tl::expected<TaskPlan, Status> failed = tl::unexpected(Status{sequence.reason()});
      const bool done = sequence.state() == TaskSequence::State::done;
      answer(orders_.front(), done ? *sequence.plan() : failed, compute_s);
      orders_.pop_front();
      begun_ = false;
    }
  }
  for (v1::TaskStatus& trial : trials_) trial_.send(trial, now);
  trials_.clear();
  for (; unpublished_ > 0; --unpublished_)
    answer_.send(answers_[answers_.size() - unpublished_], now);
}

void Requests::answer(const Waiting& request, const tl::expected<TaskPlan, Status>& plan,
                      double compute_s) {
  if (const auto& proposal = request.proposal) {
    v1::TaskStatus& trial = trials_.emplace_back();
    trial.set_state(plan ? v1::TASK_STATE_IDLE : v1::TASK_STATE_FAILED);
    trial.set_grip(proposal->grip());
    trial.set_transport(proposal->transport());
    trial.set_goal(proposal->goal());
    trial.set_plan_succeeded(plan.has_value());
    trial.set_reason(plan ? "" : plan.error().reason);
    trial.set_path_length_rad(plan ? plan->path_length_rad : 0.0);
    trial.set_plan_compute_s(compute_s);
    return;
  }
  if (answers_.size() == kKept + unpublished_) answers_.pop_front();
  v1::PlanAnswer& answer = answers_.emplace_back();
  ++unpublished_;
  answer.set_ticket(request.ticket);
  answer.set_client(request.client);
  answer.set_succeeded(plan.has_value());
  answer.set_compute_s(compute_s);
  if (!plan) {
    answer.set_reason(plan.error().reason);
    return;
  }
  answer.set_length_rad(plan->path_length_rad);
  double duration_s = 0.0;
  for (const PlannedMotion& motion : plan->motions) {
    duration_s += motion.trajectory.duration_s();
    if (request.kind == Kind::plan) *answer.add_motions() = to_proto(motion);
  }
  answer.set_duration_s(duration_s);
}

}  // namespace mimesis::planner
