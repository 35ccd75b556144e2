// Seeded mistakes: each must be found at its line and column, with the expected value.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "common/error.h"
#include "common/runtime/param_source.h"
#include "common/runtime/test/params_under_test.h"
#include "common/testing/refusal.h"

namespace mimesis::runtime {
namespace {

struct Mistake {
  const char* name;
  const char* yaml;
  const char* expected;  ///< whole message; '@' stands for the file
  std::vector<std::string> sets = {};
  std::vector<std::string> args = {};
  const char* section = "";
};

std::ostream& operator<<(std::ostream& out, const Mistake& m) { return out << m.name; }

class FindsMistake : public ::testing::TestWithParam<Mistake> {
 protected:
  FindsMistake() : folder_((std::filesystem::temp_directory_path() / "params-XXXXXX").string()) {
    EXPECT_NE(mkdtemp(folder_.data()), nullptr);
  }
  ~FindsMistake() override { std::filesystem::remove_all(folder_); }

  std::string folder_;
};

TEST_P(FindsMistake, AtItsPlace) {
  const Mistake& m = GetParam();
  const std::string file = folder_ + "/crowd.yaml";
  std::ofstream(file) << m.yaml;
  std::string expected = m.expected;
  for (std::size_t at = 0; (at = expected.find('@', at)) != std::string::npos;) {
    expected.replace(at, 1, file);
  }
  CrowdParams params;
  const std::string refused = testing::refusal([&] {
    const ParamSource source(file + m.section, m.args, m.sets);
    source.read("crowd", [&](ParamVisitor& v) { params.visit(v); });
  });
  EXPECT_EQ(refused, expected);
}

const Mistake kMistakes[] = {
    {"unknown_key", "rate_hz: 10\nrate_zh: 10\n",
     "@:2:1: crowd.rate_zh: unknown parameter, did you mean 'rate_hz'?"},
    {"unknown_far", "colour_of_the_sky: 1\n", "@:1:1: crowd.colour_of_the_sky: unknown parameter"},
    {"forgotten_unit", "rate: 10\n",
     "@:1:1: crowd.rate: unknown parameter, did you mean 'rate_hz'?"},
    {"unknown_nested", "drive:\n  enabled: true\n  limit_rad: 3\n",
     "@:3:3: crowd.drive.limit_rad: unknown parameter, did you mean 'limit_rad_s'?"},
    {"unknown_in_list", "balls:\n  - radius_m: 0.1\n  - {radius_m: 0.1, nam: x}\n",
     "@:3:21: crowd.balls.1.nam: unknown parameter, did you mean 'name'?"},
    {"too_large", "k_1_s: 50\n", "@:1:8: crowd.k_1_s: 50 is outside [0.001, 10]"},
    {"too_small", "agents:   1\n", "@:1:11: crowd.agents: 1 is outside [2, 256]"},
    {"negative", "drive: {limit_rad_s: -1}\n",
     "@:1:22: crowd.drive.limit_rad_s: -1 is outside [0, 5]"},
    {"word_for_number", "rate_hz: fast\n",
     "@:1:10: crowd.rate_hz: expected a number, found 'fast'"},
    {"unit_after_number", "rate_hz: 10Hz\n",
     "@:1:10: crowd.rate_hz: expected a number, found '10Hz'"},
    {"comma_for_point", "rate_hz: 10,5\n",
     "@:1:10: crowd.rate_hz: expected a number, found '10,5'"},
    {"nan", "rate_hz: .nan\n", "@:1:10: crowd.rate_hz: expected a number, found '.nan'"},
    {"nan_as_c", "rate_hz: nan\n", "@:1:10: crowd.rate_hz: expected a number, found 'nan'"},
    {"infinity", "rate_hz: inf\n", "@:1:10: crowd.rate_hz: expected a number, found 'inf'"},
    {"fraction_for_whole", "agents: 2.5\n",
     "@:1:9: crowd.agents: expected a whole number, found '2.5'"},
    {"octal", "agents: 010\n", "@:1:9: crowd.agents: expected a whole number, found '010'"},
    {"hexadecimal", "agents: 0x10\n", "@:1:9: crowd.agents: expected a whole number, found '0x10'"},
    {"int_overflow", "agents: 99999999999\n",
     "@:1:9: crowd.agents: expected a whole number, found '99999999999'"},
    {"no_for_false", "log: no\n", "@:1:6: crowd.log: expected true or false, found 'no'"},
    {"one_for_true", "log: 1\n", "@:1:6: crowd.log: expected true or false, found '1'"},
    {"nothing_for_text", "rate_hz: 10\nbus:\n", "@:2:1: crowd.bus: expected text, found nothing"},
    {"list_for_text", "bus: [a, b]\n", "@:1:6: crowd.bus: expected text, found a list"},
    {"map_for_number", "rate_hz:\n  k: 1\n",
     "@:2:3: crowd.rate_hz: expected a number, found a map"},
    {"choice", "graph: lin\n",
     "@:1:8: crowd.graph: expected one of ring, line, all_to_all, found 'lin', did you mean "
     "'line'?"},
    {"choice_far", "graph: tree\n",
     "@:1:8: crowd.graph: expected one of ring, line, all_to_all, found 'tree'"},
    {"scalar_for_list", "gains: 3\n", "@:1:8: crowd.gains: expected a list, found '3'"},
    {"short_list", "gains: [1, 2]\n", "@:1:8: crowd.gains: expected 3 numbers, found 2"},
    {"bad_item", "gains:\n  - 1\n  - x\n  - 3\n",
     "@:3:5: crowd.gains.1: expected a number, found 'x'"},
    {"item_out_of_range", "gains: [1, 2, 300]\n", "@:1:15: crowd.gains.2: 300 is outside [0, 100]"},
    {"text_list_item", "names: [a, {b: c}]\n", "@:1:12: crowd.names.1: expected text, found a map"},
    {"scalar_for_group", "drive: fast\n",
     "@:1:8: crowd.drive: expected a map of parameters, found 'fast'"},
    {"map_for_elements", "balls: {radius_m: 1}\n",
     "@:1:8: crowd.balls: expected a list, found a map"},
    {"scalar_for_element", "balls: [1]\n",
     "@:1:9: crowd.balls.0: expected a map of parameters, found '1'"},
    {"in_element", "balls:\n  - name: a\n    radius_m: 9\n",
     "@:3:15: crowd.balls.0.radius_m: 9 is outside [0.01, 1]"},
    {"duplicate", "rate_hz: 10\nk_1_s: 1\nrate_hz: 20\n",
     "@:3:1: key 'rate_hz' appears twice (first on line 1)"},
    {"duplicate_nested", "drive: {enabled: true, enabled: false}\n",
     "@:1:24: key 'enabled' appears twice (first on line 1)"},
    {"merge_key", "drive: &d {enabled: true}\nballs:\n  - <<: *d\n",
     "@:3:5: merge keys (<<) are not supported"},
    {"second_document", "rate_hz: 10\n---\nrate_hz: 20\n",
     "@:2:1: a second document (---) is not read"},
    {"comma_first", ", x\n", "@:1:1: a comma outside of brackets"},
    {"comma_after_comment", "# one\n, rate_hz: 10\n", "@:2:1: a comma outside of brackets"},
    {"no_utf8", "#\xff\xff\xff\xff\n,", "@:2:1: a comma outside of brackets"},
    {"xml", "\xEF\xBB\xBF<?xml version='1.0'?>\n<launch/>\n", "@: is XML, expected YAML"},
    {"urdf", "\n<robot name='r' xmlns:x='y'>\n</robot>\n",
     "@: is XML, expected YAML; `mimesis robot new` makes it from an arm's URDF, `robot check` a "
     "biped's"},
    {"long_text",
     "drive: aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"
     "\u00e9\u00e9\n",
     "@:1:8: crowd.drive: expected a map of parameters, found "
     "'aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\u00e9...'"},
    {"not_a_map", "- rate_hz\n", "@:1:1: expected a map of parameters, found a list"},
    {"variable_kind", "bus: ${argh:x}\n",
     "@:1:6: ${argh:x}: expected ${arg:NAME}, ${env:NAME}, ${host:NAME} or ${run:NAME}"},
    {"variable_open", "bus: a${arg:x\n", "@:1:7: ${ without }"},
    {"variable_unset", "bus: \"x/${env:MIMESIS_NOT_SET}\"\n",
     "@:1:9: ${env:MIMESIS_NOT_SET}: the environment has no MIMESIS_NOT_SET"},
    {"arg_undeclared",
     "args: {speed: {default: 3}}\np: {rate_hz: \"${arg:sped}\"}\n",
     "@:2:15: no argument 'sped' is declared, did you mean 'speed'?",
     {},
     {},
     "#p"},
    {"arg_without_default",
     "args: {speed: {}}\np: {rate_hz: \"${arg:speed}\"}\n",
     "@:2:15: argument 'speed' has no default: give --arg speed=VALUE",
     {},
     {},
     "#p"},
    {"arg_in_a_circle",
     "args: {a: {default: \"${arg:a}\"}}\np: {bus: \"${arg:a}\"}\n",
     "@:1:22: an argument's default names itself",
     {},
     {},
     "#p"},
    {"arg_of_wrong_type",
     "args: {speed: {default: 3}}\np: {rate_hz: \"${arg:speed}\"}\n",
     "@:2:14: crowd.rate_hz: expected a number, found 'fast'",
     {},
     {"speed=fast"},
     "#p"},
    {"arg_unknown",
     "args: {speed: {default: 3}}\np: {rate_hz: 3}\n",
     "--arg: the file declares no argument 'sped', did you mean 'speed'?",
     {},
     {"sped=3"},
     "#p"},
    {"section_missing",
     "nodes:\n  crowd:\n    params: {}\n",
     "@:2:3: has no 'crwd' on the way to nodes.crwd.params, did you mean 'crowd'?",
     {},
     {},
     "#nodes.crwd.params"},
    {"section_value",
     "nodes: {crowd: {params: {k_1_s: 99}}}\n",
     "@:1:33: crowd.k_1_s: 99 is outside [0.001, 10]",
     {},
     {},
     "#nodes.crowd.params"},
    {"set_unknown",
     "rate_hz: 10\n",
     "--set: crowd.drive.limit: unknown parameter, did you mean 'drive.limit_rad_s'?",
     {"drive.limit=3"}},
    {"set_out_of_range",
     "k_1_s: 1\n",
     "--set: crowd.k_1_s: 50 is outside [0.001, 10]",
     {"k_1_s=50"}},
    {"set_no_value", "", "--set: 'k_1_s' is not NAME=VALUE", {"k_1_s"}},
    {"set_short_list", "", "--set: crowd.gains: expected 3 numbers, found 2", {"gains=1,2"}},
    {"set_beyond_list",
     "",
     "--set: crowd.balls.2.radius_m: unknown parameter, did you mean 'balls.0.radius_m'?",
     {"balls.2.radius_m=0.3"}},
};

INSTANTIATE_TEST_SUITE_P(Params, FindsMistake, ::testing::ValuesIn(kMistakes),
                         [](const auto& param_info) { return std::string(param_info.param.name); });

// Messages of the YAML library are its own; the place is ours.
TEST(BrokenYaml, IsReportedAtItsPlace) {
  const std::pair<const char*, const char*> broken[] = {
      {"rate_hz: 10\n\tk_1_s: 1\n", "f.yaml:2:1: "},
      {"gains: [1, 2\nrate_hz: 3\n", "f.yaml:1:8: this [ is never closed, expected a ]"},
      {"drive: {enabled: [1}\n",
       "f.yaml:1:20: found }, expected the other half of the [ on line 1"},
      {"drive: {enabled: true}}\n", "f.yaml:1:23: a } too much"},
      {"bus: ${arg:x}\ndrive: {enabled: ${arg:x}}\n", "f.yaml:2:18: a variable within brackets"},
      {"drive:\n\tenabled: true\n", "f.yaml:2:1: a tab in the indentation, expected spaces"},
      {"bus:x\nk: 1\n", "f.yaml:1:4: no space behind the colon, expected 'bus: x'"},
      {"drive: {enabled: true limit: 1}\n", "f.yaml:1:28: a comma is missing before this"},
      {"drive:\n    a: 1\n  b: 1\n", "f.yaml:3:3: this line begins in a column of its own"},
      {"bus: \"open\n", "f.yaml:1:6: this quote is never closed"},
      {"bus: 'it''s open\nk: 1\n", "f.yaml:1:6: this quote is never closed"},
      {"rate_hz: 10\n  k_1_s: 1\n", "f.yaml:2:8: "},
      {"bus: *nowhere\n", "f.yaml:1:6: "},
      {"? [a]\n: 1\n", "f.yaml:1:3: a key must be text"},
      {"a: &x [*x]\n", "f.yaml:1:"},
      {"bus: \"a\\e[31mb\"\n", "f.yaml:1:6: 'a\\u001b[31mb' has control characters or is no UTF-8"},
      {"\"b\\0\": 1\n", "f.yaml:1:1: 'b\\u0000' has control characters or is no UTF-8"},
      {"bus: \"a\\nb\\e\"\n",
       "f.yaml:1:6: 'a\\u000ab\\u001b' has control characters or is no UTF-8"},
  };
  for (const auto& [text, expected] : broken) {
    const std::string refused = testing::refusal([text = text] { parse_yaml(text, "f.yaml"); });
    EXPECT_EQ(refused.substr(0, std::string(expected).size()), expected) << refused;
  }
  EXPECT_EQ(testing::refusal([] {
              parse_yaml({"\x89MCAP0\r\n\0}", 10}, "run.mcap");
            }),
            "run.mcap: is a binary file, expected YAML");
}

TEST(BrokenYaml, AbsentFileAndFolder) {
  EXPECT_THROW(
      {
        try {
          read_yaml("/nowhere/crowd.yaml");
        } catch (const ConfigError& e) {
          EXPECT_STREQ(e.what(), "/nowhere/crowd.yaml: No such file or directory");
          throw;
        }
      },
      ConfigError);
  EXPECT_THROW(read_yaml("/"), ConfigError);
}

TEST(BrokenYaml, AllMistakesAtOnceInTheOrderOfTheFile) {
  CrowdParams params;
  const std::string file = (std::filesystem::temp_directory_path() / "all-mistakes.yaml").string() +
                           std::to_string(getpid());
  std::ofstream(file) << "k_1_s: 50\nrate: 3\nagents: 1\n";
  const std::string refused = testing::refusal([&] {
    ParamSource(file, {}, {"bus="}).read("crowd", [&](ParamVisitor& v) { params.visit(v); });
  });
  EXPECT_EQ(refused, file + ":1:8: crowd.k_1_s: 50 is outside [0.001, 10]\n" + file +
                         ":2:1: crowd.rate: unknown parameter, did you mean 'rate_hz'?\n" + file +
                         ":3:9: crowd.agents: 1 is outside [2, 256]");
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace mimesis::runtime
