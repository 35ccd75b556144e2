#include <gtest/gtest.h>

#include "common/testing/bad_settings.h"
#include "common/testing/process.h"
#include "nodes/cognition/test/files.h"
#include "proto/cognition.pb.h"
#include "proto/planner.pb.h"
#include "proto/vision.pb.h"

namespace mimesis::cognition {
namespace {

using testing::Process;
using testing::TestGraph;
using testing::TestNode;
using namespace std::chrono_literals;

constexpr const char* kCognition = MIMESIS_BIN_DIR "/mimesis_cognition";

/// Vision and planner of a real cognition process, on the wall clock.
class Partner {
 public:
  explicit Partner(const TestGraph& graph)
      : node_(graph, {{"decision", "cognition/decision"}, {"fields", "cognition/fields"}},
              {{"observation", "test/observation"}, {"task", "test/task"}}),
        observation_(node_.bus(), "observation"),
        task_(node_.bus(), "task"),
        decision_(node_.bus(), "decision"),
        fields_(node_.bus(), "fields") {
    node_.open();
  }

  /// Repeats `seen` and `status` with every decision that arrives until one satisfies `done`.
  bool until(const std::function<bool(const v1::Decision&)>& done) {
    return node_.until([&] {
      const v1::Decision* d = decision_.take();
      if (d == nullptr) return false;
      observation_.send(seen, TestNode::now());
      if (status.state() != v1::TASK_STATE_UNSPECIFIED) task_.send(status, TestNode::now());
      return done(*d);
    });
  }
  bool has_fields() {
    return node_.until(
        [&] { return fields_.get() != nullptr && fields_.get()->fields_size() == 7; });
  }

  v1::Observation seen;
  v1::TaskStatus status;

 private:
  TestNode node_;
  runtime::Out<v1::Observation> observation_;
  runtime::Out<v1::TaskStatus> task_;
  runtime::Latest<v1::Decision> decision_;
  runtime::Latest<v1::FieldActivity> fields_;
};

TEST(CognitionProcess, DecidesAndLearns) {
  const NetworkFile quick("window_s: 2,", "window_s: 0.2,");
  TestGraph graph;
  Partner partner(graph);
  Process node(graph, kCognition,
               {"--in", "observation=test/observation", "--in", "task=test/task", "--set",
                "network=" + quick.path, "--set", "practice=[]"});
  partner.seen.set_grip(v1::GRIP_FULL);
  partner.seen.set_grip_confidence(std::nan(""));  // dropped at the port
  int messages = 0;
  ASSERT_TRUE(partner.until([&](const v1::Decision&) { return ++messages == 20; }))
      << node.errors();

  partner.seen.set_transport(v1::TRANSPORT_BELOW);
  partner.seen.set_goal(v1::GOAL_LOW);
  partner.seen.set_complete(true);
  partner.seen.set_grip_confidence(1.0);
  partner.seen.set_transport_confidence(1.0);
  partner.seen.set_goal_confidence(0.9);
  v1::Decision decided;
  ASSERT_TRUE(partner.until([&](const v1::Decision& d) {
    decided = d;
    return d.settled();
  })) << node.errors();
  EXPECT_EQ(decided.grip(), v1::GRIP_FULL);
  EXPECT_EQ(decided.transport(), v1::TRANSPORT_BELOW);
  EXPECT_EQ(decided.goal(), v1::GOAL_LOW);
  EXPECT_FALSE(decided.learning());

  partner.status.set_state(v1::TASK_STATE_EXECUTING);
  partner.status.set_plan_succeeded(true);
  partner.status.set_grip(decided.grip());
  partner.status.set_transport(decided.transport());
  partner.status.set_goal(decided.goal());
  EXPECT_TRUE(partner.until([](const v1::Decision& d) { return d.learning(); })) << node.errors();
  EXPECT_TRUE(partner.until([](const v1::Decision& d) { return d.learned(); })) << node.errors();
  EXPECT_TRUE(partner.has_fields());
  EXPECT_EQ(node.terminate(), 0);
  EXPECT_NE(node.errors().find("decided: full, below, low"), std::string::npos) << node.errors();
}

TEST(CognitionProcess, BadConfigurationExitsWith2AndNamesTheKey) {
  const auto refused = [](const std::string& setting, const char* what) {
    testing::refuses(kCognition, {setting}, what);
  };
  refused("netwrk=a.yaml", "did you mean 'network'");
  refused("network=/nowhere/network.yaml", "no such file");
  refused("practice=[\"full,below,middle\"]",
          "cognition.practice[0]: 'full,below,middle': 'middle' is neither 'high' nor 'low'");
  refused("goals=middle", "cognition.goals: 'middle' is neither 'high' nor 'low'\n");
  refused("rate_hz=77", "cognition.rate_hz");
  const NetworkFile weak("excitation: 2.4", "excitation: 0.5");
  refused("network=" + weak.path, "self-sustained");
  const NetworkFile renamed("name: PF,", "name: PX,");
  refused("network=" + renamed.path, ":13:5: fields.2: a robot that imitates needs PF here");
}

}  // namespace
}  // namespace mimesis::cognition
