#include <gtest/gtest.h>

#include "common/math/so3.h"
#include "common/motion/mocap/clip_file.h"
#include "common/motion/mocap/test/reader_checks.h"

namespace mimesis::mocap {
namespace {

using Eigen::Vector3d;

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != text.npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

const std::string kTwo =
    "HIERARCHY\nROOT pelvis\n{\n  OFFSET 0 0 0\n"
    "  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation\n"
    "  JOINT left knee\n  {\n    OFFSET 1 2 3\n    CHANNELS 3 Yrotation Zrotation Xrotation\n"
    "    End Site\n    {\n      OFFSET 0 -4 0\n    }\n  }\n}\n"
    "MOTION\nFrames: 2\nFrame Time: .0083333\n"
    "100 200 300 0 0 90 0 0 0\n"
    "101 200 300 0 30 0 20 40 -60\n";

TEST(Bvh, PermutesTheAxesAndMultipliesInTheOrderOfTheChannels) {
  const Clip clip = parse_bvh(kTwo, "folder/two.bvh");
  EXPECT_EQ(clip.name, "two.bvh");
  EXPECT_EQ(clip.rate_hz, 120.0);
  ASSERT_EQ(clip.skeleton.joints.size(), 2u);
  EXPECT_EQ(clip.skeleton.joints[1].name, "left knee");
  EXPECT_EQ(clip.skeleton.joints[1].parent, 0);
  EXPECT_TRUE(clip.skeleton.joints[1].offset_m.isApprox(Vector3d(0.03, 0.01, 0.02), 1e-12));
  ASSERT_EQ(clip.skeleton.ends.size(), 1u);
  EXPECT_EQ(clip.skeleton.ends[0].name, "left knee_end");
  EXPECT_EQ(clip.skeleton.ends[0].parent, 1);
  EXPECT_TRUE(clip.skeleton.ends[0].offset_m.isApprox(Vector3d(0, 0, -0.04), 1e-12));
  EXPECT_TRUE(clip.root_position_W_m.col(0).isApprox(Vector3d(3, 1, 2), 1e-12));
  EXPECT_TRUE(clip.root_position_W_m.col(1).isApprox(Vector3d(3, 1.01, 2), 1e-12));
  EXPECT_TRUE(clip.rotation_rad.col(0).head<3>().isApprox(Vector3d(0, 90 * kDeg, 0), 1e-12));
  EXPECT_TRUE(clip.rotation_rad.col(0).tail<3>().isZero(1e-15));
  EXPECT_TRUE(rotation(clip, 0, 1).isApprox(ry(30), 1e-12));
  EXPECT_TRUE(rotation(clip, 1, 1).isApprox(ry(20) * rz(40) * rx(-60), 1e-12));
}

TEST(Bvh, TakesTheHabitsOfSeveralWriters) {
  const Eigen::MatrixXd wanted = parse_bvh(kTwo, "two").rotation_rad;
  for (const std::string& text :
       {replaced(kTwo, "\n", "\r\n"), replaced(kTwo, "\n  {", " {"), replaced(kTwo, "  ", "\t\t "),
        replaced(kTwo, "\n", " \n\n"), "\xEF\xBB\xBF" + kTwo, replaced(kTwo, "ROOT", "root"),
        kTwo.substr(0, kTwo.size() - 1), replaced(kTwo, " 30 ", " +3.0e1 "),
        "# made by hand\n" + replaced(kTwo, "  OFFSET", "  # of the file\n  OFFSET"),
        replaced(kTwo, "100 200", "  # first\n100 200"), kTwo + "# end\n",
        replaced(kTwo, "End Site", "EndSite"), replaced(kTwo, "Frame Time: ", "FrameTime:"),
        replaced(kTwo, "Frames: 2", "FRAMES :\t2")}) {
    const Clip clip = parse_bvh(text, "two");
    EXPECT_EQ(clip.rotation_rad, wanted) << text;
    EXPECT_EQ(clip.skeleton.joints[1].name, "left knee");
  }
}

TEST(Bvh, TakesTheFramesThatAreThereAndSaysSo) {
  EXPECT_TRUE(parse_bvh(kTwo, "two").notes.empty());
  for (const std::string count : {"Frames: 3", "Frames: 1", "frames:2000000000"}) {
    const Clip clip = parse_bvh(replaced(kTwo, "Frames: 2", count), "two");
    EXPECT_EQ(clip.rotation_rad, parse_bvh(kTwo, "two").rotation_rad);
    ASSERT_EQ(clip.notes.size(), 1u) << count;
    EXPECT_TRUE(clip.notes[0].starts_with("2 frames are there, not ")) << clip.notes[0];
  }
}

TEST(Bvh, NamesTheDecimalComma) {
  EXPECT_EQ(message_of([] { parse_bvh(replaced(kTwo, " 90 ", " 9,5 "), "f"); }),
            "f:19: decimal comma in '9,5', expected a decimal point");
  EXPECT_EQ(message_of([] { parse_bvh(replaced(kTwo, ".0083333", "0,0083333"), "f"); }),
            "f:18: decimal comma in '0,0083333', expected a decimal point");
  EXPECT_EQ(message_of([] { parse_bvh(replaced(kTwo, " 90 ", " 9,5,1 "), "f"); }),
            "f:19: found '9,5,1', expected a number");
}

TEST(Bvh, OfNoFigureTheUnitIsACentimetreOrAsAsked) {
  EXPECT_NEAR(parse_bvh(kTwo, "a", {.unit_m = 2.0}).root_position_W_m(0, 0), 600.0, 1e-9);
  EXPECT_NEAR(parse_bvh(kTwo, "a").root_position_W_m(0, 0), 3.0, 1e-9);
}

TEST(Bvh, TurnsGoOnBeyondHalfATurn) {
  std::string text = kTwo.substr(0, kTwo.find("MOTION")) + "MOTION\nFrames: 9\nFrame Time: 0.01\n";
  for (int deg = 0; deg <= 720; deg += 90) {
    const int shown = deg > 180 && deg < 540 ? deg - 360 : deg;  // wrapped, as writers do it
    text += "0 0 0 0 0 " + std::to_string(shown) + " " + std::to_string(-shown) + " 0 0\n";
  }
  const Clip clip = parse_bvh(text, "turns");
  for (int t = 0; t < 9; ++t) {
    EXPECT_NEAR(clip.rotation_rad(1, t), 90.0 * t * kDeg, 1e-9) << t;
    EXPECT_NEAR(clip.rotation_rad(5, t), -90.0 * t * kDeg, 1e-9) << t;
  }
}

const std::string kHips =
    "HIERARCHY\nROOT joint_Root\n{\n OFFSET 0 0 0\n"
    " CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
    " JOINT Hips\n {\n  OFFSET 0 9 0\n"
    "  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
    "  JOINT Spine\n  {\n   OFFSET 7 0 0\n"
    "   CHANNELS 4 Yposition Zrotation Xrotation Yrotation\n"
    "   End Site\n   {\n    OFFSET 0 0 0\n   }\n  }\n }\n}\n"
    "MOTION\nFrames: 2\nFrame Time: 0.0333333\n"
    "10 0 0 0 0 90 5 90 1 0 20 0 3 0 0 0\n"
    "20 0 0 0 0 90 6 91 2 0 25 0 3 0 0 10\n";

TEST(Bvh, RootAndItsOnlyChildBecomeOne) {
  const Clip clip = parse_bvh(kHips, "hips");
  ASSERT_EQ(clip.skeleton.joints.size(), 2u);
  EXPECT_EQ(clip.skeleton.joints[0].name, "Hips");
  EXPECT_EQ(clip.skeleton.joints[0].parent, -1);
  EXPECT_EQ(clip.skeleton.joints[1].parent, 0);
  EXPECT_EQ(clip.skeleton.ends[0].parent, 1);
  // the position channel of Spine, which keeps still, is in place of its OFFSET
  EXPECT_TRUE(clip.skeleton.joints[1].offset_m.isApprox(Vector3d(0, 0.07, 0.03), 1e-12));
  // a quarter turn about the file's y takes its x to -z and its z to x
  EXPECT_TRUE(clip.root_position_W_m.col(0).isApprox(Vector3d(-0.05, 0.11, 0.90), 1e-12));
  EXPECT_TRUE(clip.root_position_W_m.col(1).isApprox(Vector3d(-0.06, 0.22, 0.91), 1e-12));
  EXPECT_TRUE(rotation(clip, 0, 1).isApprox(ry(90) * rx(25), 1e-12));
  EXPECT_TRUE(rotation(clip, 1, 1).isApprox(ry(10), 1e-12));
  EXPECT_EQ(clip.rate_hz, 30.0);
}

TEST(Bvh, NoiseOfInnerJointsGivesTheirMeanOffset) {
  const std::string noisy = replaced(kHips, " 3 0 0 10", " 3.03 0 0 10");
  EXPECT_NEAR(parse_bvh(noisy, "hips").skeleton.joints[1].offset_m.z(), 0.03015, 1e-9);
}

TEST(Bvh, RefusesWhatAClipCannotHold) {
  const auto says = [](const std::string& text) {
    return message_of([&] { parse_bvh(text, "f.bvh"); });
  };
  EXPECT_EQ(
      says(replaced(kHips, " 3 0 0 10", " 4 0 0 10")),
      "f.bvh: joint 'Spine' moves by 0.01 m within its parent, expected position channels that "
      "change by less than 2.0 mm but for the root's only child");
  EXPECT_EQ(says(""), "f.bvh:1: found the end of the file, expected 'HIERARCHY'");
  EXPECT_EQ(says(replaced(kTwo, "OFFSET 1 2", "OFFSET 1 x")),
            "f.bvh:8: found 'x', expected a number");
  EXPECT_EQ(says(replaced(kTwo, " 90 ", " nan ")), "f.bvh:19: found 'nan', expected a number");
  EXPECT_EQ(says(replaced(kTwo, " 90 ", " inf ")), "f.bvh:19: found 'inf', expected a number");
  EXPECT_EQ(says(replaced(kTwo, " 90 ", " 1e999 ")), "f.bvh:19: found '1e999', expected a number");
  EXPECT_EQ(says(replaced(kTwo, "-60\n", "\n")),
            "f.bvh:20: found the end of the line, expected a number");
  EXPECT_EQ(says(replaced(kTwo, "-60\n", "-60 7\n")),
            "f.bvh:20: found '7', expected the end of the line after 9 numbers, one a channel");
  EXPECT_EQ(says(kTwo + "1 2 3\n"), "f.bvh:21: found the end of the line, expected a number");
  EXPECT_EQ(says(kTwo.substr(0, kTwo.find("100 200"))),
            "f.bvh:19: found the end of the file, expected one frame or more");
  EXPECT_EQ(says(replaced(kTwo, ".0083333", "0")),
            "f.bvh:18: frame time, expected seconds above zero");
  EXPECT_EQ(
      says(replaced(kTwo, "3 Yrotation", "3 Wrotation")),
      "f.bvh:9: found 'Wrotation', expected a channel: X, Y or Z before position or rotation");
  EXPECT_EQ(says(replaced(kTwo, "CHANNELS 3", "CHANNELS 4000000000")),
            "f.bvh:9: found '4000000000', expected 0 to 6 channels");
  EXPECT_EQ(says(replaced(kTwo, "End Site", "Tip")),
            "f.bvh:10: found 'Tip', expected JOINT, End Site or '}'");
  EXPECT_EQ(says(replaced(kTwo, "End Site", "T\x01\x02p")),
            "f.bvh:10: found 'T??p', expected JOINT, End Site or '}'");
  EXPECT_NE(message_of([] { parse_bvh(kTwo, "f", {.unit_m = -1.0}); }), "");
  EXPECT_NE(message_of([] { parse_bvh(kTwo, "f", {.unit_m = 1e300}); }).find("less than 10 km"),
            std::string::npos);
}

TEST(Bvh, MemoryIsBoundedByTheFile) {  // many joints that have no channels, many short frames
  std::string text = "HIERARCHY\nROOT a\n{ OFFSET 0 0 0 CHANNELS 1 Xrotation\n", close = "}\n";
  for (int i = 0; i < 3000; ++i) text += "JOINT j\n{ OFFSET 0 0 0 ", close += '}';
  text += close + "\nMOTION\nFrames: 20000\nFrame Time: 1\n";
  for (int i = 0; i < 20000; ++i) text += "0\n";
  EXPECT_NE(message_of([&] { parse_bvh(text, "f"); }).find("f: 20000 frames of 3001 joints"),
            std::string::npos);
}

}  // namespace
}  // namespace mimesis::mocap
