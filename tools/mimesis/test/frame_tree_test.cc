// Frames by their messages, and `mimesis tf` on logs of ours and of ROS 2.
#include "tools/mimesis/frame_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/log/writer.h"
#include "common/runtime/raw.h"
#include "common/testing/process.h"
#include "common/testing/temporary_folder.h"
#include "proto/foxglove/transform.pb.h"

namespace mimesis::tool {
namespace {

using nlohmann::json;

FrameTransform at(const std::string& parent, const std::string& child, double x, double yaw) {
  FrameTransform t{parent, child, {}, 1'000'000'000};
  t.X_PC = Eigen::Translation3d(x, 0.0, 0.0) * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
  return t;
}

TEST(FrameTree, PosesGoOverTheFrameThatBothHangFrom) {
  FrameTree tree;
  tree.add(at("world", "/base", 1.0, 0.5 * M_PI), "a");
  tree.add(at("base", "arm", 2.0, 0.0), "a");
  tree.add(at("base", "eye", 0.0, M_PI), "b");
  const auto arm = tree.pose("world", "arm");
  ASSERT_TRUE(arm);
  EXPECT_TRUE(arm->translation().isApprox(Eigen::Vector3d(1.0, 2.0, 0.0), 1e-12));
  const auto seen = tree.pose("eye", "arm");  // behind the eye
  ASSERT_TRUE(seen);
  EXPECT_TRUE(seen->translation().isApprox(Eigen::Vector3d(-2.0, 0.0, 0.0), 1e-12));
  EXPECT_TRUE(tree.pose("arm", "world")->isApprox(arm->inverse(), 1e-12));
  EXPECT_EQ(tree.roots(), std::set<std::string>{"world"});
  EXPECT_EQ(tree.children("base"), (std::vector<std::string>{"arm", "eye"}));
}

TEST(FrameTree, SaysWhyThereIsNoWay) {
  FrameTree tree;
  tree.add(at("world", "base", 1.0, 0.0), "a");
  tree.add(at("map", "robot", 1.0, 0.0), "a");
  EXPECT_EQ(tree.pose("base", "robot").error().reason,
            "no way from 'base' to 'robot': they hang from 'world' and 'map'");
  EXPECT_EQ(tree.pose("base", "robt").error().reason,
            "frame 'robt' is unknown, did you mean 'robot'?");
  tree.add(at("b", "a", 0.0, 0.0), "a");
  tree.add(at("a", "b", 0.0, 0.0), "a");
  EXPECT_EQ(tree.pose("a", "world").error().reason, "frame 'a' hangs from itself: a <- b");
}

/// A log with two frames, of this project's type.
std::string our_log(const std::string& path) {
  const auto sink = log::create_file(path).value();
  log::Writer writer(*sink, {});
  foxglove::FrameTransforms message;
  const auto schema = *writer.add_schema("foxglove.FrameTransforms", "protobuf",
                                         runtime::descriptor_set(*message.GetDescriptor()));
  const auto channel =
      *writer.add_channel(schema, "walker/transforms", "protobuf", {{"node", "walker"}});
  for (int k = 0; k < 5; ++k) {
    message.Clear();
    for (const auto& [parent, child] :
         {std::pair("world", "pelvis"), std::pair("pelvis", "left_foot")}) {
      auto& t = *message.add_transforms();
      t.mutable_timestamp()->set_seconds(k / 2);
      t.mutable_timestamp()->set_nanos(k % 2 * 500'000'000);
      t.set_parent_frame_id(parent);
      t.set_child_frame_id(child);
      t.mutable_translation()->set_x(k);
      t.mutable_rotation()->set_w(1.0);
    }
    const std::string data = message.SerializeAsString();
    const std::uint64_t ns = std::uint64_t(k) * 500'000'000;
    EXPECT_TRUE(writer.write({channel, std::uint32_t(k + 1), ns, ns, data}));
  }
  EXPECT_TRUE(writer.finish());
  return path;
}

/// /tf as rosbag2 stores it: CDR with its definition.
std::string ros_log(const std::string& path) {
  const std::string definition =
      "geometry_msgs/TransformStamped[] transforms\n"
      "================================================================================\n"
      "MSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\n"
      "Transform transform\n"
      "================================================================================\n"
      "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
      "================================================================================\n"
      "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
      "================================================================================\n"
      "MSG: geometry_msgs/Transform\nVector3 translation\nQuaternion rotation\n"
      "================================================================================\n"
      "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
      "================================================================================\n"
      "MSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n";
  std::string cdr("\0\1\0\0", 4);
  const auto put = [&cdr](const auto value) {
    while ((cdr.size() - 4) % sizeof value != 0) cdr += '\0';
    cdr.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  const auto put_text = [&](const std::string& text) {
    put(std::uint32_t(text.size() + 1));
    cdr += text + '\0';
  };
  put(std::uint32_t(1));
  put(std::int32_t(7));
  put(std::uint32_t(250'000'000));
  put_text("base_link");
  put_text("camera");
  for (const double value : {0.1, 0.2, 0.3, 0.0, 0.0, 1.0, 0.0}) put(value);  // half a turn about z
  const auto sink = log::create_file(path).value();
  log::Writer writer(*sink, {});
  const auto schema = *writer.add_schema("tf2_msgs/msg/TFMessage", "ros2msg", definition);
  const auto channel = *writer.add_channel(schema, "/tf", "cdr", {});
  EXPECT_TRUE(writer.write({channel, 1, 7'250'000'000, 7'250'000'000, cdr}));
  EXPECT_TRUE(writer.finish());
  return path;
}

class Tf : public testing::VerbTest {
 protected:
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  json line() const { return json::parse(output_.substr(0, output_.find('\n')), nullptr, false); }
  testing::TemporaryFolder folder_;
};

TEST_F(Tf, ALogOfOurs) {
  const std::string log = our_log(path("ours.mcap"));
  ASSERT_EQ(call({"tf", "tree", log}), 0) << errors_;
  EXPECT_EQ(output_,
            "world\n└ pelvis   walker/transforms (walker)\n"
            "  └ left_foot   walker/transforms (walker)\n");
  ASSERT_EQ(call({"tf", "echo", "world", "left_foot", log, "--json"}), 0) << errors_;
  EXPECT_EQ(line()["position_m"], json({0.0, 0.0, 0.0}));
  EXPECT_EQ(std::ranges::count(output_, '\n'), 3);  // at 0, 1 and 2 s
  ASSERT_EQ(call({"tf", "tree", log, "--at", "0.6", "--json"}), 0) << errors_;
  EXPECT_EQ(line()["frames"][0]["position_m"], json({1.0, 0.0, 0.0}));
  ASSERT_EQ(call({"tf", "hz", log, "--json"}), 0) << errors_;
  EXPECT_EQ(line()[1]["frame"], "pelvis");
  EXPECT_EQ(line()[1]["rate_hz"], 2.0);
  EXPECT_EQ(call({"tf", "echo", "world", "right_foot", log}), 3);
  EXPECT_EQ(errors_, "frame 'right_foot' is unknown\n");
}

TEST_F(Tf, ABagOfRos2) {
  const std::string log = ros_log(path("bag.mcap"));
  ASSERT_EQ(call({"tf", "echo", "base_link", "camera", log, "--json"}), 0) << errors_;
  EXPECT_EQ(line()["stamp_ns"], 7'250'000'000);
  EXPECT_EQ(line()["position_m"], json({0.1, 0.2, 0.3}));
  EXPECT_NEAR(std::abs(line()["rpy_rad"][2].get<double>()), M_PI, 1e-12);
  ASSERT_EQ(call({"tf", "tree", log}), 0) << errors_;
  EXPECT_EQ(output_, "base_link\n└ camera   /tf\n");
}

TEST_F(Tf, InterfacesAreShownWithTheirUnitsAndNodesAreRun) {
  ASSERT_EQ(call({"interface", "show", "JointState"}), 0) << errors_;
  EXPECT_NE(output_.find("// mimesis.v1.JointState  (proto/"), std::string::npos) << output_;
  EXPECT_NE(output_.find("repeated double position_rad"), std::string::npos) << output_;
  EXPECT_NE(output_.find("// mimesis.v1.Header"), std::string::npos) << output_;
  ASSERT_EQ(call({"interface", "show", "mimesis.v1.Footprint", "--json"}), 0) << errors_;
  EXPECT_EQ(line()["fields"][1]["comment"], "position of the point below the ankle");
  EXPECT_EQ(call({"interface", "show", "JointStat"}), 2);
  EXPECT_NE(errors_.find("did you mean"), std::string::npos) << errors_;
  ASSERT_EQ(call({"interface", "list"}), 0);
  EXPECT_NE(output_.find("\nmimesis.v1.MotionGoal\n"), std::string::npos);

  ASSERT_EQ(call({"run", "--list"}), 0) << errors_;
  EXPECT_NE(output_.find("clock\n"), std::string::npos) << output_;
  ASSERT_EQ(call({"run", "clock", "--help"}), 0) << errors_;
  EXPECT_NE(output_.find("mimesis_clock"), std::string::npos) << output_;
  EXPECT_EQ(call({"run", "clok"}), 2);
  EXPECT_NE(errors_.find("no node program 'clok' beside this one, did you mean 'clock'?"),
            std::string::npos)
      << errors_;
  EXPECT_EQ(call({"run", "../clock"}), 2);
}

}  // namespace
}  // namespace mimesis::tool
