#include <assimp/anim.h>
#include <assimp/config.h>
#include <assimp/scene.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <vector>

#include "common/error.h"
#include "common/motion/mocap/clip_file.h"
#include "common/motion/mocap/readers.h"

namespace mimesis::mocap {
namespace {

constexpr double kLeastRate_hz = 30.0, kMostRate_hz = 1000.0;

[[noreturn]] void fail(const std::string& file, const std::string& what) {
  throw ConfigError(one_line(file + ": " + what));
}

Eigen::Vector3d vector_of(const aiVector3D& v) { return Eigen::Vector3d(v.x, v.y, v.z); }
Eigen::Quaterniond rotation_of(const aiQuaternion& q) {
  const Eigen::Quaterniond r(q.w, q.x, q.y, q.z);
  return r.norm() > 1e-6 ? r.normalized() : Eigen::Quaterniond::Identity();
}

/// A node of the scene, parents first.
struct Node {
  const aiNode* at = nullptr;
  int parent = -1;
  const aiNodeAnim* track = nullptr;
  bool joint = false;  ///< a bone, or animated
  int below = 0;       ///< joints in its tree, itself among them
};

const aiAnimation& choose_take(const std::string& file, const std::string& take,
                               const aiScene& scene) {
  std::vector<std::string> names;
  for (unsigned a = 0; a < scene.mNumAnimations; ++a) {
    names.emplace_back(scene.mAnimations[a]->mName.C_Str());
  }
  if (names.empty()) fail(file, "no animation, expected a motion");
  const auto found = take.empty() ? (names.size() == 1 ? names.begin() : names.end())
                                  : std::ranges::find(names, take);
  if (found == names.end()) {
    fail(file, fmt::format("{}: {}, expected one of them behind '#': FILE#NAME",
                           take.empty() ? fmt::format("{} animations", names.size())
                                        : "no animation '" + take + "'",
                           fmt::join(names, ", ")));
  }
  return *scene.mAnimations[found - names.begin()];
}

std::vector<Node> nodes_of(const aiScene& scene, const aiAnimation& take) {
  std::map<std::string, const aiNodeAnim*> tracks;
  for (unsigned c = 0; c < take.mNumChannels; ++c) {
    tracks[take.mChannels[c]->mNodeName.C_Str()] = take.mChannels[c];
  }
  std::set<std::string> bones;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    for (unsigned b = 0; b < scene.mMeshes[m]->mNumBones; ++b) {
      bones.insert(scene.mMeshes[m]->mBones[b]->mName.C_Str());
    }
  }
  std::vector<Node> nodes{{scene.mRootNode}};
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const std::string name = nodes[n].at->mName.C_Str();
    const auto track = tracks.find(name);
    nodes[n].track = track == tracks.end() ? nullptr : track->second;
    nodes[n].joint = nodes[n].track != nullptr || bones.contains(name);
    for (unsigned c = 0; c < nodes[n].at->mNumChildren; ++c) {
      nodes.push_back({nodes[n].at->mChildren[c], static_cast<int>(n)});
    }
  }
  for (std::size_t n = nodes.size(); n-- > 0;) {
    nodes[n].below += nodes[n].joint ? 1 : 0;
    if (nodes[n].parent >= 0)
      nodes[static_cast<std::size_t>(nodes[n].parent)].below += nodes[n].below;
  }
  return nodes;
}

// --- Tracks

/// The times [ticks] of a track's keys: the first, the last, and the closest that are usual.
struct Keys {
  double first = 0.0, last = 0.0, step = 0.0;
};

Keys keys_of(const std::string& file, const aiAnimation& take) {
  std::vector<double> densest;
  Keys keys{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  const auto add = [&](const auto* track, unsigned count) {
    std::vector<double> times;
    for (unsigned k = 0; k < count; ++k) {
      if (!std::isfinite(track[k].mTime)) fail(file, "a key at no time, expected a number");
      times.push_back(track[k].mTime);
    }
    if (times.empty()) return;
    keys.first = std::min(keys.first, *std::ranges::min_element(times));
    keys.last = std::max(keys.last, *std::ranges::max_element(times));
    if (times.size() > densest.size()) densest = std::move(times);
  };
  for (unsigned c = 0; c < take.mNumChannels; ++c) {
    const aiNodeAnim& track = *take.mChannels[c];
    add(track.mPositionKeys, track.mNumPositionKeys);
    add(track.mRotationKeys, track.mNumRotationKeys);
  }
  if (densest.size() < 2 || !(keys.last > keys.first)) {
    fail(file, fmt::format("animation '{}' has one frame, expected a motion", take.mName.C_Str()));
  }
  std::ranges::sort(densest);
  std::vector<double> steps;
  for (std::size_t k = 1; k < densest.size(); ++k) steps.push_back(densest[k] - densest[k - 1]);
  std::ranges::nth_element(steps, steps.begin() + static_cast<long>(steps.size() / 2));
  keys.step = steps[steps.size() / 2];
  return keys;
}

/// Value between the keys around `time`; the first or last one outside of them.
template <class Key, class Mix>
auto value_at(const Key* keys, unsigned count, double time, const Mix& mix) {
  unsigned low = 0, high = count - 1;
  if (time <= keys[low].mTime) return mix(keys[low], keys[low], 0.0);
  if (time >= keys[high].mTime) return mix(keys[high], keys[high], 0.0);
  while (high - low > 1) {
    const unsigned middle = (low + high) / 2;
    (keys[middle].mTime <= time ? low : high) = middle;
  }
  const double span = keys[high].mTime - keys[low].mTime;
  return mix(keys[low], keys[high], span > 0.0 ? (time - keys[low].mTime) / span : 0.0);
}

Eigen::Vector3d between(const aiVectorKey& a, const aiVectorKey& b, double share) {
  return (1.0 - share) * vector_of(a.mValue) + share * vector_of(b.mValue);
}

/// The transform of a node within its parent; with its track at `time`, or as it is without.
Eigen::Affine3d local(const Node& node, const double* time) {
  aiVector3D scale, place;
  aiQuaternion turn;
  node.at->mTransformation.Decompose(scale, turn, place);
  Eigen::Vector3d p = vector_of(place), s = vector_of(scale);
  Eigen::Quaterniond q = rotation_of(turn);
  const aiNodeAnim* track = node.track;
  if (time != nullptr && track != nullptr) {
    if (track->mNumPositionKeys > 0) {
      p = value_at(track->mPositionKeys, track->mNumPositionKeys, *time, between);
    }
    if (track->mNumRotationKeys > 0) {
      q = value_at(track->mRotationKeys, track->mNumRotationKeys, *time,
                   [](const aiQuatKey& a, const aiQuatKey& b, double share) {
                     return rotation_of(a.mValue).slerp(share, rotation_of(b.mValue));
                   });
    }
    if (track->mNumScalingKeys > 0) {
      s = value_at(track->mScalingKeys, track->mNumScalingKeys, *time, between);
    }
  }
  return Eigen::Translation3d(p) * q * Eigen::Scaling(s);
}

/// Where all nodes are, in the project's axes and the file's unit; without scale.
struct ScenePose {
  std::vector<Eigen::Vector3d> p;
  std::vector<Eigen::Matrix3d> R;
};

ScenePose pose_of(const std::vector<Node>& nodes, const double* time) {
  Eigen::Matrix3d axes;  // project from file
  axes << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  std::vector<Eigen::Affine3d> all(nodes.size());
  ScenePose pose{std::vector<Eigen::Vector3d>(nodes.size()),
                 std::vector<Eigen::Matrix3d>(nodes.size())};
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    all[n] = local(nodes[n], time);
    if (nodes[n].parent >= 0) all[n] = all[static_cast<std::size_t>(nodes[n].parent)] * all[n];
    Eigen::Matrix3d R = all[n].linear();
    for (int c = 0; c < 3; ++c) R.col(c) /= std::max(R.col(c).norm(), 1e-12);
    pose.p[n] = axes * all[n].translation();
    pose.R[n] = axes * Eigen::Quaterniond(R).normalized().toRotationMatrix() * axes.transpose();
  }
  return pose;
}

// --- Clip

struct Sampled {
  ScenePose rest;
  std::vector<ScenePose> frames;
  double rate_hz = 0.0;
};

/// The clip of the tree below node `root`, and where joints are within their parents.
std::pair<Clip, std::vector<Eigen::Matrix3Xd>> clip_below(const std::vector<Node>& nodes,
                                                          const Sampled& sampled,
                                                          std::size_t root) {
  std::vector<int> joint(nodes.size(), -1);
  std::vector<std::size_t> node;
  Clip clip;
  clip.rate_hz = sampled.rate_hz;
  for (std::size_t n = root; n < nodes.size(); ++n) {
    const int parent = n == root ? -1 : joint[static_cast<std::size_t>(nodes[n].parent)];
    if ((n != root && parent < 0) || (nodes[n].at->mNumMeshes > 0 && nodes[n].below == 0)) continue;
    joint[n] = static_cast<int>(node.size());
    node.push_back(n);
    clip.skeleton.joints.push_back({nodes[n].at->mName.C_Str(), parent});
  }
  const auto frames = static_cast<Eigen::Index>(sampled.frames.size());
  std::vector<Eigen::Matrix3Xd> positions(node.size(), Eigen::Matrix3Xd(3, frames));
  clip.rotation_rad.resize(3 * static_cast<Eigen::Index>(node.size()), frames);
  for (Eigen::Index t = 0; t < frames; ++t) {
    const ScenePose& pose = sampled.frames[static_cast<std::size_t>(t)];
    const auto turned = [&](std::size_t n) -> Eigen::Matrix3d {  // from the zero posture
      return pose.R[n] * sampled.rest.R[n].transpose();
    };
    for (std::size_t j = 0; j < node.size(); ++j) {
      const int parent = clip.skeleton.joints[j].parent;
      Eigen::Matrix3d R = turned(node[j]);
      if (parent < 0) {
        positions[j].col(t) = pose.p[node[j]];
      } else {
        const std::size_t up = node[static_cast<std::size_t>(parent)];
        const Eigen::Matrix3d R_up = turned(up).transpose();
        positions[j].col(t) = R_up * (pose.p[node[j]] - pose.p[up]);
        R = R_up * R;
      }
      put_rotation(clip.rotation_rad, static_cast<Eigen::Index>(j), t, Eigen::Quaterniond(R));
    }
  }
  clip.root_position_W_m = positions[0];
  for (std::size_t j = 1; j < node.size(); ++j)
    clip.skeleton.joints[j].offset_m = positions[j].col(0);
  return {std::move(clip), std::move(positions)};
}

/// Joints along the fullest branch, from above: the root of a person's skeleton, or above it.
std::vector<std::size_t> above_root(const std::vector<Node>& nodes) {
  constexpr int kLeast = 8;  // joints of a person
  std::vector<std::size_t> path;
  for (std::size_t n = 0; nodes[n].below >= kLeast;) {
    if (nodes[n].joint) path.push_back(n);
    std::size_t next = 0;
    for (std::size_t c = n + 1; c < nodes.size(); ++c) {
      if (nodes[c].parent != static_cast<int>(n)) continue;
      if (next == 0 || nodes[c].below > nodes[next].below) next = c;
    }
    if (next == 0) break;
    n = next;
  }
  return path;
}

std::size_t node_named(const std::vector<Node>& nodes, const std::string& name) {
  const auto found =
      std::ranges::find_if(nodes, [&](const Node& node) { return node.at->mName.C_Str() == name; });
  return static_cast<std::size_t>(found - nodes.begin());
}

/// The node that legs and trunk branch from: the map's root, or that of the map which is found.
/// None is found: the first joint of all.
std::size_t root_of(const std::string& file, const std::vector<Node>& nodes, const Sampled& sampled,
                    const ReadOptions& options) {
  if (options.map) {
    const std::string& name = options.map->joints[kRoot];
    const std::size_t root = node_named(nodes, name);
    if (root == nodes.size()) fail(file, "no joint '" + name + "' of the map (root)");
    return root;
  }
  const std::vector<std::size_t> path = above_root(nodes);
  if (path.empty()) fail(file, "no skeleton of 8 joints or more is animated, expected a person's");
  for (const std::size_t n : path) {
    const auto map = find_body_map(clip_below(nodes, sampled, n).first);
    if (map) return node_named(nodes, map->joints[kRoot]);
  }
  return path.front();
}

/// Length of the unit that the format means [m].
double usual_unit_m(const std::string& file, const aiScene& scene) {
  if (!same_word(std::filesystem::path(file).extension().string(), ".fbx")) return 1.0;
  float cm = 1.0f;
  if (scene.mMetaData != nullptr) scene.mMetaData->Get("UnitScaleFactor", cm);
  return cm > 0.0f && std::isfinite(cm) ? 0.01 * static_cast<double>(cm) : 0.01;
}

}  // namespace

Clip read_scene(const std::string& file, const std::string& take, const ReadOptions& options) {
  check_options(options);
  std::error_code error;
  const auto bytes = std::filesystem::file_size(file, error);
  if (error) fail(file, "cannot be read, expected a motion file");
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_PRESERVE_PIVOTS, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
  const aiScene* scene = importer.ReadFile(file, 0);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    fail(file, fmt::format("cannot be read: {}", importer.GetErrorString()));
  }
  const aiAnimation& animation = choose_take(file, take, *scene);
  const std::vector<Node> nodes = nodes_of(*scene, animation);
  const Keys keys = keys_of(file, animation);
  const double ticks = animation.mTicksPerSecond > 0.0 ? animation.mTicksPerSecond : 25.0;
  const double rate_hz =
      std::clamp(std::round(ticks / std::max(keys.step, 1e-9)), kLeastRate_hz, kMostRate_hz);
  const double count = std::floor((keys.last - keys.first) / ticks * rate_hz + 1e-3) + 1.0;
  if (!(count < 1e7))
    fail(file, fmt::format("an animation of {:.3g} frames, expected less than 1e7", count));
  check_clip_size(file, static_cast<std::size_t>(bytes), nodes.size(),
                  static_cast<std::size_t>(count));
  Sampled sampled{pose_of(nodes, nullptr), {}, rate_hz};
  for (double t = 0.0; t < count; ++t) {
    const double time = keys.first + t / rate_hz * ticks;
    sampled.frames.push_back(pose_of(nodes, &time));
    for (const Eigen::Vector3d& p : sampled.frames.back().p) {
      if (!p.allFinite()) fail(file, fmt::format("frame {}: a place that is no number", t + 1.0));
    }
  }
  auto chosen = clip_below(nodes, sampled, root_of(file, nodes, sampled, options));
  Clip& clip = chosen.first;
  clip.name = base_name(file) + (take.empty() ? "" : "#" + take);
  settle_clip(file, options, usual_unit_m(file, *scene), chosen.second, clip);
  return std::move(chosen.first);
}

}  // namespace mimesis::mocap
