#include "nodes/synthesizer/drawer/drawer_sequence.h"

#include <gtest/gtest.h>
#include <iostream>
#include <fstream>
#include <cstdlib>

namespace mimesis::synthesizer {
TEST(Draft, Model) {
  const auto data = generate_drawer_data(mocap::standard_body(), {}, {});
  const auto model = learn_drawer_model(data);
  std::cout << model.first_quality_squared << " " << model.quality_squared << "\n";
  for (auto& a : model.action) std::cout << a.name << " Q " << a.quality << " Q2 " << a.quality_squared << "\n";
  const ActionMaps maps(model);
  for (auto a : {kNormalStep, kReachingStep, kStanding}) std::cout << "bandwidth " << maps.map(a).bandwidth() << " " << maps.map(a).ridge() << "\n";
  const double D = std::getenv("DIST") ? std::atof(std::getenv("DIST")) : 2.64;
  const double JT = std::getenv("JT") ? std::atof(std::getenv("JT")) : -1, JD = std::getenv("JD") ? std::atof(std::getenv("JD")) : 0;
  auto seq = DrawerSequence::start(maps, {.front_W_m = D});
  ASSERT_TRUE(seq.has_value());
  std::ofstream out("/tmp/drawer_dump.txt");
  const auto& body = model.body;
  double corr = 0; int i = 0;
  Eigen::VectorXd last;
  double maxstep = 0; 
  while (!seq->state().done && seq->state().time_s < 15) {
    if (JT >= 0 && seq->state().time_s > JT) { seq->set_goal({.front_W_m = D + JD}); }
    const auto& s = seq->step();
    corr = std::max(corr, s.correction_m);
    if (last.size()) { Eigen::Index w; double m = (s.angle_rad - last).cwiseAbs().maxCoeff(&w) * 200; if (m > 14) std::cout << "t " << s.time_s << " row " << mocap::body_row_name(int(w)) << " " << m << " rad/s act " << s.action << " ph " << s.phase_rad << "\n"; maxstep = std::max(maxstep, m);}
    last = s.angle_rad;
    if (i++ % 10 == 0) {
    const auto& a = s.angle_rad;
    auto pose = mocap::forward_kinematics(body, std::span<const double, 51>(a.data(), 51), s.pelvis_W_m);
    out << s.time_s;
    for (int j = 0; j < 17; ++j) out << " " << pose.p_WJ[j].transpose();
    for (int sd = 0; sd < 2; ++sd) {
      int ank = sd == 0 ? mocap::kLeftAnkle : mocap::kRightAnkle, wri = sd == 0 ? mocap::kLeftWrist : mocap::kRightWrist;
      out << " " << pose.point(ank, body.toe_m[sd]).transpose() << " " << pose.point(ank, body.heel_m[sd]).transpose() << " " << pose.point(wri, body.hand_m[sd]).transpose();
    }
    out << " " << pose.point(mocap::kHead, body.head_top_m).transpose() << " " << s.handle_W_m.transpose() << " " << s.object_W_m.transpose() << " " << a.transpose() << " " << s.stands[0] << " " << s.stands[1] << " " << s.correction_m << " " << s.phase_rad << "\n";
    }
  }
  for (auto& h : seq->history()) std::cout << h.action << " " << h.length_m << " " << h.duration_s << "\n";
  const auto& s = seq->state();
  std::cout << "t " << s.time_s << " D " << seq->distance_m() << " left " << s.left_error_m << " right " << s.right_error_m << " corr " << corr << " qd " << maxstep << " " << s.refused << "\n";
}
}
