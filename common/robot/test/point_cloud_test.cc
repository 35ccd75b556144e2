#include "common/robot/point_cloud.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <fstream>

#include "common/error.h"
#include "common/testing/temporary_folder.h"

namespace mimesis::robot {
namespace {

class PointCloud : public ::testing::Test {
 protected:
  Eigen::Matrix3Xd read(const std::string& bytes, Viewpoint viewpoint = Viewpoint::refuse) {
    std::ofstream(file_, std::ios::binary) << bytes;
    return read_point_cloud(file_, viewpoint);
  }
  std::string refusal(const std::string& bytes) {
    try {
      read(bytes);
    } catch (const ConfigError& e) {
      return e.what();
    }
    return "taken";
  }
  template <class T>
  static std::string raw(T value, bool swapped = false) {
    std::string bytes(sizeof value, '\0');
    std::memcpy(bytes.data(), &value, sizeof value);
    return swapped ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
  }
  static void is(const Eigen::Matrix3Xd& points) {
    Eigen::Matrix3Xd expected(3, 2);
    expected.col(0) << 1.5, -2.25, 3.0;
    expected.col(1) << 0.125, 4.0, -5.5;
    EXPECT_EQ(points, expected);
  }

  mimesis::testing::TemporaryFolder folder_;
  const std::string file_ = (folder_ / "cloud").string();
};

std::string pcd(const std::string& data, const std::string& more = "", int points = 2) {
  return "# .PCD v.7 - Point Cloud Data file format\nVERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\n"
         "TYPE F F F U\nCOUNT 1 1 1 1\nWIDTH " +
         std::to_string(points) + "\nHEIGHT 1\n" + more + "POINTS " + std::to_string(points) +
         "\nDATA " + data + "\n";
}

TEST_F(PointCloud, PcdAsText) {
  is(read(pcd("ascii", "VIEWPOINT 0 0 0 1 0 0 0\n") + "1.5 -2.25 3 4278190080\n.125 4e0 -5.5 7\n"));
  // What a sensor did not see; lines of other systems.
  is(read(pcd("ascii", "", 4) +
          "nan nan nan 0\r\n1.5 -2.25 3 1\r\n-nan 0 0 0\r\n0.125 4 -5.5 7\r\n"));
}

/// Turned by a half turn about x, as a camera that looks down.
TEST_F(PointCloud, PcdSeenFromElsewhere) {
  const std::string bytes =
      pcd("ascii", "VIEWPOINT 1 0 0.5 0 1 0 0\n") + "0.5 2.25 -2.5 0\n-0.875 -4 6 0\n";
  is(read(bytes, Viewpoint::apply));
  EXPECT_EQ(read(bytes, Viewpoint::ignore).col(0), Eigen::Vector3d(0.5, 2.25, -2.5));
}

TEST_F(PointCloud, PcdAsBytesWithFieldsBefore) {
  std::string bytes =
      "VERSION 0.7\nFIELDS ring x y z\nSIZE 2 8 8 8\nTYPE U F F F\nCOUNT 3 1 1 1\nWIDTH 2\n"
      "HEIGHT 1\nPOINTS 2\nDATA binary\n";
  for (const auto& p : {std::array{1.5, -2.25, 3.0}, std::array{0.125, 4.0, -5.5}}) {
    for (int i = 0; i < 3; ++i) bytes += raw(std::uint16_t(9));
    for (const double x : p) bytes += raw(x);
  }
  is(read(bytes));
  bytes.pop_back();
  EXPECT_NE(refusal(bytes).find("expected 1 more"), std::string::npos) << refusal(bytes);
}

/// Fields behind each other, packed: literal runs, and one copy of what came before.
TEST_F(PointCloud, PcdCompressed) {
  std::string plain;
  for (const float x : {1.5f, 0.125f, -2.25f, 4.0f, 3.0f, -5.5f}) plain += raw(x);
  plain += std::string(8, '\7');  // the colours
  std::string packed;
  packed += '\x17' + plain.substr(0, 24);         // 24 bytes as they are
  packed += std::string("\x00\x07", 2);           // one
  packed += static_cast<char>((7 - 2) << 5 | 0);  // 7 bytes from 1 before
  packed += '\x00';
  const auto size = [](std::size_t n) { return raw(static_cast<std::uint32_t>(n)); };
  is(read(pcd("binary_compressed") + size(packed.size()) + size(plain.size()) + packed));
  packed[27] = static_cast<char>(5 << 5 | 31);  // from before the begin
  packed[28] = '\xff';
  EXPECT_NE(refusal(pcd("binary_compressed") + size(packed.size()) + size(plain.size()) + packed)
                .find("damaged"),
            std::string::npos);
  EXPECT_NE(refusal(pcd("binary_compressed") + size(packed.size()) + size(31) + packed)
                .find("not as many as POINTS"),
            std::string::npos);
}

/// Of 40 points x and y as they are; z and the colours are copies of these 320 bytes.
TEST_F(PointCloud, PcdCompressedFromFarBefore) {
  constexpr int kPoints = 40;
  std::string plain, packed;
  for (int i = 0; i < 2 * kPoints; ++i) plain += raw(0.25f * static_cast<float>(i));
  for (int i = 0; i < 10; ++i)
    packed += '\x1f' + plain.substr(32 * static_cast<std::size_t>(i), 32);
  for (const int length : {264, 56}) {  // from 320 before
    packed += static_cast<char>(7 << 5 | 319 >> 8);
    packed += static_cast<char>(length - 2 - 7);
    packed += static_cast<char>(319 & 255);
  }
  const auto size = [](std::size_t n) { return raw(static_cast<std::uint32_t>(n)); };
  const Eigen::Matrix3Xd points =
      read(pcd("binary_compressed", "", kPoints) + size(packed.size()) + size(640) + packed);
  for (int i = 0; i < kPoints; ++i)
    EXPECT_EQ(points.col(i), Eigen::Vector3d(0.25 * i, 0.25 * (i + kPoints), 0.25 * i)) << i;
}

TEST_F(PointCloud, PlyInEveryFormat) {
  const std::string properties =
      "element camera 1\nproperty list uchar int ids\nelement vertex 2\nproperty float x\n"
      "property uchar red\nproperty float y\nproperty double z\nend_header\n";
  is(read("ply\nformat ascii 1.0\ncomment by hand\n" + properties +
          "2 7 8\n1.5 255 -2.25 3\n0.125 0 4 -5.5\n"));
  for (const bool big : {false, true}) {
    const bool swapped = big != (std::endian::native == std::endian::big);
    std::string bytes = "ply\nformat binary_" + std::string(big ? "big" : "little") +
                        "_endian 1.0\n" + properties + '\2' + raw(7, swapped) + raw(8, swapped);
    for (const auto& p : {std::array{1.5, -2.25, 3.0}, std::array{0.125, 4.0, -5.5}})
      bytes += raw(static_cast<float>(p[0]), swapped) + '\xff' +
               raw(static_cast<float>(p[1]), swapped) + raw(p[2], swapped);
    is(read(bytes));
  }
}

TEST_F(PointCloud, FaultsAreSaidByTheirName) {
  const std::string vertex = "element vertex 1\nproperty float x\nproperty float y\n";
  const auto ply = [](const std::string& header, const std::string& data) {
    return "ply\nformat ascii 1.0\n" + header + "end_header\n" + data;
  };
  const std::pair<std::string, const char*> cases[] = {
      {"version https://git-lfs.github.com/spec/v1\noid sha256:83d7\nsize 9\n", "git lfs pull"},
      {"solid cube\n", "is no point cloud, expected PCD or PLY"},
      {ply(vertex + "property float z\nelement face 12\nproperty list uchar int vertex_indices\n",
           "0 0 0\n"),
       "has 12 faces, expected points alone: a mesh goes to `meshes`"},
      {ply(vertex, "0 0\n"), "vertex has no x, y and z"},
      {ply(vertex + "property float z\n", "0 0,5 0\n"), "vertex 0: '0,5', expected a number"},
      {ply(vertex + "property float z\n", ""), "ends before vertex 0"},
      {ply(vertex + "property float z\n", "nan 0 0\n"), "has no finite point"},
      {ply(vertex + "property half z\n", "0 0 0\n"), "expected a type of PLY"},
      {pcd("ascii", "VIEWPOINT 1 0 0 1 0 0 0\n") + "0 0 0 0\n0 0 0 0\n", "VIEWPOINT is not"},
      {pcd("ascii") + "0 0 0 0\n", "ends after 1 points, expected 2"},
      {pcd("ascii") + "0 0 0\n0 0 0 0\n", "point 0 has too few numbers"},
      {pcd("binary_packed"), "DATA binary_packed, expected ascii, binary or binary_compressed"},
      {pcd("ascii", "", 60'000'000), "expected 0 .. 50000000"},
      {"# .PCD v.7\nFIELDS x y\nSIZE 4 4\nTYPE F F\nPOINTS 1\nDATA ascii\n0 0\n",
       "no fields x, y and z"},
      {"# .PCD v.7\nFIELDS x y z\nSIZE 4 4 3\nTYPE F F F\nPOINTS 1\nDATA ascii\n", "SIZE 3"},
      {"# .PCD v.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 0\nPOINTS 1\nDATA binary\n",
       "COUNT of field z, expected 1 .. 10000"},
      {"# .PCD v.7\nFIELDS x y z\n", "has no DATA"}};
  for (const auto& [bytes, what] : cases) {
    const std::string said = refusal(bytes);
    EXPECT_EQ(said.find(file_), 0u) << said;
    EXPECT_NE(said.find(what), std::string::npos) << said << "\nexpected " << what;
  }
}

TEST(BallsOfPoints, HoldEachPointWithItsRadius) {
  srand(1);
  const Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Random(3, 2000);
  constexpr double kCell_m = 0.2, kRadius_m = 0.03;
  const auto balls = balls_of_points(points, kCell_m, kRadius_m);
  EXPECT_LE(balls.size(), 1331u);
  for (const math::RoundBound& ball : balls) EXPECT_LE(ball.radius, 0.867 * kCell_m + kRadius_m);
  for (const auto& p : points.colwise()) {
    EXPECT_TRUE(std::any_of(balls.begin(), balls.end(), [&](const math::RoundBound& b) {
      return (p - b.center).norm() + kRadius_m <= b.radius + 1e-12;
    }));
  }
  EXPECT_EQ(balls_of_points(points.leftCols(1), kCell_m, 0.0).front().radius, 0.0);
}

}  // namespace
}  // namespace mimesis::robot
