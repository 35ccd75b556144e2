#pragma once
// A short log of a robot at its table, as the recorder would write it: for tests.
#include <gtest/gtest.h>

#include "common/log/writer.h"
#include "common/model/files.h"
#include "common/runtime/raw.h"
#include "proto/bridge.pb.h"
#include "proto/cognition.pb.h"
#include "proto/foxglove/image.pb.h"
#include "proto/foxglove/joint_states.pb.h"
#include "proto/foxglove/log.pb.h"
#include "proto/planner.pb.h"
#include "proto/steps.pb.h"

namespace mimesis::tool {

class RobotLog {
 public:
  explicit RobotLog(const std::string& path, log::WriterOptions options = {})
      : sink_(*log::create_file(path)), writer_(*sink_, std::move(options)) {}

  /// A message of `node` on NODE/`topic`, at `time_ns`.
  template <class T>
  void send(const std::string& node, const std::string& topic, const T& message,
            std::uint64_t time_ns) {
    Channel& channel = channels_[node + "/" + topic];
    if (channel.id == 0) {
      const auto* type = T::descriptor();
      const auto schema =
          writer_.add_schema(type->full_name(), "protobuf", runtime::descriptor_set(*type));
      channel.id = *writer_.add_channel(*schema, node + "/" + topic, "protobuf",
                                        {{"node", node}, {"latched", "false"}});
    }
    const std::string data = message.SerializeAsString();
    EXPECT_TRUE(writer_.write({channel.id, ++channel.sequence, time_ns, time_ns, data}));
  }
  /// Sends a message with a header.
  template <class T>
  void stamped(const std::string& node, const std::string& topic, T message,
               std::uint64_t time_ns) {
    message.mutable_header()->set_stamp_ns(time_ns);
    send(node, topic, message, time_ns);
  }
  log::Writer& writer() { return writer_; }
  void finish() { EXPECT_TRUE(writer_.finish()); }

 private:
  struct Channel {
    std::uint16_t id = 0;
    std::uint32_t sequence = 0;
  };
  std::unique_ptr<log::Sink> sink_;
  log::Writer writer_;
  std::map<std::string, Channel> channels_;
};

/// One second: arm and joint states at 200 Hz, hand, fields, images and log lines at 10 Hz, the
/// scene, a decision and two motions. `planner`, `vision`: parameters (YAML) in their NODE/start.
inline void write_robot_second(RobotLog& log, const std::string& planner = "",
                               const std::string& vision = "") {
  const std::string models = std::string(MIMESIS_SOURCE_DIR) + "/models/";
  const kin::ArmModel arm = model::load_arm(models + "lwr4.yaml");
  v1::NodeStart start;
  start.set_node("planner");
  start.set_executable("mimesis_planner");
  start.set_parameters(planner);
  if (!planner.empty()) log.stamped("planner", "start", start, 0);
  start.set_node("vision");
  start.set_executable("mimesis_vision");
  start.set_parameters(vision);
  start.add_inputs()->set_topic("camera/image");
  if (!vision.empty()) log.stamped("vision", "start", start, 0);
  log.stamped("world", "scene", model::to_proto(model::load_table(models + "bridge_table.yaml")),
              0);

  v1::TaskStatus status;
  status.set_state(v1::TASK_STATE_PLANNING);
  status.set_transport(v1::TRANSPORT_ABOVE);
  v1::Trajectory motion;
  motion.set_phase(v1::TASK_PHASE_REACH);
  motion.add_points()->mutable_position_rad()->Assign(arm.home.begin(), arm.home.end());
  v1::JointState state;
  state.mutable_position_rad()->Assign(arm.home.begin(), arm.home.end());
  foxglove::JointStates joints;
  for (int i = 1; i <= arm.dof(); ++i) joints.add_joints()->set_name("A" + std::to_string(i));
  v1::FieldActivity fields;
  fields.add_fields()->set_name("PFC");
  for (int i = 0; i < 16; ++i) fields.mutable_fields(0)->add_u(static_cast<float>(i));
  foxglove::RawImage image;
  image.set_encoding("mono8");
  image.set_frame_id("camera");
  image.set_width(16);
  image.set_height(4);
  image.set_step(16);
  image.set_data(std::string(64, 'p'));
  foxglove::Log line;
  line.set_level(foxglove::Log::INFO);
  line.set_message("ready");

  for (std::uint64_t i = 0; i < 200; ++i) {
    const std::uint64_t now = 5'000'000 * i;
    log.stamped("bridge", "arm", state, now);
    log.stamped("sim_drives", "arm", v1::JointState(), now);  // not the one that counts
    log.send("bridge", "joints", joints, now);
    if (i == 100) log.stamped("planner", "status", status, now);
    if (i == 120) log.stamped("planner", "trajectory", motion, now);
    if (i % 20 != 0) continue;
    v1::HandState hand;
    hand.set_closure(static_cast<double>(i) / 200.0);
    log.stamped("bridge", "hand", hand, now);
    log.stamped("cognition", "fields", fields, now);
    log.send("camera", "image", image, now);
    log.send("planner", "log", line, now);
  }
}

}  // namespace mimesis::tool
