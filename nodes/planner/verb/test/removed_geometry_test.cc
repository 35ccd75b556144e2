// Plans of public arms that lost a shape since they were planned: each <collision> of the URDF, and
// each part of the arm's file, is removed in turn.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/model/files.h"
#include "common/shared_data.h"
#include "common/testing/process.h"
#include "common/testing/temporary_folder.h"
#include "nodes/planner/verb/verify_geometry.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;

std::string text_in(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

class RemovedGeometry : public testing::VerbTest {
 protected:
  /// The arm's file and a plan of a short motion. @param arm  "URDF BASE TIP [LINKS]", ~ for what
  /// is to be found, and links without geometry
  void plan(const std::string& arm) {
    std::istringstream words(arm);
    std::string urdf, base, tip;
    words >> urdf >> base >> tip;
    const fs::path published = shared_data("data/robots/public/example-robot-data/robots") / urdf;
    std::string packages;
    for (fs::path up = published.parent_path(); up.has_relative_path(); up = up.parent_path())
      packages += up.string() + ':';
    ASSERT_EQ(setenv("ROS_PACKAGE_PATH", packages.c_str(), 1), 0);
    whole_ = text_in(published);
    write(whole_);
    std::vector<std::string> make{"robot", "new",          urdf_,     "--name",        "mine",
                                  "--out", folder_.path(), "--force", "--speed-rad-s", "1"};
    if (base != "~") make.insert(make.end(), {"--base", base});
    if (tip != "~") make.insert(make.end(), {"--tip", tip});
    for (std::string link; words >> link;)
      make.insert(make.end(), {"--without-geometry", link.substr(0, link.find(','))});
    ASSERT_EQ(call(make), 0) << errors_;
    const kin::ArmModel model = model::load_arm(robot_);
    proves_ = model.unchecked.empty();
    std::ostringstream goal;
    for (Eigen::Index j = 0; j < model.dof(); ++j) {
      const bool low = model.home[j] + 0.05 < model.q_max[j];
      goal << (j > 0 ? "," : "--goal=") << model.home[j] + (low ? 0.05 : -0.05);
    }
    ASSERT_EQ(
        call({"plan", folder_ / "mine_table.yaml", "--robot", robot_, goal.str(), "-o", plan_}), 0)
        << errors_;
    EXPECT_EQ(call({"plan", "verify", plan_}), proves_ ? 0 : 1) << output_ << errors_;
  }
  void write(const std::string& urdf) { std::ofstream(urdf_, std::ios::binary) << urdf; }

  testing::TemporaryFolder folder_;
  std::string urdf_ = folder_ / "mine.urdf", robot_ = folder_ / "mine.yaml",
              plan_ = folder_ / "plan.yaml", whole_;
  bool proves_ = true;  // as it was planned
};

/// All corners are in some of the others: a sliver between rounded neighbours.
bool held_by(const std::vector<math::ConvexPart>& others, const math::ConvexPart& part) {
  return std::ranges::all_of(part.points.rowwise(), [&](const auto& corner) {
    return std::ranges::any_of(others, [&](const math::ConvexPart& other) {
      return math::gap_between(other, {corner, 0.0}, Eigen::Isometry3d::Identity()).at_most < 1e-5;
    });
  });
}

std::vector<std::string> published_arms() {
  std::vector<std::string> arms;
  if (const char* file = std::getenv("MIMESIS_PUBLIC_ARMS")) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) arms.push_back(line);
    return arms;
  }
  return {"ur_description/urdf/ur10_robot.urdf ~ ~", "panda_description/urdf/panda.urdf ~ ~",
          "tiago_description/robots/tiago_no_hand.urdf torso_lift_link ~ arm_7_link",
          "z1_description/urdf/z1.urdf ~ ~ link01 link05"};
}

TEST_F(RemovedGeometry, DISABLED_SlowIsNeverProven) {
  for (const std::string& arm : published_arms()) {
    SCOPED_TRACE(arm);
    if (!fs::exists(shared_data("data/robots/public/example-robot-data/robots") /
                    arm.substr(0, arm.find(' '))))
      continue;
    ASSERT_NO_FATAL_FAILURE(plan(arm));
    int shapes = 0, parts = 0;
    constexpr std::string_view kEnd = "</collision>";
    for (std::size_t at = 0; (at = whole_.find("<collision", at)) != whole_.npos; ++at, ++shapes) {
      const std::size_t end = whole_.find(kEnd, at);
      if (end == whole_.npos) break;
      write(whole_.substr(0, at) + whole_.substr(end + kEnd.size()));
      EXPECT_NE(call({"plan", "verify", plan_}), 0)
          << "without " << whole_.substr(at, end - at) << '\n'
          << output_;
    }
    write(whole_);
    // By the geometry alone, without the sums of the files.
    const model::CoveredArm covered = model::load_covered_arm(robot_, false);
    const std::vector<std::string> gaps = geometry_gaps(covered);
    for (std::size_t l = 0; l < covered.links.size(); ++l) {
      for (std::size_t p = 0; p < covered.links[l].parts.size(); ++p, ++parts) {
        model::CoveredArm less = covered;
        less.links[l].parts.erase(less.links[l].parts.begin() + static_cast<std::ptrdiff_t>(p));
        EXPECT_TRUE(geometry_gaps(less).size() > gaps.size() ||
                    held_by(less.links[l].parts, covered.links[l].parts[p]))
            << "part " << p << " of link " << less.links[l].link;
      }
    }
    std::cout << arm << ": " << shapes << " shapes, " << parts << " parts, each removed\n";
    EXPECT_GT(shapes, 0);
  }
}

}  // namespace
}  // namespace mimesis::tool
