// Logs of ROS 2: messages in CDR, by the definitions in the file.
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "proto/foxglove/image.pb.h"
#include "proto/foxglove/joint_states.pb.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/foxglove/transform.pb.h"
#include "tools/mimesis/log/cat.h"
#include "tools/mimesis/log/convert.h"
#include "tools/mimesis/log/field_columns.h"
#include "tools/mimesis/log/message_diff.h"
#include "tools/mimesis/log/test/log_builder.h"
#include "tools/mimesis/log/test/tool_logs.h"

namespace mimesis::tool {
namespace {

using namespace std::literals;
using nlohmann::ordered_json;

/// test_msgs/msg/Pair: a float and a string.
std::string pair_bytes(float x, const std::string& text) {
  std::string bytes = "\0\1\0\0"s;
  bytes.append(reinterpret_cast<const char*>(&x), sizeof x);
  const auto n = static_cast<std::uint32_t>(text.size() + 1);
  bytes.append(reinterpret_cast<const char*>(&n), sizeof n);
  return bytes + text + '\0';
}

class RosLog : public testlogs::ToolLogs {
 protected:
  std::string bag(const std::string& name, const std::vector<std::string>& messages,
                  const std::string& definition = "float32 x\nstring text\n") {
    LogBuilder log;
    log::Writer& writer = log.writer();
    const auto schema = writer.add_schema("test_msgs/msg/Pair", "ros2msg", definition);
    const auto channel = writer.add_channel(schema.value(), "/pair", "cdr", {});
    for (std::uint32_t i = 0; i < messages.size(); ++i) {
      EXPECT_TRUE(writer.write({channel.value(), i, i, i, messages[i]}));
    }
    return save(name, log.finish());
  }
};

TEST_F(RosLog, IsShownByItsDefinitions) {
  CatOptions options;
  options.files = {bag("a.mcap", {pair_bytes(1.5F, "one"), pair_bytes(-2.0F, "two")})};
  const auto lines = cat(options);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0]["message"], (ordered_json{{"x", 1.5}, {"text", "one"}}));
  options.fields = {"x"};
  EXPECT_EQ(cat(options)[1]["fields"], (ordered_json{{"x", -2.0}}));
  options.fields = {"y"};
  EXPECT_THROW((void)cat(options), ConfigError);
}

TEST_F(RosLog, SaysWhatIsWrongWithAMessageOrADefinition) {
  CatOptions options;
  options.files = {bag("cut.mcap", {pair_bytes(1.5F, "one").substr(0, 10)})};
  ::testing::internal::CaptureStderr();
  EXPECT_EQ(cat(options, 1)[0]["message"], (ordered_json{{"bytes", 10}}));
  EXPECT_EQ(::testing::internal::GetCapturedStderr(),
            "/pair (test_msgs/msg/Pair): holds messages that are not of their type: lengths only "
            "(field text: the message ends)\n");
  options.files = {bag("none.mcap", {pair_bytes(1.5F, "one")}, "float32\n")};
  ::testing::internal::CaptureStderr();
  (void)cat(options);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(),
            "/pair (test_msgs/msg/Pair): its definition cannot be read: lengths only (line 1: "
            "'float32': expected a type and a name)\n");
}

TEST_F(RosLog, HasFieldsToPlotAndToCompare) {
  const auto logs = open_logs({bag("a.mcap", {pair_bytes(1.5F, "one")})});
  LogDecoder decoder;
  const OpenChannel channel = channels_of(logs).at(0);
  FieldColumns columns({"/pair", "x"});
  EXPECT_TRUE(columns.has_numbers(decoder.type(channel)));
  PayloadDiff diff;
  const log::Schema& schema = *channel.schema;
  const std::string a = pair_bytes(1.5F, "one"), b = pair_bytes(1.25F, "one");
  const MessageDifference found = diff.diff({a, &schema}, {b, &schema}, {});
  ASSERT_EQ(found.fields.size(), 1u);
  EXPECT_EQ(found.fields[0].path, "x");
}

/// Ours as a bag of ROS 2, read again by the definitions in it.
class RosBag : public RosLog {
 protected:
  /// `take(topic, message)` for each message of the bag that is made of `log`.
  std::vector<std::pair<std::string, ordered_json>> converted(LogBuilder& log,
                                                              ConvertResult* result = nullptr) {
    const std::string in = save("in.mcap", log.finish());
    const std::string out = path("bag");
    const auto source = log::open_file(in).value();
    const ConvertResult r = convert_log(
        *source, {.input = in, .output = {.path = out, .force = true}, .rosbag2 = true});
    if (result != nullptr) *result = r;
    CatOptions options;
    options.files = {out + "/bag_0.mcap"};
    std::vector<std::pair<std::string, ordered_json>> messages;
    for (const ordered_json& line : cat(options)) {
      messages.emplace_back(line["topic"], line["message"]);
    }
    std::ifstream in_metadata(out + "/metadata.yaml");
    metadata_.assign(std::istreambuf_iterator<char>(in_metadata), {});
    return messages;
  }
  std::string metadata_;
};

TEST_F(RosBag, HoldsWhatRosHasTypesFor) {
  LogBuilder log;
  foxglove::JointStates joints;
  joints.mutable_timestamp()->set_seconds(3);
  joints.mutable_timestamp()->set_nanos(5);
  for (const char* name : {"a1", "a2"}) {
    auto& joint = *joints.add_joints();
    joint.set_name(name);
    joint.set_position(0.5);
  }
  joints.mutable_joints(0)->set_velocity(1.0);  // of one alone: ROS has all or none
  log.add("bridge/joints", 1'000'000'000, joints);
  foxglove::FrameTransforms frames;
  auto& frame = *frames.add_transforms();
  frame.set_parent_frame_id("world");
  frame.set_child_frame_id("base");
  frame.mutable_translation()->set_z(2.0);
  log.add("walker/transforms", 2'000'000'000, frames);
  foxglove::RawImage image;
  image.set_width(2);
  image.set_height(1);
  image.set_encoding("bgr8");
  image.set_step(6);
  image.set_data("abcdef");
  image.set_frame_id("camera");
  log.add("camera-1/image", 2'500'000'000, image);
  log.add("camera-1/rig", 2'500'000'000, v1::CanFrame());
  ConvertResult result;
  const auto messages = converted(log, &result);
  ASSERT_EQ(messages.size(), 3u);
  EXPECT_EQ(messages[0].first, "/bridge/joints");
  EXPECT_EQ(messages[0].second,
            (ordered_json{{"header", {{"stamp", {{"sec", 3}, {"nanosec", 5}}}, {"frame_id", ""}}},
                          {"name", {"a1", "a2"}},
                          {"position", {0.5, 0.5}},
                          {"velocity", ordered_json::array()},
                          {"effort", ordered_json::array()}}));
  EXPECT_EQ(messages[1].first, "/tf");
  const ordered_json& transform = messages[1].second["transforms"][0];
  EXPECT_EQ(transform["child_frame_id"], "base");
  EXPECT_EQ(transform["transform"]["translation"]["z"], 2.0);
  EXPECT_EQ(transform["transform"]["rotation"]["w"], 1.0);
  EXPECT_EQ(messages[2].first, "/camera_1/image");
  EXPECT_EQ(messages[2].second["width"], 2);
  EXPECT_EQ(messages[2].second["step"], 6);
  EXPECT_EQ(result.left_out, std::vector<std::string>{"camera-1/rig"});
  EXPECT_EQ(result.messages, 3u);
  for (const char* part :
       {"  storage_identifier: mcap\n  duration:\n    nanoseconds: 1500000000\n",
        "    nanoseconds_since_epoch: 1000000000\n  message_count: 3\n",
        "        name: /tf\n        type: tf2_msgs/msg/TFMessage\n", "    - path: bag_0.mcap\n"}) {
    EXPECT_NE(metadata_.find(part), std::string::npos) << part << metadata_;
  }
}

/// Late subscribers of RViz get what was told once [ros2/rosbag2#1049, #1183].
TEST_F(RosBag, TransformsToldOnceAreStaticAndLatchedTopicsStayLatched) {
  LogBuilder log;
  foxglove::FrameTransforms frames;
  frames.add_transforms()->set_child_frame_id("base");
  const auto schema = log.writer().add_schema("foxglove.FrameTransforms", "protobuf",
                                              runtime::descriptor_set(*frames.GetDescriptor()));
  const auto add = [&](const char* topic, bool latched, std::uint64_t messages) {
    const auto channel = log.writer().add_channel(schema.value(), topic, "protobuf",
                                                  {{"latched", latched ? "true" : "false"}});
    for (std::uint64_t t = 1; t <= messages; ++t) {
      EXPECT_TRUE(log.writer().write({channel.value(), 0, t, t, frames.SerializeAsString()}));
    }
  };
  add("arm/base", true, 1);
  add("arm/links", true, 2);
  add("once", false, 1);
  std::vector<std::string> topics;
  for (const auto& [topic, message] : converted(log)) topics.push_back(topic);
  std::ranges::sort(topics);
  EXPECT_EQ(topics, (std::vector<std::string>{"/tf", "/tf", "/tf", "/tf_static"}));
  const auto profile = [&](const std::string& topic) {
    const std::size_t at = metadata_.find("name: " + topic + "\n");
    const std::string line = "offered_qos_profiles: \"";
    const std::size_t begin = metadata_.find(line, at) + line.size();
    return metadata_.substr(begin, metadata_.find('"', begin) - begin);
  };
  EXPECT_NE(profile("/tf_static").find("\\n  durability: 1\\n"), std::string::npos) << metadata_;
  EXPECT_NE(profile("/tf").find("\\n  durability: 2\\n"), std::string::npos) << metadata_;
}

TEST_F(RosBag, ReplacesMarkersOfAnEntityAsAWhole) {
  LogBuilder log;
  foxglove::SceneUpdate update;
  auto& entity = *update.add_entities();
  entity.set_id("robot");
  entity.set_frame_id("base");
  entity.mutable_lifetime()->set_seconds(4);
  entity.add_cubes()->mutable_size()->set_x(0.25);
  auto& line = *entity.add_lines();
  line.set_type(foxglove::LinePrimitive::LINE_LIST);
  line.set_thickness(0.01);
  for (int i = 0; i < 3; ++i) line.add_points()->set_x(i);
  line.add_indices(2);
  line.add_indices(0);
  entity.add_texts()->set_text("home");
  log.add("scene", 1, update);
  update.mutable_entities(0)->clear_lines();
  update.mutable_entities(0)->clear_texts();
  log.add("scene", 2, update);
  update.Clear();
  update.add_deletions()->set_id("robot");
  log.add("scene", 3, update);
  const auto messages = converted(log);
  ASSERT_EQ(messages.size(), 3u);
  const ordered_json& first = messages[0].second["markers"];
  ASSERT_EQ(first.size(), 3u);
  EXPECT_EQ(first[0]["type"], 1);
  EXPECT_EQ(first[0]["scale"]["x"], 0.25);
  EXPECT_EQ(first[0]["lifetime"]["sec"], 4);
  EXPECT_EQ(first[1]["type"], 5);
  EXPECT_EQ(first[1]["scale"]["x"], 0.01);
  EXPECT_EQ(first[1]["points"][0]["x"], 2.0);
  EXPECT_EQ(first[1]["points"][1]["x"], 0.0);
  EXPECT_EQ(first[2]["text"], "home");
  EXPECT_EQ(first[2]["id"], 2);
  const ordered_json& second = messages[1].second["markers"];
  ASSERT_EQ(second.size(), 3u);
  EXPECT_EQ(second[0]["action"], 0);
  for (const int gone : {1, 2}) {
    EXPECT_EQ(second[std::size_t(gone)]["action"], 2);
    EXPECT_EQ(second[std::size_t(gone)]["id"], gone);
    EXPECT_EQ(second[std::size_t(gone)]["ns"], "robot");
  }
  const ordered_json& third = messages[2].second["markers"];
  ASSERT_EQ(third.size(), 1u);
  EXPECT_EQ(third[0]["action"], 2);
  EXPECT_EQ(third[0]["id"], 0);
}

}  // namespace
}  // namespace mimesis::tool
