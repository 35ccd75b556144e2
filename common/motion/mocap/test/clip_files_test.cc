#include <gtest/gtest.h>

#include <filesystem>
#include <numbers>

#include "common/math/so3.h"
#include "common/motion/mocap/clip_file.h"
#include "common/motion/mocap/readers.h"
#include "common/motion/mocap/test/reader_checks.h"
#include "common/motion/mocap/test/shared_folder.h"

namespace mimesis::mocap {
namespace {

using Eigen::Vector3d;

double degrees_between(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return math::log_so3(Eigen::Matrix3d(a.transpose() * b)).norm() * 180.0 / std::numbers::pi;
}

// Figures of B. Hahne's BVH conversion of CMU clip 35_07, made by other software from the same AMC
// (una-dinosauria/cmu-mocap: data/035/35_07.bvh, 5d98bb6): angles z, y, x [°] of the first and the
// fifteenth frame after its T-pose, by the bone's ASF name.
struct Angles {
  const char* bone;
  double first[3], late[3];
};
constexpr Angles k3507[] = {
    {"root", {-5.6589, -3.1659, -1.7935}, {-7.164, -5.0301, -0.1472}},
    {"lhipjoint", {0, 0, 0}, {0, 0, 0}},
    {"lfemur", {-12.1935, -6.5854, -24.959}, {-8.848, -12.5951, -27.8146}},
    {"ltibia", {12.0769, 18.423, 66.2324}, {3.4413, 11.3773, 33.5631}},
    {"lfoot", {-0.008, -4.7816, -3.0627}, {0.0494, 2.1383, -5.5471}},
    {"ltoes", {0.1074, -2.1134, -5.8192}, {0.1532, -2.5225, -6.952}},
    {"rhipjoint", {0, 0, 0}, {0, 0, 0}},
    {"rfemur", {33.2821, 10.4583, -6.32}, {35.1668, 6.7928, 3.0727}},
    {"rtibia", {-2.6313, -10.0729, 29.2131}, {-1.8637, -8.5762, 24.4783}},
    {"rfoot", {-0.7471, 1.629, -15.8573}, {-1.2475, 3.3339, -20.2754}},
    {"rtoes", {-0.3397, -3.7454, 10.3616}, {-0.1436, -2.4422, 6.7294}},
    {"lowerback", {3.4218, 0.1372, 13.2197}, {6.145, 1.3225, 12.0542}},
    {"upperback", {2.4919, 0.9053, -0.1862}, {2.3519, 2.7936, -0.2493}},
    {"thorax", {0.5383, 0.359, -7.6243}, {-1.4636, 1.1902, -6.8709}},
    {"lowerneck", {-2.2761, -3.1492, -16.1622}, {-1.6694, -3.2734, -16.2625}},
    {"upperneck", {-0.2356, -3.7425, 22.0065}, {-0.4857, -4.0061, 21.5171}},
    {"head", {-0.1894, -1.9583, 9.6777}, {-0.4059, -2.0569, 9.5059}},
    {"lclavicle", {0, 0, 0}, {0, 0, 0}},
    {"lhumerus", {-84.1873, 1.9371, 22.1598}, {-86.5231, 4.972, 19.6248}},
    {"lradius", {14.1896, -23.0051, -2.9018}, {12.4379, -20.4581, -2.253}},
    {"lwrist", {0, 0, -6.4337}, {0, 0, -4.5051}},
    {"lhand", {28.7449, 19.3873, 10.3192}, {28.4995, 19.7359, 10.3894}},
    {"lfingers", {-7.125, 0, 0}, {-7.125, 0, 0}},
    {"lthumb", {0.456, 51.8481, 0.0769}, {0.1362, 52.1864, 0.0241}},
    {"rclavicle", {0, 0, 0}, {0, 0, 0}},
    {"rhumerus", {88.2157, 3.4661, 7.0928}, {86.1482, 7.7934, 17.1038}},
    {"rradius", {-12.1066, 19.9643, -2.1385}, {-16.3857, 26.0408, -3.8137}},
    {"rwrist", {0, 0, 5.0027}, {0, 0, -1.6005}},
    {"rhand", {-15.0592, 14.1536, -3.7641}, {-20.5948, 20.9206, -7.6422}},
    {"rfingers", {7.125, 0, 0}, {7.125, 0, 0}},
    {"rthumb", {8.4528, -15.451, 5.9615}, {5.0825, -7.8379, 4.3595}},
};
constexpr double kRoot[2][3] = {{0.6636, 18.0401, -17.9943},
                                {0.7119, 17.9208, -15.5211}};  // position in the file's unit
struct Offset {
  const char* bone;
  double v[3];
};
constexpr Offset kLegs[] = {
    {"lfemur", {1.77779, -1.88989, 0.48267}},  {"ltibia", {2.53442, -6.96327, 0}},
    {"lfoot", {2.71068, -7.44755, 0}},         {"ltoes", {0.17992, -0.49431, 2.22524}},
    {"rfemur", {-1.58469, -1.88989, 0.48267}}, {"rtibia", {-2.60386, -7.15404, 0}},
    {"rfoot", {-2.73334, -7.50979, 0}},        {"rtoes", {-0.25618, -0.70384, 2.21822}},
};

Eigen::Matrix3d of_zyx(const double (&zyx)[3]) {
  constexpr double kRadians = std::numbers::pi / 180.0;
  const Eigen::AngleAxisd z(zyx[0] * kRadians, Vector3d::UnitZ()),
      y(zyx[1] * kRadians, Vector3d::UnitY()), x(zyx[2] * kRadians, Vector3d::UnitX());
  return (z * y * x).toRotationMatrix();  // axes of the file
}

TEST(ClipFiles, AmcAgreesWithTheBvhOfTheSameClip) {
  SKIP_WITHOUT_SHARED();
  const Clip amc = read_clip(shared_mocap() + "cmu_amc/35_07.amc");
  Eigen::Matrix3d P;  // file axes -> project axes
  P << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  for (const Angles& figures : k3507) {
    const int j = amc.skeleton.find(figures.bone);
    ASSERT_GE(j, 0) << figures.bone;
    const Eigen::Matrix3d first = P * of_zyx(figures.first) * P.transpose();
    const Eigen::Matrix3d late = P * of_zyx(figures.late) * P.transpose();
    EXPECT_LT(degrees_between(rotation(amc, j, 0), first), 1e-3) << figures.bone;
    EXPECT_LT(degrees_between(rotation(amc, j, 14), late), 1e-3) << figures.bone;
  }
  const double unit_m = 0.0254 / 0.45;
  for (int i = 0; i < 2; ++i) {
    const Vector3d wanted = P * Vector3d(kRoot[i][0], kRoot[i][1], kRoot[i][2]) * unit_m;
    EXPECT_LT((amc.root_position_W_m.col(14 * i) - wanted).norm(), 1e-5);
  }
  for (const Offset& leg : kLegs) {
    const auto j = static_cast<std::size_t>(amc.skeleton.find(leg.bone));
    const Vector3d wanted = P * Vector3d(leg.v[0], leg.v[1], leg.v[2]) * unit_m;
    EXPECT_LT((amc.skeleton.joints[j].offset_m - wanted).norm(), 1e-6) << leg.bone;
  }
}

TEST(ClipFiles, AUnitThatMakesNoPersonIsRefused) {
  SKIP_WITHOUT_SHARED();
  const std::string said =
      message_of([] { read_clip(shared_mocap() + "cmu_amc/35_07.amc", {.unit_m = 1.0}); });
  EXPECT_NE(said.find("35.asf is 3"), std::string::npos) << said;
  EXPECT_NE(said.find("m tall, expected 0.5 to 2.5 m; --unit-m"), std::string::npos) << said;
}

struct Expected {
  const char* file;
  long frames;
  double rate_hz;
  Vector3d travel_m;  // travel of the root, roughly; x forward
};

TEST(ClipFiles, RecordingsOfThreeSourcesAreReadAsTheyAre) {
  SKIP_WITHOUT_SHARED();
  const Expected all[] = {
      {"cmu_bvh/07_01.bvh", 317, 120, {3.6, 0, 0}},
      {"cmu_bvh/02_06.bvh", 2236, 120, {0, 0, 0}},
      {"cmu_amc/16_15.amc", 462, 120, {4.2, 0, 0}},
      {"cmu_amc/35_28.amc", 417, 120, {4.1, 0, 0}},
      {"bandai_nc/dataset-1_walk_happy_001.bvh", 213, 30, {9.6, 0, 0}},
      {"bandai_nc/dataset-1_walk-left_normal_001.bvh", 135, 30, {0, 4.9, 0}},
      {"bandai_nc/dataset-1_walk-right_normal_001.bvh", 135, 30, {0, -4.6, 0}},
      {"bandai_nc/dataset-1_walk-back_happy_001.bvh", 215, 30, {-7.3, 0, 0}},
  };
  for (const Expected& e : all) {
    const Clip clip = read_clip(shared_mocap() + e.file);
    EXPECT_EQ(clip.frames(), e.frames) << e.file;
    EXPECT_EQ(clip.rate_hz, e.rate_hz) << e.file;
    const Vector3d travel = clip.root_position_W_m.rightCols<1>() - clip.root_position_W_m.col(0);
    EXPECT_LT((travel - e.travel_m).norm(), 0.3) << e.file << ' ' << travel.transpose();
    const Eigen::Index n = clip.frames();  // not the T-pose before the first
    EXPECT_GT(clip.root_position_W_m.bottomRows<1>().minCoeff(), 0.45) << e.file;
    EXPECT_LT(clip.root_position_W_m.bottomRows<1>().maxCoeff(), 1.15) << e.file;
    const auto steps = clip.rotation_rad.rightCols(n - 2) - clip.rotation_rad.middleCols(1, n - 2);
    EXPECT_LT(steps.cwiseAbs().maxCoeff(), 1.0) << e.file;
  }
}

TEST(ClipFiles, EveryRecordingIsRead) {
  SKIP_WITHOUT_SHARED();
  int count = 0;
  for (const char* folder : {"cmu_bvh", "cmu_amc", "bandai_nc"}) {
    for (const auto& entry : std::filesystem::directory_iterator(shared_mocap() + folder)) {
      if (entry.path().extension() == ".asf") continue;
      const Clip clip = read_clip(entry.path().string());
      EXPECT_EQ(clip.skeleton.joints.size(),
                entry.path().string().find("bandai") == std::string::npos ? 31u : 21u);
      EXPECT_TRUE(clip.rotation_rad.allFinite());
      ++count;
    }
  }
  EXPECT_GE(count, 40);
}

}  // namespace
}  // namespace mimesis::mocap
