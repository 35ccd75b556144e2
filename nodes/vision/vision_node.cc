#include "nodes/vision/vision_node.h"

#include <cstring>

#include "nodes/vision/messages_node.h"

namespace mimesis::vision {
namespace {

WatcherSetup complete(const VisionParams& params) {
  WatcherSetup setup = params.setup;
  for (int c = 0; c < 3; ++c) {
    setup.reference_bgr[c] = params.reference_bgr[static_cast<std::size_t>(c)];
  }
  return setup;
}

runtime::Time stamp_of(const foxglove::RawImage& m) {
  return std::chrono::seconds(m.timestamp().seconds()) + runtime::Time(m.timestamp().nanos());
}

}  // namespace

void VisionParams::visit(runtime::ParamVisitor& v) {
  using runtime::ParamVisitor;
  v("rate_hz", rate_hz, 1.0, 1000.0);
  v("reference_bgr", reference_bgr, 0.0, 255.0, 3);
  const auto group = [&v](std::string_view key, auto& part) {
    v.group(key, [&part](ParamVisitor& g) { part.visit(g); });
  };
  group("view", setup.view);
  group("hand", setup.boxes.hand);
  group("object", setup.boxes.object);
  group("bridge", setup.boxes.bridge);
  group("goal_high", setup.boxes.goal_high);
  group("goal_low", setup.boxes.goal_low);
  group("tracker", setup.tracker);
  group("sizes", setup.sizes);
  group("recognizer", setup.recognizer);
}

VisionNode::VisionNode(const Params& params, runtime::Bus& bus)
    : watcher_(complete(params)),
      width_(params.setup.view.width_px),
      height_(params.setup.view.height_px),
      in_(bus, "image"),
      blobs_(bus, "blobs"),
      observation_(bus, "observation"),
      scene_(bus, "scene"),
      annotations_(bus, "annotations") {}

void VisionNode::refuse(const std::string& why) {
  if (refused_.pass()) runtime::warn("image: {}", why);
}

/// Takes over the pixels if the message is an image of the calibrated view.
bool VisionNode::accept(const foxglove::RawImage& m) {
  if (m.encoding() != "bgr8" && m.encoding() != "rgb8") {
    refuse(fmt::format("encoding '{}' is not read, expected bgr8 or rgb8", m.encoding()));
    return false;
  }
  const auto width = static_cast<std::uint64_t>(width_),
             height = static_cast<std::uint64_t>(height_);
  if (m.width() != width || m.height() != height) {
    refuse(fmt::format("{}x{} does not fit the calibrated view of {}x{} (view.width_px, height_px)",
                       m.width(), m.height(), width_, height_));
    return false;
  }
  const std::uint64_t row = 3 * width;
  if (m.step() < row || m.data().size() < (height - 1) * m.step() + row) {
    refuse(fmt::format("{} bytes in rows of {} are too few for {}x{} {}", m.data().size(), m.step(),
                       m.width(), m.height(), m.encoding()));
    return false;
  }
  image_.width = width_;
  image_.height = height_;
  image_.bgr.resize(row * height);
  for (std::uint64_t v = 0; v < height; ++v) {
    std::memcpy(image_.bgr.data() + v * row, m.data().data() + v * m.step(), row);
  }
  if (m.encoding() == "rgb8") {
    for (std::size_t i = 0; i < image_.bgr.size(); i += 3)
      std::swap(image_.bgr[i], image_.bgr[i + 2]);
  }
  return true;
}

void VisionNode::step(runtime::Time) {
  const foxglove::RawImage* message = in_.take();
  if (message == nullptr || !accept(*message)) return;
  watcher_.watch(image_);
  const runtime::Time stamp = stamp_of(*message);
  auto blobs = blobs_message(watcher_);
  blobs_.send(blobs, stamp);
  auto observation = observation_message(watcher_.action());
  observation_.send(observation, stamp);
  auto scene = scene_message(watcher_);
  scene_.send(scene, stamp);
  auto annotations = annotations_message(watcher_);
  annotations_.send(annotations, stamp);
}

}  // namespace mimesis::vision
