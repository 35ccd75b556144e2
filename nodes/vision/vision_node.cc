#include "nodes/vision/vision_node.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "common/model/files.h"
#include "common/model/messages.h"
#include "common/model/rig_file.h"
#include "nodes/vision/files/colors_file.h"

namespace mimesis::vision {
namespace {

constexpr std::array<Kind, 5> kTracked{Kind::hand, Kind::object, Kind::bar, Kind::goal_high,
                                       Kind::goal_low};

void paint(Kind kind, foxglove::Color* color) { model::set(color_of(kind), *color); }

/// Enumerations here and in the messages have the same numbers: unknown = UNSPECIFIED = 0.
template <class Message, class T>
Message convert(T value) {
  return static_cast<Message>(static_cast<int>(value));
}

void add_box(const Moments& m, Kind kind, foxglove::ImageAnnotations& out) {
  auto* box = out.add_points();
  box->set_type(foxglove::PointsAnnotation::LINE_LOOP);
  box->set_thickness(2.0);
  paint(kind, box->mutable_outline_color());
  const double left = m.left - 0.5, right = m.right + 0.5, top = m.top - 0.5,
               bottom = m.bottom + 0.5;
  for (const auto& [u, v] : {std::pair{left, top}, {right, top}, {right, bottom}, {left, bottom}}) {
    auto* p = box->add_points();
    p->set_x(u);
    p->set_y(v);
  }
  auto* text = out.add_texts();
  text->mutable_position()->set_x(left);
  text->mutable_position()->set_y(top - 2.0);
  text->set_text(std::string(name(kind)));
  text->set_font_size(12.0);
  paint(kind, text->mutable_text_color());
}

/// The axes of the hand model's capsules.
void add_bones(const TableWatcher& watcher, foxglove::ImageAnnotations& out) {
  const HandTracker& tracker = watcher.hand()->tracker();
  HandCapsules capsules;
  tracker.model().capsules(tracker.estimate().pose, capsules);
  auto* lines = out.add_points();
  lines->set_type(foxglove::PointsAnnotation::LINE_LIST);
  lines->set_thickness(1.0);
  paint(Kind::hand, lines->mutable_outline_color());
  for (const Capsule& c : std::span(capsules).first(kHandCapsules - kForearmCapsules)) {
    for (const Eigen::Vector3f& end : {c.a, c.b}) {
      const Eigen::Vector2d pixel = watcher.camera().lens().project(end.cast<double>());
      auto* p = lines->add_points();
      p->set_x(pixel.x());
      p->set_y(pixel.y());
    }
  }
}

template <class T>
std::string said(std::string_view name, const Symbol<T>& symbol) {
  if (symbol.value != T::unknown || symbol.why_not.empty())
    return fmt::format("{} {}", name, task::word(symbol.value));
  return fmt::format("{} not told, because {}", name, symbol.why_not);
}

std::string summary(const ActionRecognizer& action) {
  return fmt::format("{}, {}, {}{}", said("grip", action.grip()),
                     said("transport", action.transport()), said("goal", action.goal()),
                     action.complete() ? ", complete" : "");
}

/// The camera of that name, and with no name the second one, if there is one, for stereo.
void use_cameras(const image::Rig& rig, const std::string& from, const std::string& camera,
                 WatcherSetup& setup) {
  setup.camera = model::camera_on_table(rig, from, camera);
  setup.right.reset();
  if (camera.empty() && rig.cameras.size() > 1) setup.right = rig.cameras[1].camera;
}

WatcherSetup complete(const VisionParams& params, const std::optional<image::Rig>& rig) {
  WatcherSetup setup = params.setup;
  if (rig) use_cameras(*rig, params.rig, params.camera, setup);
  for (int c = 0; c < 3; ++c) {
    setup.reference_bgr[c] = params.reference_bgr[static_cast<std::size_t>(c)];
  }
  if (!params.colors.empty()) {
    const TaughtColors taught = load_colors(params.colors);
    setup.spots = taught.spots;
    setup.reference_bgr = taught.reference_bgr;
  }
  return setup;
}

/// Lower triangle of L by rows, L Lᵀ = covariance.
void set_spread(const Eigen::Matrix3d& covariance_m2,
                google::protobuf::RepeatedField<double>* spread_m) {
  const Eigen::Matrix3d l = covariance_m2.llt().matrixL();
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k <= i; ++k) spread_m->Add(l(i, k));
  }
}

v1::TableThing thing_message(const Thing& thing, const TableWatcher& watcher) {
  v1::TableThing out;
  out.set_kind(convert<v1::BlobKind>(thing.kind));
  out.set_id(static_cast<std::uint32_t>(thing.id));
  const Solid& s = thing.solid;
  model::to_proto(s.center, *out.mutable_center_in_table_m());
  set_spread(thing.covariance_m2, out.mutable_spread_m());
  out.set_half_width_m(s.half_width);
  out.set_length_m(s.length);
  out.set_yaw_rad(s.yaw_rad);
  out.set_seen(thing.seen);
  if (thing.kind != Kind::goal_high && thing.kind != Kind::goal_low) return out;
  out.set_goal(model::to_proto(watcher.classify(thing)));
  out.set_gap_m(watcher.gap_m(thing).value_or(0.0));
  return out;
}

bool is_yuyv(const foxglove::RawImage& m) {
  return m.encoding() == "yuyv" || m.encoding() == "yuv422_yuy2";
}

std::uint64_t bytes_in_row(const foxglove::RawImage& m) {
  return (is_yuyv(m) ? 2 : 3) * std::uint64_t{m.width()};
}

/// Why it is no whole image of the camera; empty: it is one. @param calibrated_by  for the line
std::string fault(const foxglove::RawImage& m, const image::Camera& camera,
                  const std::string& calibrated_by) {
  if (m.encoding() != "bgr8" && m.encoding() != "rgb8" && !is_yuyv(m)) {
    return fmt::format("encoding '{}' is not read, expected bgr8, rgb8 or yuyv", m.encoding());
  }
  if (std::cmp_not_equal(m.width(), camera.width()) ||
      std::cmp_not_equal(m.height(), camera.height())) {
    return fmt::format("{}x{} does not fit the calibrated view of {}x{} ({})", m.width(),
                       m.height(), camera.width(), camera.height(), calibrated_by);
  }
  if (is_yuyv(m) && m.width() % 2 != 0) {
    return fmt::format("{}x{} {}: expected an even width", m.width(), m.height(), m.encoding());
  }
  const std::uint64_t row = bytes_in_row(m), step = m.step();
  if (step < row || m.data().size() < (m.height() - 1) * step + row) {
    return fmt::format("{} bytes in rows of {} are too few for {}x{} {}", m.data().size(), step,
                       m.width(), m.height(), m.encoding());
  }
  return {};
}

runtime::Time stamp_of(const foxglove::RawImage& m) {
  return std::chrono::seconds(m.timestamp().seconds()) + runtime::Time(m.timestamp().nanos());
}

using Eigen::Isometry3d;
using Eigen::Vector3d;
using model::Rgba;

constexpr Rgba kDoubt{0.95, 0.3, 0.2, 0.6};
constexpr std::array<Rgba, kKinds> kColors{{{0.0, 0.0, 0.0},
                                            {1.0, 0.55, 0.35},
                                            {0.2, 0.9, 0.3},
                                            {0.3, 0.5, 1.0},
                                            {1.0, 0.9, 0.2},
                                            {0.9, 0.3, 0.9}}};

void add_solid(foxglove::SceneEntity& entity, const Isometry3d& X_WT, const Thing& thing) {
  const Solid& s = thing.solid;
  const Vector3d half =
      0.5 * s.length *
      (s.form == Form::bar ? Vector3d(std::cos(s.yaw_rad), 0.0, -std::sin(s.yaw_rad))
                           : Vector3d(0.0, 1.0, 0.0));
  if (s.form == Form::block) {
    const Isometry3d pose = X_WT * Eigen::Translation3d(s.center);
    model::add_box(entity, pose, {2.0 * s.half_width, s.length, 2.0 * s.half_width},
                   color_of(thing.kind));
  } else {
    model::add_rod(entity, X_WT * (s.center - half), X_WT * (s.center + half), s.half_width,
                   color_of(thing.kind));
  }
  model::add_uncertainty(entity, X_WT * s.center,
                         X_WT.linear() * thing.covariance_m2 * X_WT.linear().transpose(), kDoubt);
}

}  // namespace

const Rgba& color_of(Kind kind) { return kColors[static_cast<std::size_t>(kind)]; }

foxglove::SceneUpdate draw_sight(const TableWatcher& watcher, const Isometry3d& X_WT,
                                 std::chrono::nanoseconds stamp) {
  foxglove::SceneUpdate update;
  if (watcher.stereo() == nullptr) return update;
  foxglove::SceneEntity& things = model::add_entity(update, "things", "world", stamp);
  for (const Thing& thing : watcher.stereo()->things()) add_solid(things, X_WT, thing);
  foxglove::SceneEntity& hand = model::add_entity(update, "hand", "world", stamp);  // none: empty
  if (watcher.hand() == nullptr || !watcher.hand()->sight()) return update;
  const HandTracker& tracker = watcher.hand()->tracker();
  HandCapsules capsules;
  tracker.model().capsules(tracker.estimate().pose, capsules);
  const image::Camera& camera = watcher.camera();
  Isometry3d X_WC = X_WT * Eigen::Translation3d(camera.eye());
  X_WC.linear() *= camera.R_CT().transpose();
  for (const Capsule& c : std::span(capsules).first(kHandCapsules - kForearmCapsules)) {
    if (c.radius_a == 0.0F) continue;
    const Vector3d a = X_WC * c.a.cast<double>(), b = X_WC * c.b.cast<double>();
    model::add_rod(hand, a, b, 0.5 * (c.radius_a + c.radius_b), color_of(Kind::hand));
    model::add_ball(hand, b, c.radius_b, color_of(Kind::hand));
  }
  return update;
}

std::optional<std::string> FrameCheck::fault(std::string_view data, std::size_t height,
                                             double stamp_s) {
  constexpr int kSame = 10;  // frames: fewer are no stream
  const std::size_t row = data.size() / height;
  // A lost packet leaves a part of the frame empty; an empty frame is black.
  const std::size_t end = data.find_last_not_of('\0');
  const std::size_t filled = end == data.npos ? height : end / row + 1;
  if (height - filled > height / 50)
    return fmt::format("torn: the last {} of {} rows are empty", height - filled, height);

  Bands bands{};
  std::size_t whole = 0;
  for (std::size_t b = 0; b < kBands; ++b) {
    const std::size_t from = b * height / kBands, to = (b + 1) * height / kBands;
    const std::string_view band = data.substr(from * row, (to - from) * row);
    const std::size_t hash = std::hash<std::string_view>()(band);
    whole = 31 * whole + hash;
    if (band.find_first_not_of(band.front()) != band.npos) bands[b] = hash;
  }
  const bool same = seen_ > 0 && whole == whole_;
  if (!same) {
    same_since_s_ = stamp_s;
    same_ = 0;
  }
  whole_ = whole;
  ++same_;
  auto why = torn(bands, height);
  last_[seen_++ % kFrames] = bands;
  if (why) return why;
  const double same_s = stamp_s - same_since_s_;
  if (frozen_s_ == 0.0 || same_ <= kSame || same_s < frozen_s_) return std::nullopt;
  return fmt::format("the same for {:.1f} s, to the last bit: the camera hangs", same_s);
}

std::optional<std::string> FrameCheck::torn(const Bands& bands, std::size_t height) {
  constexpr int kTrust = 30;  // frames: what tears for longer has no noise
  std::size_t told = 0, old = 0, first = kBands, last = 0;
  for (std::size_t b = 0; b < kBands; ++b) told += bands[b] != 0 ? 1 : 0;
  for (std::size_t f = 0; f < std::min(seen_, kFrames); ++f) {
    std::size_t equal = 0;
    for (std::size_t b = 0; b < kBands; ++b) {
      if (bands[b] == 0 || bands[b] != last_[f][b]) continue;
      ++equal;
      first = std::min(first, b);
      last = std::max(last, b);
    }
    old = std::max(old, equal);
  }
  if (old == 0 || old == told) {
    lively_ = old == 0 && told > 0 ? lively_ + 1 : 0;
    torn_ = 0;
    return std::nullopt;
  }
  if (lively_ < kFrames || ++torn_ > kTrust) lively_ = 0;
  if (lively_ == 0) return std::nullopt;
  return fmt::format("torn: of {} rows those from {} to {} are of an earlier image", height,
                     first * height / kBands, (last + 1) * height / kBands);
}

v1::Blobs blobs_message(const TableWatcher& watcher) {
  v1::Blobs out;
  for (const Kind kind : kTracked) {
    const Blob& blob = watcher.blob(kind);
    if (!blob.found()) continue;
    const Moments& m = blob.moments;
    v1::Blob* b = out.add_blobs();
    b->set_kind(convert<v1::BlobKind>(kind));
    b->set_u_px(m.mean_u());
    b->set_v_px(m.mean_v());
    b->set_area(m.area);
  }
  return out;
}

v1::Observation observation_message(const ActionRecognizer& action) {
  v1::Observation out;
  out.set_grip(model::to_proto(action.grip().value));
  out.set_grip_confidence(action.grip().confidence);
  out.set_transport(model::to_proto(action.transport().value));
  out.set_transport_confidence(action.transport().confidence);
  out.set_goal(model::to_proto(action.goal().value));
  out.set_goal_confidence(action.goal().confidence);
  out.set_color(model::to_proto(action.color().value));
  out.set_color_confidence(action.color().confidence);
  out.set_complete(action.complete());
  out.set_palm_angle_rad(action.palm_angle_rad().value_or(0.0));
  return out;
}

v1::TeacherScene scene_message(const TableWatcher& watcher) {
  const Sight& s = watcher.sight();
  // A goal's position is its upper face; Sight holds where the object's centre would rest on it.
  const double half = 0.5 * watcher.sizes().object_height_m;
  v1::TeacherScene out;
  if (s.object) {
    out.set_object_x_m(s.object->x());
    out.set_object_y_m(s.object->y());
  }
  if (s.goal_high) {
    out.set_goal_high_x_m(s.goal_high->x());
    out.set_goal_high_y_m(s.goal_high->y() - half);
  }
  if (s.goal_low) {
    out.set_goal_low_x_m(s.goal_low->x());
    out.set_goal_low_y_m(s.goal_low->y() - half);
  }
  if (s.bar) {
    out.set_bar_x_m(s.bar->x());
    out.set_bar_height_m(*watcher.bar_height_m());
  }
  if (s.palm) {
    out.set_hand_x_m(s.palm->x());
    out.set_hand_y_m(s.palm->y());
  }
  out.set_complete(s.object && s.bar && s.goal_high && s.goal_low);
  if (watcher.stereo() == nullptr) return out;
  for (const Thing& thing : watcher.stereo()->things())
    *out.add_things() = thing_message(thing, watcher);
  for (const std::string& change : watcher.stereo()->changes()) out.add_changes(change);
  return out;
}

v1::Scene table_message(const SeenTable& seen) {
  v1::Scene out = model::to_proto(seen.table);
  set_spread(seen.object_m2, out.mutable_object()->mutable_spread_m());
  set_spread(seen.bar_m2, out.mutable_bar()->mutable_spread_m());
  for (int i = 0; i < out.goals_size(); ++i)
    set_spread(seen.goals_m2[static_cast<std::size_t>(i)],
               out.mutable_goals(i)->mutable_spread_m());
  return out;
}

foxglove::ImageAnnotations annotations_message(const TableWatcher& watcher) {
  foxglove::ImageAnnotations out;
  for (const Kind kind : kTracked) {
    if (watcher.blob(kind).found()) add_box(watcher.blob(kind).moments, kind, out);
  }
  if (watcher.palm()) {
    auto* circle = out.add_circles();
    circle->mutable_position()->set_x(watcher.palm()->center.x());
    circle->mutable_position()->set_y(watcher.palm()->center.y());
    circle->set_diameter(16.0);
    circle->set_thickness(2.0);
    paint(Kind::hand, circle->mutable_outline_color());
  }
  if (watcher.hand() != nullptr && watcher.hand()->sight()) add_bones(watcher, out);
  auto* text = out.add_texts();
  text->mutable_position()->set_x(8.0);
  text->mutable_position()->set_y(24.0);
  text->set_font_size(16.0);
  text->set_text(summary(watcher.action()));
  paint(Kind::object, text->mutable_text_color());
  return out;
}

void VisionParams::visit(runtime::ParamVisitor& v) {
  using runtime::ParamVisitor;
  v("rate_hz", rate_hz, 1.0, 1000.0);
  v.file("rig", rig, "camera rig");
  v("camera", camera);
  v.file("colors", colors, "taught colours");
  v("rig_days", rig_days, 0, 100000);
  v("pair_s", pair_s, 0.0, 1.0);
  v("wait_s", wait_s, 0.0, 10.0);
  v("blind_s", blind_s, 0.0, 60.0);
  v("frozen_s", frozen_s, 0.0, 3600.0);
  v("reference_bgr", reference_bgr, 0.0, 255.0, 3);
  const auto group = [&v](std::string_view key, auto& part) {
    v.group(key, [&part](ParamVisitor& g) { part.visit(g); });
  };
  group("view", setup.view);
  v("open", setup.open);
  group("stereo", setup.stereo);
  group("table", table);
  group("tracker", setup.tracker);
  group("sizes", setup.sizes);
  group("teacher_hand", setup.hand);
  group("recognizer", setup.recognizer);
}

VisionNode::VisionNode(const Params& params, runtime::Bus& bus)
    : VisionNode(params,
                 params.rig.empty() ? std::nullopt : std::optional(model::load_rig(params.rig)),
                 bus) {}

VisionNode::VisionNode(const Params& params, const std::optional<image::Rig>& rig,
                       runtime::Bus& bus)
    : setup_(complete(params, rig)),
      table_setup_(params.table),
      pair_(runtime::from_seconds(params.pair_s)),
      wait_(runtime::from_seconds(params.wait_s)),
      blind_(runtime::from_seconds(params.blind_s)),
      watcher_(setup_),
      left_check_(params.frozen_s),
      right_check_(params.frozen_s),
      calibrated_by_(rig ? params.rig : "view.width_px, height_px"),
      rig_days_(params.rig_days),
      in_(bus, "image", {.author = runtime::Author::first}),
      right_in_(bus, "right", {.author = runtime::Author::first, .optional = true}),
      rig_in_(bus, "rig", {.author = runtime::Author::first, .optional = true}),
      lesson_in_(bus, "lesson", {.optional = true}),
      blobs_(bus, "blobs"),
      observation_(bus, "observation"),
      scene_(bus, "scene"),
      table_out_(bus, "table", {.latched = true}),
      annotations_(bus, "annotations"),
      seen_(bus, "seen") {
  if (rig && rig_days_ > 0) calibrated_day_ = model::day_number(rig->date);
}

void VisionNode::refuse(const std::string& why) {
  if (refused_.pass()) runtime::warn("image: {}", why);
}

/// The cameras' own word on themselves wins over parameters.
void VisionNode::use_rig(const v1::CameraRig& message) {
  constexpr const char* kFrom = "input rig";
  try {
    const image::Rig rig = model::parse_rig(message.text(), kFrom);
    use_cameras(rig, kFrom, "", setup_);
    calibrated_by_ = kFrom;
    calibrated_day_.reset();
    if (rig_days_ > 0) calibrated_day_ = model::day_number(rig.date);
    watcher_.emplace(setup_);
    table_.reset();
  } catch (const ConfigError& e) {
    runtime::error("{}; the calibration before it holds", e.what());
  }
}

void VisionNode::take_lesson() {
  std::vector<TaughtRegion> regions;
  for (const v1::ColorRegion& r : lesson_->regions()) {
    const auto number = [](std::uint32_t x) { return static_cast<int>(std::min(x, 1u << 20)); };
    if (r.kind() == v1::BLOB_KIND_UNSPECIFIED || !v1::BlobKind_IsValid(r.kind())) continue;
    regions.push_back({static_cast<Kind>(r.kind()), number(r.left()), number(r.top()),
                       number(r.width()), number(r.height())});
  }
  const auto taught = watcher_->teach(image_, regions);
  if (!taught) runtime::warn("lesson: {}; the colours before it hold", taught.error().reason);
  lesson_.reset();
}

const foxglove::RawImage* VisionNode::partner_of(const foxglove::RawImage& left) {
  const foxglove::RawImage* right = watcher_->right_camera() ? right_in_.get() : nullptr;
  if (right == nullptr) return nullptr;
  const runtime::Time apart = stamp_of(*right) - stamp_of(left);
  return std::max(apart, -apart) <= pair_ ? right : nullptr;
}

const foxglove::RawImage* VisionNode::due(runtime::Time now) {
  waiting_ = in_.take() != nullptr || waiting_;
  if (!waiting_) return nullptr;
  const foxglove::RawImage* left = in_.get();
  const bool alone = watcher_->right_camera() && partner_of(*left) == nullptr;
  if (alone && now - stamp_of(*left) < wait_) return nullptr;
  if (alone)
    refuse(fmt::format("no second image of the same time (within pair_s) came in {} s",
                       runtime::to_seconds(wait_)));
  waiting_ = false;
  return left;
}

/// Takes over the pixels if the message is an image of the calibrated camera that shows anything,
/// and anything new.
bool VisionNode::accept(const foxglove::RawImage& m, const image::Camera& camera,
                        FrameCheck& check) {
  std::string why = fault(m, camera, calibrated_by_);
  if (why.empty()) why = rig_too_old(m);
  if (!why.empty()) {
    refuse(why);
    return false;
  }
  const auto broken =
      check.fault(std::string_view(m.data()).substr(0, std::uint64_t{m.height()} * m.step()),
                  m.height(), runtime::to_seconds(stamp_of(m)));
  copy(m);
  constexpr double kBlack = 8.0;
  const double brightest = (is_yuyv(m) ? median_bgr(yuyv_) : median_bgr(image_)).maxCoeff();
  if (brightest < kBlack) {
    refuse(fmt::format("black (median {:.0f} of 255, expected {:.0f} or more): lens or light",
                       brightest, kBlack));
    return false;
  }
  if (broken) refuse(*broken);
  return !broken;
}

/// In simulated time stamps begin in 1970: no rig is that old.
std::string VisionNode::rig_too_old(const foxglove::RawImage& m) const {
  const auto day = std::chrono::floor<std::chrono::days>(stamp_of(m)).count();
  if (!calibrated_day_ || day - *calibrated_day_ <= rig_days_) return {};
  return fmt::format("the rig {} is {} days old, expected at most {} (rig_days): calibrate anew",
                     calibrated_by_, day - *calibrated_day_, rig_days_);
}

/// Into image_ or yuyv_, without gaps between rows, as BGR. Precondition: no fault.
void VisionNode::copy(const foxglove::RawImage& m) {
  image_.width = yuyv_.width = static_cast<int>(m.width());
  image_.height = yuyv_.height = static_cast<int>(m.height());
  const std::size_t row = bytes_in_row(m);
  std::vector<std::uint8_t>& bytes = is_yuyv(m) ? yuyv_.bytes : image_.bgr;
  bytes.resize(row * m.height());
  for (std::size_t v = 0; v < m.height(); ++v) {
    std::memcpy(bytes.data() + v * row, m.data().data() + v * m.step(), row);
  }
  if (m.encoding() == "rgb8") {
    for (std::size_t i = 0; i < image_.bgr.size(); i += 3)
      std::swap(image_.bgr[i], image_.bgr[i + 2]);
  }
}

/// Cameras that were swapped or moved, or a calibration of others, leave things without partners;
/// if they were turned a little, or the others are nearly equal, their partners are in other rows.
bool VisionNode::rig_fits() {
  constexpr int kMany = 2, kLong = 30;  // classes, pictures
  const StereoScene* stereo = watcher_->stereo();
  const bool unmatched = stereo->unmatched() >= kMany;
  const std::optional<double> rows = stereo->rows_off_px();
  const double most = setup_.stereo.rows_px;
  unfit_ = unmatched || (rows && *rows > most) ? unfit_ + 1 : 0;
  if (unfit_ < kLong) return true;
  const std::string what =
      unmatched ? fmt::format("{} classes of things are in both pictures, but not in one place",
                              stereo->unmatched())
                : fmt::format(
                      "rows of the same things differ by {:.1f} px, expected at most "
                      "{:.1f} (stereo.rows_px),",
                      *rows, most);
  refuse(
      fmt::format("{} by {}: are the cameras swapped or moved, or the calibration that of others?",
                  what, calibrated_by_));
  return false;
}

void VisionNode::step(runtime::Time now) {
  if (const v1::CameraRig* rig = rig_in_.take()) use_rig(*rig);
  if (const v1::ColorLesson* lesson = lesson_in_.take()) lesson_ = *lesson;
  if (const foxglove::RawImage* left = due(now)) look(*left);
  publish_table(now);
}

void VisionNode::look(const foxglove::RawImage& left) {
  const foxglove::RawImage* right = partner_of(left);
  if (right != nullptr) {
    if (!accept(*right, *watcher_->right_camera(), right_check_)) return;
    is_yuyv(*right) ? watcher_->watch_right(yuyv_) : watcher_->watch_right(image_);
  }
  if (!accept(left, watcher_->camera(), left_check_)) return;
  looked_ = stamp_of(left);
  const auto stamp_ns = static_cast<std::uint64_t>(looked_.count());
  if (lesson_ && !is_yuyv(left) && stamp_ns >= lesson_->header().stamp_ns()) take_lesson();
  is_yuyv(left) ? watcher_->watch(yuyv_) : watcher_->watch(image_);
  const bool fits = right == nullptr || rig_fits();
  publish(looked_, fits);
}

constexpr std::chrono::milliseconds kSeenPeriod{80};  // of drawings

/// Without a hand for long nothing is being shown: said once.
void VisionNode::miss_hand(runtime::Time stamp) {
  constexpr runtime::Time kLong = std::chrono::seconds(5);
  const bool seen = watcher_->blob(Kind::hand).found();
  if (seen || !handless_since_) handless_since_ = stamp;
  if (seen || stamp - *handless_since_ < kLong) {
    handless_told_ = handless_told_ && !seen;
  } else if (!handless_told_) {
    runtime::info("no hand is seen: no symbols are told");
    handless_told_ = true;
  }
}

/// Once each: why a symbol of this demonstration is not told.
void VisionNode::say_what_is_not_told() {
  const ActionRecognizer& action = watcher_->action();
  const std::array<std::pair<const char*, const std::string*>, 3> reasons{
      {{"grip", &action.grip().why_not},
       {"transport", &action.transport().why_not},
       {"goal", &action.goal().why_not}}};
  for (std::size_t i = 0; i < reasons.size(); ++i) {
    const auto& [what, why] = reasons[i];
    if (!why->empty() && untold_[i].empty())
      runtime::info("{} is not told, because {}", what, *why);
    untold_[i] = *why;
  }
}

void VisionNode::publish(runtime::Time stamp, bool fits) {
  auto blobs = blobs_message(*watcher_);
  blobs_.send(blobs, stamp);
  miss_hand(stamp);
  if (const std::string& light = watcher_->light_remark(); !light.empty())
    runtime::warn("{}", light);
  say_what_is_not_told();
  if (fits && !watcher_->two_hands()) {
    auto observation = observation_message(watcher_->action());
    observation_.send(observation, stamp);
  } else if (fits && withheld_.pass()) {
    runtime::warn("two hands are seen, expected one: symbols withheld");
  }
  auto scene = scene_message(*watcher_);
  scene_.send(scene, stamp);
  auto annotations = annotations_message(*watcher_);
  annotations_.send(annotations, stamp);
  const StereoScene* stereo = watcher_->stereo();
  if (stereo == nullptr) return;
  if (stamp >= seen_due_) {
    seen_due_ = stamp + kSeenPeriod;
    auto seen = draw_sight(*watcher_, table_in_world(table_setup_), stamp);
    seen_.send(seen, stamp);
  }
  for (const std::string& change : stereo->changes()) runtime::info("{}", change);
  if (!fits) return table_.reset();  // nobody shall move by it
  if (stereo->goals().size() != 1) alone_since_ = stamp;
  // The same table as long as nothing changes: whoever plans by it would plan anew.
  if (!stereo->settled() || (table_ && stereo->version() == table_version_)) return;
  const bool stays_alone = runtime::to_seconds(stamp - alone_since_) >= table_setup_.lone_s;
  const auto seen = robot_table(*stereo, table_setup_, stays_alone);
  if (!seen) return miss_table(seen.error().reason, stamp);
  table_ = table_message(*seen);
  table_version_ = stereo->version();
}

/// The hand hides things for moments; what lasts is said.
void VisionNode::miss_table(const std::string& why, runtime::Time stamp) {
  constexpr runtime::Time kLong = std::chrono::seconds(5);
  if (!missed_since_) missed_since_ = stamp;
  if (table_ || stamp - *missed_since_ < kLong) return;
  runtime::warn("no table to plan by: {}", why);
  missed_since_ = stamp;
}

/// Over and over, so that whoever moves by it knows that it still holds.
void VisionNode::publish_table(runtime::Time now) {
  if (table_ && now - looked_ <= blind_) table_out_.send(*table_, now);
}

}  // namespace mimesis::vision
