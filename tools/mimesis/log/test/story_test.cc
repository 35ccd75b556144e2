// A run's messages as lines for people.
#include "tools/mimesis/log/story.h"

#include <gtest/gtest.h>

#include "common/runtime/raw.h"
#include "proto/bridge.pb.h"
#include "proto/foxglove/log.pb.h"
#include "proto/params.pb.h"
#include "proto/planner.pb.h"
#include "proto/steps.pb.h"
#include "proto/vision.pb.h"

namespace mimesis::tool {
namespace {

using Mark = v1::PlayerMark;

class StoryTest : public ::testing::Test {
 protected:
  Mark tell(const std::string& topic, const google::protobuf::Message& content) {
    const auto [it, fresh] = schemas_.try_emplace(content.GetTypeName());
    if (fresh)
      it->second = {1, content.GetTypeName(), "protobuf",
                    runtime::descriptor_set(*content.GetDescriptor())};
    const log::Channel channel{
        1, 1, topic, "protobuf", {{"node", topic.substr(0, topic.find('/'))}}};
    const std::string bytes = content.SerializeAsString();
    const log::Message message{1, 1, 0, 0, bytes};
    EXPECT_TRUE(Story::follows(channel)) << topic;
    return story_.tell({0, &channel, &it->second, &message});
  }
  Story story_;
  std::map<std::string, log::Schema> schemas_;
};

TEST_F(StoryTest, TellsWhatWasSeenDecidedAndDoneOnceEach) {
  v1::Observation seen;
  EXPECT_EQ(tell("vision/observation", seen).kind(), Mark::KIND_UNSPECIFIED);
  seen.set_grip(v1::GRIP_FULL);
  seen.set_color(v1::OBJECT_COLOR_DARK);
  EXPECT_EQ(tell("vision/observation", seen).text(), "sees full, -, -, a dark object");
  seen.set_palm_angle_rad(0.3);
  EXPECT_EQ(tell("vision/observation", seen).kind(), Mark::KIND_UNSPECIFIED) << "nothing new";

  v1::Explanation why;
  why.mutable_decision()->set_settled(true);
  why.mutable_decision()->set_grip(v1::GRIP_FULL);
  why.mutable_decision()->set_transport(v1::TRANSPORT_BELOW);
  why.mutable_decision()->set_goal(v1::GOAL_LOW);
  why.set_deciding_s(0.5);
  v1::FieldReason& field = *why.add_fields();
  field.set_field("F5g");
  field.set_site("FG");
  field.set_onset_s(0.081);
  for (const auto& [from, input] :
       {std::pair("PF->F5g", 4.54), {"STSg->F5g", -0.81}, {"task", 1e-3}}) {
    v1::Influence& influence = *field.add_influences();
    influence.set_from(from);
    influence.set_input(input);
  }
  const Mark decision = tell("cognition/explanation", why);
  EXPECT_EQ(decision.kind(), Mark::KIND_DECISION);
  EXPECT_EQ(decision.node(), "cognition");
  EXPECT_EQ(decision.text(), "decides full, below, low, 0.50 s after it was seen, confidence 0.00");
  ASSERT_EQ(decision.details_size(), 1);
  EXPECT_EQ(decision.details(0), "F5g FG after 81 ms: PF->F5g 4.54 + STSg->F5g -0.81");
  why.mutable_decision()->set_settled(false);
  why.mutable_decision()->set_reason("two goals are as good");
  EXPECT_EQ(tell("cognition/explanation", why).text(), "decides nothing: two goals are as good");

  v1::TaskStatus task;
  task.set_state(v1::TASK_STATE_EXECUTING);
  task.set_phase(v1::TASK_PHASE_APPROACH);
  EXPECT_EQ(tell("planner/status", task).text(), "moves: approach");
  task.set_state(v1::TASK_STATE_FAILED);
  task.set_reason("no path");
  const Mark failed = tell("planner/status", task);
  EXPECT_EQ(failed.kind(), Mark::KIND_STOP);
  EXPECT_EQ(failed.level(), 4U);
  EXPECT_EQ(failed.text(), "fails at -, -, -: no path");
}

TEST_F(StoryTest, TellsWhatStoppedTheArmAndWhoSetWhat) {
  v1::BridgeStatus bridge;
  bridge.set_state("following");
  EXPECT_EQ(tell("bridge/status", bridge).kind(), Mark::KIND_MOTION);
  bridge.set_state("quick_stop");
  bridge.set_reason("no command for 0.1 s");
  const Mark stop = tell("bridge/status", bridge);
  EXPECT_EQ(stop.kind(), Mark::KIND_STOP);
  EXPECT_EQ(stop.text(), "quick stop: no command for 0.1 s");
  EXPECT_EQ(stop.level(), 3U);
  v1::EmergencyStop button;
  button.set_reason("button");
  EXPECT_EQ(tell("desk/emergency_stop", button).text(), "asks for a stop: button");

  v1::StepLog steps;
  EXPECT_EQ(tell("camera/steps", steps).kind(), Mark::KIND_UNSPECIFIED);
  v1::ParamRequest request;
  request.add_set()->set_key("noise");
  request.mutable_set(0)->set_value("12");
  v1::ServedRequest& served = *steps.add_steps()->add_requests();
  served.set_service("params");
  served.set_request(request.SerializeAsString());
  EXPECT_EQ(tell("camera/steps", steps).text(), "noise = 12");
  served.set_failure("outside of [0, 1]");
  const Mark refused = tell("camera/steps", steps);
  EXPECT_EQ(refused.kind(), Mark::KIND_PARAMETER);
  EXPECT_EQ(refused.text(), "noise = 12, refused: outside of [0, 1]");
  served.set_request(v1::ParamRequest().SerializeAsString());
  EXPECT_EQ(tell("camera/steps", steps).kind(), Mark::KIND_UNSPECIFIED) << "asked only";
}

TEST_F(StoryTest, LinesOfLogsAreThereButForDebugging) {
  foxglove::Log line;
  line.set_name("walker");
  line.set_message("is late");
  line.set_level(foxglove::Log::DEBUG);
  EXPECT_EQ(tell("walker/log", line).kind(), Mark::KIND_UNSPECIFIED);
  line.set_level(foxglove::Log::WARNING);
  EXPECT_EQ(tell("walker/log", line).level(), 3U);
  EXPECT_EQ(tell("walker/log", line).kind(), Mark::KIND_LOG) << "each of them";
}

}  // namespace
}  // namespace mimesis::tool
