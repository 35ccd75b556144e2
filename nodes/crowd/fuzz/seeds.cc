// crowd_fuzz_seeds FOLDER: the scenarios of launch/crowd and what agents say of a run, to begin
// with.
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>

#include "nodes/crowd/fuzz/scenarios.h"
#include "nodes/crowd/scenario_file/scenario_file.h"
#include "nodes/crowd/test/scenario_file.h"
#include "proto/motion.pb.h"

namespace {

using namespace mimesis;
using namespace mimesis::crowd;

class Seeds {
 public:
  explicit Seeds(std::filesystem::path folder) : folder_(std::move(folder)) {
    std::filesystem::create_directories(folder_);
  }
  void add(const std::string& name, char kind, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << kind << bytes;
  }

 private:
  std::filesystem::path folder_;
};

void add_scenarios(const Seeds& seeds) {
  const std::string some = find_scenario("formation");
  for (const auto& file :
       std::filesystem::directory_iterator(std::filesystem::path(some).parent_path())) {
    std::ostringstream text;
    text << std::ifstream(file.path()).rdbuf();
    if (file.path().extension() == ".yaml") seeds.add(file.path().filename(), 0, text.str());
  }
  seeds.add("fuzz.yaml", 0, std::string(kFuzzScenario) + crowd::testing::kGaits);
}

void add_messages(const Seeds& seeds) {
  const crowd::testing::ScenarioFile file(kFuzzScenario);
  ScenarioRun run(read_scenario(file.path()));
  v1::CrowdStates robot;
  robot.add_id(run.roster().external_id(1));
  for (const double x : {1.0, 2.0}) robot.add_position_in_world_m(x);
  for (const float v : {1.0F, 0.0F}) robot.add_velocity_in_world_m_s(v);
  robot.add_heading_rad(0.1);
  robot.add_phase_rad(0.2);
  robot.add_phase_rate_rad_s(5.7);
  seeds.add("robot", 1, robot.SerializeAsString());
  robot.add_leaving(run.roster().external_id(1));
  seeds.add("leaves", 1, robot.SerializeAsString());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: crowd_fuzz_seeds FOLDER\n";
    return 2;
  }
  const Seeds seeds(argv[1]);
  add_scenarios(seeds);
  add_messages(seeds);
  return 0;
}
