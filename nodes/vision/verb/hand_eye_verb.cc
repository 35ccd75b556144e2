// `mimesis calibrate hand-eye`.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "common/image/image.h"
#include "common/json_text.h"
#include "common/model/files.h"
#include "common/model/rig_file.h"
#include "nodes/vision/verb/calibrate_tools.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180.0;

struct HandEyeOptions : BoardOptions {
  std::string rig, poses, on_arm, arm, camera, out;
};

std::string text_of(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  if (!in) throw ConfigError(file + ": cannot be read");
  return text.str();
}

struct Seen {
  std::vector<vision::ArmShot> shots;
  std::vector<vision::Rejected> rejected;
};

/// Looks for the board in the pictures of a table of poses, whose folder theirs begin in.
Seen boards(const vision::Board& board, const image::Camera& camera, const ArmPoses& poses,
            const std::string& table) {
  constexpr std::size_t kDoubt = 4;  // a search for what is not there takes long
  Seen out;
  for (std::size_t row = 0; row < poses.files.size(); ++row) {
    const std::string file = (fs::path(table).parent_path() / poses.files[row]).string();
    const std::string name = printable(poses.files[row]);
    const auto picture = image::read_image(file);
    if (!picture)
      throw ConfigError(fmt::format("{}:{}: {}", table, poses.lines[row], picture.error().reason));
    if (picture->width != camera.width() || picture->height != camera.height()) {
      throw ConfigError(fmt::format("{}:{}: {} has {}x{} pixels, the camera {}x{}", table,
                                    poses.lines[row], file, picture->width, picture->height,
                                    camera.width(), camera.height()));
    }
    auto found = vision::find_board(*picture, board);
    if (found) {
      out.shots.push_back({name, row, std::move(found->corners)});
      continue;
    }
    out.rejected.push_back(
        {name, fmt::format("no whole board of {}x{} inner corners", board.columns, board.rows)});
    if (!out.shots.empty() || out.rejected.size() < std::min(kDoubt, poses.files.size())) continue;
    const auto shown = vision::board_size_in(*picture);
    throw ConfigError(fmt::format(
        "board: no whole one of {}x{} inner corners in the first {} pictures{}", board.columns,
        board.rows, out.rejected.size(),
        shown ? fmt::format(", but one of {}x{} in {}", shown->first, shown->second, file) : ""));
  }
  return out;
}

Json list_of(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Json turn_of(const Eigen::Isometry3d& X) {
  const Eigen::Quaterniond q(X.linear());
  return {q.w(), q.x(), q.y(), q.z()};
}

std::vector<std::string> pose_advice(const vision::HandEye& found) {
  constexpr std::size_t kEnough = 12;
  constexpr double kWell_m = 1e-3, kWell_rad = 0.1 * kDegree, kSize = 0.005, kSigmas = 4.0;
  std::vector<std::string> out;
  if (found.fits.size() < kEnough) {
    out.push_back(fmt::format("take {} poses or more, these are {}", kEnough, found.fits.size()));
  }
  if (found.position_2sigma_m() > kWell_m || found.rotation_2sigma_rad() > kWell_rad)
    out.push_back("most helps a view of " + found.helps);
  const double off = std::abs(found.square_ratio - 1.0);
  if (off > kSize && off > kSigmas * found.square_ratio_sigma) {
    out.push_back(
        fmt::format("measure the squares: by the arm's motions they are {:.2f} % {} than said",
                    100.0 * off, found.square_ratio > 1.0 ? "larger" : "smaller"));
  }
  return out;
}

Json pose_report(const vision::HandEye& found, const std::vector<vision::Rejected>& rejected,
                 const HandEyeOptions& options, double pixel_m) {
  const bool carried = options.on_arm == "camera";
  Json out{{"on_arm", options.on_arm},
           {"frame", carried ? "flange" : "base"},
           {"position_m", list_of(found.X_camera.translation())},
           {"orientation", turn_of(found.X_camera)},
           {"position_2sigma_m", list_of(2.0 * found.position_sigma_m)},
           {"rotation_2sigma_rad", list_of(2.0 * found.rotation_sigma_rad)},
           {"board_frame", carried ? "base" : "flange"},
           {"board_position_m", list_of(found.X_board.translation())},
           {"board_orientation", turn_of(found.X_board)},
           {"square_ratio", found.square_ratio},
           {"square_ratio_2sigma", 2.0 * found.square_ratio_sigma},
           {"arm_sigma_m", found.arm_sigma_m},
           {"arm_sigma_rad", found.arm_sigma_rad},
           {"rms_px", found.rms_px},
           {"rms_m", found.rms_px * pixel_m},
           {"pictures", Json::array()},
           {"rejected", Json::array()}};
  for (const vision::PoseFit& each : found.fits) {
    out["pictures"].push_back({{"name", each.name},
                               {"rms_px", each.rms_px},
                               {"held_out_px", each.held_out_px},
                               {"off_m", each.off_m}});
  }
  for (const vision::Rejected& each : rejected)
    out["rejected"].push_back({{"name", each.name}, {"reason", each.reason}});
  out["advice"] = pose_advice(found);
  return out;
}

void print_poses(const vision::HandEye& found, const Json& report) {
  TextTable table({"picture", "corners, rms [px]", "left out [px]", "board off by [mm]"});
  for (const vision::PoseFit& each : found.fits) {
    table.row({each.name, fmt::format("{:.3f}", each.rms_px),
               fmt::format("{:.3f}", each.held_out_px), fmt::format("{:.2f}", 1e3 * each.off_m)});
  }
  table.print(std::cout, use_colour(STDOUT_FILENO));
  const Vector3d p = found.X_camera.translation(), s = 2.0 * found.position_sigma_m,
                 r = 2.0 / kDegree * found.rotation_sigma_rad;
  const Eigen::Quaterniond q(found.X_camera.linear());
  std::cout << fmt::format(
      "corners: {:.3f} px rms, {:.2f} mm on the board\n"
      "camera in the {}: position ({:.5f}, {:.5f}, {:.5f}) m, 2 sigma ({:.2g}, {:.2g}, {:.2g}) m\n"
      "  orientation w x y z ({:.6f}, {:.6f}, {:.6f}, {:.6f}), 2 sigma ({:.2g}, {:.2g}, {:.2g})°\n",
      found.rms_px, 1e3 * report["rms_m"].get<double>(), report["frame"].get<std::string>(), p.x(),
      p.y(), p.z(), s.x(), s.y(), s.z(), q.w(), q.x(), q.y(), q.z(), r.x(), r.y(), r.z());
  std::cout << fmt::format(
      "the arm errs by {:.2g} mm and {:.2g}° along and about each axis (1 sigma)\n"
      "squares by the arm's motions: {:.4f} ± {:.2g} of what was said\n",
      1e3 * found.arm_sigma_m, found.arm_sigma_rad / kDegree, found.square_ratio,
      2.0 * found.square_ratio_sigma);
  for (const Json& each : report["rejected"]) {
    std::cout << fmt::format("rejected {}: {}\n", each["name"].get<std::string>(),
                             each["reason"].get<std::string>());
  }
  for (const Json& line : report["advice"])
    std::cout << "advice: " << line.get<std::string>() << '\n';
}

int hand_eye(const HandEyeOptions& options) {
  const vision::Board board = vision::parse_board(options.board, options.square_m);
  if (!board.has_a_beginning()) {
    throw ConfigError(fmt::format(
        "board: {} lies in the same way after half a turn; expected an odd and an even number of "
        "inner corners, as 9x6",
        options.board));
  }
  image::Rig rig = model::load_rig(options.rig);
  const image::RigCamera* named =
      options.camera.empty() ? &rig.cameras.front() : rig.find(options.camera);
  if (named == nullptr) throw ConfigError(options.rig + ": no camera '" + options.camera + "'");
  const image::Camera camera = named->camera;
  std::optional<kin::ArmModel> arm;
  if (!options.arm.empty()) arm = model::load_arm(options.arm);
  const ArmPoses poses =
      read_arm_poses(text_of(options.poses), options.poses, arm ? &*arm : nullptr);
  Seen seen = boards(board, camera, poses, options.poses);
  const auto on_arm = options.on_arm == "camera" ? vision::OnArm::camera : vision::OnArm::board;
  const auto found = vision::calibrate_hand_eye(board, camera.lens(), on_arm, std::move(seen.shots),
                                                poses.readings);
  if (!found) {
    for (const vision::Rejected& each : seen.rejected)
      std::cerr << "calibrate: " << each.name << ": " << each.reason << '\n';
    std::cerr << "calibrate: " << found.error().reason << '\n';
    return 1;
  }
  seen.rejected.insert(seen.rejected.end(), found->rejected.begin(), found->rejected.end());
  double away_m = 0.0;
  for (const vision::PoseFit& each : found->fits) away_m += each.distance_m;
  away_m /= static_cast<double>(found->fits.size());
  Json report = pose_report(*found, seen.rejected, options, away_m / camera.lens().fx_px);
  if (!options.out.empty()) {
    // The other cameras of the rig keep their places beside this one.
    const Eigen::Matrix3d R_NT = found->X_camera.linear() * camera.R_CT();
    for (image::RigCamera& c : rig.cameras) {
      const Vector3d eye = found->X_camera.translation() + R_NT * (c.camera.eye() - camera.eye());
      c.camera = image::Camera(c.camera.lens(), c.camera.R_CT() * R_NT.transpose(), eye);
    }
    rig.frame =
        on_arm == vision::OnArm::camera ? image::Rig::Frame::flange : image::Rig::Frame::base;
    rig.position_2sigma_m = 2.0 * found->position_sigma_m;
    rig.rotation_2sigma_rad = 2.0 * found->rotation_sigma_rad;
    write_rig(options.out, rig);
    report["file"] = options.out;
  }
  options.json ? void(std::cout << json_text(report) << '\n') : print_poses(*found, report);
  if (!options.json && !options.out.empty()) std::cout << "written: " << options.out << '\n';
  return 0;
}

}  // namespace

void add_hand_eye(CLI::App* calibrate, int& exit_code) {
  auto options = std::make_shared<HandEyeOptions>();
  CLI::App* verb = calibrate->add_subcommand(
      "hand-eye",
      "Places a camera on an arm that carries it, or before one that carries the board");
  verb->add_option("RIG", options->rig, "File that mono or stereo wrote")->required();
  verb->add_option("POSES", options->poses,
                   "Table (CSV) of pictures of the board and the arm's poses in them")
      ->required();
  verb->add_option("--on-arm", options->on_arm, "What the arm carries; the other one stands still")
      ->required()
      ->check(CLI::IsMember({"camera", "board"}));
  verb->add_option("--arm", options->arm,
                   "Arm's file: POSES has its joints, and its end effector is the flange");
  verb->add_option("--camera", options->camera, "Camera that took the pictures [the rig's first]")
      ->type_name("NAME");
  add_board(verb, *options);
  verb->add_option("-o,--out", options->out,
                   "Write the rig in the frame of the flange or of the arm's base to this file")
      ->type_name("FILE");
  verb->footer(
      "Exit codes: 0 done, 1 pictures and poses give no place of the camera, 2 usage.\n"
      "POSES begins with the names of its columns: file, x_m y_m z_m (or _mm), the place of the "
      "flange in the arm's base,\n"
      "and its turn: qw qx qy qz; or rotvec_x_rad rotvec_y_rad rotvec_z_rad (of UR: rx ry rz); or\n"
      "roll_rad pitch_rad yaw_rad; or a_deg b_deg c_deg (of KUKA). With --arm: file, A1_rad, "
      "A2_rad ...\n"
      "Examples:\n"
      "  mimesis calibrate hand-eye camera.yaml poses.csv --on-arm camera --square-m 0.025 -o "
      "hand.yaml\n"
      "  mimesis calibrate hand-eye camera.yaml joints.csv --on-arm board --arm lwr4.yaml "
      "--square-m 0.025");
  verb->callback([options, &exit_code] { exit_code = hand_eye(*options); });
}

}  // namespace mimesis::tool
