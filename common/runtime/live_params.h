#pragma once
#include <string>

#include "common/runtime/bus.h"
#include "common/runtime/run_node.h"

namespace mimesis::runtime {

/// Offers service NODE/params (proto/params.proto): shows the parameters, and changes those that
/// their `visit` declares as changeable, and the level of the log. As every service it is answered
/// between two steps, recorded with the next one and answered again in a replay, at the same place:
/// a replay follows the change. `bus` and `node` outlive it; call before the node is created.
void serve_params(Bus& bus, AnyNode& node);

}  // namespace mimesis::runtime
