#pragma once
#include <chrono>
#include <functional>
#include <string>

// What a process tells whoever started it, in the protocol of sd_notify(3): its service manager
// ($NOTIFY_SOCKET, $WATCHDOG_USEC), and the launcher of a node that systemd starts, which hears the
// same on a socket of its own ($MIMESIS_NOTIFY_SOCKET, $MIMESIS_WATCHDOG_USEC). Nothing happens
// where these variables are not set.
namespace mimesis::runtime {

/// The node is ready.
void notify_ready();

/// What it does, in one line; `text` is called only if somebody listens.
void notify_status(const std::function<std::string()>& text);

/// It has begun to stop.
void notify_stopping();

/// The process lives. To be called at least as often as `alive_period` says; sends no oftener.
void notify_alive();

/// A quarter of the shorter watchdog time; an hour if nobody watches.
std::chrono::nanoseconds alive_period();

}  // namespace mimesis::runtime
