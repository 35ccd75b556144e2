#include "tools/mimesis/view/film.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>

#include "common/error.h"
#include "common/machine_time.h"
#include "common/runtime/raw.h"
#include "proto/foxglove/image.pb.h"
#include "proto/player.pb.h"
#include "tools/mimesis/launch/command.h"
#include "tools/mimesis/launch/process.h"
#include "tools/mimesis/log/playback.h"
#include "tools/mimesis/progress.h"
#include "tools/mimesis/stop_signals.h"

namespace mimesis::view {
namespace {

using namespace std::chrono_literals;

constexpr auto kPatience = 30s;                     // for the browser, and for one picture
constexpr std::uint32_t kService = 1, kMarker = 1;  // ids; topics of the log follow the marker
constexpr std::array kDrawn{"foxglove.SceneUpdate", "foxglove.FrameTransforms"};

/// A film, which ffmpeg makes of pictures.
class FilmFile {
 public:
  /// @param format  what ffmpeg is told of its input: {"-f", "image2pipe", "-c:v", "mjpeg"}
  /// @throws ConfigError without ffmpeg
  FilmFile(std::string path, const std::vector<std::string>& format, double rate_hz);
  /// @throws ConfigError if the file cannot be written
  void take(std::string_view picture);
  /// @throws ConfigError if the film could not be made
  void finish();

 private:
  std::string path_;
  launch::Fd in_;
  launch::Child child_;
};

FilmFile::FilmFile(std::string path, const std::vector<std::string>& format, double rate_hz)
    : path_(std::move(path)) {
  const std::string ffmpeg = launch::find_executable("ffmpeg");
  if (ffmpeg.empty()) throw ConfigError(path_ + ": a film needs ffmpeg: apt install ffmpeg");
  std::vector<std::string> argv{ffmpeg, "-v", "error", "-y"};
  argv.insert(argv.end(), format.begin(), format.end());
  argv.insert(argv.end(),
              {"-framerate", fmt::format("{}", rate_hz), "-i", "-", "-pix_fmt", "yuv420p", path_});
  std::signal(SIGPIPE, SIG_IGN);  // ffmpeg may end
  launch::Pipe pipe = launch::make_pipe();
  child_ = launch::spawn({argv, {}}, {}, {.output = STDERR_FILENO, .input = pipe.read.get()});
  in_ = std::move(pipe.write);
}

void FilmFile::take(std::string_view picture) {
  while (!picture.empty()) {
    const ssize_t n = write(in_.get(), picture.data(), picture.size());
    if (n <= 0) throw ConfigError(path_ + ": ffmpeg ended before the film did");
    picture.remove_prefix(static_cast<std::size_t>(n));
  }
}

void FilmFile::finish() {
  in_.reset();
  std::optional<launch::Ending> ending;
  while (!(ending = child_.reap())) {
    pollfd ended{child_.pidfd.get(), POLLIN, 0};
    poll(&ended, 1, -1);
  }
  if (!ending->good()) throw ConfigError(fmt::format("{}: ffmpeg {}", path_, ending->text()));
}

std::string find_browser(const std::string& wished) {
  for (const std::string& name :
       wished.empty() ? std::vector<std::string>{"chromium", "chromium-browser", "google-chrome"}
                      : std::vector{wished}) {
    if (const std::string found = launch::find_executable(name); !found.empty()) return found;
  }
  throw ConfigError(wished.empty()
                        ? "a film needs a browser to draw it: apt install chromium, or --browser"
                        : fmt::format("--browser {}: no such program", wished));
}

/// Draws what the server sends, with the folder of its own that it needs.
class Browser {
 public:
  Browser(const std::string& program, const std::string& url)
      : folder_(std::filesystem::temp_directory_path() / fmt::format("mimesis-film-{}", getpid())) {
    std::vector<std::string> argv{program,
                                  "--headless=new",
                                  "--disable-dev-shm-usage",
                                  "--enable-unsafe-swiftshader",
                                  "--hide-scrollbars",
                                  "--no-first-run",
                                  "--user-data-dir=" + folder_.string()};
    if (geteuid() == 0) argv.push_back("--no-sandbox");  // it refuses root otherwise
    argv.push_back(url);
    process_.emplace(launch::Command{argv, {}});
  }
  ~Browser() {
    process_->send(SIGTERM);
    process_->wait(3s);
    process_.reset();
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  /// @throws ConfigError with its last line: it ended, or has not answered in time
  [[noreturn]] void blame(const char* what) {
    const std::string words = process_->last_words();
    throw ConfigError(fmt::format("the browser {}: {}", what, words.substr(words.rfind('\n') + 1)));
  }
  bool ended() { return process_->ending().has_value(); }

 private:
  std::filesystem::path folder_;
  std::optional<launch::OwnProcess> process_;
};

/// Takes pictures and makes a file of them.
class Sink {
 public:
  explicit Sink(const FilmOptions& o) : png_(o.png) {
    if (!o.film.empty())
      film_.emplace(o.film, std::vector<std::string>{"-f", "image2pipe", "-c:v", "mjpeg"},
                    o.rate_hz);
  }
  /// @throws ConfigError if the file cannot be written
  void take(const std::string& picture) {
    if (film_) return film_->take(picture);
    std::ofstream out(png_, std::ios::binary);
    if (!(out << picture).flush()) throw ConfigError(png_ + ": cannot be written");
  }
  /// @throws ConfigError if the film could not be made
  void finish() {
    if (film_) film_->finish();
  }

 private:
  std::string png_;
  std::optional<FilmFile> film_;
};

/// The server, and the log's messages that are sent up to a time.
class Stage {
 public:
  Stage(const FilmOptions& o, const ServerOptions& server)
      : log_(open(o.logs)), server_(server), name_(o.logs.front()) {
    channels_.push_back({kMarker, "film/time", v1::PlayerSeek::descriptor()->full_name(),
                         runtime::descriptor_set(*v1::PlayerSeek::descriptor()), false});
    for (const tool::PlayedTopic& topic : log_.topics()) {
      ids_[&topic] = static_cast<std::uint32_t>(channels_.size()) + kMarker;
      channels_.push_back(
          {ids_[&topic], topic.topic, topic.type, topic.descriptors, topic.latched});
    }
    const auto half = [](const google::protobuf::Descriptor& type) {
      return Half{type.full_name(), runtime::descriptor_set(type)};
    };
    server_.announce(std::vector<Service>{{kService, "film/picture",
                                           half(*foxglove::CompressedImage::descriptor()),
                                           half(*v1::PlayerAsk::descriptor())}});
    server_.announce(channels_);
    for (tool::Played& value : log_.seek(log_.start_ns())) send(value);
    more_ = log_.next(next_);
  }

  std::string url() const { return server_.url(); }
  double end_s() const { return log_.position_s(log_.end_ns()); }
  /// The page listens to all there is.
  bool watched() const { return server_.wanted().size() == channels_.size(); }

  /// Sends all up to a time, and takes the picture of that; empty: there is none in time.
  std::string picture(double position_s) {
    const std::uint64_t until_ns = log_.log_time_ns(position_s);
    for (; more_ && next_.log_time_ns <= until_ns; more_ = log_.next(next_)) send(next_);
    v1::PlayerSeek marker;
    marker.set_position_s(position_s);
    server_.send(kMarker, marker.SerializeAsString(), until_ns);
    std::optional<Server::Asked> asked;
    for (MachineTime waited; !asked && waited.passed() < kPatience;) asked = server_.asked(100ms);
    const auto* call = asked ? std::get_if<CallService>(&asked->request) : nullptr;
    foxglove::CompressedImage image;
    if (call == nullptr || !image.ParseFromString(call->payload)) return {};
    server_.answer_binary(asked->client, service_answer(call->service, call->call, {}));
    return std::move(*image.mutable_data());
  }

 private:
  static tool::Playback open(const std::vector<std::string>& files);

  void send(tool::Played& value) {
    server_.send(ids_.at(value.topic), std::move(value.payload), value.publish_time_ns);
  }

  tool::Playback log_;
  Server server_;
  std::string name_;
  std::vector<Channel> channels_;
  std::map<const tool::PlayedTopic*, std::uint32_t> ids_;
  tool::Played next_;
  bool more_ = false;
};

tool::Playback Stage::open(const std::vector<std::string>& files) {
  std::vector<tool::OpenLog> logs = tool::open_logs(files);
  std::vector<std::string> drawn;
  for (const tool::OpenChannel& c : tool::channels_of(logs)) {
    if (std::ranges::find(kDrawn, c.type()) != kDrawn.end()) drawn.push_back(c.channel->topic);
  }
  if (drawn.empty()) {
    throw ConfigError(
        fmt::format("{}: nothing in it is drawn (no foxglove.SceneUpdate)", files.front()));
  }
  return tool::Playback(std::move(logs), {.filter = tool::TopicFilter(drawn, "", "")});
}

}  // namespace

void make_film(const FilmOptions& o, ServerOptions server) {
  const std::string program = find_browser(o.browser);
  server.backlog_bytes = std::size_t{1} << 30;  // nothing may be left out
  server.backlog_messages = 1 << 24;
  server.largest_request = std::size_t{1} << 26;  // a picture
  const tool::StopSignals stop;
  Stage stage(o, server);
  const double end_s = std::min(o.to_s.value_or(stage.end_s()), stage.end_s());
  if (o.from_s > end_s)
    throw ConfigError(fmt::format("the log has {:.3f} s, nothing at {:.3f} s", end_s, o.from_s));
  Sink sink(o);
  Browser browser(program,
                  fmt::format("{}&film={}&size={}x{}&camera={}", stage.url(),
                              o.png.empty() ? "jpeg" : "png", o.width_px, o.height_px, o.camera));
  for (MachineTime waited; !stage.watched(); std::this_thread::sleep_for(10ms)) {
    if (browser.ended()) browser.blame("ended");
    if (waited.passed() > kPatience) browser.blame("has not opened the page");
  }
  const double step_s = o.speed / o.rate_hz;
  const long pictures =
      o.png.empty() ? std::lround(std::floor((end_s - o.from_s) / step_s)) + 1 : 1;
  tool::Progress progress("film", static_cast<std::uint64_t>(pictures), tool::Progress::Unit::none);
  long i = 0;
  for (; i < pictures && !stop.requested(); ++i) {
    const std::string picture = stage.picture(o.from_s + static_cast<double>(i) * step_s);
    if (picture.empty()) browser.blame("has not drawn a picture in time");
    sink.take(picture);
    progress.at(static_cast<std::uint64_t>(i + 1));
  }
  sink.finish();
  std::cerr << fmt::format("{}: {} picture{} of {}x{}\n", o.png.empty() ? o.film : o.png, i,
                           i == 1 ? "" : "s", o.width_px, o.height_px);
}

}  // namespace mimesis::view
