#include "tools/mimesis/log/play_services.h"

namespace mimesis::tool {
namespace {

using Done = PacedPlayer::Done;

/// `act(request)` does it.
template <class Request, class Act>
void serve(runtime::Bus& bus, PacedPlayer& player, std::string_view name, Act act) {
  bus.serve(name, Request::default_instance(), v1::PlayerStatus::default_instance(),
            [&player, act](const std::string& bytes) -> tl::expected<std::string, Status> {
              Request request;
              if (!request.ParseFromString(bytes)) {
                return tl::unexpected(Status{"not a " + Request::descriptor()->full_name()});
              }
              if (const Done done = act(request); !done) return tl::unexpected(done.error());
              return player.status().SerializeAsString();
            });
}

Done seek(PacedPlayer& player, const v1::PlayerSeek& request) {
  switch (request.target_case()) {
    case v1::PlayerSeek::kPositionS:
      return player.seek(request.position_s());
    case v1::PlayerSeek::kOffsetS:
      return player.seek_by(request.offset_s());
    case v1::PlayerSeek::kLogTimeNs:
      return player.seek(request.log_time_ns());
    case v1::PlayerSeek::TARGET_NOT_SET:
      break;
  }
  return tl::unexpected(Status{"say where: position_s, offset_s or log_time_ns"});
}

}  // namespace

void serve_player(runtime::Bus& bus, PacedPlayer& player) {
  serve<v1::PlayerPause>(bus, player, "pause", [&](const auto&) { return player.pause(); });
  serve<v1::PlayerResume>(bus, player, "resume", [&](const auto&) { return player.resume(); });
  serve<v1::PlayerStep>(bus, player, "step", [&](const v1::PlayerStep& request) {
    return player.step(request.topic());
  });
  serve<v1::PlayerSeek>(bus, player, "seek",
                        [&](const v1::PlayerSeek& request) { return seek(player, request); });
  serve<v1::PlayerRate>(bus, player, "rate", [&](const v1::PlayerRate& request) {
    return player.set_rate(request.rate());
  });
  serve<v1::PlayerAsk>(bus, player, "status", [](const auto&) { return Done(); });
}

}  // namespace mimesis::tool
