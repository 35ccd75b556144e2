#pragma once
#include <Eigen/Core>
#include <deque>
#include <optional>
#include <string>

#include "common/task/symbols.h"

namespace mimesis::vision {

using task::Color, task::Goal, task::Grip, task::Transport;

/// Evidence of one picture, frame T [m]; things not seen are absent.
struct Sight {
  std::optional<Eigen::Vector2d> object, palm;  ///< centres of the blobs
  std::optional<Eigen::Vector2d> wrist;         ///< by the hand model
  /// Palm's normal against the vertical [rad]: 0 from above, π/2 from the side.
  std::optional<double> palm_angle_rad;
  /// The same by where the palm is, if it faces the object [rad]: for what the other leaves open.
  std::optional<double> facing_angle_rad;
  std::optional<Eigen::Vector2d> bar;  ///< its middle
  std::optional<double> beside_m;    ///< how far object and hand are from the bar's middle along it
  std::optional<double> bar_half_m;  ///< half of the bar's length
  std::optional<Eigen::Vector2d> goal_high, goal_low;  ///< where the object's centre would rest
  std::optional<double> object_luma;                   ///< 0..255, corrected for the light
};

/// A decided value and the share of the evidence that agreed.
template <class T>
struct Symbol {
  T value = T::unknown;
  double confidence = 0.0;  ///< 0..1 [1]
  std::string why_not;      ///< why it is not told, once the action it is told by is over
};

struct RecognizerLimits {
  int grip_votes = 10;            ///< pictures needed for the grip before the object moves
  int held_votes = 5;             ///< pictures needed for it once the object moves with the hand
  double passage_m = 0.03;        ///< way within the bar's zone needed for the transport
  int rest_frames = 6;            ///< pictures without motion that make a rest
  double agreement = 0.8;         ///< share of votes needed [1]
  double overrule = 0.9;          ///< share that lets a grip that is carried overrule a told one
  double reach_m = 0.17;          ///< palm and object belong together below it
  double clearance_m = 0.054;     ///< least distance of a grasping palm and the object
  double undecided_rad = 0.1745;  ///< abstain this close to the boundary of 45°
  double bar_zone_m = 0.09;       ///< transport is judged this far to both sides of the bar
  double bar_margin_m = 0.012;    ///< abstain this close to the bar's middle height
  double end_margin_m = 0.02;     ///< and this close to the place beside its end
  double moved_m = 0.03;          ///< the object has left its place
  double still_m = 0.006;         ///< motion within a rest
  double goal_radius_m = 0.05;    ///< recognizer: rest this close counts; sizes: a cap
  double light_luma = 104.0;      ///< boundary between a light and a dark object
  double undecided_luma = 12.0;   ///< abstain this close to it

  template <class Visitor>
  void visit(Visitor& v) {
    v("light_luma", light_luma, 0.0, 255.0);
    v("undecided_luma", undecided_luma, 0.0, 127.0);
  }
};

/// Turns observations into symbols [M18 2.2.1]: grip from the orientation of the palm at the
/// object, before it moves and while it is lifted; transport from where wrist and object pass the
/// bar, by the way they go beside it, not by pictures, so that the pace does not matter; goal from
/// the place where the object comes to rest. A hand that hovers has not grasped: what the object is
/// lifted with overrules what was told before, if nine of ten pictures agree. Else a symbol, once
/// decided, stays until a new demonstration begins: the object back before the bar, at rest and
/// alone, or the hand back at it after having been away. With two cameras, an object that is
/// carried around the end of the bar passes it neither above nor below.
class ActionRecognizer {
 public:
  explicit ActionRecognizer(const RecognizerLimits& limits) : limits_(limits) {}
  void update(const Sight& sight);

  const Symbol<Grip>& grip() const { return grip_.symbol; }
  const Symbol<Transport>& transport() const { return transport_.symbol; }
  const Symbol<Goal>& goal() const { return goal_.symbol; }
  const Symbol<Color>& color() const { return color_.symbol; }
  bool complete() const { return complete_; }
  /// The means are not decided: hand and wrist are still looked for.
  bool needs_hand() const {
    return grip_.symbol.value == Grip::unknown || transport_.symbol.value == Transport::unknown;
  }
  /// Newest palm angle [rad]; nothing if hand or object are not seen or too far apart.
  std::optional<double> palm_angle_rad() const { return angle_; }
  int grip_abstentions() const { return grip_.abstained; }  ///< in this demonstration

 private:
  enum class Stage { waiting, carried, placed };

  /// Counts votes for two values until enough agree; then fixed.
  template <class T>
  struct Ballot {
    Ballot(T a, T b) : first(a), second(b) {}
    T first, second;
    double votes_first = 0.0, votes_second = 0.0;
    int abstained = 0;  ///< pictures
    Symbol<T> symbol;
    void vote(T value, double weight = 1.0);
    void settle(double needed, double agreement);
    void clear() { *this = Ballot{first, second}; }
  };
  /// Votes of one picture for the grip: by the palm, by where it is.
  struct GripVote {
    std::optional<Grip> palm, facing;  ///< nothing: not seen; unknown: it abstains
  };

  void remember_start(const Sight& sight);
  GripVote vote_of(const Sight& sight) const;
  void judge_grip(const Sight& sight);
  void judge_held(const Sight& sight);
  void hold(const GripVote& vote);
  void end_held();
  std::optional<Grip> grip_at(const std::optional<double>& angle_rad) const;
  void judge_transport(const Sight& sight);
  void settle_transport();
  void judge_goal(const Sight& sight);
  bool object_still(const Sight& sight);
  bool near_goal(const Eigen::Vector2d& object, const Sight& sight) const;
  void restart();

  RecognizerLimits limits_;
  Stage stage_ = Stage::waiting;
  Ballot<Grip> grip_{Grip::precision, Grip::full}, facing_ = grip_, held_ = grip_,
                                                   held_facing_ = grip_;
  std::deque<GripVote> last_votes_;  ///< newest ones before the object moves
  int near_ = 0;                     ///< pictures of the hand near the object at its start
  int moved_ = 0;  ///< pictures in a row of the object, in the hand, away from its start
  Ballot<Transport> transport_{Transport::above, Transport::below};
  /// Of the object that is carried, in the picture before: how far beyond the bar.
  std::optional<double> beyond_;
  double passed_m_ = 0.0;                        ///< way within the bar's zone
  double beside_m2_ = 0.0, beside_way_m_ = 0.0;  ///< Σ of way · place along the bar, Σ of way
  std::optional<double> bar_half_m_;
  Ballot<Goal> goal_{Goal::high, Goal::low};
  Ballot<Color> color_{Color::light, Color::dark};
  std::deque<Eigen::Vector2d> trail_;     ///< newest object positions
  std::optional<Eigen::Vector2d> start_;  ///< where the object rested first
  Eigen::Vector2d placed_ = Eigen::Vector2d::Zero();
  std::optional<double> angle_;
  bool hand_away_ = true;
  bool held_over_ = false;        ///< the lifting is over, which tells the grip
  bool left_after_grip_ = false;  ///< a grasp was shown, nothing was moved, the hand went away
  bool complete_ = false;
  int away_frames_ = 0;
};

}  // namespace mimesis::vision
