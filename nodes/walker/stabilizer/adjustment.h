#pragma once
#include "nodes/walker/pattern/pattern.h"
#include "nodes/walker/stabilizer/settings.h"

namespace mimesis::walker {

/// Steps placed anew when the soles are too small for a push [walking.md 8.6.8]. While the wished
/// ZMP is cut to z_r + d, the error e of the divergent component grows to
///   e_T = (e − d) exp(ω t) + d
/// until the landing in t [Englsberger, Ott, Albu-Schäffer 2015]; along and across the heading
/// each, and not beyond 0: where d is more than e the soles do it alone, and d goes as e goes. A
/// foot that lands e_T further takes the error away if the whole pattern goes on from there: the
/// pattern moves by the offset of the foot that has landed. The other one stands where it stood,
/// with the offset that the move gives it, until its next swing; the wished CoM follows the pattern
/// slowly. Protocol: step() says how far to move the pattern; the plan of the next tick has moved.
class StepAdjustment {
 public:
  explicit StepAdjustment(const StabilizerSettings& settings);

  void reset();
  /// First call of a tick: takes over what step() made the pattern move by.
  void follow();
  /// What the soles can do about the error of the divergent component at this tick.
  struct Balance {
    Eigen::Vector2d error_W_m, zmp_change_W_m;  ///< e, d
    bool cut = false;                           ///< d is less than wished
    double omega_1_s = 0.0;
  };
  /// @return how far the whole pattern has to move after this tick; 0 but at landings
  Eigen::Vector2d step(const PatternSample& plan, const Balance& balance);

  /// Of where the foot is led from where it is planned.
  const Eigen::Vector2d& foot_W_m(Side side) const { return foot_[side]; }
  /// Of the wished CoM from the planned one.
  const Eigen::Vector2d& com_W_m() const { return com_; }
  const Eigen::Vector2d& com_v_W() const { return com_v_; }

 private:
  /// e_T in the heading frame.
  Eigen::Vector2d landing_error(const PatternSample& plan, const Balance& balance) const;
  /// @param wish  in the heading frame. @return in W
  Eigen::Vector2d within_reach(const PatternSample& plan, Eigen::Vector2d wish) const;

  const StabilizerSettings* settings_;
  double share_;
  std::array<Eigen::Vector2d, 2> foot_;
  std::array<bool, 2> in_air_{false, false};
  Eigen::Vector2d com_, com_v_, moved_;  ///< moved_: since the last follow()
};

}  // namespace mimesis::walker
