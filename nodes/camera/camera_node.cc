#include "nodes/camera/camera_node.h"

#include <chrono>

#include "common/runtime/bus.h"
#include "common/runtime/log.h"
#include "nodes/camera/recorded_device_node.h"

namespace mimesis::camera {
namespace {

Picture picture_of(const CameraParams& p) {
  Picture picture = p.picture;
  picture.script.lesson = parse_lesson(p.teacher);
  picture.script.color = p.color == "dark" ? Color::dark : Color::light;
  picture.script.only_grasp = p.shown == "grasp";
  picture.script.repeat = p.repeat;
  picture.seed = static_cast<std::uint64_t>(p.seed);
  return picture;
}

std::chrono::nanoseconds monotonic() { return std::chrono::steady_clock::now().time_since_epoch(); }

std::unique_ptr<Source> open_camera(const CameraParams& p, runtime::Bus& bus) {
  const bool replaying = bus.outside().replaying();
  if (bus.outside().describing()) return nullptr;
  if (replaying && !p.record_frames) {
    throw ConfigError(
        "source: v4l2 is a live camera, a source of the graph: it can be replayed only if "
        "record_frames was true when the log was recorded");
  }
  const image::View& view = p.picture.view;
  auto device = replaying ? nullptr : v4l2_device(p.path, view.width_px, view.height_px);
  if (!p.record_frames) return std::make_unique<Capture>(std::move(device), p.path, monotonic);
  return std::make_unique<Capture>(record_device(std::move(device), bus), p.path,
                                   record_clock(monotonic, bus));
}

std::unique_ptr<Source> open_source(const CameraParams& p, runtime::Bus& bus) {
  if (p.path.empty())
    throw ConfigError("path: empty, expected a device, film or folder for source " + p.source);
  if (p.source == "v4l2") return open_camera(p, bus);
  if (p.source == "folder") {
    return std::make_unique<Sequence>(std::make_unique<FolderReader>(p.path), p.rate_hz, p.repeat);
  }
  auto film = std::make_unique<FilmReader>(p.path);
  const double rate = film->rate_hz();
  return std::make_unique<Sequence>(std::move(film), rate, p.repeat);
}

}  // namespace

void CameraParams::visit(runtime::ParamVisitor& v) {
  v("rate_hz", rate_hz, 1.0, 240.0);
  v("source", source, {"renderer", "v4l2", "video", "folder"});
  v.file("path", path, "device, film or folder of images", false);
  v("record_frames", record_frames);
  v("repeat", repeat, 1, 1000000);
  v("teacher", teacher);
  v("color", color, {"light", "dark"});
  v("shown", shown, {"all", "grasp"});
  v("seed", seed, 0, 1 << 30);
  v("start_s", picture.script.start_s, 0.0, 3600.0);
  v("duration_s", picture.script.duration_s, 1.0, 120.0);
  v("pause_s", picture.script.pause_s, 0.0, 3600.0);
  v("bridge_height_m", picture.table.bridge_height_m, 0.13, 0.30);
  v("bridge_removed", picture.table.bridge_removed);
  v.changeable([&] {
    v("noise", picture.faults.noise, 0.0, 40.0);
    v("blur_px", picture.faults.blur_px, 0.0, 10.0);
    v("gain", picture.faults.gain, 0.1, 4.0);
    v("warmth", picture.faults.warmth, 0.5, 2.0);
  });
  v("clutter", picture.clutter, 0, 200);
  v.group("view", [this](runtime::ParamVisitor& g) { picture.view.visit(g); });
}

CameraNode::CameraNode(const Params& params, runtime::Bus& bus)
    : image_(bus, "image"), truth_(bus, "truth") {
  bus.ports_end();
  if (params.source == "renderer") {
    auto rendered = std::make_unique<Rendered>(picture_of(params));
    rendered_ = rendered.get();
    source_ = std::move(rendered);
  } else {
    source_ = open_source(params, bus);
  }
  message_.set_encoding("bgr8");
  message_.set_frame_id("camera");
}

void CameraNode::step(runtime::Time now) {
  const std::optional<Frame> frame = source_->next(now);
  if (const std::string news = source_->news(); !news.empty()) runtime::warn("{}", news);
  if (!frame) return;
  const image::Image& image = *frame->image;
  message_.set_width(static_cast<std::uint32_t>(image.width));
  message_.set_height(static_cast<std::uint32_t>(image.height));
  message_.set_step(3 * static_cast<std::uint32_t>(image.width));
  message_.set_data(image.bgr.data(), image.bgr.size());
  image_.send(message_, frame->stamp);
  if (rendered_ != nullptr) publish_truth(frame->stamp);
}

void CameraNode::change(const Params& params) {
  if (rendered_ == nullptr)
    throw ConfigError("source: light and lens are those of the renderer, this is " + params.source);
  rendered_->change(picture_of(params));
}

void CameraNode::publish_truth(runtime::Time stamp) {
  const Truth truth = rendered_->truth();
  v1::TeacherScene scene;
  scene.set_object_x_m(truth.object.x());
  scene.set_object_y_m(truth.object.y());
  scene.set_goal_high_x_m(truth.goal_high.x());
  scene.set_goal_high_y_m(truth.goal_high.y());
  scene.set_goal_low_x_m(truth.goal_low.x());
  scene.set_goal_low_y_m(truth.goal_low.y());
  scene.set_bridge_x_m(0.0);
  scene.set_bridge_height_m(truth.bridge_in_view ? truth.bridge_height : 0.0);
  scene.set_hand_x_m(truth.palm.x());
  scene.set_hand_y_m(truth.palm.y());
  scene.set_complete(truth.bridge_in_view);
  truth_.send(scene, stamp);
}

}  // namespace mimesis::camera
