#include "common/motion/mocap/body_from_markers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "common/math/so3.h"
#include "common/motion/mocap/cycles.h"
#include "common/motion/mocap/markers.h"
#include "common/motion/mocap/test/shared_folder.h"
#include "common/motion/mocap/test/walker.h"
#include "common/testing/refusal.h"

namespace mimesis::mocap {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

/// A walker who bends knees and elbows, twists the trunk and nods.
BodyClip lively_walker() {
  BodyClip clip = walk({.seconds = 3.0, .heading_rad = 0.7});
  clip.body.offset_m[kSpine] = {-0.02, 0.0, 0.12};
  clip.body.offset_m[kChest] = {0.0, 0.0, 0.2};
  for (Index f = 0; f < clip.frames(); ++f) {
    const double t = static_cast<double>(f) / clip.rate_hz, swing = std::sin(5.7 * t);
    auto angle = [&](BodyJoint joint, int axis) -> double& {
      return clip.angles_rad(3 * joint + axis, f);
    };
    angle(kLeftKnee, 1) = 0.5 + 0.4 * swing;
    angle(kRightKnee, 1) = 0.5 - 0.4 * swing;
    angle(kSpine, 2) = angle(kChest, 2) = 0.1 * swing;
    angle(kNeck, 1) = angle(kHead, 1) = 0.05 * swing;
    angle(kLeftShoulder, 0) = -1.2;  // arms down
    angle(kRightShoulder, 0) = 1.2;
    angle(kLeftElbow, 2) = -0.8 - 0.2 * swing;
    angle(kRightElbow, 2) = 0.8 - 0.2 * swing;
    angle(kLeftWrist, 0) = 0.2 * swing;
  }
  return clip;
}

/// Where the PluginGait markers sit on a figure.
Markers markers_on(const BodyClip& clip) {
  Markers m;
  m.name = "made.c3d";
  m.rate_hz = clip.rate_hz;
  for (const std::string_view name : kGaitMarkerNames)
    m.labels.push_back("Anna:" + std::string(name));
  m.position_m.resize(3 * kGaitMarkers, clip.frames());
  const double w = clip.body.offset_m[kLeftHip].y() / 0.36;
  const double asis_z = clip.body.offset_m[kLeftHip].z() + 0.30 * w;
  const double asis_x = clip.body.offset_m[kLeftHip].x() + 0.19 * w;
  const double half_knee = 0.5 * kKneeWidth_m + kMarkerRadius_m;
  const double half_ankle = 0.5 * kAnkleWidth_m + kMarkerRadius_m;
  const double half_elbow = 0.5 * kElbowWidth_m + kMarkerRadius_m;
  for (Index f = 0; f < clip.frames(); ++f) {
    const BodyPose pose = clip.pose(f);
    auto put = [&](GaitMarker marker, int joint, const Vector3d& p) {
      m.position_m.block<3, 1>(3 * marker, f) = pose.point(joint, p);
    };
    put(kLASI, kRoot, {asis_x, 0.5 * w, asis_z});
    put(kRASI, kRoot, {asis_x, -0.5 * w, asis_z});
    put(kLPSI, kRoot, {asis_x - 0.17, 0.05, asis_z});
    put(kRPSI, kRoot, {asis_x - 0.17, -0.05, asis_z});
    put(kT10, kChest, {-0.1, 0.0, 0.02});
    put(kSTRN, kChest, {0.1, 0.0, -0.02});
    put(kC7, kChest, {-0.08, 0.0, 0.23});
    put(kCLAV, kChest, {0.08, 0.0, 0.19});
    put(kLFHD, kHead, {0.09, 0.06, 0.1});
    put(kRFHD, kHead, {0.09, -0.06, 0.1});
    put(kLBHD, kHead, {-0.09, 0.06, 0.1});
    put(kRBHD, kHead, {-0.09, -0.06, 0.1});
    for (const bool left : {true, false}) {
      const double s = left ? 1.0 : -1.0;
      auto side = [&](GaitMarker l, GaitMarker r) { return left ? l : r; };
      const int shoulder = left ? kLeftShoulder : kRightShoulder;
      const int hip = left ? kLeftHip : kRightHip;
      const Body& b = clip.body;
      put(side(kLSHO, kRSHO), kChest,
          b.offset_m[static_cast<std::size_t>(shoulder)] + Vector3d(0.0, 0.0, kShoulderDrop_m));
      put(side(kLELB, kRELB), shoulder + 1, {0.0, 0.0, half_elbow});
      put(side(kLWRA, kRWRA), shoulder + 2, {0.0, 0.0, 0.03});
      put(side(kLWRB, kRWRB), shoulder + 2, {0.0, 0.0, -0.03});
      put(side(kLFIN, kRFIN), shoulder + 2, {0.0, s * 0.085, 0.0});
      put(side(kLKNE, kRKNE), hip + 1, {0.0, s * half_knee, 0.0});
      put(side(kLANK, kRANK), hip + 2, {0.0, s * half_ankle, 0.0});
      put(side(kLHEE, kRHEE), hip + 2, {-0.05, 0.0, -0.05});
      put(side(kLTOE, kRTOE), hip + 2, {0.17, 0.0, -0.05});
    }
  }
  return m;
}

TEST(BodyFromMarkers, RecoversJointCentresToFourMillimetres) {
  const BodyClip clip = lively_walker();
  const BodyClip found = body_from_markers(markers_on(clip));
  ASSERT_EQ(found.frames(), clip.frames());
  for (Index f = 0; f < clip.frames(); ++f) {
    const BodyPose a = clip.pose(f), b = found.pose(f);
    for (const int joint :
         {kLeftHip, kLeftKnee, kLeftAnkle, kRightHip, kRightKnee, kRightAnkle, kLeftShoulder,
          kLeftElbow, kLeftWrist, kRightShoulder, kRightElbow, kRightWrist}) {
      const auto j = static_cast<std::size_t>(joint);
      EXPECT_LT((a.p_WJ[j] - b.p_WJ[j]).norm(), 4e-3) << kBodyJointNames[j] << ", frame " << f;
      EXPECT_LT(math::log_so3(a.R_WJ[j].transpose() * b.R_WJ[j]).norm(), 0.03)
          << kBodyJointNames[j] << ", frame " << f;
    }
    for (const int joint : {kRoot, kSpine, kChest, kNeck, kHead}) {
      const auto j = static_cast<std::size_t>(joint);
      EXPECT_LT(math::log_so3(a.R_WJ[j].transpose() * b.R_WJ[j]).norm(), 0.03)
          << kBodyJointNames[j] << ", frame " << f;
    }
    EXPECT_LT(
        (a.point(kLeftAnkle, clip.body.toe_m[0]) - b.point(kLeftAnkle, found.body.toe_m[0])).norm(),
        4e-3);
  }
}

TEST(BodyFromMarkers, TurnsAnotherUpAxisUpright) {
  const BodyClip clip = lively_walker();
  Markers m = markers_on(clip);
  for (Index row = 0; row < m.position_m.rows(); row += 3) {  // (x, y, z) -> (y, z, x): y is up
    const Eigen::MatrixXd p = m.position_m.middleRows(row, 3);
    m.position_m.row(row) = p.row(1);
    m.position_m.row(row + 1) = p.row(2);
    m.position_m.row(row + 2) = p.row(0);
  }
  const BodyClip found = body_from_markers(m);
  const BodyPose pose = found.pose(10);
  EXPECT_GT(pose.p_WJ[kHead].z() - pose.p_WJ[kLeftAnkle].z(), 1.2);
  EXPECT_LT((found.angles_rad - body_from_markers(markers_on(clip)).angles_rad)
                .bottomRows(kBodyRows - 3)
                .cwiseAbs()
                .maxCoeff(),
            1e-9);
}

TEST(BodyFromMarkers, FillsGapsAndTakesTheLongestCompleteRun) {
  const BodyClip clip = lively_walker();
  Markers m = markers_on(clip);
  m.first_frame = 100;
  m.position_m.block(3 * kLASI, 30, 3, 60).setConstant(NAN);   // by its group
  m.position_m.block(3 * kLKNE, 200, 3, 10).setConstant(NAN);  // by a spline
  m.position_m.block(3 * kRTOE, 0, 3, 25).setConstant(NAN);    // stays
  const BodyClip found = body_from_markers(m);
  EXPECT_EQ(found.first_frame, 125);
  EXPECT_EQ(found.frames(), clip.frames() - 25);
  EXPECT_LT((found.pose(40).p_WJ[kLeftHip] - clip.pose(65).p_WJ[kLeftHip]).norm(), 4e-3);
  EXPECT_LT((found.pose(180).p_WJ[kLeftKnee] - clip.pose(205).p_WJ[kLeftKnee]).norm(), 5e-3);
}

TEST(BodyFromMarkers, RefusesWithTheLabels) {
  auto refusal = [](const Markers& m) -> std::string {
    return testing::refusal([&] { body_from_markers(m); }, "accepted");
  };
  const Markers whole = markers_on(lively_walker());
  Markers m = whole;
  m.labels[kLELB] = "Anna:nose";
  m.position_m.middleRows(3 * kC7, 3).setConstant(NAN);
  EXPECT_EQ(refusal(m),
            "made.c3d: markers absent or never seen: C7, LELB; expected the PluginGait set, or "
            "their labels in a map");
  m = whole;
  m.position_m.block(3 * kRTOE, 0, 3, 180).setConstant(NAN);
  m.position_m.block(3 * kLTOE, 180, 3, 180).setConstant(NAN);
  EXPECT_EQ(refusal(m), "made.c3d: no frame shows all markers of the set");
  m = whole;
  m.labels[kLPSI] = "Anna:SACR";
  m.labels[kRPSI] = "spare";
  EXPECT_EQ(refusal(m), "accepted");
}

/// Labels as public files have them: Helen Hayes, CMU, a lab of its own.
TEST(BodyFromMarkers, KnowsWhatOtherSetsCallTheSamePlaces) {
  const Markers made = markers_on(lively_walker());
  const BodyClip plain = body_from_markers(made, true);
  const auto renamed = [&](const std::map<std::string, std::string>& names) {
    Markers m = made;
    for (std::string& label : m.labels) {
      const std::string own = label.substr(label.rfind(':') + 1);
      if (const auto other = names.find(own); other != names.end()) label = other->second;
    }
    return m;
  };
  for (const Markers& m :
       {renamed({{"LASI", "L.ASIS"},
                 {"RASI", "R.ASIS"},
                 {"LPSI", "L.PSIS"},
                 {"RPSI", "R.PSIS"},
                 {"LKNE", "L.Knee"},
                 {"RKNE", "R.Knee"},
                 {"LANK", "L.Ankle"},
                 {"RANK", "R.Ankle"},
                 {"LHEE", "L.Heel"},
                 {"RHEE", "R.Heel"},
                 {"LTOE", "L.Toe"},
                 {"RTOE", "R.Toe"}}),
        renamed({{"LASI", "LFWT"}, {"RASI", "RFWT"}, {"LPSI", "LBWT"}, {"RPSI", "RBWT"}}),
        renamed({{"LASI", "Anna:ASISl"},
                 {"RASI", "Anna:ASISr"},
                 {"LKNE", "left knee"},
                 {"RKNE", "Right_Knee"}})}) {
    const BodyClip found = body_from_markers(m, true);
    EXPECT_TRUE(found.angles_rad.isApprox(plain.angles_rad)) << m.labels[0];
  }
  MarkerLabels given;
  given[kLKNE] = "RLK";
  const Markers swapped = renamed({{"LKNE", "RLK"}});
  EXPECT_THROW((void)body_from_markers(swapped, true), ConfigError);
  EXPECT_TRUE(body_from_markers(swapped, true, given).angles_rad.isApprox(plain.angles_rad));
}

TEST(BodyFromMarkers, TakesTheLegsAloneIfAsked) {
  const BodyClip clip = lively_walker();
  Markers m = markers_on(clip);
  m.labels[kC7] = "other";
  const BodyClip found = body_from_markers(m, true);
  EXPECT_LT((found.pose(50).p_WJ[kRightAnkle] - clip.pose(50).p_WJ[kRightAnkle]).norm(), 4e-3);
  EXPECT_LT(found.angles_rad.bottomRows(3 * (kBodyJoints - kSpine)).cwiseAbs().maxCoeff(), 1e-9);
}

// The file names the whole set, but only the markers of the legs were seen. It has another
// program's knee and ankle centres (LFEO, LTIO), from the subject's measured joint widths.
TEST(BodyFromMarkers, OfARecordedWalk) {
  SKIP_WITHOUT_SHARED();
  const Markers m = read_c3d(shared_mocap() + "c3d/FunctionalWalk.c3d");
  EXPECT_THROW(body_from_markers(m), ConfigError);
  const BodyClip clip = body_from_markers(m, true);
  EXPECT_GT(clip.frames(), 100);
  EXPECT_GE(find_gait_events(clip).heel_strike[kLeft].size() +
                find_gait_events(clip).heel_strike[kRight].size(),
            2u);
  auto rms_from = [&](const std::string& label, std::size_t joint) {
    const auto row = 3 * (std::find(m.labels.begin(), m.labels.end(), label) - m.labels.begin());
    double sum = 0.0;
    for (Index f = 0; f < clip.frames(); ++f) {
      const Vector3d p = m.position_m.block<3, 1>(row, f + clip.first_frame - m.first_frame);
      sum += (clip.pose(f).p_WJ[joint] - p).squaredNorm();
    }
    return std::sqrt(sum / static_cast<double>(clip.frames()));
  };
  EXPECT_LT(rms_from("LFEO", kLeftKnee), 0.02);
  EXPECT_LT(rms_from("LTIO", kLeftAnkle), 0.02);
  EXPECT_LT(rms_from("RFEO", kRightKnee), 0.02);
  EXPECT_LT(rms_from("RTIO", kRightAnkle), 0.02);
  for (const std::size_t hip : {kLeftHip, kRightHip}) {
    EXPECT_NEAR(clip.body.offset_m[hip + 1].norm(), 0.42, 0.06);
    EXPECT_NEAR(clip.body.offset_m[hip + 2].norm(), 0.42, 0.06);
    double bend = 0.0;
    for (Index f = 0; f < clip.frames(); ++f) {
      bend = std::max(bend, clip.angles_rad(static_cast<Index>(3 * (hip + 1) + 1), f));
    }
    EXPECT_GT(bend, 0.7);
  }
}

TEST(BodyFromMarkers, RefusesARecordingWithoutAPerson) {
  SKIP_WITHOUT_SHARED();
  EXPECT_THROW(body_from_markers(read_c3d(shared_mocap() + "c3d/parameterOverflow.c3d")),
               ConfigError);
  EXPECT_THROW(body_from_markers(read_c3d(shared_mocap() + "c3d/Eb015pr.c3d")), ConfigError);
}

}  // namespace
}  // namespace mimesis::mocap
