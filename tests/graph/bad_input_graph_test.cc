// Every input of every node gets data that no node sends: bytes that are no message, NaN, infinity,
// empty messages, lists of absurd length. The node reports it, in few lines, and continues.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "common/runtime/raw.h"
#include "common/testing/process.h"
#include "proto/bridge.pb.h"
#include "proto/cognition.pb.h"
#include "proto/foxglove/image.pb.h"
#include "proto/motion.pb.h"
#include "proto/planner.pb.h"
#include "proto/runtime.pb.h"
#include "proto/scene.pb.h"
#include "proto/task.pb.h"
#include "proto/vision.pb.h"
#include "proto/world.pb.h"

namespace mimesis::testing {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

constexpr int kManyElements = 1000, kKinds = 6;

/// Every field set: numbers to `number`, lists `size` long, enums and integers out of any range.
void fill(Message& m, double number, int size, int depth = 0) {
  const auto* type = m.GetDescriptor();
  const auto* r = m.GetReflection();
  for (int i = 0; i < type->field_count(); ++i) {
    const FieldDescriptor* f = type->field(i);
    const int n = f->is_repeated() ? size : 1;
    for (int k = 0; k < n; ++k) {
      const auto set = [&](auto single, auto repeated, auto value) {
        f->is_repeated() ? (r->*repeated)(&m, f, value) : (r->*single)(&m, f, value);
      };
      switch (f->cpp_type()) {
        case FieldDescriptor::CPPTYPE_DOUBLE:
          set(&google::protobuf::Reflection::SetDouble, &google::protobuf::Reflection::AddDouble,
              number);
          break;
        case FieldDescriptor::CPPTYPE_FLOAT:
          set(&google::protobuf::Reflection::SetFloat, &google::protobuf::Reflection::AddFloat,
              static_cast<float>(number));
          break;
        case FieldDescriptor::CPPTYPE_ENUM:
          set(&google::protobuf::Reflection::SetEnumValue,
              &google::protobuf::Reflection::AddEnumValue, 77);
          break;
        case FieldDescriptor::CPPTYPE_UINT32:
          set(&google::protobuf::Reflection::SetUInt32, &google::protobuf::Reflection::AddUInt32,
              std::numeric_limits<std::uint32_t>::max());
          break;
        case FieldDescriptor::CPPTYPE_INT32:
          set(&google::protobuf::Reflection::SetInt32, &google::protobuf::Reflection::AddInt32, -1);
          break;
        case FieldDescriptor::CPPTYPE_BOOL:
          set(&google::protobuf::Reflection::SetBool, &google::protobuf::Reflection::AddBool, true);
          break;
        case FieldDescriptor::CPPTYPE_MESSAGE:
          if (f->name() == "header" || depth > 2) break;
          fill(f->is_repeated() ? *r->AddMessage(&m, f) : *r->MutableMessage(&m, f), number,
               std::min(size, 8), depth + 1);
          break;
        default:
          break;
      }
    }
  }
}

struct Input {
  const char* port;
  const Message* type;
};

struct Victim {
  const char* node;
  std::vector<Input> inputs;
  const char* complaint;  ///< about content that is finite and nevertheless wrong
};

void PrintTo(const Victim& victim, std::ostream* out) { *out << victim.node; }

class BadInput : public ::testing::TestWithParam<Victim> {};

TEST_P(BadInput, IsReportedAndSurvived) {
  const Victim& victim = GetParam();
  TestGraph graph;
  TestNode peer(graph, {{"health", std::string(victim.node) + "/health"}}, {});
  runtime::Reliable<v1::Health> health(peer.bus(), "health");
  std::vector<std::unique_ptr<runtime::RawOut>> outs;
  std::vector<std::string> options;
  for (const Input& in : victim.inputs) {
    const std::string topic = std::string("test/") + in.port;
    outs.push_back(peer.bus().advertise_raw(
        topic, in.type->GetTypeName(), runtime::descriptor_set(*in.type->GetDescriptor()), {}));
    options.insert(options.end(), {"--in", std::string(in.port) + "=" + topic});
  }
  peer.open();
  Process node(graph, std::string("mimesis_") + victim.node, options);
  ASSERT_TRUE(node.wait_ready(graph, victim.node)) << node.errors();

  std::size_t turn = 0;
  const auto bombard = [&] {
    const std::size_t i = turn % victim.inputs.size();
    std::unique_ptr<Message> m(victim.inputs[i].type->New());
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    std::string payload = "\xff\xff no message";
    switch (turn / victim.inputs.size() % kKinds) {
      case 1:
        fill(*m, std::numeric_limits<double>::quiet_NaN(), 7);
        break;
      case 2:
        fill(*m, kInfinity, 7);
        break;
      case 3:
        fill(*m, 1e300, kManyElements);
        break;
      case 4:
        fill(*m, -1e300, 1);
        break;
      default:  // 5: a valid message without content
        break;
    }
    if (turn / victim.inputs.size() % kKinds != 0) payload = m->SerializePartialAsString();
    outs[i]->send_raw(payload, TestNode::now());
    ++turn;
  };
  // Two reports of health with rejected messages on every input: it lives, and has seen them.
  int reports = 0;
  const auto all_rejected = [&](const v1::Health& h) {
    std::size_t rejecting = 0;
    for (const auto& input : h.inputs()) rejecting += input.rejected() > 0 ? 1 : 0;
    return rejecting == victim.inputs.size();
  };
  EXPECT_TRUE(peer.until(
      [&] {
        bombard();
        while (const auto h = health.pop()) reports += all_rejected(*h) ? 1 : 0;
        return reports >= 2 || node.wait(0ms).has_value();
      },
      20s))
      << node.errors();
  EXPECT_GE(reports, 2) << node.errors();
  EXPECT_EQ(node.terminate(), 0) << node.errors();
  const std::string said = node.errors();
  EXPECT_NE(said.find(" rejected: "), std::string::npos) << said;
  EXPECT_NE(said.find(victim.complaint), std::string::npos) << said;
  EXPECT_LT(std::ranges::count(said, '\n'), 100) << said;  // lines for thousands of messages
}

INSTANTIATE_TEST_SUITE_P(
    Nodes, BadInput,
    ::testing::Values(Victim{"vision",
                             {{"image", &foxglove::RawImage::default_instance()}},
                             "is not read, expected"},
                      Victim{"cognition",
                             {{"observation", &v1::Observation::default_instance()},
                              {"task", &v1::TaskStatus::default_instance()}},
                             "a symbol that"},
                      Victim{"planner",
                             {{"decision", &v1::Decision::default_instance()},
                              {"scene", &v1::Scene::default_instance()},
                              {"joint_states", &v1::JointState::default_instance()},
                              {"hand", &v1::HandState::default_instance()}},
                             "positions, expected 7"},
                      Victim{"bridge",
                             {{"command", &v1::JointCommand::default_instance()},
                              {"hand_command", &v1::HandCommand::default_instance()}},
                             "the arm has 7"},
                      Victim{"sim_hand", {{"contact", &v1::HandContact::default_instance()}}, ""},
                      Victim{"world",
                             {{"joint_states", &v1::JointState::default_instance()},
                              {"hand", &v1::HandState::default_instance()},
                              {"task", &v1::TaskStatus::default_instance()}},
                             "positions, expected 7"},
                      Victim{"synthesizer",
                             {{"goal", &v1::MotionGoal::default_instance()},
                              {"style", &v1::StyleWish::default_instance()},
                              {"beat", &v1::Beat::default_instance()},
                              {"crowd", &v1::CrowdCommand::default_instance()}},
                             "there are 1, from 0"}),
    [](const auto& victim) { return std::string(victim.param.node); });

}  // namespace
}  // namespace mimesis::testing
