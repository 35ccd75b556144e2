#pragma once
#include <Eigen/Core>
#include <vector>

namespace mimesis::cognition {

/// Bundles of the robot's own motions, sorted without labels [M18 2.3.1]: a motion belongs to the
/// nearest bundle if that is near enough, else it begins a new one. Bundles keep their numbers.
class Bundles {
 public:
  struct Bundle {
    Eigen::MatrixXd mean;  ///< joints x postures, evenly along the motion [rad]
    int motions = 0;
  };

  /// @param most  number of bundles that are told apart
  /// @param radius_rad  farthest motion of a bundle from its mean, by mean distance of postures
  Bundles(std::size_t most, double radius_rad) : most_(most), radius_rad_(radius_rad) {}

  /// Sorts a motion in. Its bundle; -1 if it is like none and all are taken, or if it has another
  /// number of joints or postures than those known.
  int add(const Eigen::MatrixXd& motion);
  /// Bundles that were kept in a file; at most `most`.
  void restore(std::vector<Bundle> bundles) { all_ = std::move(bundles); }
  const std::vector<Bundle>& all() const { return all_; }
  std::size_t most() const { return most_; }

 private:
  std::size_t most_;
  double radius_rad_;
  std::vector<Bundle> all_;
};

}  // namespace mimesis::cognition
