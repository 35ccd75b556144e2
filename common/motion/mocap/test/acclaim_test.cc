#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/math/so3.h"
#include "common/motion/mocap/clip_file.h"
#include "common/motion/mocap/test/reader_checks.h"

namespace mimesis::mocap {
namespace {

using Eigen::Vector3d;
constexpr double kUnit = 0.0254 / 0.5;

// The leg hangs off the hip; its axes are turned by 90° about z after 20° about x.
const std::string kAsf =
    "# made for the test\n:version 1.10\n:name t\n:units\n  mass 1.0\n  length 0.5\n  angle deg\n"
    ":documentation\n  words ( and ) 1 2\n"
    ":root\n  order TX TY TZ RX RY RZ\n  axis XYZ\n  position 0 0 0\n  orientation 0 0 0\n"
    ":bonedata\n"
    "  begin\n    id 1\n    name foot\n    direction 0 0 2\n    length 1\n    axis 0 0 0 XYZ\n  "
    "end\n"
    "  begin\n    id 2\n    name hip\n    direction 1 0 0\n    length 3\n    axis 0 0 0 XYZ\n  "
    "end\n"
    "  begin\n    id 3\n    name leg\n    direction 0 -1 0\n    length 5\n    axis 20 0 90 XYZ\n"
    "    dof rz rx\n    limits (-160.0 20.0)\n           (-70.0 70.0)\n  end\n"
    ":hierarchy\n  begin\n    root hip\n    hip leg\n    leg foot\n  end\n";
const std::string kAmc =
    "#!OML:ASF x\n:FULLY-SPECIFIED\n:DEGREES\n"
    "7\nroot 1 2 3 10 20 30\nleg 40 50\n"
    "8\nleg 0 0\nroot 1 2 4 0 0 0\n";

Clip clip_of(const std::string& amc, const std::string& asf = kAsf, const ReadOptions& o = {}) {
  return parse_amc(amc, "s.amc", parse_asf(asf, "s.asf", o), o);
}

std::string with(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST(Acclaim, BonesBecomeJointsAtTheirUpperEnds) {
  const Skeleton s = parse_asf(kAsf, "s.asf").skeleton;
  ASSERT_EQ(s.joints.size(), 4u);
  const char* names[] = {"root", "hip", "leg", "foot"};
  for (std::size_t j = 0; j < 4; ++j) {
    EXPECT_EQ(s.joints[j].name, names[j]);
    EXPECT_EQ(s.joints[j].parent, static_cast<int>(j) - 1);
  }
  EXPECT_TRUE(s.joints[1].offset_m.isZero());
  EXPECT_TRUE(s.joints[2].offset_m.isApprox(Vector3d(0, 3, 0) * kUnit, 1e-12));
  EXPECT_TRUE(s.joints[3].offset_m.isApprox(Vector3d(0, 0, -5) * kUnit, 1e-12));
  ASSERT_EQ(s.ends.size(), 1u);
  EXPECT_EQ(s.ends[0].name, "foot_end");
  EXPECT_EQ(s.ends[0].parent, 3);
  EXPECT_TRUE(s.ends[0].offset_m.isApprox(Vector3d(1, 0, 0) * kUnit, 1e-12));
}

TEST(Acclaim, TurnsAboutTheBonesOwnAxesInTheOrderOfItsDof) {
  const Clip clip = clip_of(kAmc);
  EXPECT_EQ(clip.rate_hz, 120.0);
  ASSERT_EQ(clip.frames(), 2);
  EXPECT_TRUE(clip.root_position_W_m.col(0).isApprox(Vector3d(3, 1, 2) * kUnit, 1e-12));
  EXPECT_TRUE(clip.root_position_W_m.col(1).isApprox(Vector3d(4, 1, 2) * kUnit, 1e-12));
  EXPECT_TRUE(rotation(clip, 0, 0).isApprox(rz(30) * ry(20) * rx(10), 1e-12));
  const Eigen::Matrix3d C = rz(90) * rx(20), M = rx(50) * rz(40);
  EXPECT_TRUE(rotation(clip, 2, 0).isApprox(C * M * C.transpose(), 1e-12));
  EXPECT_TRUE(clip.rotation_rad.middleRows<3>(3).isZero());  // no dof
  EXPECT_TRUE(clip.rotation_rad.middleRows<3>(9).isZero());
  EXPECT_TRUE(clip.rotation_rad.col(1).isZero(1e-12));
}

TEST(Acclaim, UnitsAndOrderAreAsTheFilesOrTheCallerSay) {
  const Clip in_m = clip_of(kAmc, kAsf, {.unit_m = 1.0});
  EXPECT_NEAR(in_m.root_position_W_m(0, 0), 3.0, 1e-12);
  EXPECT_NEAR(in_m.skeleton.joints[3].offset_m.z(), -5.0, 1e-12);
  const Clip degrees = clip_of(kAmc);
  const Clip radians = clip_of(
      ":RADIANS\n1\nroot 1 2 3 0.17453292519943295 0.3490658503988659 0.5235987755982988\n"
      "leg 0.6981317007977318 0.8726646259971648\n");
  EXPECT_TRUE(radians.rotation_rad.col(0).isApprox(degrees.rotation_rad.col(0), 1e-12));
  const Clip turned = clip_of("1\nroot 30 10 20 3 2 1\nleg 40 50\n",
                              with(kAsf, "TX TY TZ RX RY RZ", "RZ RX RY TZ TY TX"));
  EXPECT_TRUE(turned.rotation_rad.col(0).isApprox(degrees.rotation_rad.col(0), 1e-12));
  EXPECT_EQ(turned.root_position_W_m.col(0), degrees.root_position_W_m.col(0));
  const Clip zyx = clip_of(kAmc, with(kAsf, "axis XYZ", "axis ZYX"));
  EXPECT_TRUE(rotation(zyx, 0, 0).isApprox(rx(10) * ry(20) * rz(30), 1e-12));
  const Clip shifted = clip_of(kAmc, with(kAsf, "position 0 0 0", "position 0 10 0"));
  EXPECT_NEAR(shifted.root_position_W_m(2, 0), 12.0 * kUnit, 1e-12);
}

TEST(Acclaim, RefusesDamagedSkeletons) {
  const auto says = [](const std::string& from, const std::string& to) {
    return message_of([&] { parse_asf(with(kAsf, from, to), "s.asf"); });
  };
  EXPECT_EQ(says("length 3", "length three"), "s.asf:27: found 'three', expected a number");
  EXPECT_EQ(says("direction 1 0 0", "direction 1 0"),
            "s.asf:26: found the end of the line, expected a number");
  EXPECT_EQ(says("    length 3\n", ""), "s.asf:23: bone 'hip' without a length");
  EXPECT_EQ(says("direction 1 0 0", "direction 0 0 0"), "s.asf:23: bone 'hip' without a direction");
  EXPECT_EQ(says("dof rz rx", "dof rz l"), "s.asf:36: found 'l', expected dof rx, ry or rz");
  EXPECT_EQ(says("dof rz rx", "dof rz rz"), "s.asf:36: 'rz' for the second time");
  EXPECT_EQ(says("20 0 90 XYZ", "20 0 90 XYX"),
            "s.asf:35: found 'XYX', expected an order of axes as XYZ");
  EXPECT_EQ(says("orientation 0 0 0", "orientation 0 90 0"),
            "s.asf:14: orientation of the root, expected 0 0 0");
  EXPECT_EQ(says("angle deg", "angle grad"), "s.asf:7: found 'grad', expected deg or rad");
  EXPECT_EQ(says("    leg foot\n", ""),
            "s.asf:16: bone 'foot' does not hang on the root in :hierarchy");
  EXPECT_EQ(says("leg foot\n", "leg foot\n foot hip\n"),
            "s.asf: bone 'hip' in :hierarchy, expected every bone of :bonedata there once");
  EXPECT_EQ(says("hip leg\n", "hip arm\n"),
            "s.asf: bone 'arm' in :hierarchy, expected every bone of :bonedata there once");
  EXPECT_EQ(says("name hip", "name leg"), "s.asf:30: bone 'leg' for the second time");
  EXPECT_NE(says("  order TX TY TZ RX RY RZ\n", ""), "");
}

TEST(Acclaim, RefusesDamagedMotions) {
  const auto says = [](const std::string& amc) { return message_of([&] { clip_of(amc); }); };
  EXPECT_EQ(says(""), "s.amc:1: found the end of the file, expected a first frame");
  EXPECT_EQ(says("leg 1 2\n"), "s.amc:1: found 'leg', expected the number of the first frame");
  EXPECT_EQ(says(with(kAmc, "leg 40 50", "leg 40")),
            "s.amc:6: found the end of the line, expected a number");
  EXPECT_EQ(says(with(kAmc, "leg 40 50", "leg 40 nan")), "s.amc:6: found 'nan', expected a number");
  EXPECT_EQ(says(with(kAmc, "leg 40 50", "leg 40 50 60")),
            "s.amc:6: found '60', expected the end of the line");
  EXPECT_EQ(says(with(kAmc, "leg 40", "arm 40")),
            "s.amc:6: found 'arm', expected a bone of the .asf");
  EXPECT_EQ(says(with(kAmc, "leg 40 50\n", "")),
            "s.amc:6: frame 7 has no line of 'leg', expected every bone with dof");
  EXPECT_EQ(says(with(kAmc, "\n8\n", "\n9\n")), "s.amc:7: found '9', expected frame 8");
  EXPECT_EQ(says(with(kAmc, "8\nleg 0 0\n", "8\nleg 0 0\nleg 0 0\n")),
            "s.amc:9: bone 'leg' twice in a frame");
  EXPECT_EQ(says(kAmc.substr(0, kAmc.rfind("root"))),
            "s.amc:9: frame 8 has no line of 'root', expected every bone with dof");
}

TEST(Acclaim, FindsTheSkeletonByTheSubject) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "find_asf";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  const std::string amc = (folder / "35_01.amc").string();
  std::ofstream(amc) << kAmc;
  EXPECT_EQ(message_of([&] { read_clip(amc); }),
            amc + ": no skeleton beside it, expected 35_01.asf, 35.asf");
  std::ofstream(folder / "35.asf") << kAsf;
  EXPECT_EQ(find_asf(amc), (folder / "35.asf").string());
  EXPECT_EQ(read_clip(amc).name, "35_01.amc");
  std::ofstream(folder / "other.asf") << with(kAsf, "name leg", "name ggg");
  EXPECT_NE(message_of([&] { read_clip(amc, {.asf = (folder / "other.asf").string()}); }), "");
  EXPECT_NE(message_of([&] { read_clip((folder / "35.c3d").string()); }), "");
  EXPECT_NE(message_of([&] { read_clip((folder / "none.bvh").string()); }), "");
  EXPECT_NE(message_of([&] { read_clip(folder.string()); }), "");
}

}  // namespace
}  // namespace mimesis::mocap
