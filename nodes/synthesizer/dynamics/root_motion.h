#pragma once
#include "nodes/synthesizer/dynamics/posture.h"

namespace mimesis::synthesizer {

/// Root motion of 16 figures from their standing feet [M18 3.5]: the pelvis moves and turns so that
/// the standing foot rests on the ground.
///
/// Heading frame H: origin at the pelvis, z up, x along the heading. From one step to the next the
/// point of the standing foot that is lower rests in the world W (near flat contact heel and toe
/// are mixed, over 2 cm of height difference), and so does the direction from heel to toe:
///   Δψ = −Δ∠(toe − heel),   ΔP = q₀ − Rz(Δψ) q₁,   q the resting point in H before and after.
/// Height: the lowest of the four foot points touches the ground.
///
/// Which foot stands: the one with the smaller
///   Jf = (zf − min z)/2 cm + |vf − v̄|/0.5 m/s,
/// zf the height of its lowest point, vf the pelvis velocity it would mean, v̄ the velocity of the
/// last 0.3 s; it changes when the other's J is smaller by 0.3. So the foot that swings is told
/// by its speed, forwards, backwards and sideways, and changes happen where both agree about
/// the pelvis. The two feet still differ by up to 1 m/s then. So that the pelvis' velocity has no
/// jump, its place goes on from where the old foot would have taken it, p₀ = 0, ṗ₀ = difference,
/// and comes back to what the new foot says, p̈ = −2λṗ − λ²p with λ = 20 1/s: 1.8 cm away at most
/// for a difference of 1 m/s, all of it forgotten after 0.3 s, no travel lost. That foot slides by
/// as much (foot_lock.h holds it). Turns likewise.
struct alignas(64) RootLanes {
  // state
  Lane foot[4][3] = {};                         ///< the points of the step before, in its H [m]
  Lane mean_vx = {}, mean_vy = {}, known = {};  ///< v̄·known, known → 1 as it fills
  Lane support = {};                            ///< 0 left, 1 right
  Lane ease[3] = {}, ease_rate[3] = {};  ///< p and ṗ: x, y of H [m, m/s], turn [rad, rad/s]
  Lane fresh;                            ///< 1: there is no step before; the pelvis stays
  /// Of each foot by the foot lock, in H [m]; 0 without. The pelvis goes after the standing foot's
  /// with a time constant of 0.12 s, and so brings the leg back to what was synthesized.
  Lane displaced[2][2] = {};
  // the last step
  Lane dx = {}, dy = {};         ///< ΔP in H before the step [m]
  Lane cos_turn, sin_turn = {};  ///< of Δψ
  Lane turn = {};                ///< Δψ [rad]
  Lane height = {};              ///< of the pelvis above the ground [m]
  Lane slip[2][2] = {};    ///< velocity in W of each foot's lower point, in H after the step [m/s]
  Lane clearance[2] = {};  ///< height of each foot's lower point above the ground [m]

  RootLanes();
};

void root_motion(const PointLanes& point, float dt_s, RootLanes& root);

}  // namespace mimesis::synthesizer
