#include "nodes/camera/camera_node.h"

#include <algorithm>
#include <chrono>

#include "common/image/image.h"
#include "common/model/files.h"
#include "common/model/rig_file.h"
#include "common/runtime/bus.h"
#include "common/runtime/log.h"
#include "nodes/camera/random_scene.h"
#include "nodes/camera/recorded_device.h"
#include "nodes/camera/source/v4l2.h"

namespace mimesis::camera {
namespace {

Picture picture_of(const CameraParams& p) {
  Picture picture = p.picture;
  picture.script.demonstration = task::parse_demonstration(p.teacher, "teacher");
  picture.script.demonstration.color = task::parse_symbol<Color>(p.color, "color");
  picture.script.only_grasp = p.shown == "grasp";
  picture.script.repeat = p.repeat;
  picture.seed = static_cast<std::uint64_t>(p.seed);
  if (p.scene != "random") return picture;
  Picture random = random_scene(picture, picture.seed).picture;
  if (p.source == "robot") random.clutter = 0;
  return random;
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
  auto device = replaying ? nullptr
                          : v4l2_device(p.path, {.format = p.format,
                                                 .width = view.width_px,
                                                 .height = view.height_px,
                                                 .rate_hz = p.rate_hz});
  const Light light = p.light == "locked"     ? Light::locked
                      : p.light == "followed" ? Light::followed
                                              : Light::device;
  if (!p.record_frames)
    return std::make_unique<Capture>(std::move(device), p.path, monotonic, light);
  return std::make_unique<Capture>(record_device(std::move(device), bus), p.path,
                                   record_clock(monotonic, bus), light);
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
  v("source", source, {"renderer", "robot", "v4l2", "video", "folder"});
  v.file("path", path, "device, film or folder of images", false);
  v("record_frames", record_frames);
  v("format", format,
    {"any", "YUYV", "UYVY", "YVYU", "NV12", "YU12", "GREY", "RGB3", "RGGB", "GRBG", "GBRG", "BA81",
     "MJPG"});
  v("light", light, {"device", "followed", "locked"});
  v("packed", packed, {"none", "jpeg", "png"});
  v("repeat", repeat, 1, 1000000);
  v("teacher", teacher);
  v("color", color, {"light", "dark"});
  v("shown", shown, {"all", "grasp"});
  v("scene", scene, {"usual", "random"});
  v("stereo", stereo);
  v("baseline_m", baseline_m, 0.01, 5.0);
  v("seed", seed, 0, 1 << 30);
  v.file("robot", robot, "arm");
  v("origin_m", origin_m, -10.0, 10.0, 3);
  v("duration_s", picture.script.duration_s, 1.0, 120.0);
  v("bar_height_m", picture.table.bar_height_m, 0.13, 0.30);
  v("bar_removed", picture.table.bar_removed);
  v.changeable([&] {
    v("noise", picture.faults.noise, 0.0, 40.0);
    v("blur_px", picture.faults.blur_px, 0.0, 10.0);
    v("gain", picture.faults.gain, 0.1, 4.0);
    v("warmth", picture.faults.warmth, 0.5, 2.0);
  });
  v("clutter", picture.clutter, 0, 200);
  v.group("view", [this](runtime::ParamVisitor& g) { picture.view.visit(g); });
}

namespace {

image::Rig rig_of(const std::vector<image::Camera>& cameras, const CameraParams& p) {
  image::Rig rig;
  rig.date = "1970-01-01";  // simulated time begins then
  rig.board = "none: rendered cameras";
  rig.frame = image::Rig::Frame::table;
  rig.pictures = 1;
  std::vector<image::Camera> known = cameras;
  // The robot's own eye is never known exactly, nor are cameras that somebody set up at random.
  if (known.size() == 2 && (p.scene == "random" || p.source == "robot")) {
    const auto told = calibrated({known[0], known[1]}, static_cast<std::uint64_t>(p.seed));
    known.assign(told.begin(), told.end());
  }
  rig.cameras.push_back({"left", known[0]});
  if (known.size() == 2) rig.cameras.push_back({"right", known[1]});
  return rig;
}

v1::BlobKind kind_of(const std::string& name) {
  if (name == "object") return v1::BLOB_KIND_OBJECT;
  if (name == "bar") return v1::BLOB_KIND_BAR;
  return name == "goal_high" ? v1::BLOB_KIND_GOAL_HIGH : v1::BLOB_KIND_GOAL_LOW;
}

v1::ColorLesson lesson_of(const std::vector<Click>& clicks) {
  v1::ColorLesson lesson;
  for (const Click& c : clicks) {
    v1::ColorRegion& region = *lesson.add_regions();
    region.set_kind(kind_of(c.name));
    region.set_left(static_cast<std::uint32_t>(std::max(c.left, 0)));
    region.set_top(static_cast<std::uint32_t>(std::max(c.top, 0)));
    region.set_width(static_cast<std::uint32_t>(c.width));
    region.set_height(static_cast<std::uint32_t>(c.height));
  }
  return lesson;
}

}  // namespace

CameraNode::CameraNode(const Params& params, runtime::Bus& bus)
    : params_(params),
      picture_(picture_of(params)),
      images_{{{bus, "image"}, {bus, "right"}}},
      packed_{{{bus, "packed"}, {bus, "packed_right"}}},
      rig_(bus, "rig", {.latched = true}),
      lesson_(bus, "lesson", {.latched = true}),
      truth_(bus, "truth"),
      scene_(bus, "scene", {.author = runtime::Author::first, .optional = true}),
      state_(bus, "state", {.author = runtime::Author::first, .optional = true}),
      arm_(bus, "joint_states", {.author = runtime::Author::first, .optional = true}),
      ports_end_(bus) {
  message_.set_encoding("bgr8");
  message_.set_frame_id("camera");
  if (!rendered()) {
    source_ = open_source(params, bus);
    return;
  }
  const image::View& view = picture_.view;
  const auto pair = params.scene == "random"
                        ? random_cameras(view, static_cast<std::uint64_t>(params.seed))
                        : usual_cameras(view, params.baseline_m);
  cameras_.assign(pair.begin(), pair.begin() + (params.stereo ? 2 : 1));
  pictures_.resize(cameras_.size());
  if (params.source == "robot") {
    arm_model_ = model::load_arm(params.robot);
    return;
  }
  const TeacherMotion shown(picture_.script, picture_.table);  // refuses what cannot be shown
  bus.refusals_end();
  for (std::size_t eye = 0; eye < cameras_.size(); ++eye) {
    teacher_.push_back(std::make_unique<Renderer>(picture_, cameras_[eye], static_cast<int>(eye)));
  }
}

void CameraNode::step(runtime::Time now) { rendered() ? step_rendered(now) : step_source(now); }

void CameraNode::step_source(runtime::Time now) {
  const std::optional<Frame> frame = source_->next(now);
  if (const std::string opened = source_->opened(); !opened.empty()) runtime::info("{}", opened);
  if (const std::string news = source_->news(); !news.empty()) runtime::warn("{}", news);
  if (frame) send(*frame->image, 0, frame->stamp);
}

void CameraNode::step_rendered(runtime::Time now) {
  if (!(params_.source == "robot" ? render_robot(now) : render_teacher(now))) return;
  if (!first_sent_) publish_first(now);
  first_sent_ = true;
  for (std::size_t eye = 0; eye < pictures_.size(); ++eye) send(pictures_[eye], eye, now);
}

bool CameraNode::render_teacher(runtime::Time now) {
  if (!start_) start_ = now;
  const double t_s = to_seconds(now - *start_);
  for (std::size_t eye = 0; eye < teacher_.size(); ++eye)
    teacher_[eye]->render(t_s, pictures_[eye]);
  publish_truth(teacher_[0]->truth(t_s), now);
  return true;
}

/// Nothing before the table and the arm are known.
bool CameraNode::render_robot(runtime::Time now) {
  const v1::Scene* scene = scene_.get();
  const v1::WorldState* state = state_.get();
  const v1::JointState* arm = arm_.get();
  const bool ready = scene != nullptr && state != nullptr && arm != nullptr &&
                     arm->position_rad_size() == arm_model_.dof();
  if (!ready) return false;
  if (robot_.empty()) {
    const kin::Table table = model::from_proto(*scene);
    const Eigen::Vector3d origin = Eigen::Vector3d::Map(params_.origin_m.data());
    if (params_.scene == "random") aim_at(table, origin);
    for (std::size_t eye = 0; eye < cameras_.size(); ++eye) {
      robot_.push_back(std::make_unique<RobotRenderer>(table, picture_.table.paints, picture_.room,
                                                       origin, cameras_[eye], picture_.faults,
                                                       picture_.seed, static_cast<int>(eye)));
    }
  }
  std::vector<Eigen::Isometry3d> X;
  kin::forward(arm_model_, Eigen::VectorXd::Map(arm->position_rad().data(), arm_model_.dof()), X);
  Eigen::Matrix3Xd centers;
  kin::ball_centers(arm_model_, X, centers);
  std::vector<kin::Ball> balls;
  for (std::size_t i = 0; i < arm_model_.balls.size(); ++i)
    balls.push_back({centers.col(static_cast<Eigen::Index>(i)), arm_model_.balls[i].radius});
  const auto& p = state->object_position_in_world_m();
  for (std::size_t eye = 0; eye < robot_.size(); ++eye)
    robot_[eye]->render(balls, {p.x_m(), p.y_m(), p.z_m()}, to_seconds(now), pictures_[eye]);
  return true;
}

/// Moves random cameras until they see all of what matters, as somebody who sets them up does.
void CameraNode::aim_at(const kin::Table& table, const Eigen::Vector3d& origin) {
  constexpr std::uint64_t kAttempts = 100;
  const auto sees = [&](const image::Camera& camera) { return sees_all(table, origin, camera); };
  for (std::uint64_t i = 1; !std::ranges::all_of(cameras_, sees); ++i) {
    if (i == kAttempts) return runtime::warn("{} random cameras do not see the whole object", i);
    const auto pair = random_cameras(picture_.view, static_cast<std::uint64_t>(params_.seed), i);
    cameras_.assign(pair.begin(), pair.begin() + static_cast<std::ptrdiff_t>(cameras_.size()));
  }
}

/// The calibration, and what somebody who sees the first image would teach.
void CameraNode::publish_first(runtime::Time stamp) {
  v1::CameraRig rig;
  rig.set_text(model::rig_text(rig_of(cameras_, params_)));
  rig_.send(rig, stamp);
  auto lesson = lesson_of(robot_.empty() ? clicks(picture_, cameras_[0]) : robot_[0]->clicks());
  lesson_.send(lesson, stamp);
}

void CameraNode::send(const image::Image& image, std::size_t eye, runtime::Time stamp) {
  constexpr int kQuality = 90;
  message_.set_width(static_cast<std::uint32_t>(image.width));
  message_.set_height(static_cast<std::uint32_t>(image.height));
  message_.set_step(3 * static_cast<std::uint32_t>(image.width));
  message_.set_data(image.bgr.data(), image.bgr.size());
  images_.at(eye).send(message_, stamp);
  if (params_.packed == "none") return;
  auto bytes =
      params_.packed == "png" ? image::encode_png(image) : image::encode_jpeg(image, kQuality);
  if (!bytes) return runtime::warn("{}", bytes.error().reason);
  foxglove::CompressedImage packed;
  packed.set_data(std::move(*bytes));
  packed.set_format(params_.packed);
  packed.set_frame_id(message_.frame_id());
  packed_.at(eye).send(packed, stamp);
}

void CameraNode::change(const Params& params) {
  if (!rendered())
    throw ConfigError("source: light and lens are those of a renderer, this is " + params.source);
  picture_.faults = picture_of(params).faults;
  for (const auto& eye : teacher_) eye->change_faults(picture_.faults);
  for (const auto& eye : robot_) eye->change_faults(picture_.faults);
}

void CameraNode::publish_truth(const Truth& truth, runtime::Time stamp) {
  v1::TeacherScene scene;
  scene.set_object_x_m(truth.object.x());
  scene.set_object_y_m(truth.object.y());
  scene.set_goal_high_x_m(truth.goal_high.x());
  scene.set_goal_high_y_m(truth.goal_high.y());
  scene.set_goal_low_x_m(truth.goal_low.x());
  scene.set_goal_low_y_m(truth.goal_low.y());
  scene.set_bar_x_m(0.0);
  scene.set_bar_height_m(truth.bar_in_view ? truth.bar_height : 0.0);
  scene.set_hand_x_m(truth.palm.x());
  scene.set_hand_y_m(truth.palm.y());
  scene.set_complete(truth.bar_in_view);
  truth_.send(scene, stamp);
}

}  // namespace mimesis::camera
