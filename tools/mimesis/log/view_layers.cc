#include "tools/mimesis/log/view_layers.h"

#include <fmt/format.h>

#include <array>

#include "common/model/files.h"
#include "common/model/viewer.h"
#include "tools/mimesis/log/view_camera.h"
#include "tools/mimesis/log/view_fields.h"

namespace mimesis::tool {
namespace {

struct Layer {
  const char* option;
  bool ViewLayers::*asked;
  const google::protobuf::Descriptor* type;  ///< that it is drawn from
};

const std::array<Layer, 4>& known_layers() {
  static const std::array<Layer, 4> layers{{
      {"--robot", &ViewLayers::robot, v1::ArmState::descriptor()},
      {"--fields", &ViewLayers::fields, v1::FieldActivity::descriptor()},
      {"--roadmap", &ViewLayers::roadmap, v1::Scene::descriptor()},
      {"--table", &ViewLayers::table, v1::Scene::descriptor()},
  }};
  return layers;
}

/// Several nodes may publish the same type; the bridge is the one that speaks for the robot.
std::optional<SeenTopic> source_of(const std::vector<OpenLog>& logs,
                                   const google::protobuf::Descriptor& type) {
  const bool hand = &type == v1::HandState::descriptor();
  return topic_of(logs, type.full_name(), hand ? "bridge/hand" : "bridge/arm");
}

bool drawn(bool ViewLayers::*layer, const ViewLayers& layers, const std::vector<OpenLog>& logs) {
  for (const Layer& known : known_layers()) {
    if (known.asked == layer) return (layers.*layer || layers.all) && source_of(logs, *known.type);
  }
  return false;
}

}  // namespace

std::optional<std::string> missing_topic(const ViewLayers& layers,
                                         const std::vector<OpenLog>& logs) {
  for (const Layer& layer : known_layers()) {
    if (layers.*layer.asked && !source_of(logs, *layer.type)) {
      return fmt::format("{}: no topic of type {} in the log", layer.option,
                         layer.type->full_name());
    }
  }
  return std::nullopt;
}

LayerPainter::LayerPainter(const ViewLayers& layers, const std::vector<OpenLog>& logs) {
  const Setups setups = read_setups(logs);
  if (const auto image = topic_of(logs, "foxglove.RawImage", "camera/image")) {
    camera_ = view_of(setups, *image);
  }
  if (drawn(&ViewLayers::robot, layers, logs)) add_robot(logs, setups);
  if (drawn(&ViewLayers::roadmap, layers, logs)) add_roadmap(logs, setups);
  if (drawn(&ViewLayers::fields, layers, logs)) {
    follow<v1::FieldActivity>(logs, [](const v1::FieldActivity& fields, const Draw& draw) {
      draw("view/fields", to_board(fields), std::chrono::nanoseconds(fields.header().stamp_ns()));
      return true;
    });
  }
  if (drawn(&ViewLayers::table, layers, logs)) {
    follow<v1::Scene>(logs, [](const v1::Scene& scene, const Draw& draw) {
      const std::chrono::nanoseconds stamp(scene.header().stamp_ns());
      draw("view/table", model::to_table(model::from_proto(scene), stamp), stamp);
      return true;
    });
  }
}

void LayerPainter::add_robot(const std::vector<OpenLog>& logs, const Setups& setups) {
  const auto arm = source_of(logs, *v1::ArmState::descriptor());
  robot_.emplace(model::load_arm(robot_of(setups, arm->node)));
  follow<v1::ArmState>(logs, [this](const v1::ArmState& state, const Draw& draw) {
    return robot_->see(state, draw);
  });
  follow<v1::HandState>(logs, [this](const v1::HandState& state, const Draw& draw) {
    return robot_->see(state, draw);
  });
}

void LayerPainter::add_roadmap(const std::vector<OpenLog>& logs, const Setups& setups) {
  const planner::PlannerParams params = planner_params(setups);
  roadmap_.emplace(model::load_arm(params.robot), planner::task_settings(params));
  const auto see = [this](const auto& message, const Draw& draw) {
    return roadmap_->see(message, draw);
  };
  follow<v1::Scene>(logs, see);
  follow<v1::TaskStatus>(logs, see);
  follow<v1::Trajectory>(logs, see);
}

template <class T, class See>
void LayerPainter::follow(const std::vector<OpenLog>& logs, See see) {
  const auto source = source_of(logs, *T::descriptor());
  if (!source) return;
  painters_.emplace(source->topic, [see](std::string_view payload, const Draw& draw) {
    T message;
    return message.ParseFromArray(payload.data(), static_cast<int>(payload.size())) &&
           see(message, draw);
  });
}

void LayerPainter::begin(std::chrono::nanoseconds stamp, const Draw& draw) const {
  if (!camera_) return;
  draw("view/camera", to_calibration(*camera_, stamp), stamp);
  draw("view/camera_frames", to_camera_frames(*camera_, stamp), stamp);
}

void LayerPainter::see(const log::MergedReader::Item& item, const Draw& draw) {
  const auto [first, last] = painters_.equal_range(item.channel->topic);
  for (auto painter = first; painter != last; ++painter) {
    if (!painter->second(item.message->data, draw)) ++failed_[item.channel->topic];
  }
}

std::vector<std::string> LayerPainter::problems() const {
  std::vector<std::string> lines;
  for (const auto& [topic, count] : failed_) {
    lines.push_back(
        fmt::format("{}: {} messages cannot be drawn: damaged, or of another robot", topic, count));
  }
  return lines;
}

}  // namespace mimesis::tool
