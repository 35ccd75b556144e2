#pragma once
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/image/pinhole.h"
#include "tools/mimesis/log/open_log.h"
#include "tools/mimesis/log/view_drawing.h"
#include "tools/mimesis/log/view_roadmap.h"
#include "tools/mimesis/log/view_robot.h"
#include "tools/mimesis/log/view_setup.h"

namespace mimesis::tool {

/// What to draw.
struct ViewLayers {
  bool robot = false, fields = false, roadmap = false, table = false;
  bool all = false;  ///< of these, whatever the log has the topics for
};

/// Why `layers` cannot be drawn: the log lacks a topic. Nothing if they can.
std::optional<std::string> missing_topic(const ViewLayers& layers,
                                         const std::vector<OpenLog>& logs);

/// Turns messages of a log into drawings.
class LayerPainter {
 public:
  /// Precondition: nothing is missing. @throws ConfigError if the log names a robot or parameters
  /// that this version does not know.
  LayerPainter(const ViewLayers& layers, const std::vector<OpenLog>& logs);

  /// What holds from the first message on: the camera's place and calibration, if the log has
  /// images and says how the camera stands.
  void begin(std::chrono::nanoseconds stamp, const Draw& draw) const;
  /// Messages of other topics are passed over.
  void see(const log::MergedReader::Item& item, const Draw& draw);

  /// One line per topic with messages that could not be drawn: cut off, or not of this robot.
  std::vector<std::string> problems() const;

 private:
  void add_robot(const std::vector<OpenLog>& logs, const Setups& setups);
  void add_roadmap(const std::vector<OpenLog>& logs, const Setups& setups);
  /// `see(message, draw)` is called for messages on the topic of type `T`, if there is one; false:
  /// it could not be drawn.
  template <class T, class See>
  void follow(const std::vector<OpenLog>& logs, See see);

  std::optional<RobotView> robot_;
  std::optional<RoadmapView> roadmap_;
  std::optional<image::View> camera_;
  using Painter = std::function<bool(std::string_view payload, const Draw&)>;
  std::multimap<std::string, Painter> painters_;  ///< by topic
  std::map<std::string, std::uint64_t> failed_;   ///< messages by topic
};

}  // namespace mimesis::tool
