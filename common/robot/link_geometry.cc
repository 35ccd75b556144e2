#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string_view>

#include "common/error.h"
#include "common/robot/solids.h"
#include "common/robot/urdf_model.h"

namespace mimesis::robot {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

/// @throws ConfigError if there is no such file
fs::path mesh_path(const fs::path& beside, std::string name, const MeshPaths* paths) {
  for (const auto& [from, to] : paths != nullptr ? *paths : MeshPaths{}) {
    if (!name.starts_with(from)) continue;
    name.replace(0, from.size(), to);
    break;
  }
  constexpr std::string_view kPackage = "package://", kFile = "file://";
  const fs::path folder = fs::absolute(beside).parent_path();
  std::vector<fs::path> tried;
  if (name.starts_with(kPackage)) {
    name = name.substr(kPackage.size());
    for (fs::path around = folder;; around = around.parent_path()) {
      tried.push_back(around / name);
      if (around == around.root_path()) break;
    }
    const char* more = std::getenv("ROS_PACKAGE_PATH");
    std::istringstream folders(more ? more : "");
    for (std::string one; std::getline(folders, one, ':');) tried.push_back(fs::path(one) / name);
  } else {
    if (name.starts_with(kFile)) name = name.substr(kFile.size());
    tried.push_back(folder / name);
  }
  std::error_code ignored;
  for (const fs::path& path : tried)
    if (fs::is_regular_file(path, ignored)) return path;
  const std::string there = tried.size() == 1 ? "at " + tried.front().lexically_normal().string()
                                              : "in a folder around " + beside.filename().string() +
                                                    ", or in $ROS_PACKAGE_PATH";
  throw ConfigError("mesh '" + name + "' is not there, expected it " + there +
                    (paths != nullptr ? ", or mesh_paths that say where" : ""));
}

std::shared_ptr<const TriangleMesh> read_mesh(const fs::path& file, const Vector3d& scale) {
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const aiScene* scene =
      importer.ReadFile(file.string(), aiProcess_Triangulate | aiProcess_PreTransformVertices);
  if (scene == nullptr) {
    std::string begin(23, '\0');
    std::ifstream(file, std::ios::binary).read(begin.data(), std::ssize(begin));
    if (begin == "version https://git-lfs")
      throw ConfigError("mesh '" + file.string() +
                        "' is a pointer of Git LFS, expected the mesh itself: git lfs pull");
    std::error_code none;
    const bool header = fs::file_size(file, none) <= 84 && begin[0] == '\0';  // of an STL file
    if (header || std::string_view(importer.GetErrorString()).starts_with("No output meshes"))
      throw ConfigError("mesh '" + file.string() + "' has no triangles, expected some");
    throw ConfigError("mesh '" + file.string() + "': " + importer.GetErrorString() +
                      ", expected STL, OBJ or Collada");
  }
  std::vector<TriangleMesh::Triangle> triangles;
  for (const aiMesh* mesh : std::span(scene->mMeshes, scene->mNumMeshes)) {
    for (const aiFace& face : std::span(mesh->mFaces, mesh->mNumFaces)) {
      if (face.mNumIndices != 3) continue;  // points and lines
      TriangleMesh::Triangle triangle;
      for (unsigned i = 0; i < 3; ++i) {
        const aiVector3D& v = mesh->mVertices[face.mIndices[i]];
        triangle[i] = Vector3d(v.x, v.y, v.z).cwiseProduct(scale);
      }
      triangles.push_back(triangle);
    }
  }
  try {
    return std::make_shared<const TriangleMesh>(std::move(triangles));
  } catch (const ConfigError& e) {
    throw ConfigError("mesh '" + file.string() + "' " + e.what() + ", expected some");
  }
}

void check_sizes(const Vector3d& v, const std::string& what) {
  if (!v.allFinite() || !(v.minCoeff() > 0.0) || v.maxCoeff() > 100.0)
    throw ConfigError(what + ", expected lengths above 0, and below 100 m");
}

/// A box of size 0 0 0 marks a frame (Kinova's roots), a sphere of radius 0 a contact point (feet
/// in Drake's models): they hold nothing.
bool is_point(const urdf::Geometry& geometry) {
  const auto* box = dynamic_cast<const urdf::Box*>(&geometry);
  const auto* ball = dynamic_cast<const urdf::Sphere*>(&geometry);
  return (box != nullptr && vector_of(box->dim).isZero(0.0)) ||
         (ball != nullptr && ball->radius == 0.0);
}

Solid solid_of(const urdf::Pose& origin, const urdf::Geometry* geometry,
               const std::string& urdf_file, const MeshPaths& paths) {
  Solid solid{.X_LS = pose_of(origin)};
  if (!solid.X_LS.matrix().allFinite())
    throw ConfigError("origin of its geometry, expected finite numbers");
  if (const auto* box = dynamic_cast<const urdf::Box*>(geometry)) {
    solid.half_m = 0.5 * vector_of(box->dim);
    check_sizes(solid.half_m, "size of a box");
  } else if (const auto* ball = dynamic_cast<const urdf::Sphere*>(geometry)) {
    solid.kind = Solid::Kind::ball;
    solid.half_m.setConstant(ball->radius);
    check_sizes(solid.half_m, "radius of a sphere");
  } else if (const auto* rod = dynamic_cast<const urdf::Cylinder*>(geometry)) {
    solid.kind = Solid::Kind::cylinder;
    solid.half_m = {rod->radius, rod->radius, 0.5 * rod->length};
    check_sizes(solid.half_m, "radius or length of a cylinder");
  } else if (const auto* mesh = dynamic_cast<const urdf::Mesh*>(geometry)) {
    solid.kind = Solid::Kind::mesh;
    solid.mesh = load_mesh(urdf_file, mesh->filename, vector_of(mesh->scale), &paths);
  } else {
    throw ConfigError("its geometry, expected box, cylinder, sphere or mesh");
  }
  return solid;
}

}  // namespace

std::shared_ptr<const TriangleMesh> load_mesh(const std::string& beside, const std::string& name,
                                              const Vector3d& scale, const MeshPaths* paths) {
  check_sizes(scale.cwiseAbs(), "scale of a mesh");
  auto mesh = read_mesh(mesh_path(beside, name, paths), scale);
  check_sizes(Vector3d::Constant(mesh->box().sizes().maxCoeff()), "size of a mesh");
  return mesh;
}

std::map<std::string, LinkParts> link_parts(const std::string& urdf_file) {
  const auto model = parse_urdf(urdf_file);
  std::map<std::string, LinkParts> found;
  const auto any = [](const auto& parts) {
    return std::ranges::any_of(parts, [](const auto& part) {
      return !part || !part->geometry || !is_point(*part->geometry);
    });
  };
  for (const auto& [name, link] : model->links_)
    found[name] = {any(link->collision_array), any(link->visual_array)};
  return found;
}

std::map<std::string, std::vector<Solid>> link_solids(const std::string& urdf_file,
                                                      const std::vector<std::string>& links,
                                                      bool use_visual, const MeshPaths& paths) {
  const auto model = parse_urdf(urdf_file);
  std::map<std::string, std::vector<Solid>> solids;
  for (const std::string& name : links) {
    const auto link = model->getLink(name);
    if (link == nullptr) continue;
    const auto add = [&](const auto& parts) {
      for (const auto& part : parts) {
        if (!part || !part->geometry) throw ConfigError("it has no shape, expected a geometry");
        if (is_point(*part->geometry)) continue;
        solids[name].push_back(solid_of(part->origin, part->geometry.get(), urdf_file, paths));
      }
    };
    try {
      add(link->collision_array);
      if (solids[name].empty() && use_visual) add(link->visual_array);
    } catch (const ConfigError& e) {
      std::string what = urdf_file + ": link '" + name + "': " + e.what();
      for (char& c : what) c = c == '\n' || c == '\r' ? ' ' : c;
      throw ConfigError(what);
    }
  }
  return solids;
}

}  // namespace mimesis::robot
