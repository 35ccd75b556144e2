#pragma once
#include <Eigen/Core>

#include "common/task/symbols.h"
#include "proto/scene.pb.h"
#include "proto/task.pb.h"

// Symbols of the task, and places, on the wire.
namespace mimesis::model {

static_assert(static_cast<int>(task::Grip::precision) == v1::GRIP_PRECISION);
static_assert(static_cast<int>(task::Grip::full) == v1::GRIP_FULL);
static_assert(static_cast<int>(task::Transport::above) == v1::TRANSPORT_ABOVE);
static_assert(static_cast<int>(task::Transport::below) == v1::TRANSPORT_BELOW);
static_assert(static_cast<int>(task::Goal::high) == v1::GOAL_HIGH);
static_assert(static_cast<int>(task::Goal::low) == v1::GOAL_LOW);
static_assert(static_cast<int>(task::Color::light) == v1::OBJECT_COLOR_LIGHT);
static_assert(static_cast<int>(task::Color::dark) == v1::OBJECT_COLOR_DARK);
/// Values for messages.
inline v1::Grip to_proto(task::Grip grip) { return static_cast<v1::Grip>(grip); }
inline v1::Transport to_proto(task::Transport transport) {
  return static_cast<v1::Transport>(transport);
}
inline v1::Goal to_proto(task::Goal goal) { return static_cast<v1::Goal>(goal); }
inline v1::ObjectColor to_proto(task::Color color) { return static_cast<v1::ObjectColor>(color); }

/// Values that are not known here (of a newer sender) are unknown.
template <class Symbol>
Symbol symbol_of(int value) {
  return value == 1 || value == 2 ? static_cast<Symbol>(value) : Symbol::unknown;
}
inline task::Grip from_proto(v1::Grip grip) { return symbol_of<task::Grip>(grip); }
inline task::Transport from_proto(v1::Transport t) { return symbol_of<task::Transport>(t); }
inline task::Goal from_proto(v1::Goal goal) { return symbol_of<task::Goal>(goal); }
inline task::Color from_proto(v1::ObjectColor color) { return symbol_of<task::Color>(color); }

/// Places on the wire [m].
inline Eigen::Vector3d to_eigen(const v1::Vector3& v) { return {v.x_m(), v.y_m(), v.z_m()}; }
/// The other way.
inline void to_proto(const Eigen::Vector3d& v, v1::Vector3& out) {
  out.set_x_m(v.x());
  out.set_y_m(v.y());
  out.set_z_m(v.z());
}

}  // namespace mimesis::model
