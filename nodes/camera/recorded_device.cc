#include "nodes/camera/recorded_device.h"

#include <stdexcept>

#include "common/log/wire.h"

namespace mimesis::camera {
namespace {

constexpr std::string_view kName = "camera";

std::string encode(Taken taken, const RawFrame& frame) {
  std::string bytes;
  log::Encoder out(bytes);
  out.integer(static_cast<std::uint8_t>(taken));
  if (taken != Taken::frame) return bytes;
  out.integer(static_cast<std::uint8_t>(frame.format));
  out.integer(static_cast<std::uint32_t>(frame.width));
  out.integer(static_cast<std::uint32_t>(frame.height));
  out.integer(static_cast<std::uint32_t>(frame.row_bytes));
  out.integer(static_cast<std::uint64_t>(frame.captured.count()));
  out.raw({reinterpret_cast<const char*>(frame.bytes.data()), frame.bytes.size()});
  return bytes;
}

Taken decode(std::string_view bytes, RawFrame& frame) {
  log::Decoder in(bytes);
  const auto taken = static_cast<Taken>(in.integer<std::uint8_t>());
  if (taken == Taken::frame) {
    frame.format = static_cast<PixelFormat>(in.integer<std::uint8_t>());
    frame.width = static_cast<int>(in.integer<std::uint32_t>());
    frame.height = static_cast<int>(in.integer<std::uint32_t>());
    frame.row_bytes = static_cast<int>(in.integer<std::uint32_t>());
    frame.captured = std::chrono::nanoseconds(in.integer<std::uint64_t>());
    const std::string_view pixels = in.rest();
    frame.bytes.assign(pixels.begin(), pixels.end());
  }
  if (!in.ok() || taken > Taken::gone || frame.format > kLastFormat) {
    throw std::runtime_error("recorded 'camera': " + std::to_string(bytes.size()) +
                             " bytes are no frame, see nodes/camera/recorded_device.h");
  }
  return taken;
}

class RecordedDevice final : public FrameDevice {
 public:
  RecordedDevice(std::unique_ptr<FrameDevice> device, runtime::Bus& graph)
      : device_(std::move(device)), graph_(graph) {}

  tl::expected<std::string, Status> open() override {
    return outcome([this] { return device_->open(); });
  }

  tl::expected<void, Status> set_light(Light light) override {
    const auto done = outcome(
        [this, light] { return device_->set_light(light).map([] { return std::string(); }); });
    if (!done) return tl::unexpected(done.error());
    return {};
  }

  void close() override {
    if (device_) device_->close();
  }

  Taken take_newest(RawFrame& out) override {
    const std::string bytes = runtime::read_outside(graph_, kName, [&] {
      const Taken taken = device_->take_newest(out);
      return encode(taken, out);
    });
    return bytes.empty() ? Taken::none : decode(bytes, out);  // empty: a replay that has ended
  }

 private:
  template <class Action>
  tl::expected<std::string, Status> outcome(const Action& action) {
    const std::string bytes = runtime::read_outside(graph_, kName, [&] {
      const tl::expected<std::string, Status> done = action();
      return done ? '\1' + *done : '\0' + done.error().reason;
    });
    if (bytes.starts_with('\1')) return bytes.substr(1);
    return tl::unexpected(Status{bytes.empty() ? bytes : bytes.substr(1)});
  }

  std::unique_ptr<FrameDevice> device_;
  runtime::Bus& graph_;
};

}  // namespace

std::unique_ptr<FrameDevice> record_device(std::unique_ptr<FrameDevice> device,
                                           runtime::Bus& graph) {
  return std::make_unique<RecordedDevice>(std::move(device), graph);
}

Capture::Clock record_clock(Capture::Clock clock, runtime::Bus& graph) {
  return [clock = std::move(clock), &graph] {
    const auto ns = runtime::read_outside_value<std::int64_t>(
        graph, "camera_clock", [&] { return std::int64_t{clock().count()}; });
    return std::chrono::nanoseconds(ns);
  };
}

}  // namespace mimesis::camera
