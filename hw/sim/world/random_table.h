#pragma once
#include <cstdint>
#include <string>

#include "common/kin/arm.h"
#include "common/kin/table.h"

namespace mimesis::world {

/// The object or the high goal if the arm cannot let its hand down on it from above, in words;
/// empty if it can. The hand points down, its fingers 20 mm below the top of an object that stands
/// there; at every 10 mm from there to 90 mm higher the arm must have a posture whose safety balls
/// are 5 mm clear of bar and boxes. Nothing is said about ways from one posture to the next:
/// that is for whoever plans. The low goal is behind the bar and reached from the side, where there
/// is room.
std::string out_of_reach(const kin::ArmModel& arm, const kin::Table& table);

/// `usual` with object, plinth, goals and stands up to 15 mm aside and stands up to 15 mm higher or
/// lower, drawn until nothing is out of reach. The same seed gives the same table.
/// @throws ConfigError if 100 draws are not enough
kin::Table random_table(const kin::ArmModel& arm, const kin::Table& usual, std::uint64_t seed);

}  // namespace mimesis::world
