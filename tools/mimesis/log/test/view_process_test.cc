// `mimesis log view` as a process.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/log/indexed_reader.h"
#include "common/testing/process.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/foxglove/transform.pb.h"
#include "tools/mimesis/log/test/robot_log.h"

namespace mimesis::tool {
namespace {

using testing::Process;
namespace fs = std::filesystem;

const std::string kPlanner = "robot: lwr4.yaml\nroadmap_nodes: 120\nspeed: 0.5\n";
const std::string kVision =
    "rate_hz: 60\nview:\n  eye_m: [0.4, 0.5, 1.0]\n  focal_px: 700\n  width_px: 16\n  height_px: "
    "8\n";

std::string bytes_of(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

struct Entry {
  std::string topic, data;
  std::uint64_t log_time, publish_time;
  std::uint32_t sequence;
};

std::vector<Entry> entries(const std::string& file) {
  std::vector<Entry> all;
  const auto source = log::open_file(file);
  if (!source) return all;
  const auto summary = log::summarize(**source);
  if (!summary) return all;
  EXPECT_TRUE(summary->from_file);
  log::IndexedReader reader(**source, *summary);
  while (const log::Message* m = reader.next()) {
    all.push_back({summary->channels.at(m->channel_id).topic, std::string(m->data), m->log_time,
                   m->publish_time, m->sequence});
  }
  return all;
}

class LogView : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "mimesis-view-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    in_ = (folder_ / "in.mcap").string();
    out_ = (folder_ / "out.mcap").string();
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write_input(const std::string& planner = kPlanner, const std::string& vision = kVision) {
    RobotLog log(in_);
    write_robot_second(log, planner, vision);
    log::Attachment attachment;
    attachment.name = "launch.yaml";
    attachment.data = "nodes: {}";
    EXPECT_TRUE(log.writer().attach(attachment));
    EXPECT_TRUE(log.writer().add_metadata({"mimesis.counts", {{"total", "lost=0"}}}));
    log.finish();
  }
  int view(std::vector<std::string> options) {
    std::vector<std::string> arguments{"log", "view", "--json"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    Process process("mimesis", arguments);
    const int exit_code = process.wait(std::chrono::seconds(60)).value_or(-1);
    errors_ = process.errors();
    report_ = nlohmann::json::parse(process.output(), nullptr, false);
    return exit_code;
  }

  fs::path folder_;
  std::string in_, out_, errors_;
  nlohmann::json report_;
};

TEST_F(LogView, KeepsEveryMessageAndPutsDrawingsBesideThem) {
  write_input();
  ASSERT_EQ(view({in_, "-o", out_, "--all"}), 0) << errors_;
  std::map<std::string, int> drawn;
  std::vector<Entry> kept;
  std::uint64_t last = 0;
  for (const Entry& entry : entries(out_)) {
    EXPECT_GE(entry.log_time, last);
    last = entry.log_time;
    if (!entry.topic.starts_with("view/")) {
      kept.push_back(entry);
      continue;
    }
    EXPECT_EQ(entry.sequence, static_cast<std::uint32_t>(++drawn[entry.topic]));
    EXPECT_EQ(entry.publish_time, entry.log_time);  // times of the messages they show
  }
  const std::vector<Entry> before = entries(in_);
  ASSERT_EQ(kept.size(), before.size());
  for (std::size_t i = 0; i < kept.size(); ++i) {
    EXPECT_EQ(kept[i].topic, before[i].topic);
    EXPECT_EQ(kept[i].data, before[i].data);
    EXPECT_EQ(kept[i].sequence, before[i].sequence);
  }
  EXPECT_EQ(drawn, (std::map<std::string, int>{{"view/camera", 1},
                                               {"view/camera_frames", 1},
                                               {"view/fields", 10},
                                               {"view/roadmap", 2},
                                               {"view/table", 1}}));
  EXPECT_EQ(report_["drawn"], nlohmann::json(drawn));
  EXPECT_EQ(report_["messages"], before.size() + 15);
  EXPECT_EQ(report_["attachments"], 1);
  EXPECT_EQ(report_["metadata"], 1);
}

TEST_F(LogView, TakesParametersFromTheLog) {
  write_input();
  ASSERT_EQ(view({in_, "-o", out_, "--roadmap"}), 0) << errors_;
  for (const Entry& entry : entries(out_)) {
    if (entry.topic == "view/camera") {
      foxglove::CameraCalibration calibration;
      ASSERT_TRUE(calibration.ParseFromString(entry.data));
      EXPECT_EQ(calibration.k(0), 700.0);
      EXPECT_EQ(calibration.width(), 16u);
    }
    if (entry.topic == "view/roadmap") {
      foxglove::SceneUpdate update;
      ASSERT_TRUE(update.ParseFromString(entry.data));
      int nodes = 0;
      for (const auto& entity : update.entities()) nodes += entity.spheres_size();
      EXPECT_GT(nodes, 120);   // sampled, and those of reaches
      EXPECT_LT(nodes, 2500);  // the default
    }
  }
  write_input("speed: 0.5\nno_such_parameter: 1\n", "");
  EXPECT_EQ(view({in_, "-o", out_, "--force", "--roadmap"}), 2);
  EXPECT_NE(errors_.find("no_such_parameter"), std::string::npos) << errors_;
}

TEST_F(LogView, GivesTheSameBytesForTheSameLog) {
  write_input();
  ASSERT_EQ(view({in_, "-o", out_, "--all"}), 0) << errors_;
  const std::string again = (folder_ / "again.mcap").string();
  ASSERT_EQ(view({in_, "-o", again, "--all"}), 0) << errors_;
  EXPECT_EQ(bytes_of(out_), bytes_of(again));
}

TEST_F(LogView, SaysWhatItCannotDo) {
  RobotLog log(in_);
  v1::Scene other;
  other.mutable_object()->mutable_position_in_world_m()->set_x_m(NAN);
  log.stamped("world", "scene", other, 1);
  log.finish();
  EXPECT_EQ(view({in_, "-o", out_, "--fields"}), 3);
  EXPECT_EQ(errors_, "--fields: no topic of type mimesis.v1.FieldActivity in the log\n");
  EXPECT_FALSE(fs::exists(out_));

  ASSERT_EQ(view({in_, "-o", out_, "--all"}), 0) << errors_;  // nothing to draw: a copy
  EXPECT_NE(errors_.find("world/scene: 1 messages cannot be drawn"), std::string::npos) << errors_;
  EXPECT_EQ(report_["drawn"], nlohmann::json::object());
  EXPECT_EQ(report_["messages"], 1);

  const std::string before = bytes_of(out_);
  EXPECT_EQ(view({in_, "-o", out_, "--all"}), 2);     // exists
  EXPECT_EQ(view({out_, "-o", out_, "--force"}), 2);  // would read its own output
  EXPECT_EQ(bytes_of(out_), before);
  EXPECT_EQ(view({(folder_ / "none.mcap").string(), "-o", out_, "--force"}), 3);
  EXPECT_EQ(view({MIMESIS_SOURCE_DIR "/LICENSE", "-o", out_, "--force"}), 1);
  EXPECT_EQ(bytes_of(out_), before);
}

}  // namespace
}  // namespace mimesis::tool
