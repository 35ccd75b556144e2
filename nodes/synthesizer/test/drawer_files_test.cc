// Drawer trials as files: what is written is learned as if it had been generated here.
#include "nodes/synthesizer/sequence/drawer_files.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "common/error.h"
#include "common/model/files.h"
#include "common/testing/loopback.h"
#include "common/testing/refusal.h"
#include "common/testing/temporary_folder.h"
#include "nodes/synthesizer/robot/robot_trials.h"
#include "nodes/synthesizer/synthesizer_node.h"
#include "nodes/synthesizer/test/model_file.h"

namespace mimesis::synthesizer {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using Eigen::Index;
using Sets = std::array<mocap::Trials, kActions>;

class DrawerFiles : public ::testing::Test {
 protected:
  void write(const Sets& sets) const {
    for (std::size_t a = 0; a < kActions; ++a) {
      mocap::write_trials(sets[a], folder_ / kActionFiles[a]);
    }
  }
  Sets read() const {
    Sets sets;
    for (std::size_t a = 0; a < kActions; ++a) {
      sets[a] = mocap::read_trials(folder_ / kActionFiles[a]);
    }
    return sets;
  }
  mimesis::testing::TemporaryFolder folder_;
};

const DrawerData& four_trials() {
  static const DrawerData data =
      generate_drawer_data(mocap::standard_body(), {}, {.trials = 4, .paces = {0.8}});
  return data;
}

void expect_equal(const DrawerData& a, const DrawerData& b) {
  EXPECT_EQ(a.drawer, b.drawer);
  for (std::size_t i = 0; i < kActions; ++i) {
    EXPECT_EQ(a.action[i].rows, b.action[i].rows);
    EXPECT_EQ(a.action[i].task_names, b.action[i].task_names);
    EXPECT_EQ(a.action[i].samples, b.action[i].samples) << "bit by bit";
    ASSERT_EQ(a.action[i].trials.size(), b.action[i].trials.size());
    for (std::size_t k = 0; k < a.action[i].trials.size(); ++k) {
      const mocap::Trial &x = a.action[i].trials[k], &y = b.action[i].trials[k];
      EXPECT_EQ(x.clip, y.clip);
      EXPECT_EQ(x.style, y.style);
      EXPECT_EQ(x.duration_s, y.duration_s);
      EXPECT_EQ(x.step_length_m, y.step_length_m);
      EXPECT_EQ(x.task, y.task);
    }
  }
}

TEST_F(DrawerFiles, ComeBackBitByBit) {
  write(split_actions(four_trials()));
  expect_equal(join_actions(read(), drawer_rows(), mocap::standard_body(), "here"), four_trials());
  const robot::Biped biped = model::load_biped("biped.yaml");
  const DrawerData robots = generate_robot_data(biped, {.trials = 4, .paces = {}, .samples = 20});
  write(split_actions(robots));
  expect_equal(join_actions(read(), robot_rows(biped), robots.body, "here"), robots);
}

// What they hold is what was generated (ComeBackBitByBit).
TEST_F(DrawerFiles, TheNodeLearnsFromThem) {
  write(split_actions(generate_drawer_data(mocap::standard_body(), {}, {.seed = 3})));
  const testing::ModelFile three(testing::three_styles());
  SynthesizerParams p;
  p.model = three.path();
  p.drawer = true;
  p.drawer_trials = folder_.path();
  p.goal = {.kind = "drawer", .x_m = 1.6};
  mimesis::testing::Loopback bus;
  SynthesizerNode node(p, bus);
  bool reached = false;
  for (runtime::Time now = 1s; now < 6s && !reached; now += 5ms) {
    node.step(now);
    reached = bus.take<v1::Motion>("motion").value().action() == "reach";
  }
  EXPECT_TRUE(reached);
}

TEST_F(DrawerFiles, SayWhatIsWrong) {
  const auto refusal = [](const std::function<void(Sets&)>& harm) -> std::string {
    Sets sets = split_actions(four_trials());
    harm(sets);
    return mimesis::testing::refusal(
        [&] { join_actions(std::move(sets), drawer_rows(), mocap::standard_body(), "d"); },
        "taken");
  };
  EXPECT_EQ(refusal([](Sets&) {}), "taken");
  EXPECT_EQ(refusal([](Sets& s) { s[1].rows[3] = "knee"; }),
            "d/reaching_step.csv: row 4 of a trial is knee, expected lhip.x");
  EXPECT_EQ(refusal([](Sets& s) { s[2].samples(54 + 4, 7) = 57.3; }),
            "d/standing.csv: generated 1/1, cycle 0: lhip.y at t7 is 57.3, expected rad, m or m/s "
            "within 2 pi");
  EXPECT_EQ(refusal([](Sets& s) { s[1].samples = s[1].samples.leftCols(50).eval(); }),
            "d/reaching_step.csv: 50 samples a row, expected 100 as in d/normal_step.csv");
  EXPECT_EQ(
      refusal([](Sets& s) { std::swap(s[2].trials[0], s[2].trials[1]); }),
      "d/standing.csv: generated 1/1, cycle 0: trial 1, expected generated 1/0, cycle 0 as in "
      "d/normal_step.csv");
  EXPECT_EQ(refusal([](Sets& s) {
              s[2].trials.pop_back();
              s[2].samples = s[2].samples.topRows(7 * kDrawerRows).eval();
            }),
            "d/standing.csv: 7 trials, expected 8 as in d/normal_step.csv");
  EXPECT_EQ(refusal([](Sets& s) {
              for (mocap::Trials& set : s) {
                set.trials.resize(3);
                set.samples = set.samples.topRows(3 * kDrawerRows).eval();
              }
            }),
            "d/normal_step.csv: 3 trials, expected at least 4");
  EXPECT_EQ(refusal([](Sets& s) { s[0].trials[2].step_length_m = 0.0; }),
            "d/normal_step.csv: generated 1/2, cycle 0: step_length_m 0, expected more than 0");
  EXPECT_EQ(
      refusal([](Sets& s) {
        for (mocap::Trial& t : s[1].trials) t.step_length_m = 0.5;
      }),
      "d/reaching_step.csv: step_length_m is 0.5 in all trials, expected lengths that differ");
  EXPECT_EQ(refusal([](Sets& s) { s[2].task_names[2] = "depth"; }),
            "d/standing.csv: no column 'object_depth_m', expected one");
  EXPECT_EQ(refusal([](Sets& s) { s[1].trials[5].task[7] = 0.3; }),
            "d/reaching_step.csv: generated 1/1, cycle 1: another drawer, expected that of the "
            "first trial");
  const std::string far = refusal([](Sets& s) { s[0].trials[4].task[0] *= 1000.0; });  // [mm]
  EXPECT_EQ(far.substr(0, 61), "d/normal_step.csv: generated 1/0, cycle 1: distance_m 1988.17");
  EXPECT_NE(refusal([](Sets& s) { s[1].trials[4].task[1] += 0.2; }).find("final_distance_m"),
            std::string::npos);
}

}  // namespace
}  // namespace mimesis::synthesizer
