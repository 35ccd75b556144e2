// Boards rendered through lenses that the calibration does not know, and the real pairs.
#include "nodes/vision/calibration/calibration.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/image/image.h"
#include "common/shared_data.h"
#include "nodes/vision/calibration/testing/board_scene.h"

namespace mimesis::vision {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::array<PictureSize, 2> kSizes{{{640, 480}, {640, 480}}};

/// A pair of cameras, positions of a board before it, and the corners found in rendered pictures.
struct Bench {
  Board board;
  std::array<TrueCamera, 2> pair;
  std::vector<Eigen::Isometry3d> places;
  std::vector<Shot> shots;
};

/// @param rendered false: corners are projected, with Gaussian errors of `noise` pixels
Bench bench(unsigned seed, const Board& board, int positions, double noise, bool rendered) {
  std::mt19937 random(seed);
  Bench out{board, random_pair(random), {}, {}};
  std::normal_distribution<double> error(0.0, noise);
  for (int i = 0; i < positions; ++i) {
    out.places.push_back(random_place(board, out.pair, random));
    Shot shot{"shot" + std::to_string(i), {}};
    for (const TrueCamera& camera : out.pair) {
      if (rendered) {
        const auto seen =
            find_board(board_picture(camera, board, out.places.back(), noise, random), board);
        EXPECT_TRUE(seen) << "seed " << seed << ", " << shot.name;
        if (seen) shot.seen.push_back(seen->corners);
      } else {
        shot.seen.push_back(true_corners(camera, board, out.places.back()));
        for (Vector2d& p : shot.seen.back()) p += Vector2d(error(random), error(random));
      }
    }
    if (shot.seen.size() == 2) out.shots.push_back(shot);
  }
  return out;
}

/// Rms error of positions that the calibrated pair triangulates from true pixels, over depth, at
/// the corners of boards that it has not seen.
double position_error(const Bench& truth, const Calibrated& ours, unsigned seed) {
  std::mt19937 random(seed);
  double squares = 0.0;
  int count = 0;
  for (int i = 0; i < 20; ++i) {
    const auto place = random_place(truth.board, truth.pair, random);
    for (std::size_t k = 0; k < truth.board.size(); k += 5) {
      const Vector3d p = place * truth.board.point(k);
      const std::array<image::Sighting, 2> seen{{{&ours.cameras[0], truth.pair[0].pixel(p), 0.1},
                                                 {&ours.cameras[1], truth.pair[1].pixel(p), 0.1}}};
      const auto found = image::triangulate(seen);
      EXPECT_TRUE(found);
      if (!found) return 1.0;
      squares += (found->p_T - p).squaredNorm() / (p.z() * p.z());
      ++count;
    }
  }
  return std::sqrt(squares / count);
}

TEST(FindBoard, CornersAreWhereTheyWereRendered) {
  std::mt19937 random(11);
  for (int i = 0; i < 6; ++i) {
    const Board board{i % 2 == 0 ? 9 : 7, 6 - i % 3, 0.02 + 0.002 * i};
    if (!board.has_a_beginning()) continue;
    const auto pair = random_pair(random);
    const auto place = random_place(board, pair, random);
    const auto seen = find_board(board_picture(pair[0], board, place, 4.0, random), board);
    ASSERT_TRUE(seen) << i;
    const Corners truth = true_corners(pair[0], board, place);
    double squares = 0.0;
    for (std::size_t k = 0; k < truth.size(); ++k)
      squares += (seen->corners[k] - truth[k]).squaredNorm() / static_cast<double>(truth.size());
    EXPECT_LT(std::sqrt(squares), 0.15)
        << board.described();  // another order is off by 10 and more
  }
}

TEST(FindBoard, BeginsAtTheSameCornerHoweverThePictureIsTurned) {
  std::mt19937 random(5);
  const Board board{8, 5, 0.03};
  const auto pair = random_pair(random);
  const auto place = random_place(board, pair, random);
  const image::Image upright = board_picture(pair[0], board, place, 3.0, random);
  image::Image turned(upright.width, upright.height);
  for (int v = 0; v < upright.height; ++v) {
    for (int u = 0; u < upright.width; ++u)
      std::copy_n(upright.at(u, v), 3, turned.at(upright.width - 1 - u, upright.height - 1 - v));
  }
  const auto a = find_board(upright, board), b = find_board(turned, board);
  ASSERT_TRUE(a && b);
  for (std::size_t i = 0; i < board.size(); ++i) {
    EXPECT_NEAR((a->corners[i] + b->corners[i] - Vector2d(639.0, 479.0)).norm(), 0.0, 0.2) << i;
  }
}

TEST(FindBoard, SeesTheSizeOfABoardThatIsNotAsSaid) {
  std::mt19937 random(3);
  const Board board{9, 6, 0.025};
  const auto pair = random_pair(random);
  Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
  place.translation() = Vector3d(0.0, 0.0, 0.45) - board.middle();
  const image::Image picture = board_picture(pair[0], board, place, 3.0, random);
  EXPECT_FALSE(find_board(picture, {7, 10, 0.025}));
  EXPECT_EQ(board_size_in(picture), (std::pair{9, 6}));
  EXPECT_FALSE(find_board(image::Image(640, 480), board));
}

TEST(ParseBoard, RefusesWhatIsNoUsableBoard) {
  EXPECT_EQ(parse_board("9x6", 0.1).columns, 9);
  for (const char* text : {"", "9", "9x", "x6", "9x6x3", "9,6", "2x6", "9x2", "7x7", "-9x6",
                           "1000x6", "9x6 ", "nan"}) {
    EXPECT_THROW(parse_board(text, 0.1), ConfigError) << text;
  }
}

TEST(Calibrate, RecoversPairsFromRenderedBoards) {
  for (const unsigned seed : {101u, 202u}) {
    const Bench truth = bench(seed, {9, 6, 0.024 + 0.001 * (seed % 7)}, 11, 2.0 + seed % 3, true);
    const auto ours = calibrate(truth.board, kSizes, truth.shots);
    ASSERT_TRUE(ours) << seed << ": " << ours.error().reason;
    EXPECT_TRUE(ours->rejected.empty())
        << ours->rejected.front().name << ours->rejected.front().reason;
    for (std::size_t c = 0; c < 2; ++c) {
      const image::Lens& lens = ours->cameras[c].lens();
      const TrueCamera& camera = truth.pair[c];
      EXPECT_NEAR(lens.fx_px / camera.fx, 1.0, 0.006) << seed;
      EXPECT_NEAR(lens.fy_px / camera.fy, 1.0, 0.006) << seed;
      EXPECT_NEAR(lens.cx_px, camera.cx, 4.0) << seed;
      EXPECT_NEAR(lens.cy_px, camera.cy, 4.0) << seed;
    }
    const Vector3d p = truth.pair[1].p_FC;
    EXPECT_LT((ours->cameras[1].eye() - p).norm(), 0.01 * p.norm()) << seed;
    EXPECT_LT(position_error(truth, *ours, seed + 1), 0.004) << seed;
    const HeldOutSummary held = summary(ours->held_out);
    EXPECT_LT(held.reprojection_px, 0.2) << seed;
    EXPECT_LT(held.epipolar_px, 0.1) << seed;
    EXPECT_GT(held.epipolar_px, 0.0);
  }
}

TEST(Calibrate, ExactCornersGiveTheExactPair) {
  const Bench truth = bench(7, {8, 5, 0.03}, 12, 0.0, false);
  const auto ours = calibrate(truth.board, kSizes, truth.shots);
  ASSERT_TRUE(ours) << ours.error().reason;
  // OpenCV takes corners as single floats: 3e-5 px.
  EXPECT_LT(ours->rms_px, 1e-3);
  EXPECT_NEAR(ours->cameras[0].lens().distortion[0], truth.pair[0].k[0], 1e-3);
  EXPECT_NEAR(ours->cameras[1].lens().distortion[2], truth.pair[1].k[2], 1e-4);
  EXPECT_LT((ours->cameras[1].R_CT() - truth.pair[1].R_CF).norm(), 1e-4);
  EXPECT_LT((ours->cameras[1].eye() - truth.pair[1].p_FC).norm(), 1e-5);
}

TEST(Calibrate, OneCameraAloneHasALens) {
  const Bench truth = bench(17, {7, 4, 0.03}, 14, 0.1, false);
  std::vector<Shot> shots = truth.shots;
  for (Shot& shot : shots) shot.seen.pop_back();
  const auto ours = calibrate(truth.board, std::span(kSizes).first(1), shots);
  ASSERT_TRUE(ours) << ours.error().reason;
  EXPECT_NEAR(ours->cameras[0].lens().fx_px / truth.pair[0].fx, 1.0, 0.01);
  EXPECT_EQ(ours->held_out.size(), shots.size());
  EXPECT_NEAR(summary(ours->held_out).reprojection_px, 0.14, 0.03);  // 0.1 px in u and in v
}

/// The left camera alone: what it has seen.
std::vector<Shot> left_of(std::vector<Shot> shots) {
  for (Shot& shot : shots) shot.seen.resize(1);
  return shots;
}

/// Forty lenses and sets of views, corners off by 0.15 px: the true focal lengths are within the
/// stated 2 sigma, which is neither too proud nor too modest.
TEST(Calibrate, KnowsHowWellItKnowsTheFocalLength) {
  int within = 0, refused = 0;
  double stated = 0.0, error = 0.0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const Bench truth = bench(1000 + seed, {9, 6, 0.025}, 12, 0.15, false);
    const auto ours = calibrate(truth.board, std::span(kSizes).first(1), left_of(truth.shots));
    if (!ours) {
      ++refused;
      continue;
    }
    const double off = ours->cameras[0].lens().fx_px - truth.pair[0].fx;
    within += std::abs(off) <= 2.0 * ours->sigma[0].fx_px ? 1 : 0;
    stated += std::pow(ours->sigma[0].fx_px, 2);
    error += off * off;
  }
  RecordProperty("within", within);
  RecordProperty("sigma_over_error", std::to_string(std::sqrt(stated / error)));
  EXPECT_LE(refused, 2);
  EXPECT_GE(within, 36 - refused);
  EXPECT_LT(stated, 6.0 * error) << "modest: " << std::sqrt(stated / error);
}

/// Views that do not bound the lens: parallel, all the same, or almost.
TEST(Calibrate, RefusesViewsThatDoNotBoundTheFocalLength) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    std::mt19937 random(seed);
    Bench truth = bench(2000 + seed, {9, 6, 0.03}, 1, 0.0, false);
    std::normal_distribution<double> error(0.0, 0.1);
    std::uniform_real_distribution<double> place(-0.05, 0.05);
    std::vector<Shot> shots;
    for (int i = 0; i < 8; ++i) {
      Eigen::Isometry3d X_FB = Eigen::Isometry3d::Identity();
      if (seed % 2 == 0)
        X_FB.translation() = Vector3d(place(random), place(random), 0.45 + place(random));
      else
        X_FB.linear() = Eigen::AngleAxisd(0.1, Vector3d(1, 1, 0).normalized()).matrix();
      if (seed % 2 == 1) X_FB.translation() = Vector3d(0.0, 0.0, 0.5);
      X_FB.translation() -= X_FB.linear() * truth.board.middle();
      Shot shot{"shot" + std::to_string(i), {true_corners(truth.pair[0], truth.board, X_FB)}};
      for (Vector2d& p : shot.seen[0]) p += Vector2d(error(random), error(random));
      shots.push_back(shot);
    }
    const auto ours = calibrate(truth.board, std::span(kSizes).first(1), shots);
    ASSERT_FALSE(ours) << seed << ": " << ours->cameras[0].lens().fx_px << " +- "
                       << 2.0 * ours->sigma[0].fx_px << ", true " << truth.pair[0].fx;
    EXPECT_NE(ours.error().reason.find("camera: "), std::string::npos) << ours.error().reason;
  }
}

TEST(Calibrate, RejectsByNameTheBoardThatWasMovedBetweenTheCameras) {
  Bench truth = bench(21, {9, 6, 0.025}, 10, 0.05, false);
  constexpr std::size_t kBad = 7;
  // 4 mm along the baseline: no epipolar line sees that.
  Eigen::Isometry3d moved = truth.places[kBad];
  moved.translation() += 0.004 * truth.pair[1].p_FC.normalized();
  truth.shots[kBad].seen[1] = true_corners(truth.pair[1], truth.board, moved);
  const auto ours = calibrate(truth.board, kSizes, truth.shots);
  ASSERT_TRUE(ours) << ours.error().reason;
  ASSERT_EQ(ours->rejected.size(), 1u);
  EXPECT_EQ(ours->rejected[0].name, truth.shots[kBad].name);
  EXPECT_NE(ours->rejected[0].reason.find("moved"), std::string::npos);
  EXPECT_LT(position_error(truth, *ours, 3), 0.003);
}

TEST(Calibrate, SaysWhenTheShotsContradictEachOther) {
  Bench truth = bench(31, {9, 6, 0.025}, 9, 0.1, false);
  for (std::size_t i = 0; i < 9; i += 2) {  // each right picture is another board's
    truth.shots[i].seen[1] = truth.shots[(i + 3) % 9].seen[1];
  }
  const auto ours = calibrate(truth.board, kSizes, truth.shots);
  ASSERT_FALSE(ours);
  EXPECT_NE(ours.error().reason.find("contradict"), std::string::npos) << ours.error().reason;
}

TEST(Calibrate, NumbersABoardWithoutABeginningAlikeInBothCameras) {
  const Bench truth = bench(41, {8, 6, 0.025}, 12, 0.1, false);
  std::vector<Shot> shots = truth.shots;
  for (std::size_t i = 0; i < shots.size(); i += 3) std::ranges::reverse(shots[i].seen[1]);
  std::ranges::reverse(shots[4].seen[0]);
  const auto ours = calibrate(truth.board, kSizes, shots);
  ASSERT_TRUE(ours) << ours.error().reason;
  EXPECT_TRUE(ours->rejected.empty());
  EXPECT_LT((ours->cameras[1].eye() - truth.pair[1].p_FC).norm(), 0.002);
}

TEST(Calibrate, RefusesSwappedCameras) {
  Bench truth = bench(51, {9, 6, 0.025}, 10, 0.1, false);
  for (Shot& shot : truth.shots) std::swap(shot.seen[0], shot.seen[1]);
  const auto ours = calibrate(truth.board, kSizes, truth.shots);
  ASSERT_FALSE(ours);
  EXPECT_NE(ours.error().reason.find("swapped"), std::string::npos) << ours.error().reason;
}

TEST(Calibrate, RefusesPixelsThatAreNotSquare) {
  Bench truth = bench(61, {9, 6, 0.025}, 10, 0.1, false);
  for (Shot& shot : truth.shots) {
    for (Vector2d& p : shot.seen[1]) p.x() = 320.0 + 0.9 * (p.x() - 320.0);
  }
  const auto ours = calibrate(truth.board, kSizes, truth.shots);
  ASSERT_FALSE(ours);
  EXPECT_NE(ours.error().reason.find("right camera: focal lengths"), std::string::npos)
      << ours.error().reason;
}

TEST(Calibrate, SetsPositionsWithMissingCornersAside) {
  Bench truth = bench(71, {9, 6, 0.025}, 10, 0.1, false);
  truth.shots[2].seen[1].pop_back();
  truth.shots[5].seen[0].clear();
  const auto ours = calibrate(truth.board, kSizes, truth.shots);
  ASSERT_TRUE(ours) << ours.error().reason;
  ASSERT_EQ(ours->rejected.size(), 2u);
  EXPECT_EQ(ours->rejected[0].reason, "54 and 53 corners seen, expected 54 in each picture");
  EXPECT_EQ(ours->rejected[1].name, "shot5");
  truth.shots.resize(4);
  const auto few = calibrate(truth.board, kSizes, truth.shots);
  ASSERT_FALSE(few);
  EXPECT_NE(few.error().reason.find("3 of 4"), std::string::npos) << few.error().reason;
}

/// A pair above a table, looking down at it from either side, and a board on it.
TEST(PlaceOnTable, GivesFrameTFromBothSides) {
  for (const Side side : {Side::near, Side::far}) {
    for (const bool turned : {false, true}) {
      const double z = side == Side::near ? 0.8 : -0.8;
      image::View view;
      view.eye_m = {0.1, 0.6, z};
      view.target_m = {0.05, 0.0, 0.0};
      const image::Camera left(view);
      view.eye_m[0] += side == Side::near ? 0.1 : -0.1;
      const image::Camera right(view);
      const Board board{9, 6, 0.03};
      // Board's x along T's x or against it, or along z; its z points into the table.
      Eigen::Matrix3d R_TB;
      const Vector3d x = turned ? Vector3d::UnitZ() : Vector3d::UnitX();
      R_TB << x, (-Vector3d::UnitY()).cross(x), -Vector3d::UnitY();
      const Vector3d middle(0.07, 0.004, -0.02);
      Corners seen_left, seen_right;
      for (std::size_t i = 0; i < board.size(); ++i) {
        const Vector3d p = R_TB * (board.point(i) - board.middle()) + middle;
        seen_left.push_back(left.project(p));
        seen_right.push_back(right.project(p));
      }
      // As calibrated: in the frame of the left camera.
      const std::array<image::Camera, 2> rig{
          image::Camera(left.lens(), Eigen::Matrix3d::Identity(), Vector3d::Zero()),
          image::Camera(right.lens(), right.R_CT() * left.R_CT().transpose(),
                        left.in_camera(right.eye()))};
      const std::array<Corners, 2> seen{seen_left, seen_right};
      const auto placed = place_on_table(board, rig, seen, side, 0.004, {0.07, -0.02}, 0.5);
      ASSERT_TRUE(placed) << placed.error().reason;
      EXPECT_LT((placed->cameras[0].eye() - left.eye()).norm(), 1e-5);
      EXPECT_LT((placed->cameras[1].eye() - right.eye()).norm(), 1e-5);
      EXPECT_LT((placed->cameras[1].R_CT() - right.R_CT()).norm(), 1e-5);
      const auto alone = place_on_table(board, std::span(rig).first(1), std::span(seen).first(1),
                                        side, 0.004, {0.07, -0.02}, 0.5);
      ASSERT_TRUE(alone);
      EXPECT_LT((alone->cameras[0].eye() - left.eye()).norm(), 1e-4);
      // Another board size, or a camera that was moved since: it does not fit.
      std::array<image::Camera, 2> knocked = rig;
      knocked[1] = image::Camera(rig[1].lens(), rig[1].R_CT(), rig[1].eye() + Vector3d(0.01, 0, 0));
      const auto refused = place_on_table(board, knocked, seen, side, 0.0, {0.0, 0.0}, 0.5);
      ASSERT_FALSE(refused);
      EXPECT_NE(refused.error().reason.find("calibrate anew"), std::string::npos);
    }
  }
}

TEST(Calibrate, MeetsTheGoalsOnTheRealPairs) {
  const auto folder = shared_data("vision/stereo_calibration");
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "not here: " << folder << " is absent";
  const Board board{9, 6, 1.0};
  std::vector<Shot> shots;
  for (const char* name :
       {"01", "02", "03", "04", "05", "06", "07", "08", "09", "11", "12", "13", "14"}) {
    Shot shot{name, {}};
    for (const char* side : {"left", "right"}) {
      const auto picture = image::read_image(folder / (std::string(side) + name + ".jpg"));
      ASSERT_TRUE(picture) << picture.error().reason;
      const auto seen = find_board(*picture, board);
      ASSERT_TRUE(seen) << side << name;
      shot.seen.push_back(seen->corners);
    }
    shots.push_back(shot);
  }
  const auto ours = calibrate(board, kSizes, shots);
  ASSERT_TRUE(ours) << ours.error().reason;
  EXPECT_TRUE(ours->rejected.empty());
  EXPECT_LE(ours->rms_px, 0.22);
  const HeldOutSummary held = summary(ours->held_out);
  EXPECT_LE(held.epipolar_px, 0.14);
  EXPECT_LE(held.worst_epipolar_px, 0.21);
  EXPECT_LE(held.baseline_spread, 1e-3);

  // A real pair whose right picture is another's is told by name.
  shots[6].seen[1] = shots[2].seen[1];
  const auto mixed = calibrate(board, kSizes, shots);
  ASSERT_TRUE(mixed) << mixed.error().reason;
  ASSERT_EQ(mixed->rejected.size(), 1u);
  EXPECT_EQ(mixed->rejected[0].name, "07");
}

}  // namespace
}  // namespace mimesis::vision
