#include "experiments/motion/source_map.h"

#include <svm.h>

#include <memory>
#include <string>

#include "common/error.h"
#include "common/math/circle.h"

namespace mimesis::synthesizer {
namespace {

void silent(const char*) {}

void check(const Eigen::Matrix2Xd& states, const Eigen::VectorXd& values, const SvrSettings& s) {
  auto need = [](bool condition, const std::string& what) {
    if (!condition) throw ConfigError("source map: " + what);
  };
  need(values.size() > 0 && states.cols() == values.size(),
       std::to_string(states.cols()) + " states for " + std::to_string(values.size()) + " values");
  need(states.allFinite() && values.allFinite(), "a state or value is not finite");
  need(s.gamma > 0.0 && s.cost > 0.0 && s.epsilon > 0.0 && s.tolerance > 0.0,
       "gamma, cost, epsilon and tolerance must be positive");
}

Eigen::Vector2d on_circle(int sample, int samples, double turns) {
  const double angle = turns * math::kTwoPi * sample / samples;
  return {std::cos(angle), std::sin(angle)};
}

}  // namespace

SourceMap::SourceMap(const Eigen::Matrix2Xd& states, const Eigen::VectorXd& values,
                     const SvrSettings& settings)
    : gamma_(settings.gamma) {
  check(states, values, settings);
  svm_set_print_string_function(silent);  // LIBSVM would print to stdout
  const auto n = static_cast<std::size_t>(values.size());
  std::vector<svm_node> nodes(3 * n);
  std::vector<svm_node*> rows(n);
  std::vector<double> y(values.begin(), values.end());
  for (std::size_t i = 0; i < n; ++i) {
    const auto c = static_cast<Eigen::Index>(i);
    nodes[3 * i] = {1, states(0, c)};
    nodes[3 * i + 1] = {2, states(1, c)};
    nodes[3 * i + 2] = {-1, 0.0};
    rows[i] = &nodes[3 * i];
  }
  const svm_problem problem{static_cast<int>(n), y.data(), rows.data()};
  svm_parameter parameter{};
  parameter.svm_type = EPSILON_SVR;
  parameter.kernel_type = RBF;
  parameter.gamma = settings.gamma;
  parameter.C = settings.cost;
  parameter.p = settings.epsilon;
  parameter.eps = settings.tolerance;
  parameter.cache_size = 16.0;  // MB
  parameter.shrinking = 0;      // no heuristics; and without probability nothing random
  auto free_model = [](svm_model* m) { svm_free_and_destroy_model(&m); };
  const std::unique_ptr<svm_model, decltype(free_model)> model(svm_train(&problem, &parameter),
                                                               free_model);
  centre_.resize(2, model->l);
  factor_.resize(model->l);
  for (int i = 0; i < model->l; ++i) {
    centre_.col(i) << model->SV[i][0].value, model->SV[i][1].value;
    factor_[i] = model->sv_coef[0][i];
  }
  offset_ = -model->rho[0];
}

double SourceMap::operator()(const Eigen::Vector2d& state) const {
  double sum = offset_;
  for (Eigen::Index i = 0; i < factor_.size(); ++i) {
    sum += factor_[i] * std::exp(-gamma_ * (state - centre_.col(i)).squaredNorm());
  }
  return sum;
}

std::vector<SourceMap> learn_source_maps(const motion::MotionModel& model,
                                         const SvrSettings& settings) {
  const int samples = static_cast<int>(model.sources.cols());
  std::vector<SourceMap> maps;
  for (Eigen::Index k = 0; k < model.sources.rows(); ++k) {
    Eigen::Matrix2Xd states(2, samples);
    for (int t = 0; t < samples; ++t) {
      states.col(t) = on_circle(t, samples, k < model.fixed ? 0.5 : 1.0);
    }
    maps.emplace_back(states, model.sources.row(k).transpose(), settings);
  }
  return maps;
}

}  // namespace mimesis::synthesizer
