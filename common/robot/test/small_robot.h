#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace mimesis::robot {

/// base -shoulder- arm -slide- rod -tip_frame- tip, arm -turn- wheel.
inline constexpr const char* kSmallRobot = R"(<?xml version="1.0"?>
<robot name="small">
  <link name="base"><inertial><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <link name="arm"><inertial><origin xyz="0 0 -0.1" rpy="0 0 1.5707963267948966"/><mass value="2"/>
    <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.04"/></inertial></link>
  <link name="rod"><inertial><mass value="0.5"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <link name="wheel"/>
  <link name="tip"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="arm"/>
    <origin xyz="0.1 0.2 0.3" rpy="0 0 1.5707963267948966"/><axis xyz="3 0 4"/>
    <limit lower="-1" upper="2" velocity="3" effort="40"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="arm"/><child link="rod"/>
    <origin xyz="0 0 -0.4" rpy="0.3 -0.2 0.1"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="0.2" velocity="1" effort="10"/>
  </joint>
  <joint name="turn" type="continuous">
    <parent link="arm"/><child link="wheel"/>
    <origin xyz="0.05 0 0"/><axis xyz="0 0 1"/>
  </joint>
  <joint name="tip_frame" type="fixed">
    <parent link="rod"/><child link="tip"/>
    <origin xyz="0 0.1 -0.3" rpy="0 0.5 0"/>
  </joint>
</robot>
)";

/// Path of a new file small.urdf with this text.
inline std::string write_urdf(const std::string& text) {
  const auto folder = std::filesystem::path(::testing::TempDir()) /
                      ::testing::UnitTest::GetInstance()->current_test_info()->name();
  std::filesystem::create_directories(folder);
  const auto file = folder / "small.urdf";
  std::ofstream(file) << text;
  return file.string();
}

}  // namespace mimesis::robot
