#include <gtest/gtest.h>

#include "nodes/vision/action_recognizer.h"

namespace mimesis::vision {
namespace {

using Eigen::Vector2d;

constexpr double kFromAbove = 0.1, kFromSide = 1.5;  // palm against the vertical [rad]

/// Plays scenes to a recognizer: an object at (-0.27, 0.04), a bar at height 0.215, goals at 0.19
/// and 0.35.
class Stage : public ::testing::Test {
 protected:
  void show(const Vector2d& object, const std::optional<Vector2d>& palm, int frames) {
    for (int k = 0; k < frames; ++k) {
      sight_.object = object;
      sight_.palm = palm;
      sight_.palm_angle_rad = palm ? std::optional(angle_) : std::nullopt;
      recognizer_.update(sight_);
    }
  }
  /// Object and palm move together in equal steps.
  void carry(const Vector2d& from, const Vector2d& to, const Vector2d& palm_offset, int frames) {
    for (int k = 1; k <= frames; ++k) {
      const Vector2d at = from + (to - from) * k / frames;
      show(at, at + palm_offset, 1);
    }
  }
  void grasp(const Vector2d& palm_offset, int frames) {
    show(start_, std::nullopt, 20);
    show(start_, start_ + palm_offset, frames);
  }
  void transport(double height, const Vector2d& palm_offset, const Vector2d& goal) {
    carry(start_, {-0.27, height}, palm_offset, 15);
    carry({-0.27, height}, {goal.x(), height}, palm_offset, 40);
    carry({goal.x(), height}, goal, palm_offset, 15);
    show(goal, goal + palm_offset, 10);
  }

  const Vector2d start_{-0.27, 0.04}, high_{0.35, 0.16}, low_{0.19, 0.07};
  const Vector2d from_above_{-0.02, 0.10}, from_side_{-0.07, 0.01};
  double angle_ = kFromAbove;
  Sight sight_{.object = {},
               .palm = {},
               .wrist = {},
               .palm_angle_rad = {},
               .facing_angle_rad = {},
               .bar = Vector2d(0.0, 0.215),
               .beside_m = {},
               .bar_half_m = {},
               .goal_high = high_,
               .goal_low = low_,
               .object_luma = 150.0};
  ActionRecognizer recognizer_{RecognizerLimits{}};
};

TEST_F(Stage, KnowsAWholeDemonstration) {
  grasp(from_above_, 15);
  EXPECT_EQ(recognizer_.grip().value, Grip::precision);
  EXPECT_EQ(recognizer_.transport().value, Transport::unknown);
  transport(0.30, from_above_, high_);
  EXPECT_EQ(recognizer_.transport().value, Transport::above);
  EXPECT_EQ(recognizer_.goal().value, Goal::high);
  EXPECT_GT(recognizer_.goal().confidence, 0.9);
  EXPECT_EQ(recognizer_.color().value, Color::light);
  EXPECT_FALSE(recognizer_.complete());  // the hand is still there
  show(high_, high_ + Vector2d(-0.3, 0.1), 10);
  EXPECT_TRUE(recognizer_.complete());
}

TEST_F(Stage, KnowsTheOtherOne) {
  sight_.object_luma = 70.0;
  angle_ = kFromSide;
  grasp(from_side_, 15);
  transport(0.06, from_side_, low_);
  EXPECT_EQ(recognizer_.grip().value, Grip::full);
  EXPECT_EQ(recognizer_.transport().value, Transport::below);
  EXPECT_EQ(recognizer_.goal().value, Goal::low);
  EXPECT_EQ(recognizer_.color().value, Color::dark);
}

TEST_F(Stage, AbstainsFromAColourBetweenLightAndDark) {
  const RecognizerLimits limits;
  for (const double off : {-0.99, 0.0, 0.99}) {
    sight_.object_luma = limits.light_luma + off * limits.undecided_luma;
    grasp(from_above_, 15);
    EXPECT_EQ(recognizer_.color().value, Color::unknown) << off;
  }
  sight_.object_luma = limits.light_luma - 1.01 * limits.undecided_luma;
  show(start_, std::nullopt, 20);
  EXPECT_EQ(recognizer_.color().value, Color::dark);
}

TEST_F(Stage, SaysNothingBeforeEnoughFramesAgree) {
  grasp(from_above_, 9);
  EXPECT_EQ(recognizer_.grip().value, Grip::unknown);
  show(start_, start_ + from_above_, 1);
  EXPECT_EQ(recognizer_.grip().value, Grip::precision);
}

TEST_F(Stage, AbstainsNearTheBoundaryOf45Degrees) {
  angle_ = 0.785;
  grasp(from_above_, 40);
  EXPECT_EQ(recognizer_.grip().value, Grip::unknown);
  EXPECT_EQ(recognizer_.grip_abstentions(), 40);
  ASSERT_TRUE(recognizer_.palm_angle_rad());
  EXPECT_NEAR(*recognizer_.palm_angle_rad(), 0.785, 1e-3);
}

TEST_F(Stage, DoesNotChangeItsMindAfterTheDecision) {
  grasp(from_above_, 12);
  angle_ = kFromSide;
  show(start_, start_ + from_side_, 100);
  EXPECT_EQ(recognizer_.grip().value, Grip::precision);
}

TEST_F(Stage, KeepsOnlyTheGripIfOnlyGraspingIsSeen) {  // [M18 Fig. 2.20]
  angle_ = kFromSide;
  grasp(from_side_, 40);
  EXPECT_EQ(recognizer_.grip().value, Grip::full);
  EXPECT_EQ(recognizer_.transport().value, Transport::unknown);
  EXPECT_EQ(recognizer_.goal().value, Goal::unknown);
  EXPECT_FALSE(recognizer_.complete());
}

TEST_F(Stage, TellsNoTransportWithoutABar) {  // [M18 Fig. 2.21]
  sight_.bar.reset();
  grasp(from_side_, 15);
  transport(0.10, from_side_, high_);
  EXPECT_EQ(recognizer_.transport().value, Transport::unknown);
  EXPECT_EQ(recognizer_.goal().value, Goal::high);
}

TEST_F(Stage, StaysWithWhatWasPlacedWhenItsStandIsOutOfSight) {
  sight_.bar.reset();
  grasp(from_side_, 15);
  transport(0.10, from_side_, high_);
  sight_.goal_high.reset();
  show(high_, high_ + Vector2d(-0.3, 0.1), 30);
  EXPECT_TRUE(recognizer_.complete());
  EXPECT_EQ(recognizer_.goal().value, Goal::high);
  show(start_, std::nullopt, 10);
  EXPECT_FALSE(recognizer_.complete());
}

TEST_F(Stage, StartsAnewWhenTheObjectIsBack) {
  grasp(from_above_, 15);
  transport(0.30, from_above_, high_);
  show(high_, std::nullopt, 10);
  ASSERT_TRUE(recognizer_.complete());
  show(start_, std::nullopt, 10);
  EXPECT_FALSE(recognizer_.complete());
  EXPECT_EQ(recognizer_.grip().value, Grip::unknown);
  EXPECT_EQ(recognizer_.goal().value, Goal::unknown);
  angle_ = kFromSide;
  grasp(from_side_, 15);
  EXPECT_EQ(recognizer_.grip().value, Grip::full);
}

TEST_F(Stage, StartsAnewWhenTheHandReturnsAfterAMereGrasp) {
  grasp(from_above_, 15);
  show(start_, std::nullopt, 30);
  EXPECT_EQ(recognizer_.grip().value, Grip::precision);
  angle_ = kFromSide;
  show(start_, start_ + from_side_, 15);
  EXPECT_EQ(recognizer_.grip().value, Grip::full);
}

TEST_F(Stage, AbstainsWhereTheHandModelSaysNothing) {
  show(start_, std::nullopt, 20);
  for (int k = 0; k < 30; ++k) {
    sight_.palm = start_ + from_above_;
    sight_.palm_angle_rad.reset();
    recognizer_.update(sight_);
  }
  EXPECT_EQ(recognizer_.grip().value, Grip::unknown);
  EXPECT_TRUE(recognizer_.needs_hand());
}

TEST_F(Stage, WhereTheHandIsTellsWhatTheModelLeavesOpen) {
  show(start_, std::nullopt, 20);
  const auto approach = [&](int pictures, double facing_rad) {
    sight_.facing_angle_rad = facing_rad;
    angle_ = 0.785;  // the model abstains
    show(start_, start_ + from_side_, pictures);
  };
  approach(25, kFromSide);
  EXPECT_EQ(recognizer_.grip().value, Grip::unknown);
  show(start_ + Vector2d(0.0, 0.1), start_ + Vector2d(-0.07, 0.11), 2);
  EXPECT_EQ(recognizer_.grip().value, Grip::unknown);  // it may be something else
  show(start_ + Vector2d(0.0, 0.1), start_ + Vector2d(-0.07, 0.11), 1);
  EXPECT_EQ(recognizer_.grip().value, Grip::full);
}

TEST_F(Stage, ASinglePictureOfTheObjectElsewhereChangesNothing) {
  show(start_, std::nullopt, 20);
  show(start_, start_ + from_above_, 2);
  show(start_ + Vector2d(-0.03, 0.04), start_ + from_above_, 1);
  show(start_, start_ + from_above_, 12);
  EXPECT_EQ(recognizer_.grip().value, Grip::precision);
}

TEST_F(Stage, ThePalmOutvotesWhereTheHandIs) {
  sight_.facing_angle_rad = kFromSide;
  grasp(from_above_, 40);  // from above by the palm
  EXPECT_EQ(recognizer_.grip().value, Grip::precision);
}

TEST_F(Stage, TheWristDecidesBesideTheBar) {
  grasp(from_above_, 15);
  sight_.wrist = Vector2d(0.0, 0.215);  // at the height of the bar: neither above nor below
  transport(0.30, from_above_, high_);
  EXPECT_EQ(recognizer_.transport().value, Transport::unknown);
}

TEST_F(Stage, KnowsAQuickTransportOnceTheBarIsPassed) {
  grasp(from_above_, 15);
  carry(start_, {-0.27, 0.3}, from_above_, 15);
  for (const double x : {-0.13, -0.07, -0.01, 0.05}) show({x, 0.3}, Vector2d(x - 0.02, 0.4), 1);
  EXPECT_EQ(recognizer_.transport().value, Transport::unknown);
  show({0.11, 0.3}, Vector2d(0.09, 0.4), 1);
  EXPECT_EQ(recognizer_.transport().value, Transport::above);
}

/// As many pictures as a demonstration of 1 to 10 s has at 30 Hz.
TEST_F(Stage, KnowsTheMeansAtAnyPace) {
  for (const double whole_s : {1.0, 1.5, 2.2, 4.0, 10.0}) {
    const auto pictures = [whole_s](double share) {
      return std::max(2, static_cast<int>(std::lround(share * whole_s * 30.0)));
    };
    for (const bool above : {true, false}) {
      ActionRecognizer fresh{RecognizerLimits{}};
      recognizer_ = fresh;
      angle_ = above ? kFromAbove : kFromSide;
      const Vector2d palm = above ? from_above_ : from_side_, goal = above ? high_ : low_;
      const double height = above ? 0.30 : 0.06;
      grasp(palm, pictures(0.12));
      carry(start_, {-0.27, height}, palm, pictures(0.12));
      carry({-0.27, height}, {goal.x(), height}, palm, pictures(0.25));
      carry({goal.x(), height}, goal, palm, pictures(0.12));
      show(goal, goal + palm, 8);
      EXPECT_EQ(recognizer_.grip().value, above ? Grip::precision : Grip::full) << whole_s;
      EXPECT_EQ(recognizer_.transport().value, above ? Transport::above : Transport::below)
          << whole_s;
      EXPECT_EQ(recognizer_.goal().value, above ? Goal::high : Goal::low) << whole_s;
    }
  }
}

TEST_F(Stage, TellsNoPassageOfWhatIsCarriedAroundTheEndOfTheBar) {
  sight_.bar_half_m = 0.13;
  for (const double beside : {0.0, -0.05, 0.10, 0.13, -0.18, 0.30}) {
    ActionRecognizer fresh{RecognizerLimits{}};
    recognizer_ = fresh;
    sight_.beside_m = beside;
    grasp(from_above_, 15);
    transport(0.30, from_above_, high_);
    const Symbol<Transport>& told = recognizer_.transport();
    const bool over = std::abs(beside) < 0.11;
    EXPECT_EQ(told.value, over ? Transport::above : Transport::unknown) << beside;
    EXPECT_EQ(told.why_not.find("around the end of the bar") != std::string::npos,
              std::abs(beside) > 0.15)
        << beside << told.why_not;
    EXPECT_EQ(told.why_not.find("too near to tell") != std::string::npos, beside == 0.13)
        << told.why_not;
    EXPECT_EQ(recognizer_.goal().value, Goal::high);
  }
}

TEST_F(Stage, TheGripThatLiftsOverrulesTheOneThatHovered) {
  angle_ = kFromSide;
  show(start_, std::nullopt, 20);
  show(start_, start_ + from_side_, 30);  // told already: it may be a mere grasp
  angle_ = kFromAbove;
  show(start_, start_ + from_above_, 12);
  transport(0.30, from_above_, high_);
  EXPECT_EQ(recognizer_.grip().value, Grip::precision);
  EXPECT_GE(recognizer_.grip().confidence, 0.9);
}

/// Votes of the way beside the bar, not of the time spent there.
TEST_F(Stage, HesitationBesideTheBarCountsForNothing) {
  grasp(from_above_, 15);
  carry(start_, {-0.27, 0.3}, from_above_, 15);
  carry({-0.27, 0.3}, {-0.08, 0.3}, from_above_, 15);
  carry({-0.08, 0.3}, {-0.08, 0.15}, from_above_, 10);  // down beside the bar, and up again
  show({-0.08, 0.15}, Vector2d(-0.08, 0.15) + Vector2d(-0.1, 0.0), 90);
  carry({-0.08, 0.15}, {-0.08, 0.3}, from_above_, 10);
  carry({-0.08, 0.3}, {0.35, 0.3}, from_above_, 30);
  EXPECT_EQ(recognizer_.transport().value, Transport::above);
}

TEST_F(Stage, SaysWhyASymbolIsNotTold) {
  angle_ = 0.785;
  grasp(from_above_, 15);
  sight_.wrist = Vector2d(0.0, 0.215);
  transport(0.30, from_above_, {0.28, 0.25});  // into the air between the goals
  show({0.28, 0.25}, std::nullopt, 10);
  EXPECT_NE(recognizer_.grip().why_not.find("turned between both grips"), std::string::npos)
      << recognizer_.grip().why_not;
  EXPECT_NE(recognizer_.transport().why_not.find("the rest at its height"), std::string::npos)
      << recognizer_.transport().why_not;
  EXPECT_NE(recognizer_.goal().why_not.find("mm from the nearest goal"), std::string::npos)
      << recognizer_.goal().why_not;
}

TEST_F(Stage, SaysThatThePalmWasNotSeen) {
  show(start_, std::nullopt, 20);
  for (int k = 0; k < 55; ++k) {  // up, and across the bar
    const Vector2d at = k < 15 ? Vector2d(start_ + Vector2d(0.0, 0.02) * k)
                               : Vector2d(-0.27 + 0.015 * (k - 15), 0.32);
    sight_.object = at;
    sight_.palm = at + from_above_;
    sight_.palm_angle_rad.reset();
    recognizer_.update(sight_);
  }
  EXPECT_EQ(recognizer_.grip().value, Grip::unknown);
  EXPECT_NE(recognizer_.grip().why_not.find("pictures show the palm at the object"),
            std::string::npos)
      << recognizer_.grip().why_not;
}

TEST_F(Stage, TakesNoStopInTheAirForAGoal) {
  grasp(from_above_, 15);
  carry(start_, {-0.27, 0.3}, from_above_, 15);
  carry({-0.27, 0.3}, {0.35, 0.3}, from_above_, 40);
  show({0.35, 0.3}, Vector2d(0.35, 0.3) + from_above_, 30);
  EXPECT_EQ(recognizer_.goal().value, Goal::unknown);
}

}  // namespace
}  // namespace mimesis::vision
