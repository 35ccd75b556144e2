#pragma once
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <random>
#include <vector>

namespace mimesis::truth {

/// A number of [least, most], the same on every platform.
double draw(std::mt19937_64& random, double least, double most);

/// One person's hand, drawn from ranges: lengths in metres. Its shape is a mesh of lofted ellipses,
/// which has nothing in common with the capsules of the tracker, neither code nor sizes.
struct Anatomy {
  bool left = false;
  double length_m = 0.0;   ///< wrist crease to tip of the middle finger, stretched
  double breadth_m = 0.0;  ///< across the knuckles, without the thumb
  double depth_m = 0.0;    ///< thickness of the palm

  struct Finger {
    double along_m, side_m;          ///< place of the knuckle, side: + towards the thumb
    std::array<double, 3> length_m;  ///< phalanges from the knuckle on
    double width_m, flat;            ///< breadth at the knuckle; height over width [1]
    double splay_rad;                ///< direction when straight, + towards the thumb
  };
  std::array<Finger, 4> fingers{};  ///< index, middle, ring, little
  std::array<double, 3> thumb_m{};  ///< metacarpal and two phalanges
  double thumb_width_m = 0.0;
  double thumb_turn_rad = 0.0;  ///< how far its bending plane is turned out of that of the palm
  double wrist_m = 0.0;         ///< breadth of the wrist
  double forearm_m = 0.0;       ///< breadth at the elbow
  double sleeve_m = 0.0;        ///< bare skin between wrist and sleeve; >= 0.3: no sleeve

  static Anatomy drawn(std::mt19937_64& random);
};

/// Angles of all joints [rad]; flexion is positive, spreading positive towards the thumb.
struct Gesture {
  std::array<std::array<double, 4>, 4> fingers{};  ///< spread, knuckle, middle joint, end joint
  std::array<double, 4> thumb{};                   ///< away from the palm, across it, two joints
  std::array<double, 2> wrist{};                   ///< flexion, deviation of the forearm
};

struct Vertex {
  Eigen::Vector3f at, normal;
  float tone;  ///< 0: cloth; else brightness of the skin, about 1
};

/// Triangles in the frame H of the hand: origin halfway between wrist and middle knuckle, x towards
/// the latter, z out of the palm.
struct Mesh {
  std::vector<Vertex> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::array<Eigen::Vector3d, 5> tips;  ///< thumb, index, ..., little
};

/// Writes the mesh of a gesture; storage is reused.
void build_hand(const Anatomy& anatomy, const Gesture& gesture, Mesh& out);

}  // namespace mimesis::truth
