#include "nodes/planner/planning_job_node.h"

#include <fmt/format.h>

#include <chrono>
#include <limits>

namespace mimesis::planner {
namespace {

using WallClock = std::chrono::steady_clock;

constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();

/// Answers whether to stop, and remembers since which question.
struct StopAsker {
  std::shared_ptr<std::atomic<bool>> cancelled;
  std::optional<WallClock::time_point> end{};
  std::uint64_t stopped_at = kNever, asked = 0;

  bool stop() {
    if (*cancelled) return true;
    if (++asked < stopped_at && end && WallClock::now() >= *end) stopped_at = asked;
    return asked >= stopped_at;
  }
};

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
    StopAsker asker{cancelled};
    if (timed && bus.outside().replaying()) {  // then the work is done in a step
      asker.stopped_at = runtime::read_outside_value<std::uint64_t>(bus, "stopped_at",
                                                                    [] { return std::uint64_t{}; });
    } else if (timed) {
      asker.end = begin + std::chrono::duration_cast<WallClock::duration>(
                              std::chrono::duration<double>(deadline_s));
    }
    settings.search.stop = [&asker] { return asker.stop(); };
    const auto roadmap =
        known ? refreshed_roadmap(known, arm, request.table, settings)
              : std::make_shared<const Roadmap>(prepare_roadmap(arm, request.table, settings));
    auto plan = plan_request(arm, *roadmap, request, settings);
    if (!plan && asker.stopped_at != kNever && asker.asked >= asker.stopped_at)
      plan =
          tl::unexpected(Status{fmt::format("no plan within the deadline of {:g} s", deadline_s)});
    const std::chrono::duration<double> spent = WallClock::now() - begin;
    return Work{{roadmap, std::move(plan), spent.count()}, asker.stopped_at};
  });
}

std::optional<PlanningJob::Done> PlanningJob::take() {
  auto work = job_.take();
  if (!work) return std::nullopt;
  if (timed_ && !bus_.outside().replaying()) {
    runtime::read_outside_value<std::uint64_t>(bus_, "stopped_at",
                                               [&] { return work->stopped_at; });
  }
  work->done.compute_s =
      runtime::read_outside_value<double>(bus_, "compute_s", [&] { return work->done.compute_s; });
  return std::move(work->done);
}

}  // namespace mimesis::planner
