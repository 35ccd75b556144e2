// Descriptions of drives as makers write them, and what a drive lacks by them.
#include "hw/cia402/eds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "common/testing/refusal.h"
#include "hw/cia402/cia402.h"
#include "hw/cia402/test/eds_text.h"

namespace mimesis::hw::cia402 {
namespace {

using namespace eds_text;  // NOLINT(google-build-using-namespace): one test's words

std::vector<SetupStep> steps(const Axis& axis = {.node_id = 5}) {
  return setup_steps(axis, {.q_min = -1, .q_max = 1, .v_max = 1, .a_max = 1}, {5, -3});
}
std::vector<EdsFinding> lacks(const std::vector<Entry>& entries,
                              const Axis& axis = {.node_id = 5}) {
  return lacks_of(Eds(text_of(entries), "drive.eds", 5), steps(axis));
}
/// The drive with one object changed; without it if `change` returns false.
std::vector<Entry> changed(Object object, const std::function<bool(Entry&)>& change) {
  std::vector<Entry> out = whole_drive();
  std::erase_if(out, [&](Entry& e) { return e.object == object && !change(e); });
  return out;
}
std::vector<Entry> without(Object object) {
  return changed(object, [](Entry&) { return false; });
}

TEST(Eds, AWholeDriveLacksNothing) {
  for (const EdsFinding& each : lacks(whole_drive())) ADD_FAILURE() << each.text;
}

TEST(Eds, EachObjectThatIsMissedIsNamed) {
  struct Case {
    Object object;
    EdsFinding::Kind kind;
    const char *word, *text;
  };
  using enum EdsFinding::Kind;
  const std::vector<Case> cases{
      {object::kAbortOption, accept, "no_6007",
       "6007:00 (quick stop when the connection is lost): "
       "the drive lacks it: what it does when"},
      {object::kMasterHeartbeat, accept, "no_1016", "1016:01"},
      {object::kHeartbeatTime, accept, "no_1017", "1017:00"},
      {object::kQuickStopOption, accept, "no_605A", "605A:00"},
      {object::kPeriodValue, accept, "no_60C2", "60C2:01"},
      {object::kPositionMin, warning, "", "607D:01"},
      {object::kRpdo1Deadline, warning, "", "1400:05"},
      {object::kVelocity, warning, "", "606C:00"},
      {object::kMode, unusable, "", "6060:00"},
      {object::kControlword, unusable, "", "6040:00 (in an RPDO): the drive lacks it"},
      {object::kTarget, unusable, "", "607A:00"},
      {object::kStatusword, unusable, "", "6041:00 (in a TPDO): the drive lacks it"},
      {object::kPosition, unusable, "", "6064:00"},
      {{0x1800, 1}, unusable, "", "1800:01 (PDO on): the drive lacks it"},
      {{0x1801, 2}, unusable, "", "1801:02 (PDO on SYNC): the drive lacks it"}};
  for (const Case& c : cases) {
    const auto found = lacks(without(c.object));
    ASSERT_EQ(found.size(), 1u) << c.text << (found.size() > 1 ? found[1].text : "");
    EXPECT_EQ(found[0].kind, c.kind) << found[0].text;
    EXPECT_EQ(found[0].word, c.word);
    EXPECT_TRUE(found[0].text.starts_with(c.text)) << found[0].text;
  }
  // What is no drive at all is said in one line.
  std::vector<Entry> other = whole_drive();
  std::erase_if(other, [](const Entry& e) { return e.object.index >= 0x6000; });
  const auto alone = lacks(other);
  ASSERT_EQ(alone.size(), 1u);
  EXPECT_EQ(alone[0].text, "is no drive of CiA 402: it lacks 6040:00 and 6041:00");
  // An axis that accepts it is warned.
  const auto accepted = lacks(without(object::kAbortOption), {.node_id = 5, .accept = {"no_6007"}});
  ASSERT_EQ(accepted.size(), 1u);
  EXPECT_EQ(accepted[0].kind, EdsFinding::Kind::warning);
  // Nothing stops a drive that watches neither.
  std::vector<Entry> deaf = without(object::kMasterHeartbeat);
  std::erase_if(deaf, [](const Entry& e) { return e.object == object::kRpdo1Deadline; });
  const auto found = lacks(deaf, {.node_id = 5, .accept = {"no_1016"}});
  EXPECT_TRUE(std::ranges::any_of(found, [](const EdsFinding& each) {
    return each.kind == EdsFinding::Kind::unusable &&
           each.text.starts_with("nothing stops it when the bridge is lost");
  }));
}

TEST(Eds, WhatDoesNotFitIsSaidWithItsLine) {
  struct Case {
    Object object;
    std::function<void(Entry&)> change;
    const char* text;
  };
  const std::vector<Case> cases{
      {object::kTarget, [](Entry& e) { e.type = kI16; }, ": is INTEGER16, expected 4 bytes"},
      {object::kTarget, [](Entry& e) { e.pdo = false; }, ": cannot be mapped"},
      {object::kTarget, [](Entry& e) { e.access = "ro"; }, ": cannot be mapped"},
      {object::kPosition, [](Entry& e) { e.access = "wo"; }, ": cannot be mapped"},
      {object::kHeartbeatTime, [](Entry& e) { e.access = "ro", e.value = "1000"; },
       ": is read-only with 1000, expected 100"},
      {object::kHeartbeatTime, [](Entry& e) { e.access = "const"; },
       ": is read-only, and its value is not said"},
      {object::kQuickStopOption, [](Entry& e) { e.more = "LowLimit=0\nHighLimit=1\n"; },
       ": takes 0 to 1, the bridge writes 2"},
      {object::kPositionMin, [](Entry& e) { e.more = "LowLimit=0\nHighLimit=0x7FFFFFFF\n"; },
       ": takes 0 to 2147483647, the bridge writes -160000"},
      {object::kSupportedModes, [](Entry& e) { e.value = "0x2D"; }, ": is 0x2d, expected 0x80"},
      {object::kDeviceType, [](Entry& e) { e.value = "0x00000191"; },
       ": is 0x191, expected 0x192"}};
  for (const Case& c : cases) {
    const auto found = lacks(changed(c.object, [&](Entry& e) {
      c.change(e);
      return true;
    }));
    ASSERT_EQ(found.size(), 1u) << c.text;
    EXPECT_EQ(found[0].kind, EdsFinding::Kind::unusable) << found[0].text;
    EXPECT_NE(found[0].text.find(c.text), std::string::npos) << found[0].text;
    EXPECT_NE(found[0].text.find("line "), std::string::npos) << found[0].text;
  }
  // Read-only, and as wanted.
  EXPECT_TRUE(lacks(changed(object::kHeartbeatTime, [](Entry& e) {
                e.access = "ro";
                e.value = "100";
                return true;
              })).empty());
  // A limit that is no range, and all bits as a negative number.
  EXPECT_TRUE(lacks(changed(object::kPositionMin, [](Entry& e) {
                e.more = "LowLimit=0x80000000\nHighLimit=0x7FFFFFFF\n";
                return true;
              })).empty());
}

TEST(Eds, PdosThatCannotBeChangedMustCarryWhatMoves) {
  const auto fixed = [](bool target) {
    std::vector<Entry> out = whole_drive();
    for (Entry& e : out) {
      const bool mapping = e.object.index == 0x1600 || e.object.index == 0x1A00;
      if (!mapping) continue;
      e.access = "const";
      const bool command = e.object.index == 0x1600;
      constexpr std::array<const char*, 3> kCommand{"2", "0x60400010", "0x607A0020"},
          kState{"2", "0x60410010", "0x60640020"}, kSpeed{"2", "0x60400010", "0x60FF0020"};
      if (e.object.sub < 3)
        e.value = (!command ? kState : target ? kCommand : kSpeed).at(e.object.sub);
    }
    return out;
  };
  const auto warned = lacks(fixed(true));  // only the torque is not shown
  ASSERT_EQ(warned.size(), 1u);
  EXPECT_EQ(warned[0].kind, EdsFinding::Kind::warning);
  EXPECT_TRUE(warned[0].text.starts_with("6077:00 (in a TPDO): line ")) << warned[0].text;
  EXPECT_TRUE(warned[0].text.ends_with("its PDO cannot be changed")) << warned[0].text;
  const auto found = lacks(fixed(false));
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[0].text, "RPDO1 carries 60FF:00, which the bridge cannot give");
  EXPECT_TRUE(found[1].text.starts_with("607A:00 (in an RPDO): line ")) << found[1].text;
  EXPECT_EQ(found[1].kind, EdsFinding::Kind::unusable);
  // Without a mapping nothing is carried.
  const auto none = lacks(without({0x1600, 0}));
  ASSERT_EQ(none.size(), 2u);
  EXPECT_EQ(none[0].text, "6040:00 (in an RPDO): the drive lacks 1600:00");
}

constexpr const char* kHead = "[DeviceInfo]\nProductName=X\n";
Eds small_eds(const std::string& text, int node = 5) { return {kHead + text, "drive.eds", node}; }
/// The value of 2000h, written so.
std::optional<std::int64_t> value_of(const std::string& text, int type = kU32) {
  const auto found = small_eds("[2000]\nDataType=" + std::to_string(type) +
                               "\nAccessType=rw\nDefaultValue=" + text + "\n")
                         .find({0x2000, 0});
  return found ? found->value : std::nullopt;
}

TEST(Eds, NumbersAreReadAsTheyAreWritten) {
  for (const auto& [text, value] :
       std::vector<std::pair<std::string, std::int64_t>>{{"0x1A", 26},
                                                         {"0X1a", 26},
                                                         {"26", 26},
                                                         {"032", 26},
                                                         {"0", 0},
                                                         {"$NODEID+0x180", 0x185},
                                                         {"$NodeID + 0x80", 0x85},
                                                         {"0x600+$NODEID", 0x605},
                                                         {"$nodeid", 5},
                                                         {"0x40000180+$NODEID", 0x40000185},
                                                         {"0xFFFFFFFF", 0xFFFFFFFF},
                                                         {"7 ; seven", 7}}) {
    EXPECT_EQ(value_of(text), value) << text;
  }
  EXPECT_EQ(value_of("0xFFFF", kI16), -1);
  EXPECT_EQ(value_of("-1", kI16), -1);
  EXPECT_EQ(value_of(""), std::nullopt);
  EXPECT_EQ(value_of("abc", 9), std::nullopt);  // VISIBLE_STRING
  for (const char* text : {"0x", "0xG", "08", "1e3", "1.5", "$NODE", "$NODEID+", "+", "--1", "1 2",
                           "99999999999999999999999"}) {
    const std::string refused = testing::refusal([&] { (void)value_of(text); });
    EXPECT_TRUE(refused.starts_with("drive.eds:6: defaultvalue: expected a number as 0x1A"))
        << text << ": " << refused;
  }
  EXPECT_TRUE(testing::refusal([] {
                (void)value_of("0x1FF", kU8);
              }).starts_with("drive.eds:3: a value of 511 is no UNSIGNED8"));
}

TEST(Eds, FilesAreReadAsMakersWriteThem) {
  const std::string text =
      "\xEF\xBB\xBF; made by a tool\n[deviceinfo]\nProductName = Antrieb f\xFCr Gelenke\n"
      "VendorNumber=251\n\n [MandatoryObjects] ; listed\nSupportedObjects=1\n1=0x1000\n[1000]\n"
      "PARAMETERNAME=Device type\nobjecttype=7\nDataType=0x0007\nAccessType=RO\n"
      "DefaultValue=0x192\n[1003]\nObjectType=0x8\nSubNumber=11\n[1003subA]\nDataType=0x7\n"
      "AccessType=ro\nDefaultValue=10\n[1003sub10]\nDataType=0x7\nAccessType=ro\n"
      "DefaultValue=16\n[Comments]\nLines=2\nLine1=one\nwhich runs on\n[1000]\nObjFlags=1\n"
      "[M1SubExt1027]\nwhatever=1\n[Vendor Tool]\nPath=C:\\x\n[6060]\nDataType=2\nAccessType=rw";
  const auto with = [&](const std::string& end) {
    std::string out;
    for (const char c : text) out += c == '\n' ? end : std::string(1, c);
    return out;
  };
  for (const char* end : {"\n", "\r\n", "\r"}) {
    const Eds eds(with(end), "drive.eds", 5);
    EXPECT_EQ(eds.identity(1), 251u);
    EXPECT_EQ(eds.identity(2), std::nullopt);
    EXPECT_TRUE(eds.device("productname").starts_with("Antrieb f"));
    ASSERT_TRUE(eds.find({0x1000, 0}));
    EXPECT_EQ(eds.find({0x1000, 0})->value, 0x192);
    EXPECT_EQ(eds.find({0x1000, 0})->name, "Device type");
    EXPECT_FALSE(eds.find({0x1000, 0})->writable);
    EXPECT_EQ(eds.find({0x1003, 0x0A})->value, 10);
    EXPECT_EQ(eds.find({0x1003, 0x10})->value, 16);
    EXPECT_TRUE(eds.find({0x6060, 0}));  // without an end of its line
    EXPECT_FALSE(eds.find({0x6060, 1}));
    EXPECT_FALSE(eds.find({0x6061, 0}));
  }
  // Lines count in any of them.
  for (const char* end : {"\n", "\r\n", "\r"}) {
    const std::string refused =
        testing::refusal([&] { const Eds eds(with(end) + end + "nonsense", "drive.eds", 5); });
    EXPECT_EQ(refused, "drive.eds:39: expected [SECTION] or KEY=VALUE, found 'nonsense'");
  }
}

TEST(Eds, ArraysInOneSection) {
  const Eds eds = small_eds(
      "CompactPDO=0x07\nNrOfRXPDO=2\nNrOfTXPDO=1\n[1F81]\nObjectType=8\nDataType=7\n"
      "AccessType=rw\nDefaultValue=3\nCompactSubObj=127\n[1F81Value]\nNrOfEntries=2\n"
      "2=0x0000030D\n0x10=$NODEID+1\n[1F81sub7]\nDataType=7\nAccessType=ro\nDefaultValue=77\n");
  EXPECT_EQ(eds.find({0x1F81, 0})->value, 127);
  EXPECT_EQ(eds.find({0x1F81, 0})->bytes, 1);
  EXPECT_EQ(eds.find({0x1F81, 1})->value, 3);
  EXPECT_EQ(eds.find({0x1F81, 2})->value, 0x30D);
  EXPECT_EQ(eds.find({0x1F81, 7})->value, 77);
  EXPECT_EQ(eds.find({0x1F81, 16})->value, 6);
  EXPECT_FALSE(eds.find({0x1F81, 128}));
  // CompactPDO: bits 1 and 2, the COB-ID and the transmission type.
  EXPECT_EQ(eds.find({0x1401, 1})->bytes, 4);
  EXPECT_EQ(eds.find({0x1401, 2})->bytes, 1);
  EXPECT_FALSE(eds.find({0x1401, 5}));
  EXPECT_FALSE(eds.find({0x1402, 1}));
  EXPECT_EQ(eds.find({0x1A00, 3})->bytes, 4);
  EXPECT_FALSE(eds.find({0x1A01, 3}));
}

TEST(Eds, DamageIsNamedWithItsLine) {
  const struct {
    std::string text;
    const char* told;
  } cases[] = {
      {"", "drive.eds:1: no section [DeviceInfo] and no [MandatoryObjects]: this is no EDS or DCF"},
      {"<?xml version=\"1.0\"?>\n", "drive.eds:1: a key before the first section"},
      {"[DeviceInfo\nA=1\n", "drive.eds:1: a section without ']'"},
      {"[DeviceInfo] x\n", "drive.eds:1: behind the section there is 'x'"},
      {"A=1\n", "drive.eds:1: a key before the first section"},
      {"[DeviceInfo]\n=1\n", "drive.eds:2: expected [SECTION] or KEY=VALUE, found '=1'"},
      {std::string("[DeviceInfo]\nA=\0\n", 17), "drive.eds:2: a byte 0: expected text"},
      {"[DeviceInfo]\n[6040]\nDataType=6\n[6040]\nDataType=7\n",
       "drive.eds:5: datatype is '7' here and '6' in line 3"}};
  for (const auto& c : cases) {
    const std::string told = testing::refusal([&] { const Eds eds(c.text, "drive.eds", 5); });
    EXPECT_TRUE(told.starts_with(c.told)) << told;
  }
  const struct {
    const char *text, *told;
  } objects[] = {
      {"[OptionalObjects]\n1=0x6040\n",
       "drive.eds:4: lists 0x6040, but there is no section [6040]"},
      {"[6040]\nAccessType=maybe\n", "drive.eds:4: AccessType: expected ro, wo, rw, rwr, rww or"},
      {"[6040]\nObjectType=99\n", "drive.eds:3: ObjectType: 99 is none of CiA 306"},
      {"[6040]\nDataType=UNSIGNED16\n", "drive.eds:4: datatype: expected a number"}};
  for (const auto& c : objects) {
    const Eds eds = small_eds(c.text);
    EXPECT_FALSE(eds.find({0x6041, 0}));  // what is not asked for need not make sense
    const std::string told = testing::refusal([&] { (void)eds.find({0x6040, 0}); });
    EXPECT_TRUE(told.starts_with(c.told)) << told;
  }
}

TEST(Eds, TheSameKeyTwiceWithOneValueIsOne) {
  EXPECT_EQ(testing::refusal(
                [] { small_eds("[6040]\nDataType=6\n[6040]\nDataType=6\nAccessType=rw\n"); }),
            "");
}

}  // namespace
}  // namespace mimesis::hw::cia402
