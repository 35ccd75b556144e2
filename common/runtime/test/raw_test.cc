// Messages whose types are read from descriptors.
#include "common/runtime/raw.h"

#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include <functional>

#include "common/runtime/ports.h"
#include "common/runtime/test/peers.h"

namespace mimesis::runtime {
namespace {

using namespace std::chrono_literals;

TEST(RawMessages, AreOfTheTypeTheirDescriptorsSay) {
  TestGraph graph;
  TestNode sender(graph, {}, {}, "sender"), receiver(graph, {{"in", "t/x"}}, {}, "receiver");
  EXPECT_THROW(sender.bus().advertise_raw("t/x", "mimesis.v1.Publication", "no descriptors", {}),
               ConfigError);
  const auto raw = sender.bus().advertise_raw("t/x", "mimesis.v1.Publication",
                                              descriptor_set(*v1::Publication::descriptor()), {});
  auto in = receiver.bus().subscribe("in", v1::Publication::default_instance(),
                                     {.policy = Policy::reliable});
  Tap tap(
      graph.name(), [](const std::string&) { return true; }, Policy::reliable);
  ASSERT_TRUE(both(sender, receiver, [&] {
    tap.next(0ms);
    return raw->subscribers() == 2;
  }));
  sender.open();
  raw->send_raw(numbered(42).SerializeAsString(), 3s);
  ASSERT_TRUE(receiver.until([&] { return in->counters().received == 1; }));
  v1::Publication m;
  EXPECT_TRUE(m.ParseFromString(in->pop()->payload));
  EXPECT_EQ(m.seq(), 42U);
  const auto tapped = tap.next(5s);
  ASSERT_TRUE(tapped);
  EXPECT_EQ(tapped->topic, "t/x");
  EXPECT_EQ(tapped->type, "mimesis.v1.Publication");
  EXPECT_EQ(tapped->message.source, "sender");
  EXPECT_EQ(tapped->message.stamp, 3s);
  TypePool pool;
  const auto dynamic = pool.make(tapped->type, tap.descriptors(tapped->type_hash));
  ASSERT_TRUE(dynamic);
  ASSERT_TRUE(dynamic->ParseFromString(tapped->message.payload));
  EXPECT_EQ(dynamic->SerializeAsString(), numbered(42).SerializeAsString());
  EXPECT_EQ(pool.make("mimesis.v1.Nothing", tap.descriptors(tapped->type_hash)), nullptr);
}

TEST(Tap, AStrangersWordsOnATypeAreNotBelieved) {
  TestGraph graph;
  const auto announce = [&](RegistryEntry& entry, std::uint64_t start_id, const std::string& set) {
    v1::NodeInfo info;
    info.set_name("n" + std::to_string(start_id));
    info.set_start_id(start_id);
    v1::TopicInfo& output = *info.add_outputs();
    output.set_topic("t/x");
    output.set_type("mimesis.v1.Publication");
    output.set_type_hash(type_hash(*v1::Publication::descriptor()));
    (*info.mutable_descriptors())[output.type()] = set;
    entry.publish(info);
  };
  const std::string right = descriptor_set(*v1::Publication::descriptor());
  google::protobuf::FileDescriptorSet other;
  ASSERT_TRUE(other.ParseFromString(right));
  for (auto& file : *other.mutable_file()) {
    for (auto& type : *file.mutable_message_type()) type.mutable_field()->RemoveLast();
  }
  RegistryEntry before(graph.directory(), "n1"), honest(graph.directory(), "n2"),
      after(graph.directory(), "n3");
  Tap tap(
      graph.name(), [](const std::string&) { return true; }, Policy::latest);
  announce(before, 1, other.SerializeAsString());
  tap.next(50ms);
  announce(honest, 2, right);
  tap.next(50ms);
  announce(after, 3, "no set");
  tap.next(50ms);
  EXPECT_EQ(tap.descriptors(type_hash(*v1::Publication::descriptor())), right);
}

TEST(TypePool, DoesNotMakeWhatProtobufCannotRead) {
  using google::protobuf::DescriptorProto;
  const auto field = [](DescriptorProto& type) { return type.mutable_field(0); };
  const auto extension = [](DescriptorProto& type) {
    auto* room = type.add_extension_range();
    room->set_start(1000);
    room->set_end(1001);
    auto* added = type.add_extension();
    added->set_name("more");
    added->set_number(1000);
    added->set_label(google::protobuf::FieldDescriptorProto::LABEL_OPTIONAL);
    added->set_type(google::protobuf::FieldDescriptorProto::TYPE_INT32);
    added->set_extendee("." + std::string(v1::Publication::descriptor()->full_name()));
    return added;
  };
  for (const auto& part :
       {std::function<google::protobuf::FieldDescriptorProto*(DescriptorProto&)>(field),
        {extension}}) {
    google::protobuf::FileDescriptorSet set;
    ASSERT_TRUE(set.ParseFromString(descriptor_set(*v1::Publication::descriptor())));
    for (auto& file : *set.mutable_file()) {
      for (auto& type : *file.mutable_message_type()) {
        if (type.name() != "Publication") continue;
        part(type)->mutable_options()->set_weak(true);
        file.set_syntax("proto2");  // others have no extensions
      }
    }
    TypePool pool;
    const auto made = pool.make("mimesis.v1.Publication", set.SerializeAsString());
    EXPECT_EQ(made, nullptr);
    if (made) {
      EXPECT_NO_THROW(made->ParseFromString(numbered(42).SerializeAsString()));
    }
  }
}

}  // namespace
}  // namespace mimesis::runtime
