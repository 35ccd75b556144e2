#pragma once
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "common/kin/arm.h"
#include "common/kin/table.h"
#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "common/time.h"
#include "nodes/camera/renderer.h"
#include "nodes/camera/robot_renderer.h"
#include "nodes/camera/source/source.h"
#include "proto/bridge.pb.h"
#include "proto/foxglove/image.pb.h"
#include "proto/scene.pb.h"
#include "proto/vision.pb.h"
#include "proto/world.pb.h"

namespace mimesis::camera {

struct CameraParams {
  double rate_hz = 30.0;            ///< rate of looking for frames [Hz]
  std::string source = "renderer";  ///< renderer (teacher), robot (rendered), v4l2, video, folder
  std::string path;                 ///< device, film or folder
  /// v4l2: layout of pixels; any: raw if the camera reaches rate_hz with it, else MJPG
  std::string format = "any";
  bool record_frames = false;    ///< v4l2: keeps the device's frames, for replays
  std::string light = "device";  ///< v4l2: exposure and white balance: device (as they are),
                                 ///< followed (automatic) or locked (a second after opening)
  std::string packed = "none";   ///< images are also told as: none, jpeg, png (lossless)
  int repeat = 1;                ///< number of demonstrations, or of passes of a film or folder [1]
  std::string teacher = "precision,above,high";  ///< renderer: grip,transport,goal
  std::string color = "light";                   ///< renderer: colour of the object
  std::string shown = "all";        ///< renderer: all, or grasp (the teacher stops after it)
  std::string scene = "usual";      ///< rendered: usual, or random (drawn with the seed)
  bool stereo = false;              ///< rendered: a second camera
  double baseline_m = 0.3;          ///< rendered: from the first camera to the second
  int seed = 1;                     ///< rendered: seed of noise, clutter and scene [1]
  std::string robot = "lwr4.yaml";  ///< robot: arm before the table, in models/
  std::vector<double> origin_m{0.52, 0.0, -0.01};  ///< robot: origin of frame T in W
  Picture picture;                                 ///< rendered: scene, light, view

  void visit(runtime::ParamVisitor& v);
};

/// Publishes images of a table; of a rendered one also the calibration of its cameras and a
/// lesson of its colours, of the teacher's the truth.
class CameraNode {
 public:
  using Params = CameraParams;
  CameraNode(const Params& params, runtime::Bus& bus);
  void step(runtime::Time now);
  void change(const Params& params);  ///< light and lens, from the next image on

 private:
  void step_rendered(runtime::Time now);
  void step_source(runtime::Time now);
  bool render_teacher(runtime::Time now);
  bool render_robot(runtime::Time now);
  void aim_at(const kin::Table& table, const Eigen::Vector3d& origin);
  void publish_first(runtime::Time stamp);
  void publish_truth(const Truth& truth, runtime::Time stamp);
  void send(const image::Image& image, std::size_t eye, runtime::Time stamp);
  bool rendered() const { return params_.source == "renderer" || params_.source == "robot"; }

  Params params_;
  Picture picture_;
  foxglove::RawImage message_;
  std::array<runtime::Out<foxglove::RawImage>, 2> images_;
  std::array<runtime::Out<foxglove::CompressedImage>, 2> packed_;
  runtime::Out<v1::CameraRig> rig_;
  runtime::Out<v1::ColorLesson> lesson_;
  runtime::Out<v1::TeacherScene> truth_;
  runtime::Latest<v1::Scene> scene_;
  runtime::Latest<v1::WorldState> state_;
  runtime::Latest<v1::JointState> arm_;
  runtime::PortsEnd ports_end_;

  std::unique_ptr<Source> source_;  ///< null if rendered
  std::vector<image::Camera> cameras_;
  std::vector<std::unique_ptr<Renderer>> teacher_;
  std::vector<std::unique_ptr<RobotRenderer>> robot_;
  kin::ArmModel arm_model_;
  std::optional<runtime::Time> start_;
  std::vector<image::Image> pictures_;  ///< of cameras_
  bool first_sent_ = false;
};

}  // namespace mimesis::camera
