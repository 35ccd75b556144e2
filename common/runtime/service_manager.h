#pragma once
#include <chrono>

// What a process tells whoever started it, systemd or the launcher, in the protocol of
// sd_notify(3). Nothing happens where the variables of the environment are not set.
namespace mimesis::runtime {

/// The node is ready ($NOTIFY_SOCKET).
void notify_ready();

/// The process lives ($NOTIFY_SOCKET, $WATCHDOG_USEC). To be called at least as often as
/// `alive_period` says; sends no oftener.
void notify_alive();

/// A quarter of $WATCHDOG_USEC; an hour if nobody watches.
std::chrono::nanoseconds alive_period();

}  // namespace mimesis::runtime
