#include "tools/mimesis/view/protocol.h"

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <random>

namespace mimesis::view {
namespace {
using nlohmann::json;

TEST(Protocol, AdvertisesTypesAsBase64) {
  const std::vector<Channel> channels{{7, "a/b", "x.Y", std::string("\x00\xff\x10", 3), true}};
  const json said = json::parse(advertise(channels));
  EXPECT_EQ(said["op"], "advertise");
  EXPECT_EQ(said["channels"][0], (json{{"id", 7},
                                       {"topic", "a/b"},
                                       {"encoding", "protobuf"},
                                       {"schemaName", "x.Y"},
                                       {"schemaEncoding", "protobuf"},
                                       {"schema", "AP8Q"}}));
}

TEST(Protocol, NumbersOfMessagesAreLittleEndian) {
  const MessageHeader header = message_header(0x01020304, 0x1112131415161718);
  const std::array<unsigned char, 13> expected{1,    4,    3,    2,    1,    0x18, 0x17,
                                               0x16, 0x15, 0x14, 0x13, 0x12, 0x11};
  EXPECT_EQ(std::memcmp(header.data(), expected.data(), header.size()), 0);
  EXPECT_EQ(service_answer(2, 3, "xy"),
            std::string("\x03\x02\0\0\0\x03\0\0\0\x08\0\0\0protobufxy", 23));
}

TEST(Protocol, GraphNamesWhatIsGoneOnce) {
  Connections before, now;
  before.published = {{"old", {"n"}}, {"kept", {"n"}}};
  before.subscribed = {{"old", {"m"}}, {"heard", {"m"}}};
  before.services = {{"n/params", {"n"}}};
  now.subscribed = {{"kept", {"m"}}};
  const json said = json::parse(connection_graph(now, before));
  EXPECT_EQ(said["removedTopics"], json({"old", "heard"}));
  EXPECT_EQ(said["removedServices"], json::array({"n/params"}));
  EXPECT_EQ(said["subscribedTopics"][0]["subscriberIds"][0], "m");
}

TEST(Protocol, WhoMayNotChangeIsNotToldThatItCould) {
  const json may = json::parse(server_info("n", "s", {}, true));
  const json not_ = json::parse(server_info("n", "s", {}, false));
  EXPECT_NE(may["capabilities"].dump().find("services"), std::string::npos);
  EXPECT_EQ(not_["capabilities"], json({"time", "connectionGraph"}));
}

TEST(Protocol, UnderstandsWhatClientsSay) {
  const auto subscribe =
      parse_text(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":9}]})");
  ASSERT_TRUE(subscribe) << subscribe.error();
  EXPECT_EQ(std::get<Subscribe>(*subscribe).subscriptions.at(0), std::pair(1U, 9U));
  const auto set =
      parse_text(R"({"op":"setParameters","id":"q","parameters":[{"name":"a.b","value":[1,2]}]})");
  ASSERT_TRUE(set) << set.error();
  EXPECT_EQ(std::get<SetParameters>(*set).parameters.at(0).value, json({1, 2}));
  EXPECT_EQ(std::get<SetParameters>(*set).request, "q");
  const auto watch = parse_text(R"({"op":"unsubscribeParameterUpdates","parameterNames":["x"]})");
  EXPECT_FALSE(std::get<WatchParameters>(*watch).on);
  const auto call = parse_binary(std::string("\x02\x05\0\0\0\x06\0\0\0\x08\0\0\0protobuf\x01", 22));
  ASSERT_TRUE(call) << call.error();
  EXPECT_EQ(std::get<CallService>(*call).call, 6U);
  EXPECT_EQ(std::get<CallService>(*call).payload, "\x01");
}

TEST(Protocol, SaysWhatItDoesNotUnderstand) {
  for (const char* text :
       {"", "nonsense", "[]", "{}", R"({"op":7})", R"({"op":"fly"})", R"({"op":"subscribe"})",
        R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]})",
        R"({"op":"setParameters","parameters":[{"name":3}]})"}) {
    const auto request = parse_text(text);
    ASSERT_FALSE(request) << text;
    EXPECT_FALSE(request.error().empty());
  }
  EXPECT_FALSE(parse_text(std::string(100'000, '[')));
  for (const auto& bytes : {std::string(), std::string("\x02"), std::string("\x01\0\0\0\0", 5),
                            std::string("\x02\0\0\0\0\0\0\0\0\xff\xff\xff\xff", 13),
                            std::string("\x02\0\0\0\0\0\0\0\0\x04\0\0\0json", 17)}) {
    EXPECT_FALSE(parse_binary(bytes));
  }
}

/// Any bytes are either a request or a line that says why not.
TEST(Protocol, RandomBytesDoNoHarm) {
  std::mt19937 random(1);
  const std::string good =
      R"({"op":"setParameters","id":"q","parameters":[{"name":"a.b","value":1}]})";
  for (int i = 0; i < 20'000; ++i) {
    std::string text = good;
    for (unsigned k = 0; k <= random() % 8; ++k)
      text[random() % text.size()] = static_cast<char>(random());
    text.resize(random() % (text.size() + 1));
    for (const auto& r : {parse_text(text), parse_binary(text)}) {
      EXPECT_TRUE(r || !r.error().empty());
    }
  }
}

/// The library's own watch of the depth takes a time that grows with the square of an array's
/// length: 17 s for 180 kB, ten minutes for this message.
TEST(Protocol, ReadsTheLargestMessageInLinearTime) {
  std::string text = R"({"op": "subscribe", "subscriptions": [{})";
  while (text.size() < (1 << 20)) text += ",{}";
  EXPECT_FALSE(parse_text(text + "]}")) << "they have no ids";
}

/// The library's reason repeats what it has read, control characters eightfold.
TEST(Protocol, RefusesInALine) {
  for (const std::string& text : {"{\"D\"" + std::string(1 << 20, '\n') + "x",
                                  R"({"op": ")" + std::string(1 << 20, 'x') + R"("})"}) {
    const auto parsed = parse_text(text);
    ASSERT_FALSE(parsed);
    EXPECT_LT(parsed.error().size(), 400U);
  }
}

TEST(Protocol, RefusesDeepNesting) {
  for (const char* open : {"[", "{\"a\":"}) {
    std::string text;
    for (int i = 0; i < 300'000; ++i) text += open;
    const auto parsed = parse_text(text);
    ASSERT_FALSE(parsed);
    EXPECT_EQ(parsed.error(), "not understood: nested deeper than 16");
  }
  EXPECT_TRUE(
      parse_text(R"({"op": "getParameters", "parameterNames": ["[[[[[[[[[[[[[[[[[[[[\"{"]})"));
}

}  // namespace
}  // namespace mimesis::view
