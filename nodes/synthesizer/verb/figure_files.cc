#include "nodes/synthesizer/verb/figure_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/error.h"
#include "common/math/so3.h"
#include "common/runtime/param_source.h"
#include "common/runtime/yaml_document.h"
#include "common/time.h"
#include "nodes/synthesizer/character/characters.h"
#include "nodes/synthesizer/synthesizer_messages.h"
#include "proto/steps.pb.h"
#include "tools/mimesis/field_text.h"

namespace mimesis::tool {
namespace {

using synthesizer::body_rows;

/// A character at one instant; `rows` as the model has them.
struct Moment {
  std::int64_t stamp_ns = 0;
  Eigen::Vector3d pelvis_W_m = Eigen::Vector3d::Zero();
  double heading_rad = 0.0;
  std::vector<double> rows;
};

mocap::BodyClip empty_clip(const mocap::Body& body, std::string name, double rate_hz,
                           Eigen::Index frames) {
  mocap::BodyClip clip;
  clip.body = body;
  clip.name = std::move(name);
  clip.rate_hz = rate_hz;
  clip.root_position_W_m.resize(3, frames);
  clip.angles_rad.resize(mocap::kBodyRows, frames);
  return clip;
}

/// A column of the clip: the model's rows put to the body's, the heading to the root's.
void put_moment(const Moment& moment, const std::vector<int>& body_row, Eigen::Index column,
                mocap::BodyClip& clip) {
  std::array<double, mocap::kBodyRows> angles{};
  for (std::size_t r = 0; r < body_row.size(); ++r) {
    if (body_row[r] >= 0) angles[static_cast<std::size_t>(body_row[r])] = moment.rows[r];
  }
  mocap::BodyPose pose = forward_kinematics(clip.body, angles, moment.pelvis_W_m);
  const Eigen::Matrix3d R_WH =
      Eigen::AngleAxisd(moment.heading_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  for (Eigen::Matrix3d& R : pose.R_WJ) R = R_WH * R;
  clip.root_position_W_m.col(column) = moment.pelvis_W_m;
  put_angles(pose, column, clip.angles_rad);
}

// --- Log

template <class Message>
std::string type_name() {
  return std::string(Message::descriptor()->full_name());
}

/// The topic of the motion, and its node.
struct MotionTopic {
  std::string topic, node;
};

MotionTopic find_topic(const std::vector<OpenLog>& logs, const std::string& wanted) {
  std::vector<MotionTopic> found;
  for (const OpenChannel& c : channels_of(logs)) {
    if (c.type() != type_name<v1::Motion>() && c.type() != type_name<v1::MotionBatch>()) continue;
    if (!wanted.empty() && c.channel->topic != wanted) continue;
    const MotionTopic one{c.channel->topic, sender_of(*c.channel)};
    const bool known = std::ranges::any_of(found, [&](const MotionTopic& other) {
      return other.topic == one.topic && other.node == one.node;
    });
    if (!known) found.push_back(one);
  }
  if (found.size() == 1) return found[0];
  if (!wanted.empty()) require_topic(logs, wanted);
  std::vector<std::string> names;
  for (const MotionTopic& one : found) names.push_back(one.topic);
  throw ConfigError(found.empty()
                        ? fmt::format("{}: no {}, expected a topic of a synthesizer's motion",
                                      wanted.empty() ? logs.front().path : wanted,
                                      type_name<v1::Motion>())
                        : fmt::format("{}: motion on {}, expected one of them as --topic",
                                      logs.front().path, fmt::join(names, ", ")));
}

/// What the node of the motion says of it.
struct MotionSource {
  v1::MotionRows rows;
  std::string model;
  std::vector<Moment> moments;
};

void add(const v1::Motion& m, int character, const std::string& topic, MotionSource& out) {
  if (character != 0) {
    throw ConfigError(fmt::format("--character {}: {} has one, 0", character, topic));
  }
  out.moments.push_back(
      {static_cast<std::int64_t>(m.header().stamp_ns()),
       {m.position_pelvis_in_world_m().x_m(), m.position_pelvis_in_world_m().y_m(),
        m.position_pelvis_in_world_m().z_m()},
       m.heading_rad(),
       {m.position_rad().begin(), m.position_rad().end()}});
}

void add(const v1::MotionBatch& m, int character, const std::string& topic, MotionSource& out) {
  const int count = m.heading_rad_size();
  if (character >= count) {
    throw ConfigError(fmt::format("--character {}: {} has {}, from 0", character, topic, count));
  }
  const int rows = count > 0 ? m.position_rad_size() / count : 0;
  Moment moment;
  moment.stamp_ns = static_cast<std::int64_t>(m.header().stamp_ns());
  if (m.position_pelvis_in_world_m_size() != 3 * count) return;
  for (int k = 0; k < 3; ++k) {
    moment.pelvis_W_m[k] = m.position_pelvis_in_world_m(3 * character + k);
  }
  moment.heading_rad = m.heading_rad(character);
  for (int r = 0; r < rows; ++r) moment.rows.push_back(m.position_rad(character * rows + r));
  out.moments.push_back(std::move(moment));
}

MotionSource read_source(const std::vector<OpenLog>& logs, const MotionTopic& topic,
                         const CharacterOptions& options) {
  MotionSource out;
  const LogTimes times = resolve(options.range, span_of(logs));
  const auto of_node = [&](const log::Channel& c) { return sender_of(c) == topic.node; };
  const auto decode = [](const Item& item, auto message, const auto& take) {
    if (!parse(item, message)) {
      throw ConfigError(item.channel->topic + ": a message that is damaged");
    }
    take(message);
  };
  scan_logs(logs, {of_node, 0, times.end}, "motion", [&](const Item& item) {
    const std::string type = item.schema == nullptr ? "" : item.schema->name;
    if (type == type_name<v1::MotionRows>()) {
      decode(item, v1::MotionRows(), [&](const auto& m) { out.rows = m; });
    } else if (type == type_name<v1::NodeStart>()) {
      decode(item, v1::NodeStart(), [&](const v1::NodeStart& m) {
        const runtime::Yaml parameters = runtime::parse_yaml(m.parameters(), item.channel->topic);
        if (const runtime::Yaml* model = parameters.find("model")) out.model = model->text;
      });
    } else if (item.channel->topic == topic.topic && item.message->log_time >= times.start) {
      const auto take = [&](const auto& m) { add(m, options.character, topic.topic, out); };
      if (type == type_name<v1::Motion>()) decode(item, v1::Motion(), take);
      if (type == type_name<v1::MotionBatch>()) decode(item, v1::MotionBatch(), take);
    }
  });
  return out;
}

/// The model file's; it must be the one of the run.
motion::MotionModel load_model(const MotionSource& source, const CharacterOptions& options,
                               const std::string& path) {
  const std::string name = options.model.empty() ? source.model : options.model;
  if (name.empty()) {
    throw ConfigError(path + ": does not say which model moved the figure, expected --model FILE");
  }
  motion::MotionModel model = motion::load_motion_model(
      options.model.empty() ? runtime::find_model_file(name) : options.model);
  const auto& rows = source.rows.rows();
  if (!std::equal(rows.begin(), rows.end(), model.rows.begin(), model.rows.end())) {
    throw ConfigError(
        fmt::format("{}: {} rows, expected the {} of {}: give the model of the run by "
                    "--model",
                    path, rows.size(), model.rows.size(), name));
  }
  return model;
}

double median_step_s(const std::vector<Moment>& moments) {
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < moments.size(); ++i) {
    steps.push_back(moments[i].stamp_ns - moments[i - 1].stamp_ns);
  }
  std::ranges::nth_element(steps, steps.begin() + static_cast<long>(steps.size() / 2));
  return 1e-9 * static_cast<double>(steps[steps.size() / 2]);
}

Moment between(const Moment& a, const Moment& b, double share) {
  Moment out = a;
  out.pelvis_W_m += share * (b.pelvis_W_m - a.pelvis_W_m);
  out.heading_rad += share * math::wrap_pi(b.heading_rad - a.heading_rad);
  for (std::size_t r = 0; r < out.rows.size(); ++r) out.rows[r] += share * (b.rows[r] - a.rows[r]);
  return out;
}

std::vector<int> figure_rows(const std::vector<std::string>& rows, const std::string& path,
                             std::vector<std::string>& notes) {
  std::vector<int> out = body_rows(rows);
  const auto others = std::ranges::count(out, -1);
  if (others == static_cast<std::ptrdiff_t>(out.size())) {
    throw ConfigError(fmt::format("{}: rows {}, .. are a robot's, expected a figure's ({})", path,
                                  rows.empty() ? "" : rows.front(), mocap::body_row_name(0)));
  }
  if (others > 0)
    notes.push_back(fmt::format("{}: {} rows of a robot's joints left out", path, others));
  return out;
}

}  // namespace

mocap::BodyClip read_character(const std::vector<OpenLog>& logs, const CharacterOptions& options,
                               std::vector<std::string>& notes) {
  const MotionTopic topic = find_topic(logs, options.topic);
  MotionSource source = read_source(logs, topic, options);
  const std::string& path = logs.front().path;
  const motion::MotionModel model = load_model(source, options, path);
  std::vector<Moment>& moments = source.moments;
  std::ranges::stable_sort(moments, {}, &Moment::stamp_ns);
  const auto same_time = [](const Moment& a, const Moment& b) { return a.stamp_ns == b.stamp_ns; };
  moments.erase(std::unique(moments.begin(), moments.end(), same_time), moments.end());
  if (moments.size() < 2) {
    throw ConfigError(
        fmt::format("{}: {} messages of {}, expected a motion", path, moments.size(), topic.topic));
  }
  for (const Moment& m : moments) {
    if (m.rows.size() == model.rows.size()) continue;
    throw ConfigError(fmt::format("{}: {} numbers a character, expected the model's {}",
                                  topic.topic, m.rows.size(), model.rows.size()));
  }
  const double step_s = median_step_s(moments);
  const double rate_hz = options.rate_hz > 0.0 ? options.rate_hz : 1.0 / step_s;
  const double span_s =
      1e-9 * static_cast<double>(moments.back().stamp_ns - moments.front().stamp_ns);
  const double count = std::floor(span_s * rate_hz + 1e-6) + 1.0;
  constexpr double kMost = 1e7;
  if (count > kMost) {
    throw ConfigError(
        fmt::format("{}: {:.3g} frames, expected less than {:g}", path, count, kMost));
  }
  const auto frames = static_cast<Eigen::Index>(count);
  mocap::BodyClip clip =
      empty_clip(model.body, fmt::format("{}#{}", topic.topic, options.character), rate_hz, frames);
  const std::vector<int> body_row = figure_rows(model.rows, path, notes);
  double longest_s = 0.0;
  std::size_t at = 0;
  for (Eigen::Index t = 0; t < frames; ++t) {
    const auto time_ns = moments.front().stamp_ns +
                         std::int64_t(std::llround(1e9 * static_cast<double>(t) / rate_hz));
    while (at + 2 < moments.size() && moments[at + 1].stamp_ns <= time_ns) ++at;
    const double gap_ns = static_cast<double>(moments[at + 1].stamp_ns - moments[at].stamp_ns);
    longest_s = std::max(longest_s, 1e-9 * gap_ns);
    const double share = static_cast<double>(time_ns - moments[at].stamp_ns) / gap_ns;
    put_moment(between(moments[at], moments[at + 1], std::clamp(share, 0.0, 1.0)), body_row, t,
               clip);
  }
  if (longest_s > 1.5 * step_s) {
    notes.push_back(
        fmt::format("{}: nothing for up to {:.3f} s, interpolated", topic.topic, longest_s));
  }
  return clip;
}

mocap::BodyClip style_cycle(const std::string& model_file, const std::string& style, double rate_hz,
                            bool in_place) {
  constexpr int kSettled = 12;  // cycles until nothing changes any more
  const motion::MotionModel model = motion::load_motion_model(model_file);
  std::vector<std::string> notes;
  const std::vector<int> body_row = figure_rows(model.rows, model_file, notes);
  synthesizer::CharactersSettings settings;
  settings.style = style;
  settings.walking = true;
  const auto frequency = [](const synthesizer::Characters& c) {
    const auto& repertoire = c.repertoire();
    const auto shares = c.walk(0).style().shares();
    const auto at = std::ranges::max_element(shares) - shares.begin();
    return repertoire.motion(repertoire.style(static_cast<int>(at)).straight)
        .parameters.frequency_rad_s;
  };
  const std::array<synthesizer::CharacterStart, 1> start{};
  const double cycle_s = math::kTwoPi / frequency(synthesizer::Characters(model, start, settings));
  const auto frames = static_cast<Eigen::Index>(std::max(2.0, std::round(cycle_s * rate_hz)));
  settings.walk.dt_s = cycle_s / static_cast<double>(frames);
  synthesizer::Characters characters(model, start, settings);
  characters.walk(0).set_free(true);
  const auto moment = [&] {
    const synthesizer::CharacterState& state = characters.state(0);
    const auto angles = characters.angles(0);
    return Moment{.pelvis_W_m = {state.root.position_W_m.x(), state.root.position_W_m.y(),
                                 state.root.height_m},
                  .heading_rad = state.root.heading_rad,
                  .rows = {angles.begin(), angles.end()}};
  };
  for (Eigen::Index t = 0; t < kSettled * frames; ++t) characters.step();
  mocap::BodyClip clip = empty_clip(model.body, model.name + (style.empty() ? "" : "#" + style),
                                    1.0 / settings.walk.dt_s, frames);
  std::vector<Moment> moments;
  for (Eigen::Index t = 0; t <= frames; ++t, characters.step()) moments.push_back(moment());
  // along the way that it goes: the pelvis turns to and fro about it
  const Moment first = moments.front();
  const Eigen::Vector3d way = moments.back().pelvis_W_m - first.pelvis_W_m;
  constexpr double kGoes_m = 0.05;
  const double heading_rad =
      way.head<2>().norm() > kGoes_m ? std::atan2(way.y(), way.x()) : first.heading_rad;
  const Eigen::Matrix3d R_0W =
      Eigen::AngleAxisd(-heading_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Vector3d origin(first.pelvis_W_m.x(), first.pelvis_W_m.y(), 0.0);
  for (Eigen::Index t = 0; t < frames; ++t) {
    Moment& now = moments[static_cast<std::size_t>(t)];
    const double share = static_cast<double>(t) / static_cast<double>(frames);
    if (in_place) now.pelvis_W_m.head<2>() -= share * way.head<2>();
    now.pelvis_W_m = R_0W * (now.pelvis_W_m - origin);
    now.heading_rad -= heading_rad;
    put_moment(now, body_row, t, clip);
  }
  return clip;
}

}  // namespace mimesis::tool
