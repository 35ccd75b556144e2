// Recorded C3D files of many laboratories.
#include <gtest/gtest.h>

#include <cmath>

#include "common/motion/mocap/markers.h"
#include "common/motion/mocap/test/reader_checks.h"
#include "common/motion/mocap/test/shared_folder.h"

namespace mimesis::mocap {
namespace {

// Expects equal trials in several encodings, to the step of the whole numbers.
void expect_same(const Markers& a, const Markers& b, double step_m) {
  ASSERT_EQ(a.labels, b.labels);
  ASSERT_EQ(a.position_m.cols(), b.position_m.cols());
  for (Eigen::Index i = 0; i < a.position_m.size(); ++i) {
    const double x = a.position_m.data()[i], y = b.position_m.data()[i];
    ASSERT_EQ(std::isnan(x), std::isnan(y)) << b.name << ' ' << i;
    if (std::isnan(x)) continue;
    ASSERT_NEAR(x, y, step_m) << b.name << ' ' << i;
  }
}

TEST(C3dFiles, EncodingsOfOneTrialAgree) {
  SKIP_WITHOUT_SHARED();
  const std::string folder = shared_mocap() + "c3d/";
  const Markers eb = read_c3d(folder + "Eb015pi.c3d");
  EXPECT_EQ(eb.frames(), 450);
  for (const char* name : {"Eb015pr.c3d", "Eb015si.c3d", "Eb015vr.c3d"}) {
    expect_same(eb, read_c3d(folder + name), 0.5 * 0.0833334e-3);
  }
  const Markers pc = read_c3d(folder + "pc_int.c3d");
  EXPECT_EQ(pc.labels.size(), 36u);
  for (const char* name : {"pc_real.c3d", "DEC_INT.C3D", "sgi_real.c3d"}) {
    expect_same(pc, read_c3d(folder + name), 1.001 * 0.281182e-3);  // one file was cut, not rounded
  }
}

TEST(C3dFiles, AllAreReadOrRefusedWithALine) {
  SKIP_WITHOUT_SHARED();
  const std::string folder = shared_mocap() + "c3d/";
  EXPECT_EQ(message_of([&] { read_c3d(folder + "Empty.c3d"); }),
            folder + "Empty.c3d: 0 bytes, expected a C3D file of 1024 or more");
  struct Expected {
    const char* file;
    long frames, first;
    int points;
    double rate_hz;
  };
  // The last two are damaged: parameters overwritten by the data, a section stated too short. Their
  // markers are whole.
  for (const Expected& e : {Expected{"FunctionalWalk.c3d", 438, 480, 146, 120.0},
                            Expected{"Gait.c3d", 487, 1, 33, 100.0},
                            Expected{"bad_parameter_section.c3d", 332, 1, 45, 120.0},
                            Expected{"parameterOverflow.c3d", 101, 1, 142, 100.0}}) {
    const Markers m = read_c3d(folder + e.file);
    EXPECT_EQ(m.frames(), e.frames) << e.file;
    EXPECT_EQ(m.first_frame, e.first) << e.file;
    EXPECT_EQ(m.position_m.rows(), 3 * e.points) << e.file;
    EXPECT_EQ(m.rate_hz, e.rate_hz) << e.file;
    for (Eigen::Index i = 0; i < m.position_m.size(); ++i) {  // the laboratory is no larger
      const double x = m.position_m.data()[i];
      ASSERT_TRUE(std::isnan(x) || std::abs(x) < 6.0) << e.file << ' ' << i;
    }
  }
}

}  // namespace
}  // namespace mimesis::mocap
