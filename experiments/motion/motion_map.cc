#include "experiments/motion/motion_map.h"

#include <algorithm>

#include "common/error.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Index;

double value_of(const motion::MotionModel& model, const motion::Pattern& pattern,
                const TaskInput& input) {
  switch (input.kind) {
    case TaskInput::Kind::duration_s:
      return pattern.trial.duration_s;
    case TaskInput::Kind::step_length_m:
      return pattern.trial.step_length_m;
    case TaskInput::Kind::turn_rad:
      return pattern.trial.turn_rad;
    case TaskInput::Kind::task:
      break;
  }
  const auto found = std::ranges::find(model.task_names, input.name);
  const auto i = static_cast<std::size_t>(found - model.task_names.begin());
  if (found == model.task_names.end() || i >= pattern.trial.task.size()) {
    throw ConfigError("map: model '" + model.name + "' has no task parameter '" + input.name + "'");
  }
  return pattern.trial.task[i];
}

struct Table {
  Eigen::MatrixXd inputs, outputs;
  Eigen::VectorXi clip;
};

Table table_of(const motion::MotionModel& model, const std::vector<TaskInput>& inputs) {
  if (inputs.empty()) throw ConfigError("map: no task inputs");
  if (model.patterns.empty()) throw ConfigError("map: model '" + model.name + "' has no pattern");
  if (!model.tied) {
    throw ConfigError("map: model '" + model.name + "' has free delays, expected tied ones");
  }
  const auto n = static_cast<Index>(model.patterns.size());
  const Index rows = model.patterns[0].mean_rad.size(), sources = model.sources.rows();
  Table t{Eigen::MatrixXd(n, static_cast<Index>(inputs.size())),
          Eigen::MatrixXd(n, rows * (sources + 1) + 1), Eigen::VectorXi(n)};
  std::vector<std::string> clips;
  for (Index i = 0; i < n; ++i) {
    const motion::Pattern& pattern = model.patterns[static_cast<std::size_t>(i)];
    const MotionParameters p = parameters_of(pattern);
    if (p.weight_rad.rows() != rows || p.weight_rad.cols() != sources) {
      throw ConfigError("map: patterns of different sizes");
    }
    for (std::size_t c = 0; c < inputs.size(); ++c) {
      t.inputs(i, static_cast<Index>(c)) = value_of(model, pattern, inputs[c]);
    }
    t.outputs.row(i) << p.mean_rad.transpose(), p.weight_rad.reshaped().transpose(),
        p.frequency_rad_s;
    const auto known = std::ranges::find(clips, pattern.trial.clip);
    t.clip[i] = static_cast<int>(known - clips.begin());
    if (known == clips.end()) clips.push_back(pattern.trial.clip);
  }
  // a single clip cannot be left out
  if (clips.size() < 2) t.clip.resize(0);
  return t;
}

std::variant<LocalRegression, GaussianProcess> learn(const Table& t,
                                                     const MotionMap::Options& options) {
  if (const auto* local = std::get_if<LocalRegressionOptions>(&options)) {
    return LocalRegression(t.inputs, t.outputs, *local, t.clip);
  }
  return GaussianProcess(t.inputs, t.outputs, std::get<GaussianProcessOptions>(options), t.clip);
}

}  // namespace

MotionMap::MotionMap(const motion::MotionModel& model, const std::vector<TaskInput>& inputs,
                     const Options& options)
    : map_(learn(table_of(model, inputs), options)) {
  delay_rad_ = model.patterns[0].delay_rad;
}

MotionMap::Value MotionMap::at(const Eigen::Ref<const Eigen::VectorXd>& task) const {
  const MapValue v = std::visit([&](const auto& map) { return map.at(task); }, map_);
  const Index rows = delay_rad_.rows(), sources = delay_rad_.cols();
  return {{v.value.head(rows), v.value.segment(rows, rows * sources).reshaped(rows, sources),
           delay_rad_, v.value[v.value.size() - 1]},
          v.outside};
}

}  // namespace mimesis::synthesizer
