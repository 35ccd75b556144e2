// Arms whose camera, or board, is known: exact, with noise, and with the mistakes that people make.
#include "nodes/vision/calibration/hand_eye.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <random>

#include "nodes/vision/calibration/testing/board_scene.h"

namespace mimesis::vision {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180.0;

Matrix3d turn(const Vector3d& axis_angle) {
  return Eigen::AngleAxisd(axis_angle.norm(), axis_angle.normalized()).toRotationMatrix();
}
Vector3d turn_between(const Matrix3d& from, const Matrix3d& to) {
  const Eigen::AngleAxisd by(Matrix3d(to * from.transpose()));
  return by.angle() * by.axis();
}

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  Vector3d vector(double most) {
    std::uniform_real_distribution<double> d(-most, most);
    return {d(random_), d(random_), d(random_)};
  }
  Vector3d normal(double sigma) {
    std::normal_distribution<double> d(0.0, sigma);
    return {d(random_), d(random_), d(random_)};
  }
  Isometry3d pose(const Vector3d& middle, double spread_m, double most_rad) {
    Isometry3d X = Isometry3d::Identity();
    X.translation() = middle + vector(spread_m);
    X.linear() = turn(vector(most_rad) + Vector3d(1e-9, 0.0, 0.0));
    return X;
  }
  std::mt19937& random() { return random_; }

 private:
  std::mt19937 random_;
};

/// An arm, a camera and a board, one of them on the arm.
struct ArmBench {
  Board board{9, 6, 0.025};
  OnArm on_arm;
  std::array<TrueCamera, 2> pair;
  image::Lens lens;
  Isometry3d X_camera, X_board;
  std::vector<Isometry3d> X_CB, X_WF;
  std::vector<ArmShot> shots;

  ArmBench(unsigned seed, OnArm carried, int pictures, double noise_px = 0.0)
      : on_arm(carried), draw(seed) {
    pair = random_pair(draw.random());
    const TrueCamera& c = pair[0];
    lens = {c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.k};
    X_camera = on_arm == OnArm::camera ? draw.pose({0.03, -0.05, 0.08}, 0.05, 1.0)
                                       : draw.pose({1.0, 0.2, 0.8}, 0.2, 2.0);
    X_board = on_arm == OnArm::camera ? draw.pose({0.6, 0.1, 0.0}, 0.1, 2.0)
                                      : draw.pose({0.02, 0.0, 0.1}, 0.05, 1.0);
    for (int i = 0; i < pictures; ++i) add(random_place(board, pair, draw.random()), noise_px);
  }

  void add(const Isometry3d& place, double noise_px = 0.0) {
    X_CB.push_back(place);
    X_WF.push_back(on_arm == OnArm::camera ? X_board * (X_camera * place).inverse()
                                           : X_camera * place * X_board.inverse());
    ArmShot shot{"p" + std::to_string(shots.size()), shots.size(),
                 true_corners(pair[0], board, place)};
    for (Vector2d& p : shot.seen) p += draw.normal(noise_px).head<2>();
    shots.push_back(shot);
  }
  /// The arm is not quite where it says.
  void disturb(double sigma_m, double sigma_rad) {
    for (Isometry3d& X : X_WF) {
      X.translation() += draw.normal(sigma_m);
      X.linear() = turn(draw.normal(sigma_rad)) * X.linear();
    }
  }

  tl::expected<HandEye, Status> solve(std::vector<PoseReading> readings = {}) const {
    if (readings.empty()) readings.push_back({"", X_WF});
    return calibrate_hand_eye(board, lens, on_arm, shots, readings);
  }
  /// What it is refused with; "" if it is not.
  std::string refusal(std::vector<PoseReading> readings = {}) const {
    const auto found = solve(std::move(readings));
    return found ? "" : found.error().reason;
  }

  Draw draw;
};

constexpr std::array kBoth{OnArm::camera, OnArm::board};

TEST(HandEye, ExactPosesGiveTheTruth) {
  for (const OnArm on_arm : kBoth) {
    for (unsigned seed = 1; seed <= 5; ++seed) {
      const ArmBench bench(seed, on_arm, 8);
      const auto found = bench.solve();
      ASSERT_TRUE(found) << found.error().reason;
      EXPECT_LT((found->X_camera.translation() - bench.X_camera.translation()).norm(), 1e-7);
      EXPECT_LT((found->X_board.translation() - bench.X_board.translation()).norm(), 1e-7);
      EXPECT_LT(turn_between(found->X_camera.linear(), bench.X_camera.linear()).norm(), 1e-7);
      EXPECT_NEAR(found->square_ratio, 1.0, 1e-7);
      EXPECT_LT(found->rms_px, 1e-5);
      EXPECT_EQ(found->fits.size(), 8u);
      EXPECT_TRUE(found->rejected.empty());
    }
  }
}

/// Deviations over sigmas of 40 sets, six each.
/// @param arm mean of how the arms err by the result [m, rad]
std::vector<double> deviations(double noise_px, double arm_m, double arm_rad, Vector2d& arm) {
  std::vector<double> out;
  arm.setZero();
  for (unsigned seed = 100; seed < 140; ++seed) {
    ArmBench bench(seed, kBoth.at(seed % 2), 15, noise_px);
    bench.disturb(arm_m, arm_rad);
    const auto found = bench.solve();
    EXPECT_TRUE(found) << seed << ": " << found.error().reason;
    if (!found) continue;
    EXPECT_TRUE(found->rejected.empty()) << seed << ": " << found->rejected[0].reason;
    const Vector3d p = (found->X_camera.translation() - bench.X_camera.translation())
                           .cwiseQuotient(found->position_sigma_m),
                   r = turn_between(bench.X_camera.linear(), found->X_camera.linear())
                           .cwiseQuotient(found->rotation_sigma_rad);
    for (int k = 0; k < 3; ++k) out.insert(out.end(), {p[k], r[k]});
    arm += Vector2d(found->arm_sigma_m, found->arm_sigma_rad) / 40.0;
  }
  return out;
}

double share_within_two(const std::vector<double>& z) {
  return static_cast<double>(
             std::ranges::count_if(z, [](double each) { return std::abs(each) <= 2.0; })) /
         static_cast<double>(z.size());
}
double mean_square(const std::vector<double>& z) {
  double sum = 0.0;
  for (const double each : z) sum += each * each / static_cast<double>(z.size());
  return sum;
}

TEST(HandEye, TheTruthIsWithinTwoSigma) {
  Vector2d arm;
  const auto z = deviations(0.3, 0.0, 0.0, arm);
  ASSERT_EQ(z.size(), 240u);
  EXPECT_GE(share_within_two(z), 0.90);
  EXPECT_GT(mean_square(z), 0.4);  // and the sigmas are no excuse
  EXPECT_LT(arm.x(), 0.1e-3);      // nor is the arm
  EXPECT_LT(arm.y(), 0.01 * kDegree);
}

TEST(HandEye, TheTruthIsWithinTwoSigmaOfAnArmThatErrs) {
  Vector2d arm;
  const auto z = deviations(0.1, 0.5e-3, 0.03 * kDegree, arm);
  ASSERT_EQ(z.size(), 240u);
  EXPECT_GE(share_within_two(z), 0.88);  // fifteen poses estimate a sigma to 20 %
  EXPECT_GT(mean_square(z), 0.4);
  EXPECT_NEAR(arm.x(), 0.5e-3, 0.1e-3);
  EXPECT_NEAR(arm.y(), 0.03 * kDegree, 0.006 * kDegree);
}

/// X_FC by OpenCV's closed form [Park and Martin 1994], code that is not ours.
Isometry3d by_opencv(const ArmBench& bench) {
  const auto mat = [](const Eigen::MatrixXd& m) {
    cv::Mat out(static_cast<int>(m.rows()), static_cast<int>(m.cols()), CV_64F);
    for (int i = 0; i < out.rows; ++i)
      for (int k = 0; k < out.cols; ++k) out.at<double>(i, k) = m(i, k);
    return out;
  };
  const image::Lens& l = bench.lens;
  const cv::Mat k =
      mat((Matrix3d() << l.fx_px, 0, l.cx_px, 0, l.fy_px, l.cy_px, 0, 0, 1).finished());
  std::vector<cv::Mat> r_f, t_f, r_b, t_b;
  for (const ArmShot& shot : bench.shots) {
    r_f.push_back(mat(bench.X_WF[shot.row].linear()));
    t_f.push_back(mat(bench.X_WF[shot.row].translation()));
    std::vector<cv::Point3d> places;
    std::vector<cv::Point2d> seen;
    for (std::size_t i = 0; i < bench.board.size(); ++i) {
      const Vector3d p = bench.board.point(i);
      places.emplace_back(p.x(), p.y(), p.z());
      seen.emplace_back(shot.seen[i].x(), shot.seen[i].y());
    }
    cv::Mat turned, shift, rotation;
    cv::solvePnP(places, seen, k, std::vector<double>(l.distortion.begin(), l.distortion.end()),
                 turned, shift);
    cv::Rodrigues(turned, rotation);
    r_b.push_back(rotation);
    t_b.push_back(shift);
  }
  cv::Mat r, t;
  cv::calibrateHandEye(r_f, t_f, r_b, t_b, r, t, cv::CALIB_HAND_EYE_PARK);
  Isometry3d out = Isometry3d::Identity();
  for (int i = 0; i < 3; ++i) {
    out.translation()[i] = t.at<double>(i);
    for (int c = 0; c < 3; ++c) out.linear()(i, c) = r.at<double>(i, c);
  }
  return out;
}

/// A second opinion, which the result agrees with and is better than: for arms that do not err, and
/// for those that do.
TEST(HandEye, AgreesWithOpenCvAndIsNearerToTheTruth) {
  for (const double arm : {0.0, 1.0, 2.0}) {
    Vector2d ours = Vector2d::Zero(), theirs = Vector2d::Zero();
    for (unsigned seed = 200; seed < 220; ++seed) {
      ArmBench bench(seed, OnArm::camera, 12, 0.2);
      bench.disturb(arm * 0.5e-3, arm * 0.03 * kDegree);
      const auto found = bench.solve();
      ASSERT_TRUE(found) << found.error().reason;
      const Isometry3d other = by_opencv(bench);
      EXPECT_LT((found->X_camera.translation() - other.translation()).norm(), 0.015) << seed;
      const auto error = [&](const Isometry3d& X) {
        return Vector2d((X.translation() - bench.X_camera.translation()).squaredNorm(),
                        turn_between(bench.X_camera.linear(), X.linear()).squaredNorm());
      };
      ours += error(found->X_camera);
      theirs += error(other);
    }
    EXPECT_LT(ours.x(), theirs.x()) << arm;
    EXPECT_LT(ours.y(), theirs.y()) << arm;
  }
}

/// Whether every one of `words` is in the text.
::testing::AssertionResult says(const std::string& text, const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    if (text.find(word) == std::string::npos)
      return ::testing::AssertionFailure() << "no '" << word << "' in: " << text;
  }
  return ::testing::AssertionSuccess();
}

TEST(HandEye, PosesThatAreTheOtherWayRoundAreRefusedByName) {
  for (unsigned seed = 20; seed < 26; ++seed) {
    const OnArm on_arm = kBoth.at(seed % 2);
    ArmBench bench(seed, on_arm, 12, 0.3);
    for (Isometry3d& X : bench.X_WF) X = X.inverse();
    EXPECT_TRUE(says(bench.refusal(), {"each pose is that of the base in the flange",
                                       on_arm == OnArm::camera ? "it is the board that the arm"
                                                               : "it is the camera that the arm"}))
        << seed;
  }
}

TEST(HandEye, PosesOfTheNextOrThePreviousRowAreRefusedByName) {
  for (unsigned seed = 30; seed < 36; ++seed) {
    ArmBench bench(seed, kBoth.at(seed % 2), 12, 0.3);
    const bool late = seed < 33;
    auto& poses = bench.X_WF;
    std::rotate(poses.begin(), late ? poses.end() - 1 : poses.begin() + 1, poses.end());
    EXPECT_TRUE(says(bench.refusal(), {"each pose belongs to the picture one row",
                                       late ? "before it" : "behind it"}))
        << seed;
  }
}

TEST(HandEye, LengthsInAnotherUnitAreRefusedByName) {
  for (const auto& [factor, name] :
       {std::pair{1e3, "the positions are in mm, not in m"},
        std::pair{1e-3, "the positions are in m, not in mm"},
        std::pair{1.0 / 0.0254, "the positions are in inches, not in m"}}) {
    for (const OnArm on_arm : kBoth) {
      ArmBench bench(41, on_arm, 12, 0.3);
      for (Isometry3d& X : bench.X_WF) X.translation() *= factor;
      EXPECT_TRUE(says(bench.refusal(), {name}));
    }
  }
}

TEST(HandEye, SquaresOfAnotherSizeAreRefusedByName) {
  for (const auto& [said_m, name] :
       {std::pair{0.05, "the squares have 25 mm, not 50 mm"},
        std::pair{0.0125, "the squares have 25 mm, not 12.5 mm"},
        std::pair{0.024, "the squares have 2"}, std::pair{0.026, "the squares have 2"}}) {
    for (const OnArm on_arm : kBoth) {
      ArmBench bench(42, on_arm, 15, 0.1);
      bench.board.square_m = said_m;
      EXPECT_TRUE(says(bench.refusal(), {name}));
    }
  }
}

TEST(HandEye, OtherReadingsAreNamed) {
  ArmBench bench(43, OnArm::camera, 12, 0.3);
  const std::vector<Isometry3d> right = bench.X_WF;
  for (Isometry3d& X : bench.X_WF) {
    const Eigen::Quaterniond q(X.linear());
    X.linear() = Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()).toRotationMatrix();
  }
  EXPECT_TRUE(says(bench.refusal({{"", bench.X_WF}, {"the quaternions are w x y z", right}}),
                   {"if the quaternions are w x y z"}));
  // Two mistakes at once.
  std::vector<Isometry3d> large = right;
  for (Isometry3d& X : large) X.translation() *= 1e3;
  EXPECT_TRUE(says(bench.refusal({{"", bench.X_WF}, {"the quaternions are w x y z", large}}),
                   {"the quaternions are w x y z", "and if the positions are in mm"}));
  // Without the right one nothing fits, and it is said by how much.
  EXPECT_TRUE(says(bench.refusal({{"", bench.X_WF}}),
                   {"contradict each other", "the arm's turns differ by"}));
}

TEST(HandEye, MotionsThatDoNotBoundItAreRefusedByName) {
  for (const OnArm on_arm : kBoth) {
    const ArmBench few(51, on_arm, 3);
    EXPECT_TRUE(says(few.refusal(), {"3 of 3 pictures are of use, expected 4 or more"}));

    const auto row_of = [&](const std::vector<Isometry3d>& places, double noise_px = 0.1) {
      ArmBench bench(52, on_arm, 0);
      for (const Isometry3d& X : places) bench.add(X, noise_px);
      return bench.refusal();
    };
    Isometry3d front = Isometry3d::Identity();
    front.translation() = Vector3d(-0.1, -0.06, 0.5);
    std::vector<Isometry3d> same(10, front), shifts, one_axis;
    for (int i = 0; i < 10; ++i) {
      shifts.push_back(front);
      shifts.back().translation() += Vector3d(0.008 * i, -0.004 * i, 0.02 * (i % 4));
      one_axis.push_back(front);
      one_axis.back().linear() = turn({0.0, 0.0, 0.1 * i - 0.45 + 1e-6});
    }
    EXPECT_TRUE(says(row_of(same), {"all pictures show the board at one place"}));
    EXPECT_TRUE(says(row_of(shifts), {"shifts alone tell nothing of where the camera is"}));
    EXPECT_TRUE(
        says(row_of(one_axis),
             {"all turns are about one axis, near the line of sight",
              "add poses in which the board is turned by 30° or more about the picture's"}));
    // Two axes, but hardly turned: bounded in principle only.
    std::vector<Isometry3d> little;
    for (int i = 0; i < 6; ++i) {
      little.push_back(front);
      little.back().linear() = turn({0.1 * (i % 2), 0.1 * (i / 2 % 2), 1e-6});
    }
    const std::string refused = row_of(little, 1.3);
    EXPECT_TRUE(
        says(refused, {"do not bound where the camera is: 2 sigma", "most helps a view of"}))
        << refused;
  }
}

TEST(HandEye, APictureWithoutItsPoseIsRejectedByName) {
  for (const OnArm on_arm : kBoth) {
    ArmBench bench(61, on_arm, 14, 0.2);
    bench.X_WF[5].translation() += Vector3d(0.004, -0.003, 0.0);  // the arm still moved
    const auto found = bench.solve();
    ASSERT_TRUE(found) << found.error().reason;
    ASSERT_EQ(found->rejected.size(), 1u);
    EXPECT_EQ(found->rejected[0].name, "p5");
    EXPECT_LT((found->X_camera.translation() - bench.X_camera.translation()).norm(), 2e-3);
    EXPECT_EQ(found->fits.size(), 13u);
  }
}

TEST(HandEye, TheAdvisedViewNarrowsItMost) {
  ArmBench bench(71, OnArm::camera, 6, 0.3);
  const auto before = bench.solve();
  ASSERT_TRUE(before) << before.error().reason;
  const double distance_m = before->fits[0].distance_m;
  // 2 sigma with three more of a view.
  const auto after = [&](double degrees, const Vector3d& axis, double away_m) {
    ArmBench more = bench;
    Isometry3d place = Isometry3d::Identity();
    place.linear() = turn(degrees * kDegree * axis + Vector3d(1e-12, 0.0, 0.0));
    place.translation() = Vector3d(0.0, 0.0, away_m) - place.linear() * bench.board.middle();
    for (int i = 0; i < 3; ++i) more.add(place, 0.3);
    const auto found = more.solve();
    EXPECT_TRUE(found) << found.error().reason;
    return found ? found->position_2sigma_m() : 1.0;
  };
  double advised = 0.0;
  if (before->helps.starts_with("the board at ")) {
    advised = after(0.0, Vector3d::UnitX(), std::stod(before->helps.substr(13)));
  } else {
    ASSERT_TRUE(before->helps.starts_with("the board turned by ")) << before->helps;
    const Vector3d axis = before->helps.ends_with("horizontal") ? Vector3d::UnitX()
                          : before->helps.ends_with("vertical") ? Vector3d::UnitY()
                                                                : Vector3d::UnitZ();
    advised = after(std::stod(before->helps.substr(20)), axis, distance_m);
  }
  EXPECT_LT(advised, 0.9 * before->position_2sigma_m());
  // The same view again tells less.
  ArmBench again = bench;
  for (int i = 0; i < 3; ++i) again.add(bench.X_CB[0], 0.3);
  const auto same = again.solve();
  ASSERT_TRUE(same) << same.error().reason;
  EXPECT_LT(advised, same->position_2sigma_m());
}

}  // namespace
}  // namespace mimesis::vision
