#include "tools/mimesis/log/ros_messages.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <type_traits>
#include <utility>
#include <vector>

#include "proto/foxglove/image.pb.h"
#include "proto/foxglove/joint_states.pb.h"
#include "proto/foxglove/log.pb.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/foxglove/transform.pb.h"

namespace mimesis::tool {
namespace {

// --- CDR

/// Values one behind the other, each at a multiple of its size.
class CdrWriter {
 public:
  template <class T>
  void put(T value) {
    while ((bytes_.size() - kHead) % sizeof value != 0) bytes_ += '\0';
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void number(double value) { put(value); }
  void flag(bool value) { put<std::uint8_t>(value ? 1 : 0); }
  void length(std::size_t count) { put(static_cast<std::uint32_t>(count)); }
  void text(std::string_view value) {
    length(value.size() + 1);
    bytes_.append(value);
    bytes_ += '\0';
  }
  void bytes(std::string_view value) {
    length(value.size());
    bytes_.append(value);
  }
  template <class Values>
  void numbers(const Values& values) {
    length(static_cast<std::size_t>(std::distance(values.begin(), values.end())));
    for (const double value : values) number(value);
  }
  std::string take() { return std::move(bytes_); }

 private:
  static constexpr std::size_t kHead = 4;
  std::string bytes_ = std::string("\0\1\0\0", kHead);  // little endian
};

void put_time(CdrWriter& out, const google::protobuf::Timestamp& t) {
  out.put(static_cast<std::int32_t>(t.seconds()));
  out.put(static_cast<std::uint32_t>(t.nanos()));
}
void put_header(CdrWriter& out, const google::protobuf::Timestamp& t, std::string_view frame) {
  put_time(out, t);
  out.text(frame);
}
template <class Vector>
void put_vector(CdrWriter& out, const Vector& v) {
  for (const double x : {v.x(), v.y(), v.z()}) out.number(x);
}
/// ROS refuses a quaternion of zeros, which is what is not given here.
void put_quaternion(CdrWriter& out, const foxglove::Quaternion& q) {
  const bool none = q.x() == 0.0 && q.y() == 0.0 && q.z() == 0.0 && q.w() == 0.0;
  for (const double x : {q.x(), q.y(), q.z(), none ? 1.0 : q.w()}) out.number(x);
}
void put_pose(CdrWriter& out, const foxglove::Pose& pose) {
  put_vector(out, pose.position());
  put_quaternion(out, pose.orientation());
}
void put_color(CdrWriter& out, const foxglove::Color& c) {
  for (const double x : {c.r(), c.g(), c.b(), c.a()}) out.put(static_cast<float>(x));
}

void put(CdrWriter& out, const foxglove::RawImage& m) {
  put_header(out, m.timestamp(), m.frame_id());
  out.put<std::uint32_t>(m.height());
  out.put<std::uint32_t>(m.width());
  out.text(m.encoding());
  out.put<std::uint8_t>(0);
  out.put<std::uint32_t>(m.step());
  out.bytes(m.data());
}

void put(CdrWriter& out, const foxglove::CompressedImage& m) {
  put_header(out, m.timestamp(), m.frame_id());
  out.text(m.format());
  out.bytes(m.data());
}

void put(CdrWriter& out, const foxglove::CameraCalibration& m) {
  put_header(out, m.timestamp(), m.frame_id());
  out.put<std::uint32_t>(m.height());
  out.put<std::uint32_t>(m.width());
  out.text(m.distortion_model());
  out.numbers(m.d());
  const auto fixed = [&](const auto& values, int count) {
    for (int i = 0; i < count; ++i) out.number(i < values.size() ? values.Get(i) : 0.0);
  };
  fixed(m.k(), 9);
  fixed(m.r(), 9);
  fixed(m.p(), 12);
  out.put<std::uint32_t>(0);  // binning
  out.put<std::uint32_t>(0);
  for (int i = 0; i < 4; ++i) out.put<std::uint32_t>(0);  // region: the whole
  out.flag(false);
}

void put(CdrWriter& out, const foxglove::JointStates& m) {
  put_header(out, m.timestamp(), "");
  out.length(static_cast<std::size_t>(m.joints_size()));
  for (const foxglove::JointState& joint : m.joints()) out.text(joint.name());
  // a list is of all joints, or empty
  const auto list = [&](bool (foxglove::JointState::*has)() const,
                        double (foxglove::JointState::*value)() const) {
    const bool all = std::ranges::all_of(m.joints(), [&](const auto& j) { return (j.*has)(); });
    out.length(all ? static_cast<std::size_t>(m.joints_size()) : 0);
    for (const foxglove::JointState& joint : m.joints()) {
      if (all) out.number((joint.*value)());
    }
  };
  list(&foxglove::JointState::has_position, &foxglove::JointState::position);
  list(&foxglove::JointState::has_velocity, &foxglove::JointState::velocity);
  list(&foxglove::JointState::has_effort, &foxglove::JointState::effort);
}

void put_transform(CdrWriter& out, const foxglove::FrameTransform& t) {
  put_header(out, t.timestamp(), t.parent_frame_id());
  out.text(t.child_frame_id());
  put_vector(out, t.translation());
  put_quaternion(out, t.rotation());
}
void put(CdrWriter& out, const foxglove::FrameTransform& m) {
  out.length(1);
  put_transform(out, m);
}
void put(CdrWriter& out, const foxglove::FrameTransforms& m) {
  out.length(static_cast<std::size_t>(m.transforms_size()));
  for (const foxglove::FrameTransform& t : m.transforms()) put_transform(out, t);
}

void put(CdrWriter& out, const foxglove::PoseInFrame& m) {
  put_header(out, m.timestamp(), m.frame_id());
  put_pose(out, m.pose());
}

void put(CdrWriter& out, const foxglove::Log& m) {
  constexpr std::array<std::uint8_t, 6> kLevels{20, 10, 20, 30, 40, 50};
  put_time(out, m.timestamp());
  out.put(kLevels[static_cast<std::size_t>(std::clamp<int>(m.level(), 0, 5))]);
  out.text(m.name());
  out.text(m.message());
  out.text(m.file());
  out.text("");
  out.put<std::uint32_t>(m.line());
}

// --- Markers

/// Types of markers, by their numbers in ROS.
enum class Shape : std::int32_t {
  arrow,
  cube,
  sphere,
  cylinder,
  line_strip,
  line_list,
  text = 9,
  triangles = 11
};

/// A marker of ROS with what ours have.
struct Marker {
  Shape shape = Shape::cube;
  foxglove::Pose pose;
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  foxglove::Color color;
  std::vector<foxglove::Point3> points{};
  std::vector<foxglove::Color> colors{};
  std::string words{};
};

enum class Action : std::int32_t { add = 0, remove = 2, remove_all = 3 };

void put_marker(CdrWriter& out, const foxglove::SceneEntity& entity, int id, Action action,
                const Marker& m) {
  put_header(out, entity.timestamp(), entity.frame_id());
  out.text(entity.id());
  out.put(static_cast<std::int32_t>(id));
  out.put(static_cast<std::int32_t>(m.shape));
  out.put(static_cast<std::int32_t>(action));
  put_pose(out, m.pose);
  for (int k = 0; k < 3; ++k) out.number(m.scale[k]);
  put_color(out, m.color);
  out.put(static_cast<std::int32_t>(entity.lifetime().seconds()));
  out.put(static_cast<std::uint32_t>(entity.lifetime().nanos()));
  out.flag(entity.frame_locked());
  out.length(m.points.size());
  for (const foxglove::Point3& p : m.points) put_vector(out, p);
  out.length(m.colors.size());
  for (const foxglove::Color& c : m.colors) put_color(out, c);
  out.text("");  // texture and what belongs to it
  put_header(out, {}, "");
  out.text("");
  out.length(0);
  out.length(0);
  out.text(m.words);
  out.text("");  // mesh and its file
  out.text("");
  out.length(0);
  out.flag(false);
}

/// The points that indices name, or all.
template <class Primitive>
void add_points(const Primitive& from, Marker& marker) {
  const auto add = [&](int i) {
    if (i >= from.points_size()) return;
    marker.points.push_back(from.points(i));
    if (i < from.colors_size()) marker.colors.push_back(from.colors(i));
  };
  for (const std::uint32_t i : from.indices()) add(static_cast<int>(std::min(i, 0x7fffffffu)));
  for (int i = 0; from.indices_size() == 0 && i < from.points_size(); ++i) add(i);
  if (marker.colors.size() != marker.points.size()) marker.colors.clear();
}

std::vector<Marker> markers_of(const foxglove::SceneEntity& entity) {
  std::vector<Marker> markers;
  const auto solid = [&](Shape shape, const auto& all) {
    for (const auto& p : all) {
      markers.push_back({shape, p.pose(), {p.size().x(), p.size().y(), p.size().z()}, p.color()});
    }
  };
  for (const foxglove::ArrowPrimitive& p : entity.arrows()) {
    const double length = p.shaft_length() + p.head_length();
    markers.push_back(
        {Shape::arrow, p.pose(), {length, p.shaft_diameter(), p.shaft_diameter()}, p.color()});
  }
  solid(Shape::cube, entity.cubes());
  solid(Shape::sphere, entity.spheres());
  solid(Shape::cylinder, entity.cylinders());
  for (const foxglove::LinePrimitive& p : entity.lines()) {
    constexpr double kPixel_m = 0.002;  // ROS has no lines in pixels
    Marker line{
        p.type() == foxglove::LinePrimitive::LINE_LIST ? Shape::line_list : Shape::line_strip,
        p.pose(), Eigen::Vector3d::Constant(0.0), p.color()};
    line.scale.x() = p.thickness() * (p.scale_invariant() ? kPixel_m : 1.0);
    add_points(p, line);
    if (p.type() == foxglove::LinePrimitive::LINE_LOOP && !line.points.empty()) {
      line.points.push_back(line.points.front());
      if (!line.colors.empty()) line.colors.push_back(line.colors.front());
    }
    markers.push_back(std::move(line));
  }
  for (const foxglove::TriangleListPrimitive& p : entity.triangles()) {
    Marker mesh{Shape::triangles, p.pose(), Eigen::Vector3d::Ones(), p.color()};
    add_points(p, mesh);
    markers.push_back(std::move(mesh));
  }
  for (const foxglove::TextPrimitive& p : entity.texts()) {
    Marker words{Shape::text, p.pose(), {0.0, 0.0, p.font_size()}, p.color()};
    words.words = p.text();
    markers.push_back(std::move(words));
  }
  return markers;
}

/// An entity is replaced as a whole: markers that it had and has no more are removed.
void put_scene(CdrWriter& out, const foxglove::SceneUpdate& m,
               std::map<std::string, int>& markers_of_entity) {
  struct One {
    foxglove::SceneEntity entity;  ///< without its primitives
    int id;
    Action action;
    Marker marker;
  };
  std::vector<One> all;
  const auto add = [&](const google::protobuf::Timestamp& t, const std::string& name, int id,
                       Action action) {
    foxglove::SceneEntity entity;
    *entity.mutable_timestamp() = t;
    entity.set_id(name);
    all.push_back({std::move(entity), id, action, {}});
  };
  for (const foxglove::SceneEntityDeletion& d : m.deletions()) {
    if (d.type() == foxglove::SceneEntityDeletion::ALL) {
      markers_of_entity.clear();
      add(d.timestamp(), "", 0, Action::remove_all);
      continue;
    }
    for (int id = 0; id < markers_of_entity[d.id()]; ++id) {
      add(d.timestamp(), d.id(), id, Action::remove);
    }
    markers_of_entity.erase(d.id());
  }
  for (const foxglove::SceneEntity& entity : m.entities()) {
    const std::vector<Marker> markers = markers_of(entity);
    foxglove::SceneEntity head = entity;
    head.clear_cubes();
    head.clear_spheres();
    head.clear_cylinders();
    head.clear_arrows();
    head.clear_lines();
    head.clear_triangles();
    head.clear_texts();
    head.clear_models();
    int id = 0;
    for (const Marker& marker : markers) all.push_back({head, id++, Action::add, marker});
    int& before = markers_of_entity[entity.id()];
    for (int gone = id; gone < before; ++gone) {
      add(entity.timestamp(), entity.id(), gone, Action::remove);
    }
    before = id;
  }
  out.length(all.size());
  for (const One& one : all) put_marker(out, one.entity, one.id, one.action, one.marker);
}

// --- Types

/// A message of ROS 2 as its package defines it, without constants and comments.
struct Definition {
  std::string_view name, fields;
  std::array<std::string_view, 9> uses{};
};
constexpr std::array kDefinitions{
    Definition{"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"},
    Definition{"builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n"},
    Definition{"std_msgs/Header",
               "builtin_interfaces/Time stamp\nstring frame_id\n",
               {"builtin_interfaces/Time"}},
    Definition{"std_msgs/ColorRGBA", "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n"},
    Definition{"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    Definition{"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    Definition{"geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"},
    Definition{"geometry_msgs/Pose",
               "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
               {"geometry_msgs/Point", "geometry_msgs/Quaternion"}},
    Definition{"geometry_msgs/PoseStamped",
               "std_msgs/Header header\ngeometry_msgs/Pose pose\n",
               {"std_msgs/Header", "geometry_msgs/Pose"}},
    Definition{"geometry_msgs/Transform",
               "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
               {"geometry_msgs/Vector3", "geometry_msgs/Quaternion"}},
    Definition{"geometry_msgs/TransformStamped",
               "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
               {"std_msgs/Header", "geometry_msgs/Transform"}},
    Definition{"tf2_msgs/TFMessage",
               "geometry_msgs/TransformStamped[] transforms\n",
               {"geometry_msgs/TransformStamped"}},
    Definition{"sensor_msgs/Image",
               "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 "
               "is_bigendian\nuint32 step\nuint8[] data\n",
               {"std_msgs/Header"}},
    Definition{"sensor_msgs/CompressedImage",
               "std_msgs/Header header\nstring format\nuint8[] data\n",
               {"std_msgs/Header"}},
    Definition{"sensor_msgs/RegionOfInterest",
               "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"},
    Definition{"sensor_msgs/CameraInfo",
               "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\n"
               "float64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 "
               "binning_y\nsensor_msgs/RegionOfInterest roi\n",
               {"std_msgs/Header", "sensor_msgs/RegionOfInterest"}},
    Definition{"sensor_msgs/JointState",
               "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
               "float64[] effort\n",
               {"std_msgs/Header"}},
    Definition{"rcl_interfaces/Log",
               "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\n"
               "string function\nuint32 line\n",
               {"builtin_interfaces/Time"}},
    Definition{"visualization_msgs/UVCoordinate", "float32 u\nfloat32 v\n"},
    Definition{"visualization_msgs/MeshFile", "string filename\nuint8[] data\n"},
    Definition{
        "visualization_msgs/Marker",
        "std_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\n"
        "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\n"
        "builtin_interfaces/Duration lifetime\nbool frame_locked\n"
        "geometry_msgs/Point[] points\nstd_msgs/ColorRGBA[] colors\nstring "
        "texture_resource\nsensor_msgs/CompressedImage texture\n"
        "visualization_msgs/UVCoordinate[] uv_coordinates\nstring text\nstring "
        "mesh_resource\nvisualization_msgs/MeshFile mesh_file\nbool "
        "mesh_use_embedded_materials\n",
        {"std_msgs/Header", "geometry_msgs/Pose", "geometry_msgs/Vector3", "std_msgs/ColorRGBA",
         "builtin_interfaces/Duration", "geometry_msgs/Point", "sensor_msgs/CompressedImage",
         "visualization_msgs/UVCoordinate", "visualization_msgs/MeshFile"}},
    Definition{"visualization_msgs/MarkerArray",
               "visualization_msgs/Marker[] markers\n",
               {"visualization_msgs/Marker"}}};

using Scene = std::map<std::string, int>;

template <class Message>
tl::expected<std::string, Status> convert(std::string_view payload, Scene& scene) {
  Message message;
  if (!message.ParseFromArray(payload.data(), static_cast<int>(payload.size()))) {
    return tl::unexpected(Status{"no valid message"});
  }
  CdrWriter out;
  if constexpr (std::is_same_v<Message, foxglove::SceneUpdate>) {
    put_scene(out, message, scene);
  } else {
    put(out, message);
  }
  return out.take();
}

struct Equivalent {
  std::string_view type, ros;
  tl::expected<std::string, Status> (*convert)(std::string_view payload, Scene& scene);
};
constexpr std::array kEquivalents{
    Equivalent{"foxglove.RawImage", "sensor_msgs/msg/Image", convert<foxglove::RawImage>},
    Equivalent{"foxglove.CompressedImage", "sensor_msgs/msg/CompressedImage",
               convert<foxglove::CompressedImage>},
    Equivalent{"foxglove.CameraCalibration", "sensor_msgs/msg/CameraInfo",
               convert<foxglove::CameraCalibration>},
    Equivalent{"foxglove.JointStates", "sensor_msgs/msg/JointState",
               convert<foxglove::JointStates>},
    Equivalent{"foxglove.FrameTransform", "tf2_msgs/msg/TFMessage",
               convert<foxglove::FrameTransform>},
    Equivalent{"foxglove.FrameTransforms", "tf2_msgs/msg/TFMessage",
               convert<foxglove::FrameTransforms>},
    Equivalent{"foxglove.PoseInFrame", "geometry_msgs/msg/PoseStamped",
               convert<foxglove::PoseInFrame>},
    Equivalent{"foxglove.Log", "rcl_interfaces/msg/Log", convert<foxglove::Log>},
    Equivalent{"foxglove.SceneUpdate", "visualization_msgs/msg/MarkerArray",
               convert<foxglove::SceneUpdate>}};

const Equivalent* equivalent(std::string_view type) {
  const auto* found = std::ranges::find(kEquivalents, type, &Equivalent::type);
  return found == kEquivalents.end() ? nullptr : found;
}

}  // namespace

std::string ros_type(std::string_view type) {
  const Equivalent* found = equivalent(type);
  return found == nullptr ? "" : std::string(found->ros);
}

std::string ros_definition(const std::string& ros_type) {
  const std::size_t part = ros_type.find("/msg/");
  std::vector<std::string> names{ros_type.substr(0, part) + ros_type.substr(part + 4)};
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {  // those that it uses, each once
    const auto* definition = std::ranges::find(kDefinitions, names[i], &Definition::name);
    if (i > 0) text += std::string(80, '=') + "\nMSG: " + names[i] + '\n';
    text += definition->fields;
    for (const std::string_view used : definition->uses) {
      if (!used.empty() && std::ranges::find(names, used) == names.end()) names.emplace_back(used);
    }
  }
  return text;
}

tl::expected<std::string, Status> ToRos::convert(std::string_view type, std::string_view payload) {
  const Equivalent* found = equivalent(type);
  if (found == nullptr) return tl::unexpected(Status{"ROS has no " + std::string(type)});
  return found->convert(payload, scene_);
}

}  // namespace mimesis::tool
