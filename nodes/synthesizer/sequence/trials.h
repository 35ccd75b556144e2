#pragma once
#include <cstdint>
#include <random>
#include <vector>

#include "common/motion/mocap/body.h"
#include "common/motion/mocap/trials.h"
#include "nodes/synthesizer/sequence/limbs.h"

namespace mimesis::synthesizer {

/// The actions of the drawer task [M18 fig. 3.12]: a normal gait cycle from left heel strike to
/// left heel strike (two steps), a shortened cycle with the left hand's reach to the drawer, and
/// standing: the left hand pulls, the right takes the object.
enum Action { kNormalStep, kReachingStep, kStanding };
inline constexpr int kActions = 3;

/// The furniture. The front panel is a plane across the way; all relative to where it is closed.
struct Drawer {
  double handle_height_m = 0.92, handle_lateral_m = 0.14;  ///< lateral: + to the left
  double object_height_m = 0.90;
  double pull_m = 0.26;  ///< how far the left hand opens it
  bool operator==(const Drawer&) const = default;
};

/// How one person moves in one trial: what varies beside the lengths.
struct Manner {
  double half_width_m = 0.09;  ///< half width of the track, at the ankles
  double sway_m = 0.022;       ///< sway of the pelvis, to the standing foot
  double pelvis_turn_rad = 0.08, pelvis_list_rad = 0.04;
  double arm_swing_rad = 0.38, elbow_rad = 0.40;
  double lean_rad = 0.05,
         extra_lean_rad = 0.0;  ///< lean of the walking trunk; additional lean at the drawer
  double toe_out_rad = 0.10;
  double clearance_m = 0.05;
  double drift_rad = 0.010;  ///< slow wandering of trunk and head
  double drift_phase_rad = 0.0;
  double first_step_share = 0.5;  ///< share of the normal cycle's length
};

/// One trial: the steps, the place of the drawer, the time.
struct TrialPlan {
  double normal_length_m = 1.57,
         reaching_length_m = 0.47;  ///< travel of the pelvis in actions 1, 2
  double final_distance_m = 0.60;   ///< pelvis to front panel while standing
  double object_depth_m = 0.25;     ///< behind the front panel
  double object_lateral_m = 0.0;    ///< + to the left
  double duration_s[kActions] = {1.12, 1.25, 1.60};
  Manner manner;
  int recording = 0;  ///< which of the drawn trials; augmented ones keep the number
  double pace = 1.0;  ///< factor of the propagation velocity, 1 for drawn trials

  double initial_distance_m() const {
    return normal_length_m + reaching_length_m + final_distance_m;
  }
};

struct GeneratorSettings {
  std::uint64_t seed = 1;
  int trials = 10;
  double nearest_m = 2.34, farthest_m = 2.94;  ///< initial distance pelvis - front panel
  /// Further trials of each by scaled propagation velocity [M18 3.8.3]: lengths of actions 1 and 2
  /// times the factor, durations and upper body as they were.
  std::vector<double> paces = {0.8, 0.92, 1.2};
  int samples = 100;  ///< T, of each action
  /// R² of action 1's length on the initial distance: 0.08 as people had it [M18 3.3.1]. Within
  /// [0, 1].
  double length_r_squared = 0.08;
};

/// Draws the plans, in the order of the initial distance, then the augmented ones. Distances are
/// spread evenly; the object stands front or back, left or right in turn; the length of action 1 is
/// drawn apart from the distance but for a share that gives length_r_squared, the final distance
/// rises with the object's depth, action 2 takes the rest: what fig. 3.7 reports of the human.
/// Variations are normal, cut at two standard deviations. @pre at least 4 trials, distances within
/// [2.3, 3.2] m, paces within [0.5, 1.25]
std::vector<TrialPlan> draw_plans(const GeneratorSettings& settings);

/// One trial as motion. Sample k of block a (0: the cycle before, 1..3: the actions, 4: 0.5 s of
/// standing after) is column a·samples + k. W: pelvis above x = y = 0 at the start of action 1.
struct RenderedTrial {
  Eigen::VectorXd time_s;
  Eigen::MatrixXd angle_rad;                    ///< 51×5·samples, rows of the body
  Eigen::Matrix3Xd pelvis_W_m;                  ///< 3×5·samples
  std::vector<std::array<Contact, 2>> contact;  ///< left, right
  Eigen::Matrix3Xd handle_W_m, object_W_m;      ///< targets of the hands at the end of actions
  double short_by_m = 0.0;                      ///< worst miss of any limb's target
};
RenderedTrial render(const mocap::Body& body, const TrialPlan& plan, const Drawer& drawer,
                     int samples);

/// The training data of the task: trials of each action, all with the same rows: 51 of the body and
/// "pelvis.x" (progress less the even one), "pelvis.y", "pelvis.z" (height) [m]. Any source of such
/// data can be used, recorded or not. Task parameters: kTaskNames.
struct DrawerData {
  mocap::Body body;
  Drawer drawer;
  std::array<mocap::Trials, kActions> action;
};
inline constexpr int kPelvisRows = 3;
inline constexpr int kDrawerRows = mocap::kBodyRows + kPelvisRows;
/// Names of Trial::task: distances at the start of the action and at the end of action 2, place of
/// the object.
inline constexpr std::array<const char*, 4> kTaskNames = {"distance_m", "final_distance_m",
                                                          "object_depth_m", "object_lateral_m"};

DrawerData generate_drawer_data(const mocap::Body& body, const Drawer& drawer,
                                const GeneratorSettings& settings);

/// Random numbers. Standard library generators give the same bits everywhere, its distributions do
/// not.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}
  double between(double low, double high) { return low + (high - low) * uniform(); }
  double uniform() { return (static_cast<double>(random_() >> 11) + 0.5) * 0x1.0p-53; }  ///< (0, 1)
  double normal();  ///< cut at two standard deviations
  double around(double mean, double deviation) { return mean + deviation * normal(); }

 private:
  std::mt19937_64 random_;
};

/// Action `a` of a trial, `length_m` long and begun `distance_m` before the front.
mocap::Trial action_trial(const TrialPlan& plan, int a, double length_m, double distance_m,
                          std::uint64_t seed, Eigen::Index first_frame, Eigen::Index samples);

/// When things happen in one generated trial [s]; action 1 starts at 0.
struct TrialTimes {
  double t1, t2, t3;                 ///< durations of the actions
  double right_strike, left_strike;  ///< strikes of action 2
  double reached, done;              ///< ends of actions 2 and 3
  explicit TrialTimes(const TrialPlan& p)
      : t1(p.duration_s[0]),
        t2(p.duration_s[1]),
        t3(p.duration_s[2]),
        right_strike(t1 + 0.42 * t2),
        left_strike(t1 + 0.86 * t2),
        reached(t1 + t2),
        done(t1 + t2 + t3) {}
};

/// Where one foot stands in the cycle before, in action 1 and in action 2; the last print stays.
std::vector<Footprint> prints_of(mocap::Side side, const TrialPlan& plan, const TrialTimes& times);

}  // namespace mimesis::synthesizer
