#include "experiments/walk/mujoco/mujoco_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/robot/dynamics.h"

namespace mimesis::walk {
namespace {

using hw::sim::BodyOptions;
using hw::sim::MotorModel;

constexpr double kHalfSole_m = 0.02;
// Contacts. A foot that lands at 0.1 m/s sinks in by less than 0.2 mm (v·τ/e, critically damped) at
// τ = 5 ms, a walker's tick and five of our steps, of which MuJoCo asks two at least; standing it
// sinks in by micrometres. Elliptic cones, because pyramids have a friction that depends on the
// direction; friction ten times as stiff as the normal force, else standing soles creep.
constexpr const char* kContact = "solref=\"0.005 1\" solimp=\"0.99 0.99 0.001\"";
constexpr const char* kOption = "integrator=\"implicitfast\" cone=\"elliptic\" impratio=\"10\"";

std::string text(const Eigen::Vector3d& v) { return fmt::format("{} {} {}", v.x(), v.y(), v.z()); }

std::string place(const Eigen::Isometry3d& X) {
  const Eigen::Quaterniond q(X.linear());
  return fmt::format("pos=\"{}\" quat=\"{} {} {} {}\"", text(X.translation()), q.w(), q.x(), q.y(),
                     q.z());
}

/// Writes the XML from the outside in, and counts the measures.
class Writer {
 public:
  Writer(const robot::Biped& biped, const BodyOptions& options)
      : biped_(biped), links_(biped.tree.links()), options_(options) {
    X_WG_.linear() = (Eigen::AngleAxisd(options.slope_rad.x(), Eigen::Vector3d::UnitY()) *
                      Eigen::AngleAxisd(options.slope_rad.y(), Eigen::Vector3d::UnitX()))
                         .toRotationMatrix();
  }

  MujocoModel write() {
    model_.motors = hw::sim::motor_models(biped_, options_);
    model_.body.resize(links_.size());
    add("<mujoco>\n<compiler angle=\"radian\" inertiafromgeom=\"false\"/>\n"
        "<option timestep=\"{}\" gravity=\"0 0 {}\" {}><flag autoreset=\"disable\"/></option>\n"
        "<default><geom friction=\"{} 0 0\" {}/></default>\n<worldbody>\n",
        options_.dt_s, -robot::kGravity, kOption, options_.friction, kContact);
    ground();
    body(0);
    add("</worldbody>\n");
    motors();
    measures();
    start();
    add("</mujoco>\n");
    return std::move(model_);
  }

 private:
  template <class... Values>
  void add(fmt::format_string<Values...> format, Values&&... values) {
    fmt::format_to(std::back_inserter(model_.xml), format, std::forward<Values>(values)...);
  }

  /// Soles touch the ground, and nothing else.
  void ground() {
    constexpr const char* kGround = "contype=\"1\" conaffinity=\"0\"";
    add("<geom type=\"plane\" size=\"0 0 1\" {} {}/>\n", place(X_WG_), kGround);
    for (const hw::sim::Plate& plate : options_.plates) {
      const double half = 0.5 * plate.height_m;
      const Eigen::Vector3d center(plate.center_W_m.x(), plate.center_W_m.y(), half);
      add("<geom type=\"box\" size=\"{} {} {}\" {} {}/>\n", plate.half_m.x(), plate.half_m.y(),
          half, place(X_WG_ * Eigen::Translation3d(center)), kGround);
    }
  }

  void body(int index) {
    model_.body[static_cast<std::size_t>(index)] = bodies_++;  // depth first
    const robot::Link& link = links_[static_cast<std::size_t>(index)];
    add("<body name=\"{}\" {}>\n", link.name,
        place(link.parent < 0 ? X_WG_ * biped_.X_WB_half_sitting : link.X_PJ));
    if (link.parent < 0) add("<freejoint/>\n");
    if (link.dof >= 0) joint(link);
    inertia(link, index == biped_.trunk ? options_.payload_kg : 0.0);
    for (const robot::Biped::Leg& leg : biped_.leg) {
      if (leg.sole == index) sole(link, leg);
    }
    for (int child = index + 1; child < static_cast<int>(links_.size()); ++child) {
      if (links_[static_cast<std::size_t>(child)].parent == index) body(child);
    }
    add("</body>\n");
  }

  void joint(const robot::Link& link) {
    add("<joint name=\"{}\" type=\"{}\" axis=\"{}\"", link.joint,
        link.type == robot::JointType::prismatic ? "slide" : "hinge", text(link.axis));
    if (std::isfinite(link.lower) && std::isfinite(link.upper)) {
      add(" limited=\"true\" range=\"{} {}\" solreflimit=\"0.005 1\"", link.lower, link.upper);
    }
    add("/>\n");
  }

  void inertia(const robot::Link& link, double payload_kg) {
    const double mass = link.inertia.mass_kg + payload_kg;
    if (mass <= 0.0) return;
    const Eigen::Matrix3d& I = link.inertia.about_com_kg_m2;
    add("<inertial pos=\"{}\" mass=\"{}\" fullinertia=\"{} {} {} {} {} {}\"/>\n",
        text(link.inertia.com_m), mass, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
  }

  void sole(const robot::Link& link, const robot::Biped::Leg& leg) {
    const Eigen::Vector2d half = 0.5 * (leg.max_S_m - leg.min_S_m),
                          middle = 0.5 * (leg.max_S_m + leg.min_S_m);
    add("<geom name=\"{}\" type=\"box\" size=\"{} {} {}\" pos=\"{} {} {}\" contype=\"0\" "
        "conaffinity=\"1\"/>\n",
        link.name, half.x(), half.y(), kHalfSole_m, middle.x(), middle.y(), kHalfSole_m);
  }

  /// A spring is a force that MuJoCo knows how to integrate. A servo is a constraint beside the
  /// contacts: its acceleration takes the joint to the servo's speed within a step. As a force it
  /// would be stiffer than a step allows.
  void motors() {
    add("<actuator>\n");
    for (int i = 0; i < biped_.tree.dof(); ++i) {
      const MotorModel& motor = model_.motors[static_cast<std::size_t>(i)];
      (motor.servo ? model_.servos : model_.springs).push_back(i);
      if (motor.servo) continue;
      add("<position joint=\"{}\" kp=\"{}\" kv=\"{}\"", biped_.tree.moved(i).joint,
          motor.stiffness_n_m_rad, motor.damping_n_m_s_rad);
      if (std::isfinite(motor.torque_n_m)) {
        add(" forcelimited=\"true\" forcerange=\"{} {}\"", -motor.torque_n_m, motor.torque_n_m);
      }
      add("/>\n");
    }
    add("</actuator>\n<equality>\n");
    for (const int i : model_.servos) {
      add("<joint joint1=\"{}\" polycoef=\"{} 0 0 0 0\" solref=\"{} {}\" solimp=\"0.9999 0.9999 "
          "0.001\"/>\n",
          biped_.tree.moved(i).joint, biped_.half_sitting[i],
          -hw::sim::kServoGain_1_s / options_.dt_s, -1.0 / options_.dt_s);
    }
    add("</equality>\n");
    if (model_.servos.empty()) return;
    add("<custom><numeric name=\"torques\" data=\"");
    for (const int i : model_.servos) {
      add("{} ", std::min(model_.motors[static_cast<std::size_t>(i)].torque_n_m, 1e9));
    }
    add("\"/></custom>\n");
  }

  void measures() {
    const std::string& root = links_.front().name;
    Eigen::Index at = 0;
    add("<sensor>\n");
    for (const auto& [kind, first] : {std::pair{"jointpos", &model_.q},
                                      {"jointvel", &model_.dq},
                                      {"jointactuatorfrc", &model_.torque}}) {
      *first = at;
      for (int i = 0; i < biped_.tree.dof(); ++i, ++at) {
        add("<{} joint=\"{}\"/>\n", kind, biped_.tree.moved(i).joint);
      }
    }
    model_.poses = at;
    for (const robot::Link& link : links_) {
      for (const char* kind : {"framepos", "framequat"}) {
        add("<{} objtype=\"xbody\" objname=\"{}\"/>\n", kind, link.name);
      }
      at += MujocoModel::kPose;
    }
    model_.imu = at;
    add("<framelinvel objtype=\"xbody\" objname=\"{}\"/>\n", biped_.tree.link(biped_.imu).name);
    model_.com = at += 3;
    add("<subtreecom body=\"{}\"/>\n<subtreelinvel body=\"{}\"/>\n", root, root);
    model_.contacts = at += 6;
    for (const robot::Biped::Leg& leg : biped_.leg) {
      add("<contact geom2=\"{}\" data=\"force torque pos\" reduce=\"netforce\"/>\n",
          biped_.tree.link(leg.sole).name);
    }
    add("</sensor>\n");
    model_.servo_torque = at += 2 * MujocoModel::kContact;
    model_.end = at + static_cast<Eigen::Index>(model_.servos.size());
  }

  void start() {
    const Eigen::Isometry3d X_WB = X_WG_ * biped_.X_WB_half_sitting;
    const Eigen::Quaterniond q(X_WB.linear());
    add("<keyframe><key qpos=\"{} {} {} {} {} {}\"/></keyframe>\n", text(X_WB.translation()), q.w(),
        q.x(), q.y(), q.z(), fmt::join(biped_.half_sitting, " "));
  }

  const robot::Biped& biped_;
  const std::vector<robot::Link>& links_;
  const BodyOptions& options_;
  Eigen::Isometry3d X_WG_ = Eigen::Isometry3d::Identity();
  std::size_t bodies_ = 0;
  MujocoModel model_;
};

}  // namespace

MujocoModel make_mujoco_model(const robot::Biped& biped, const BodyOptions& options) {
  return Writer(biped, options).write();
}

}  // namespace mimesis::walk
