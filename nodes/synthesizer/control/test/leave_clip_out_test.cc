#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <set>

#include "nodes/synthesizer/control/gaussian_process.h"
#include "nodes/synthesizer/control/local_regression.h"
#include "nodes/synthesizer/control/test/gait_sets.h"
#include "nodes/synthesizer/demix/mixture.h"

namespace mimesis::synthesizer {
namespace {
using Eigen::Index;

TEST(LeaveClipOut, Experiment) {
  if (testing::shared_folder().empty()) GTEST_SKIP() << "no shared folder";
  const mocap::Trials all = testing::gait_set("A", "07_");
  for (auto& t : all.trials) std::printf("%s %d %.3f %.3f\n", t.clip.c_str(), t.cycle, t.duration_s, t.step_length_m);
  const Index R = all.rows_per_trial();
  std::set<std::string> clips;
  for (auto& t : all.trials) clips.insert(t.clip);
  for (int K : {4, 6}) {
    std::map<std::string, std::vector<double>> q;
    for (auto& clip : clips) {
      const auto train = testing::subset(all, [&](const mocap::Trial& t) { return t.clip != clip; });
      const auto test = testing::subset(all, [&](const mocap::Trial& t) { return t.clip == clip; });
      const MotionModel model = testing::tied_model(train, K);
      const Index n = static_cast<Index>(train.trials.size());
      Eigen::MatrixXd X(n, 2), Y(n, R * (K + 1));
      Eigen::VectorXi group(n);
      Eigen::MatrixXd meanx = Eigen::MatrixXd::Zero(R, 100);
      for (Index i = 0; i < n; ++i) {
        const auto& p = model.patterns[static_cast<std::size_t>(i)];
        X.row(i) << p.trial.duration_s, p.trial.step_length_m;
        Y.row(i).head(R) = p.mean_rad.transpose();
        Y.row(i).tail(R * K) = p.weight_rad.reshaped().transpose();
        group[i] = static_cast<int>(std::distance(clips.begin(), clips.find(p.trial.clip)));
        meanx += train.samples.middleRows(i * R, R) / static_cast<double>(n);
      }
      auto synth = [&](const Eigen::VectorXd& v) { return testing::synthesize(model, v.head(R), v.tail(R * K).reshaped(R, K), model.patterns[0].delay_rad); };
      std::vector<std::pair<std::string, std::function<Eigen::VectorXd(const Eigen::VectorXd&)>>> maps;
      for (double m : {0.0, 0.25, 0.5, 10.0}) {
        auto l = std::make_shared<LocalRegression>(X, Y, LocalRegressionOptions{0, 0, m}, group);
        if (m==0.25) std::printf("lwlr h %.2f r %.3f ", l->bandwidth(), l->ridge());
        maps.push_back({"lwlr loo m" + std::to_string(m), [l](const Eigen::VectorXd& x) { return l->at(x).value; }});
        auto l2 = std::make_shared<LocalRegression>(X, Y, LocalRegressionOptions{1.0, 0.05, m}, group);
        maps.push_back({"lwlr 1 .05 m" + std::to_string(m), [l2](const Eigen::VectorXd& x) { return l2->at(x).value; }});
        auto g = std::make_shared<GaussianProcess>(X, Y, GaussianProcessOptions{GaussianProcessOptions::Fit::marginal_likelihood, {}, m}, group);
        if (m==0.25) std::printf("gp %.2f %.4f %.3f ", g->covariance().length, g->covariance().linear, g->covariance().noise);
        maps.push_back({"gp ml m" + std::to_string(m), [g](const Eigen::VectorXd& x) { return g->at(x).value; }});
        auto g2 = std::make_shared<GaussianProcess>(X, Y, GaussianProcessOptions{GaussianProcessOptions::Fit::leave_one_out, {}, m}, group);
        if (m==0.25) std::printf("gpl %.2f %.4f %.3f\n", g2->covariance().length, g2->covariance().linear, g2->covariance().noise);
        maps.push_back({"gp loo m" + std::to_string(m), [g2](const Eigen::VectorXd& x) { return g2->at(x).value; }});
      }
      InputDomain d(X, 0.0);
      for (std::size_t i = 0; i < test.trials.size(); ++i) {
        const Eigen::MatrixXd truth = test.samples.middleRows(static_cast<Index>(i) * R, R);
        const Eigen::Vector2d x(test.trials[i].duration_s, test.trials[i].step_length_m);
        InputDomain wide(X, 100.0);
        const Eigen::VectorXd xs = wide.bring_in(x).x;
        Index near = 0;
        (wide.scaled().rowwise() - xs.transpose()).rowwise().squaredNorm().minCoeff(&near);
        q["0 nearest"].push_back(demix::quality(truth, train.samples.middleRows(near * R, R)));
        q["0 mean"].push_back(demix::quality(truth, meanx));
        q["0 nearest tied"].push_back(demix::quality(truth, synth(Y.row(near).transpose())));
        q["0 mean tied"].push_back(demix::quality(truth, synth(Y.colwise().mean().transpose())));
        for (auto& [name, f] : maps) q[name].push_back(demix::quality(truth, synth(f(x))));
      }
    }
    for (auto& [name, v] : q) {
      auto s = v;
      std::ranges::sort(s);
      std::printf("K %d %-24s median %.3f min %.3f |", K, name.c_str(), 0.5 * (s[6] + s[7]), s[0]);
      for (double a : v) std::printf(" %.2f", a);
      std::printf("\n");
    }
  }
}

}  // namespace
}  // namespace mimesis::synthesizer
