#include "common/motion/mocap/body_map.h"

#include <array>

namespace mimesis::mocap {
namespace {

// Medians over the slow stances of the clips at hand: CMU 15 to 23°, Bandai-Namco 39.6°.
constexpr double kCmuSole_rad = -0.314, kBandaiSole_rad = -0.691;

// CMU's frames are parallel to the world in the zero posture; only the legs are spread.
BodyMap cmu_bvh() {
  BodyMap m;
  m.name = "CMU BVH";
  m.joints = {"Hips",        "LeftUpLeg", "LeftLeg",  "LeftFoot",     "RightUpLeg", "RightLeg",
              "RightFoot",   "Spine",     "Spine1",   "Neck1",        "Head",       "LeftArm",
              "LeftForeArm", "LeftHand",  "RightArm", "RightForeArm", "RightHand"};
  m.toes = {"LeftToeBase", "RightToeBase"};
  m.sole_rad = kCmuSole_rad;
  return m;
}

BodyMap cmu_asf() {
  BodyMap m;
  m.name = "CMU ASF";
  m.joints = {"root",    "lfemur",    "ltibia",   "lfoot",     "rfemur", "rtibia",
              "rfoot",   "upperback", "thorax",   "upperneck", "head",   "lhumerus",
              "lradius", "lwrist",    "rhumerus", "rradius",   "rwrist"};
  m.toes = {"ltoes", "rtoes"};
  m.sole_rad = kCmuSole_rad;
  return m;
}

// Bandai-Namco's frames have x along the bone (on the right side of the limbs: against it), so
// the zero posture is folded together; the T-posture turns all by multiples of 90°.
BodyMap bandai_namco() {
  BodyMap m;
  m.name = "Bandai-Namco BVH";
  m.joints = {"Hips",       "UpperLeg_L", "LowerLeg_L", "Foot_L",     "UpperLeg_R", "LowerLeg_R",
              "Foot_R",     "Spine",      "Chest",      "Neck",       "Head",       "UpperArm_L",
              "LowerArm_L", "Hand_L",     "UpperArm_R", "LowerArm_R", "Hand_R"};
  m.toes = {"Toes_L", "Toes_R"};
  m.sole_rad = kBandaiSole_rad;
  const std::string trunk = "+z+x+y", left_leg = "+x+z-y", right_leg = "-x+z+y",
                    right_arm = "-x+y-z";
  m.axes = {"+x-z+y",  left_leg, left_leg,  left_leg,  right_leg, right_leg,
            right_leg, trunk,    trunk,     trunk,     trunk,     "",
            "",        "",       right_arm, right_arm, right_arm};
  return m;
}

}  // namespace

std::span<const BodyMap> known_body_maps() {
  static const std::array<BodyMap, 3> maps = {cmu_bvh(), cmu_asf(), bandai_namco()};
  return maps;
}

}  // namespace mimesis::mocap
