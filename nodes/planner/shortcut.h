#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

namespace mimesis::planner {

/// Tells whether the straight motion between two postures is proven free.
using Certify = std::function<bool(const Eigen::VectorXd&, const Eigen::VectorXd&)>;

/// Shortens a path whose parts are certified, keeping its ends and the certificate: first whole
/// detours between waypoints, then `attempts` chords between points drawn from `seed` anywhere on
/// the path.
std::vector<Eigen::VectorXd> shortened(std::vector<Eigen::VectorXd> waypoints,
                                       const Certify& certify, int attempts, std::uint64_t seed);

}  // namespace mimesis::planner
