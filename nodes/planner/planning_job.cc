#include "nodes/planner/planning_job.h"

#include <fmt/format.h>

#include <chrono>

namespace mimesis::planner {
namespace {

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

}  // namespace mimesis::planner
