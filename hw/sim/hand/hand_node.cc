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
modbus::HandOutput HandNode::exchange(const modbus::HandInput& input) {
  const modbus::Registers shown = modbus::encode(input);
  bus_.outside().written("hand", {reinterpret_cast<const char*>(shown.data()), sizeof shown});
  return modbus::decode_output(runtime::read_outside_value<modbus::Registers>(
      bus_, "hand", [&] { return modbus::encode(server_->exchange(input)); }));
}

void HandNode::step(runtime::Time now) {
  const v1::HandContact* met = contact_.get();
  const bool reachable = met != nullptr && met->reachable();
  const double dt = runtime::to_seconds(now - last_step_.value_or(now));
  last_step_ = now;
  plant_.step(dt, exchange(plant_.input()),
              reachable ? std::optional(met->contact_closure()) : std::nullopt);

  const modbus::HandInput& input = plant_.input();
  v1::HandState state;
  state.set_grip(input.mode == modbus::HandMode::pinch   ? v1::GRIP_PRECISION
                 : input.mode == modbus::HandMode::basic ? v1::GRIP_FULL
                                                         : v1::GRIP_UNSPECIFIED);
  state.set_closure(plant_.closure());
  state.set_moving(input.go && input.motion == modbus::Motion::moving);
  state.set_object_detected(input.contact == modbus::Contact::while_closing);
  state.set_active(input.initialisation == modbus::Initialisation::done && input.fault == 0);
  state.set_fault(modbus::fault_text(input.fault));
  hand_.send(state, now);
}

}  // namespace mimesis::hw::sim
