#include "nodes/planner/roadmap_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <random>

#include "common/error.h"
#include "common/model/files.h"
#include "common/testing/refusal.h"

namespace mimesis::planner {
namespace {

namespace fs = std::filesystem;

struct Stored {
  kin::ArmModel arm = model::load_arm("lwr4.yaml");
  fs::path file = fs::temp_directory_path() / ("mimesis-" + std::to_string(getpid()) + ".roadmap");
  Roadmap roadmap = arm_roadmap(arm, {.nodes = 400, .seed = 5, .refinement = {}}, 0.002);

  Stored() { save_roadmap(roadmap, arm, file); }
  ~Stored() { fs::remove(file); }
  std::string bytes() const {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::string fault(const kin::ArmModel& of) const {
    return testing::refusal([&] { load_roadmap(file, of); });
  }
  std::string fault() const { return fault(arm); }
};

TEST(RoadmapFile, GivesBackEveryBit) {
  const Stored stored;
  const Roadmap read = load_roadmap(stored.file, stored.arm);
  EXPECT_EQ(read.nodes(), stored.roadmap.nodes());
  ASSERT_EQ(read.links().size(), stored.roadmap.links().size());
  for (std::size_t i = 0; i < read.links().size(); ++i) {
    ASSERT_EQ(read.links()[i].size(), stored.roadmap.links()[i].size());
    for (std::size_t k = 0; k < read.links()[i].size(); ++k) {
      EXPECT_EQ(read.links()[i][k].to, stored.roadmap.links()[i][k].to);
      EXPECT_FLOAT_EQ(read.links()[i][k].weight, stored.roadmap.links()[i][k].weight);
    }
  }
  CollisionChecker alone(stored.arm, {}, 0.002);
  EXPECT_EQ(std::ranges::count(alone.free_columns(read.nodes()), 0), 0) << "free of itself";
}

TEST(RoadmapFile, IsRefusedWhenTheArmChanged) {
  const Stored stored;
  const std::vector<std::function<void(kin::ArmModel&)>> changes{
      [](auto& arm) { arm.links[2].d += 1e-9; },
      [](auto& arm) { arm.links[3].modified = true; },
      [](auto& arm) { arm.q_max[6] += 1e-9; },
      [](auto& arm) { arm.balls[4].radius += 1e-9; },
      [](auto& arm) { arm.balls.pop_back(); },
      [](auto& arm) { arm.self_pairs.pop_back(); },
      [](auto& arm) { arm.X_LE.translation().z() += 1e-9; },
  };
  for (std::size_t i = 0; i < changes.size(); ++i) {
    kin::ArmModel changed = stored.arm;
    changes[i](changed);
    EXPECT_NE(stored.fault(changed).find("or the file of 'lwr4' has changed"), std::string::npos)
        << i;
  }
  kin::ArmModel faster = stored.arm;
  faster.v_max *= 2.0;
  faster.X_WB.translation().x() = 1.0;
  EXPECT_EQ(stored.fault(faster), "") << "nothing that matters to the roadmap";
}

TEST(RoadmapFile, EveryDamageIsNoticed) {
  const Stored stored;
  const std::string whole = stored.bytes();
  std::mt19937 random(3);
  for (int trial = 0; trial < 300; ++trial) {
    std::string damaged = whole;
    if (trial % 2 == 0) {
      damaged.resize(random() % whole.size());
    } else {
      damaged[random() % whole.size()] ^= static_cast<char>(1 << (random() % 8));
    }
    std::ofstream(stored.file, std::ios::binary) << damaged;
    EXPECT_NE(stored.fault(), "") << trial;
  }
  std::ofstream(stored.file, std::ios::binary) << "MIMROAD0" << whole.substr(8);
  EXPECT_NE(stored.fault().find("expected a roadmap of `mimesis plan roadmap`"), std::string::npos);
  fs::remove(stored.file);
  EXPECT_NE(stored.fault().find("not read: No such file"), std::string::npos) << stored.fault();
}

}  // namespace
}  // namespace mimesis::planner
