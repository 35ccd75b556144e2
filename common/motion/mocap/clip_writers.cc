#include "common/motion/mocap/clip_writers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <vector>

#include "common/json_text.h"
#include "common/motion/mocap/readers.h"

namespace mimesis::mocap {
namespace {

using nlohmann::ordered_json;

/// In the order of BodyJoint.
constexpr std::array<const char*, kBodyJoints> kFileNames = {
    "Hips",        "LeftUpLeg", "LeftLeg",  "LeftFoot",     "RightUpLeg", "RightLeg",
    "RightFoot",   "Spine",     "Spine1",   "Neck",         "Head",       "LeftArm",
    "LeftForeArm", "LeftHand",  "RightArm", "RightForeArm", "RightHand"};

/// (x, y, z)_file = (y, z, x)_project: see from_file_axes().
Eigen::Vector3d to_file_axes(const Eigen::Vector3d& v) { return {v.y(), v.z(), v.x()}; }

/// Where a chain ends, in the frame of the joint that carries it; null: goes on, or has no end.
const Eigen::Vector3d* end_of(const Body& body, int joint) {
  switch (joint) {
    case kLeftAnkle:
      return &body.toe_m[kLeft];
    case kRightAnkle:
      return &body.toe_m[kRight];
    case kHead:
      return &body.head_top_m;
    case kLeftWrist:
      return &body.hand_m[kLeft];
    case kRightWrist:
      return &body.hand_m[kRight];
    default:
      return nullptr;
  }
}

std::vector<int> children_of(int joint) {
  std::vector<int> children;
  for (int j = 1; j < kBodyJoints; ++j) {
    if (kBodyParents[static_cast<std::size_t>(j)] == joint) children.push_back(j);
  }
  return children;
}

Eigen::Quaterniond rotation_in_file(const BodyClip& clip, int joint, Eigen::Index frame) {
  const Eigen::Vector3d v = to_file_axes(clip.angles_rad.block<3, 1>(3 * joint, frame));
  const double angle = v.norm();
  if (angle < 1e-12) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, v / angle));
}

// --- BVH

/// Of lengths [cm] or angles [degrees]: six digits, no "-0".
std::string numbers_of(const Eigen::Vector3d& v) {
  const auto rounded = [](double value) { return std::round(1e6 * value) / 1e6 + 0.0; };
  return fmt::format("{:.6f} {:.6f} {:.6f}", rounded(v.x()), rounded(v.y()), rounded(v.z()));
}

void write_joint(const Body& body, int joint, int depth, std::string& out) {
  const std::string indent(static_cast<std::size_t>(depth), '\t');
  const bool root = joint == kRoot;
  out += fmt::format("{}{} {}\n{}{{\n", indent, root ? "ROOT" : "JOINT",
                     kFileNames[static_cast<std::size_t>(joint)], indent);
  out +=
      fmt::format("{}\tOFFSET {}\n{}\tCHANNELS {}Zrotation Xrotation Yrotation\n", indent,
                  numbers_of(100.0 * to_file_axes(body.offset_m[static_cast<std::size_t>(joint)])),
                  indent, root ? "6 Xposition Yposition Zposition " : "3 ");
  for (const int child : children_of(joint)) write_joint(body, child, depth + 1, out);
  if (const Eigen::Vector3d* end = end_of(body, joint)) {
    out += fmt::format("{0}\tEnd Site\n{0}\t{{\n{0}\t\tOFFSET {1}\n{0}\t}}\n", indent,
                       numbers_of(100.0 * to_file_axes(*end)));
  }
  out += indent + "}\n";
}

/// Angles about z, then the turned x and y [degrees]: R = Rz Rx Ry.
Eigen::Vector3d zxy_degrees(const Eigen::Matrix3d& R) {
  const double x = std::asin(std::clamp(R(2, 1), -1.0, 1.0));
  Eigen::Vector3d zxy(0.0, x, 0.0);
  if (std::abs(R(2, 1)) < 1.0 - 1e-12) {
    zxy[0] = std::atan2(-R(0, 1), R(1, 1));
    zxy[2] = std::atan2(-R(2, 0), R(2, 2));
  } else {  // x by ±90°: z and y turn about one axis
    zxy[0] = std::atan2(R(1, 0), R(0, 0));
  }
  return zxy / kRadians;
}

/// Joints as the hierarchy names them: depth first.
void list_depth_first(int joint, std::vector<int>& out) {
  out.push_back(joint);
  for (const int child : children_of(joint)) list_depth_first(child, out);
}

// --- glTF

/// Numbers behind one another in the file's only buffer, and what they are.
class Buffer {
 public:
  /// Floats, `width` a piece ("SCALAR", "VEC3", "VEC4"). With its bounds, as the format wants them
  /// of times and positions.
  int add_floats(const std::vector<float>& values, int width, bool bounded) {
    ordered_json accessor = piece(values.data(), values.size() * sizeof(float));
    accessor["componentType"] = 5126;
    accessor["count"] = values.size() / static_cast<std::size_t>(width);
    accessor["type"] = width == 1 ? "SCALAR" : fmt::format("VEC{}", width);
    for (int k = 0; bounded && k < width; ++k) {
      float least = values[static_cast<std::size_t>(k)], most = least;
      for (std::size_t i = static_cast<std::size_t>(k); i < values.size();
           i += static_cast<std::size_t>(width)) {
        least = std::min(least, values[i]);
        most = std::max(most, values[i]);
      }
      accessor["min"].push_back(least);
      accessor["max"].push_back(most);
    }
    accessors.push_back(std::move(accessor));
    return static_cast<int>(accessors.size()) - 1;
  }

  std::string bytes;
  ordered_json views = ordered_json::array(), accessors = ordered_json::array();

 private:
  ordered_json piece(const void* data, std::size_t size) {
    static_assert(std::endian::native == std::endian::little, "glTF is little endian");
    views.push_back({{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", size}});
    bytes.append(static_cast<const char*>(data), size);
    return {{"bufferView", views.size() - 1}};
  }
};

/// A wedge of length 1 along y, thickest near its begin: triangles with a normal each.
int add_bone_mesh(Buffer& buffer, ordered_json& meshes) {
  constexpr float kWide = 0.5f, kAt = 0.2f;
  const std::array<Eigen::Vector3f, 6> p = {
      {{0, 0, 0}, {kWide, kAt, 0}, {0, kAt, -kWide}, {-kWide, kAt, 0}, {0, kAt, kWide}, {0, 1, 0}}};
  std::vector<float> positions, normals;
  const auto triangle = [&](std::size_t a, std::size_t b, std::size_t c) {
    const Eigen::Vector3f normal = (p[b] - p[a]).cross(p[c] - p[a]).normalized();
    for (const std::size_t corner : {a, b, c}) {
      positions.insert(positions.end(), p[corner].data(), p[corner].data() + 3);
      normals.insert(normals.end(), normal.data(), normal.data() + 3);
    }
  };
  for (std::size_t side = 0; side < 4; ++side) {
    const std::size_t a = 1 + side, b = 1 + (side + 1) % 4;
    triangle(0, b, a);
    triangle(5, a, b);
  }
  const ordered_json attributes = {{"POSITION", buffer.add_floats(positions, 3, true)},
                                   {"NORMAL", buffer.add_floats(normals, 3, false)}};
  const ordered_json primitive = {{"attributes", attributes}, {"material", 0}};
  meshes.push_back({{"name", "bone"}, {"primitives", ordered_json::array({primitive})}});
  return static_cast<int>(meshes.size()) - 1;
}

ordered_json json_of(const Eigen::Vector3d& v) {
  return ordered_json::array({v.x(), v.y(), v.z()});
}
ordered_json json_of(const Eigen::Quaterniond& q) {
  return ordered_json::array({q.x(), q.y(), q.z(), q.w()});
}

/// The wedge from a joint to `to` in its frame (axes of the file).
ordered_json bone_node(const std::string& name, const Eigen::Vector3d& to, int mesh) {
  constexpr double kSlender = 0.25, kThickest_m = 0.12;
  const double length = to.norm(), wide = std::min(kSlender * length, kThickest_m);
  const Eigen::Quaterniond turn(math::rotation_onto(Eigen::Vector3d::UnitY(), to));
  return {{"name", name + "_bone"},
          {"mesh", mesh},
          {"rotation", json_of(turn)},
          {"scale", json_of(Eigen::Vector3d(wide, length, wide))}};
}

struct Gltf {
  ordered_json nodes = ordered_json::array();
  std::array<int, kBodyJoints> node{};  // by joint
};

Gltf joint_nodes(const Body& body, int mesh) {
  constexpr double kShortest_m = 1e-3;
  Gltf out;
  for (int j = 0; j < kBodyJoints; ++j) {
    const auto at = static_cast<std::size_t>(j);
    out.node[at] = static_cast<int>(out.nodes.size());
    out.nodes.push_back({{"name", kFileNames[at]},
                         {"translation", json_of(to_file_axes(body.offset_m[at]))},
                         {"children", ordered_json::array()}});
    if (j > 0) {
      const int parent = out.node[static_cast<std::size_t>(kBodyParents[at])];
      out.nodes[static_cast<std::size_t>(parent)]["children"].push_back(out.node[at]);
    }
  }
  const auto add_bone = [&](int joint, const std::string& end, const Eigen::Vector3d& to_m) {
    if (to_m.norm() < kShortest_m) return;
    const auto parent = static_cast<std::size_t>(out.node[static_cast<std::size_t>(joint)]);
    out.nodes[parent]["children"].push_back(out.nodes.size());
    out.nodes.push_back(bone_node(end, to_file_axes(to_m), mesh));
  };
  for (int j = 0; j < kBodyJoints; ++j) {
    for (const int child : children_of(j)) {
      const auto at = static_cast<std::size_t>(child);
      add_bone(j, kFileNames[at], body.offset_m[at]);
    }
    const Eigen::Vector3d* end = end_of(body, j);
    if (end == nullptr) continue;
    const std::string name = kFileNames[static_cast<std::size_t>(j)] + std::string("_end");
    add_bone(j, name, *end);
    const auto parent = static_cast<std::size_t>(out.node[static_cast<std::size_t>(j)]);
    out.nodes[parent]["children"].push_back(out.nodes.size());
    out.nodes.push_back({{"name", name}, {"translation", json_of(to_file_axes(*end))}});
  }
  for (ordered_json& node : out.nodes) {
    if (node.contains("children") && node["children"].empty()) node.erase("children");
  }
  return out;
}

ordered_json animation_of(const BodyClip& clip, const Gltf& gltf, Buffer& buffer) {
  ordered_json samplers = ordered_json::array(), channels = ordered_json::array();
  std::vector<float> times;
  for (Eigen::Index t = 0; t < clip.frames(); ++t) {
    times.push_back(static_cast<float>(static_cast<double>(t) / clip.rate_hz));
  }
  const int input = buffer.add_floats(times, 1, true);
  const auto add = [&](int joint, const char* path, const std::vector<float>& keys, int width) {
    const ordered_json target = {{"node", gltf.node[static_cast<std::size_t>(joint)]},
                                 {"path", path}};
    channels.push_back({{"sampler", samplers.size()}, {"target", target}});
    samplers.push_back({{"input", input},
                        {"interpolation", "LINEAR"},
                        {"output", buffer.add_floats(keys, width, false)}});
  };
  std::vector<float> keys;
  for (Eigen::Index t = 0; t < clip.frames(); ++t) {
    const Eigen::Vector3f p = to_file_axes(clip.root_position_W_m.col(t)).cast<float>();
    keys.insert(keys.end(), p.data(), p.data() + 3);
  }
  add(kRoot, "translation", keys, 3);
  for (int j = 0; j < kBodyJoints; ++j) {
    keys.clear();
    Eigen::Vector4f last = Eigen::Vector4f::Zero();
    for (Eigen::Index t = 0; t < clip.frames(); ++t) {
      Eigen::Vector4f q = rotation_in_file(clip, j, t).coeffs().cast<float>();
      if (q.dot(last) < 0.0f) q = -q;  // the same rotation, the short way
      keys.insert(keys.end(), q.data(), q.data() + 4);
      last = q;
    }
    add(j, "rotation", keys, 4);
  }
  return {{"name", clip.name}, {"samplers", samplers}, {"channels", channels}};
}

void add_chunk(std::string chunk, std::uint32_t type, char pad, std::string& out) {
  chunk.resize((chunk.size() + 3) / 4 * 4, pad);
  const std::array<std::uint32_t, 2> head = {static_cast<std::uint32_t>(chunk.size()), type};
  out.append(reinterpret_cast<const char*>(head.data()), sizeof head);
  out += chunk;
}

}  // namespace

std::string bvh_text(const BodyClip& clip) {
  std::string out = "HIERARCHY\n";
  write_joint(clip.body, kRoot, 0, out);
  out += fmt::format("MOTION\nFrames: {}\nFrame Time: {:.9g}\n", clip.frames(), 1.0 / clip.rate_hz);
  std::vector<int> order;
  list_depth_first(kRoot, order);
  for (Eigen::Index t = 0; t < clip.frames(); ++t) {
    out += numbers_of(100.0 * to_file_axes(clip.root_position_W_m.col(t)));
    for (const int joint : order) {
      out += ' ' + numbers_of(zxy_degrees(rotation_in_file(clip, joint, t).toRotationMatrix()));
    }
    out += '\n';
  }
  return out;
}

std::string glb_bytes(const BodyClip& clip) {
  Buffer buffer;
  ordered_json meshes = ordered_json::array();
  const int mesh = add_bone_mesh(buffer, meshes);
  const Gltf gltf = joint_nodes(clip.body, mesh);
  const ordered_json animation = animation_of(clip, gltf, buffer);
  const ordered_json material = {{"name", "bone"},
                                 {"pbrMetallicRoughness",
                                  {{"baseColorFactor", ordered_json::array({0.8, 0.8, 0.75, 1.0})},
                                   {"metallicFactor", 0.0},
                                   {"roughnessFactor", 0.8}}}};
  const ordered_json scene = {{"nodes", ordered_json::array({gltf.node[kRoot]})}};
  const ordered_json only_buffer = {{"byteLength", buffer.bytes.size()}};
  const ordered_json document = {
      {"asset", {{"version", "2.0"}, {"generator", "mimesis motion export"}}},
      {"scene", 0},
      {"scenes", ordered_json::array({scene})},
      {"nodes", gltf.nodes},
      {"meshes", meshes},
      {"materials", ordered_json::array({material})},
      {"animations", ordered_json::array({animation})},
      {"accessors", buffer.accessors},
      {"bufferViews", buffer.views},
      {"buffers", ordered_json::array({only_buffer})}};
  std::string chunks;
  add_chunk(json_text(document), 0x4E4F534A, ' ', chunks);   // "JSON"
  add_chunk(buffer.bytes, 0x004E4942, '\0', chunks);         // "BIN"
  const std::array<std::uint32_t, 3> head = {0x46546C67, 2,  // "glTF"
                                             static_cast<std::uint32_t>(chunks.size() + 12)};
  return std::string(reinterpret_cast<const char*>(head.data()), sizeof head) + chunks;
}

}  // namespace mimesis::mocap
