#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/motion/demix/mixture.h"
#include "experiments/motion/motion_map.h"
#include "experiments/motion/test/gait_sets.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Index;

struct Score {
  double median, minimum;
};

Score score(std::vector<double> q) {
  std::ranges::sort(q);
  const std::size_t n = q.size();
  return {0.5 * (q[(n - 1) / 2] + q[n / 2]), q.front()};
}

/// Q of all cycles of CMU subject 07, each with its clip left out of everything that is learned:
/// sources, delays, maps.
std::map<std::string, Score> leave_clips_out(const mocap::Trials& all, int sources) {
  std::set<std::string> clips;
  for (const mocap::Trial& t : all.trials) clips.insert(t.clip);
  std::map<std::string, std::vector<double>> q;
  const Index rows = all.rows_per_trial();
  for (const std::string& clip : clips) {
    const auto learned = testing::subset(all, [&](const auto& t) { return t.clip != clip; });
    const auto asked = testing::subset(all, [&](const auto& t) { return t.clip == clip; });
    const motion::MotionModel model = testing::tied_model(learned, sources);
    const std::vector<TaskInput> inputs = {TaskInput::duration(), TaskInput::step_length()};
    const MotionMap local(model, inputs, LocalRegressionOptions{});
    const MotionMap process(model, inputs, GaussianProcessOptions{});
    const auto count = static_cast<Index>(learned.trials.size());
    Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(rows, all.samples.cols()), points(count, 2);
    for (Index i = 0; i < count; ++i) {
      const mocap::Trial& t = learned.trials[static_cast<std::size_t>(i)];
      mean += learned.samples.middleRows(i * rows, rows) / static_cast<double>(count);
      points.row(i) << t.duration_s, t.step_length_m;
    }
    const InputDomain scaled(points, 1e3);
    for (std::size_t i = 0; i < asked.trials.size(); ++i) {
      const auto truth = asked.samples.middleRows(static_cast<Index>(i) * rows, rows);
      const Eigen::Vector2d x(asked.trials[i].duration_s, asked.trials[i].step_length_m);
      Index nearest = 0;
      (scaled.scaled().rowwise() - scaled.bring_in(x).x.transpose())
          .rowwise()
          .squaredNorm()
          .minCoeff(&nearest);
      q["nearest"].push_back(
          demix::quality(truth, learned.samples.middleRows(nearest * rows, rows)));
      q["mean"].push_back(demix::quality(truth, mean));
      for (const auto& [name, map] : {std::pair{"local", &local}, {"process", &process}}) {
        const MotionParameters p = map->at(x).parameters;
        q[name].push_back(demix::quality(
            truth, testing::synthesize(model, p.mean_rad, p.weight_rad, p.delay_rad)));
      }
    }
  }
  std::map<std::string, Score> scores;
  for (const auto& [name, values] : q) {
    scores[name] = score(values);
    std::printf("K=%d %-8s Q median %.3f minimum %.3f over %zu cycles\n", sources, name.c_str(),
                scores[name].median, scores[name].minimum, values.size());
  }
  return scores;
}

TEST(LeaveClipOut, MapsBeatTheNearestAndTheMeanTrial) {
  if (testing::shared_folder().empty()) GTEST_SKIP() << "not here: no shared folder";
  const mocap::Trials all = testing::gait_set("A", "07_");
  ASSERT_EQ(all.trials.size(), 14u);
  for (const mocap::Trial& t : all.trials) {
    ASSERT_GT(t.step_length_m, 1.2) << t.clip;
    ASSERT_LT(t.step_length_m, 1.9) << t.clip;
  }
  auto s = leave_clips_out(all, 4);
  for (const char* map : {"local", "process"}) {
    EXPECT_GT(s[map].median, s["nearest"].median + 0.05) << map;
    EXPECT_GT(s[map].median, s["mean"].median + 0.05) << map;
    EXPECT_GE(s[map].minimum, 0.45) << map;
  }
}

}  // namespace
}  // namespace mimesis::synthesizer
