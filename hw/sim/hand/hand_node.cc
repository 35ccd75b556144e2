#include "hw/sim/hand/hand_node.h"

#include "common/runtime/bus.h"

namespace mimesis::hw::sim {

HandNode::HandNode(const Params& params, runtime::Bus& bus)
    : bus_(bus),
      plant_(params.hand),
      contact_(bus, "contact", {.author = runtime::Author::first}),
      hand_(bus, "hand") {
  const modbus::Address address = modbus::parse_address(params.address, bus.directory());
  bus.outside().opens({.kind = "hand", .address = params.address});
  if (bus.outside().replaying()) return;
  server_ = std::make_unique<HandServer>(address);
}

/// Shows `input` to clients and returns their last output. Both are recorded as registers.
HandOutput HandNode::exchange(const HandInput& input) {
  const Registers shown = encode(input);
  bus_.outside().written("hand", {reinterpret_cast<const char*>(shown.data()), sizeof shown});
  return decode_output(runtime::read_outside_value<Registers>(
      bus_, "hand", [&] { return encode(server_->exchange(input)); }));
}

void HandNode::step(runtime::Time now) {
  const v1::HandContact* met = contact_.get();
  const bool reachable = met != nullptr && met->reachable();
  const double dt = runtime::to_seconds(now - last_step_.value_or(now));
  last_step_ = now;
  plant_.step(dt, exchange(plant_.input()),
              reachable ? std::optional(met->contact_closure()) : std::nullopt);

  const HandInput& input = plant_.input();
  v1::HandState state;
  state.set_grip(input.mode == HandMode::pinch   ? v1::GRIP_PRECISION
                 : input.mode == HandMode::basic ? v1::GRIP_FULL
                                                 : v1::GRIP_UNSPECIFIED);
  state.set_closure(plant_.closure());
  state.set_moving(input.go && input.motion == Motion::moving);
  state.set_object_detected(input.contact == Contact::while_closing);
  state.set_active(input.initialisation == Initialisation::done && input.fault == 0);
  state.set_fault(fault_text(input.fault));
  hand_.send(state, now);
}

}  // namespace mimesis::hw::sim
