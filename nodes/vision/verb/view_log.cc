#include "nodes/vision/verb/view_log.h"

#include <fmt/format.h>

#include <cmath>
#include <deque>
#include <filesystem>
#include <iostream>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "common/image/image_file.h"
#include "tools/mimesis/launch/film_file.h"
#include "tools/mimesis/log/export.h"
#include "tools/mimesis/log/playback.h"
#include "tools/mimesis/log/restore.h"

namespace mimesis::tool {
namespace {

using foxglove::PointsAnnotation;
using Stamp = std::pair<std::int64_t, std::int32_t>;

Stamp stamp_of(const google::protobuf::Timestamp& t) { return {t.seconds(), t.nanos()}; }

struct Picture {
  Stamp stamp;
  image::Image image;
};

template <class Message>
Message parsed(const Played& value) {
  Message message;
  if (message.ParseFromString(value.payload)) return message;
  throw ConfigError(fmt::format("{}: expected {}, found {}", value.topic->topic,
                                Message::descriptor()->full_name(), value.topic->type));
}

Picture picture_of(const Played& value) {
  Picture out;
  const auto no_image = [&](const Status& why) {
    throw VerbEnd{fmt::format("{}: {}", value.topic->topic, why.reason), 1};
  };
  if (value.topic->type == "foxglove.CompressedImage") {
    const auto message = parsed<foxglove::CompressedImage>(value);
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(message.data().data());
    if (const auto done = image::decode_jpeg({bytes, message.data().size()}, out.image); !done)
      no_image(done.error());
    out.stamp = stamp_of(message.timestamp());
    return out;
  }
  const auto message = parsed<foxglove::RawImage>(value);
  auto image = raw_image(message);
  if (!image) no_image(image.error());
  out.image = std::move(*image);
  out.stamp = stamp_of(message.timestamp());
  return out;
}

/// Where the pictures go.
class Out {
 public:
  explicit Out(const ViewLogOptions& o) : o_(o) {
    if (!o.frames.empty()) std::filesystem::create_directories(o.frames);
  }
  void take(const image::Image& image) {
    ++count_;
    if (!o_.frames.empty()) {
      const std::string file = fmt::format("{}/{:06}.png", o_.frames, count_);
      if (const auto done = image::write_png(file, image); !done)
        throw VerbEnd{done.error().reason, 1};
      return;
    }
    const std::string size = fmt::format("{}x{}", image.width, image.height);
    if (!film_)
      film_.emplace(o_.film,
                    std::vector<std::string>{"-f", "rawvideo", "-pix_fmt", "bgr24", "-s", size},
                    o_.rate_hz);
    film_->take({reinterpret_cast<const char*>(image.bgr.data()), image.bgr.size()});
  }
  void finish() {
    if (film_) film_->finish();
  }
  int count() const { return count_; }

 private:
  const ViewLogOptions& o_;
  std::optional<launch::FilmFile> film_;
  int count_ = 0;
};

}  // namespace

void draw(const foxglove::ImageAnnotations& annotations, image::Image& image) {
  cv::Mat view(image.height, image.width, CV_8UC3, image.bgr.data());
  const auto color = [](const foxglove::Color& c) {
    return cv::Scalar(255.0 * c.b(), 255.0 * c.g(), 255.0 * c.r());
  };
  const auto at = [](const foxglove::Point2& p) {
    return cv::Point(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
  };
  const auto thick = [](double thickness) {
    return std::max(1, static_cast<int>(std::lround(thickness)));
  };
  for (const auto& c : annotations.circles()) {
    cv::circle(view, at(c.position()), static_cast<int>(std::lround(0.5 * c.diameter())),
               color(c.outline_color()), thick(c.thickness()), cv::LINE_AA);
  }
  for (const auto& points : annotations.points()) {
    const int n = points.points_size(), step = points.type() == PointsAnnotation::LINE_LIST ? 2 : 1;
    for (int i = 0; i < n; i += step) {
      const cv::Point from = at(points.points(i));
      const bool last = i + 1 == n, loop = points.type() == PointsAnnotation::LINE_LOOP;
      if (last && !loop && points.type() != PointsAnnotation::POINTS) break;
      const cv::Point to =
          points.type() == PointsAnnotation::POINTS ? from : at(points.points((i + 1) % n));
      cv::line(view, from, to, color(points.outline_color()), thick(points.thickness()),
               cv::LINE_AA);
    }
  }
  for (const auto& text : annotations.texts()) {
    constexpr double kHeight = 21.0;  // of capital letters at scale 1 [px]
    cv::putText(view, text.text(), at(text.position()), cv::FONT_HERSHEY_SIMPLEX,
                0.7 * text.font_size() / kHeight, color(text.text_color()), 1, cv::LINE_AA);
  }
}

int view_log(const ViewLogOptions& o) {
  if (o.film.empty() == o.frames.empty())
    throw ConfigError("vision view: expected --film FILE or --frames FOLDER");
  auto logs = open_whole_logs(o.logs);
  for (const std::string& topic : {o.image, o.annotations}) require_topic(logs, topic);
  Playback log(std::move(logs),
               {.filter = TopicFilter({o.image, o.annotations}, "", ""), .range = o.range});
  Out out(o);
  std::deque<Picture> waiting;  // for their annotations, which come later
  int annotated = 0;
  const auto flush = [&](std::size_t keep) {
    for (; waiting.size() > keep; waiting.pop_front()) out.take(waiting.front().image);
  };
  log.seek(log.start_ns());
  for (Played value; log.next(value);) {
    if (value.topic->topic == o.image) {
      constexpr std::size_t kMost = 60;
      waiting.push_back(picture_of(value));
      flush(kMost);
      continue;
    }
    const auto annotations = parsed<foxglove::ImageAnnotations>(value);
    const auto it = std::ranges::find(waiting, stamp_of(annotations.timestamp()), &Picture::stamp);
    if (it == waiting.end()) continue;
    draw(annotations, it->image);
    ++annotated;
    flush(static_cast<std::size_t>(waiting.end() - it - 1));
  }
  flush(0);
  out.finish();
  std::cout << fmt::format("{}: {} pictures, {} of them annotated\n",
                           o.film.empty() ? o.frames : o.film, out.count(), annotated);
  return annotated > 0 ? 0 : 1;
}

}  // namespace mimesis::tool
