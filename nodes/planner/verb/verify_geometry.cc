#include "nodes/planner/verb/verify_geometry.h"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>
#include <tinyxml.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>

#include "common/runtime/param_source.h"
#include "nodes/planner/verb/hulls_apart.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using Triangle = std::array<Vector3d, 3>;

constexpr double kSlack_m = 2e-5;  // of the file's digits
constexpr double kSmallest_m = 1e-3;
constexpr int kSides = 64;

/// What is wrong with an element; the link is said by the caller.
struct Unreadable : std::runtime_error {
  using std::runtime_error::runtime_error;
};

std::vector<double> numbers(const TiXmlElement* element, const char* attribute, std::size_t count,
                            double missing) {
  const char* text = element != nullptr ? element->Attribute(attribute) : nullptr;
  if (text == nullptr) return std::vector<double>(count, missing);
  std::istringstream in(text);
  std::vector<double> out;
  for (double v = 0.0; in >> v;) out.push_back(v);
  if (out.size() != count || !in.eof())
    throw Unreadable(fmt::format("{}=\"{}\", expected {} numbers", attribute, text, count));
  return out;
}

Eigen::Isometry3d pose(const TiXmlElement* origin) {
  const std::vector<double> xyz = numbers(origin, "xyz", 3, 0.0),
                            rpy = numbers(origin, "rpy", 3, 0.0);
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translate(Vector3d::Map(xyz.data()));
  X.rotate(Eigen::AngleAxisd(rpy[2], Vector3d::UnitZ()));
  X.rotate(Eigen::AngleAxisd(rpy[1], Vector3d::UnitY()));
  X.rotate(Eigen::AngleAxisd(rpy[0], Vector3d::UnitX()));
  return X;
}

using Renamed = std::vector<std::pair<std::string, std::string>>;

fs::path mesh_file(const fs::path& urdf, std::string name, const Renamed& renamed) {
  const auto known = std::ranges::find_if(
      renamed, [&name](const auto& begin) { return name.starts_with(begin.first); });
  if (known != renamed.end()) name = known->second + name.substr(known->first.size());
  constexpr std::string_view kPackage = "package://";
  if (name.starts_with(kPackage)) {
    name.erase(0, kPackage.size());
    std::vector<fs::path> roots;
    for (fs::path up = fs::absolute(urdf).parent_path(); up.has_relative_path();
         up = up.parent_path())
      roots.push_back(up);
    if (const char* path = std::getenv("ROS_PACKAGE_PATH")) {
      std::istringstream list(path);
      for (std::string root; std::getline(list, root, ':');) roots.emplace_back(root);
    }
    for (const fs::path& root : roots)
      if (fs::exists(root / name)) return root / name;
    throw Unreadable("mesh " + name + " is not there");
  }
  if (name.starts_with("file://")) name.erase(0, 7);
  return fs::absolute(urdf).parent_path() / name;
}

void add_mesh(const fs::path& file, const std::vector<double>& scale, std::vector<Triangle>& out) {
  Assimp::Importer reader;
  reader.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const aiScene* scene =
      reader.ReadFile(file.string(), aiProcess_PreTransformVertices | aiProcess_Triangulate);
  if (scene == nullptr) throw Unreadable("mesh " + file.string() + " cannot be read");
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& mesh = *scene->mMeshes[m];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      if (mesh.mFaces[f].mNumIndices != 3) continue;
      Triangle triangle;
      for (unsigned i = 0; i < 3; ++i) {
        const aiVector3D& v = mesh.mVertices[mesh.mFaces[f].mIndices[i]];
        triangle[i] = {scale[0] * static_cast<double>(v.x), scale[1] * static_cast<double>(v.y),
                       scale[2] * static_cast<double>(v.z)};
      }
      out.push_back(triangle);
    }
  }
}

/// Points on rings around z, stacked, as triangles: a cylinder of two rings, a ball of many.
void add_rings(const std::vector<std::pair<double, double>>& radius_and_z,
               std::vector<Triangle>& out) {
  const auto at = [](const std::pair<double, double>& ring, int i) {
    const double turn = 2.0 * M_PI * i / kSides;
    return Vector3d(ring.first * std::cos(turn), ring.first * std::sin(turn), ring.second);
  };
  for (std::size_t r = 0; r + 1 < radius_and_z.size(); ++r) {
    const auto &low = radius_and_z[r], &high = radius_and_z[r + 1];
    for (int i = 0; i < kSides; ++i) {
      out.push_back({at(low, i), at(low, i + 1), at(high, i)});
      out.push_back({at(high, i), at(low, i + 1), at(high, i + 1)});
    }
  }
}

/// In the frame of the shape.
std::vector<Triangle> surface(const TiXmlElement& geometry, const model::CoveredArm& arm) {
  std::vector<Triangle> out;
  if (const auto* box = geometry.FirstChildElement("box")) {
    const std::vector<double> size = numbers(box, "size", 3, NAN);
    if (std::ranges::count(size, 0.0) == 3) return out;  // marks a frame
    const double round = std::sqrt(0.5);                 // corners of a turned square
    std::vector<Triangle> rod;
    for (int i = 0; i < 4; ++i) {
      const auto at = [&](int k, double z) {
        const double turn = M_PI_2 * k + M_PI_4;
        return Vector3d(round * std::cos(turn) * size[0], round * std::sin(turn) * size[1],
                        z * size[2]);
      };
      rod.push_back({at(i, -0.5), at(i + 1, -0.5), at(i, 0.5)});
      rod.push_back({at(i, 0.5), at(i + 1, -0.5), at(i + 1, 0.5)});
    }
    return rod;
  }
  if (const auto* rod = geometry.FirstChildElement("cylinder")) {
    const double r = numbers(rod, "radius", 1, NAN)[0],
                 half = 0.5 * numbers(rod, "length", 1, NAN)[0];
    add_rings({{r, -half}, {r, half}}, out);
  } else if (const auto* ball = geometry.FirstChildElement("sphere")) {
    const double r = numbers(ball, "radius", 1, NAN)[0];
    if (r == 0.0) return out;  // marks a contact point
    std::vector<std::pair<double, double>> rings;
    for (int i = 0; i <= kSides / 2; ++i) {
      const double up = M_PI * (2.0 * i / kSides - 0.5);
      rings.emplace_back(r * std::cos(up), r * std::sin(up));
    }
    add_rings(rings, out);
  } else if (const auto* mesh = geometry.FirstChildElement("mesh")) {
    const char* name = mesh->Attribute("filename");
    if (name == nullptr) throw Unreadable("a mesh without filename");
    add_mesh(mesh_file(arm.urdf, name, arm.mesh_paths), numbers(mesh, "scale", 3, 1.0), out);
  } else {
    throw Unreadable("a geometry that is no box, cylinder, sphere or mesh");
  }
  if (out.empty()) throw Unreadable("a mesh without triangles");
  return out;
}

/// Whether p is in the rounded hull.
bool holds(const math::ConvexPart& part, const Vector3d& p) {
  const double reach = part.radius + kSlack_m;
  Vector3d normal = Vector3d::Zero();
  return hulls_apart(part.points.transpose(), p, reach, reach, normal).at_most <= reach;
}

class LinkCover {
 public:
  void add(const std::vector<math::ConvexPart>& parts) {
    for (const math::ConvexPart& part : parts) {
      const Vector3d out = Vector3d::Constant(part.radius + kSlack_m);
      boxes_.emplace_back(part.points.colwise().minCoeff().transpose() - out,
                          part.points.colwise().maxCoeff().transpose() + out);
      parts_.push_back(&part);
    }
  }
  bool empty() const { return parts_.empty(); }

  /// A point that is in no part, if there is one.
  std::optional<Vector3d> bare(const Triangle& triangle) const {
    std::vector<Triangle> open{triangle};
    while (!open.empty()) {
      const Triangle t = open.back();
      open.pop_back();
      if (std::ranges::any_of(parts_, [&](const auto& part) { return held(t, part); })) continue;
      std::size_t longest = 0;
      const auto edge = [&t](std::size_t i) { return (t[(i + 1) % 3] - t[i]).norm(); };
      for (const std::size_t i : {std::size_t{1}, std::size_t{2}})
        if (edge(i) > edge(longest)) longest = i;
      const Vector3d &a = t[longest], &b = t[(longest + 1) % 3], &c = t[(longest + 2) % 3];
      if (edge(longest) < kSmallest_m) {  // across the border of parts: each corner is in one
        for (const Vector3d& p : t)
          if (std::ranges::none_of(parts_, [&](const auto* part) { return holds(*part, p); }))
            return p;
        continue;
      }
      const Vector3d middle = 0.5 * (a + b);
      open.push_back({a, middle, c});
      open.push_back({middle, b, c});
    }
    return std::nullopt;
  }

 private:
  bool held(const Triangle& t, const math::ConvexPart* const& part) const {
    const auto& box = boxes_[static_cast<std::size_t>(&part - parts_.data())];
    return std::ranges::all_of(t, [&](const Vector3d& p) { return box.contains(p); }) &&
           std::ranges::all_of(t, [&](const Vector3d& p) { return holds(*part, p); });
  }

  std::vector<const math::ConvexPart*> parts_;
  std::vector<Eigen::AlignedBox3d> boxes_;
};

/// Names of the base, of what is fixed to it, and of the links behind the first joint that moves
/// between it and the tip.
std::set<std::string> judged_links(const TiXmlElement& robot, const std::string& base,
                                   const std::string& tip) {
  struct Joint {
    std::string parent, type;
  };
  std::map<std::string, Joint> carrier;  // of a link
  for (auto* joint = robot.FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    const auto name = [joint](const char* which) -> std::string {
      const TiXmlElement* link = joint->FirstChildElement(which);
      const char* text = link != nullptr ? link->Attribute("link") : nullptr;
      return text != nullptr ? text : "";
    };
    const char* type = joint->Attribute("type");
    carrier[name("child")] = {name("parent"), type != nullptr ? type : ""};
  }
  std::string first;
  for (std::string link = tip; link != base && carrier.contains(link); link = carrier[link].parent)
    if (carrier[link].type != "fixed") first = link;
  std::set<std::string> judged{base};
  for (const auto& [link, unused] : carrier) {
    std::string up = link;
    bool fixed = true;  // to what it goes up to
    for (std::size_t i = 0; i <= carrier.size() && up != first && up != base; ++i) {
      const auto joint = carrier.find(up);
      if (joint == carrier.end()) break;
      fixed = fixed && joint->second.type == "fixed";
      up = joint->second.parent;
    }
    if (up == first || (up == base && fixed)) judged.insert(link);
  }
  return judged;
}

/// The elements that tell a link's shape.
std::vector<const TiXmlElement*> shapes_of(const TiXmlElement& link, bool use_visual) {
  std::vector<const TiXmlElement*> shapes;
  for (const char* kind : {"collision", "visual"}) {
    if (!shapes.empty() || (!use_visual && kind[0] == 'v')) break;
    for (auto* shape = link.FirstChildElement(kind); shape != nullptr;
         shape = shape->NextSiblingElement(kind))
      shapes.push_back(shape);
  }
  return shapes;
}

std::string gap_of(const TiXmlElement& link, const model::CoveredArm& arm, const LinkCover& cover) {
  try {
    for (const TiXmlElement* shape : shapes_of(link, arm.use_visual)) {
      const TiXmlElement* geometry = shape->FirstChildElement("geometry");
      if (geometry == nullptr) return "has a shape without geometry";
      const Eigen::Isometry3d X = pose(shape->FirstChildElement("origin"));
      for (const Triangle& t : surface(*geometry, arm)) {
        if (cover.empty()) return "has geometry, but no part or ball";
        if (const auto bare = cover.bare({X * t[0], X * t[1], X * t[2]}))
          return fmt::format("no part or ball holds its geometry at ({:.4f}, {:.4f}, {:.4f}) m",
                             bare->x(), bare->y(), bare->z());
      }
    }
  } catch (const Unreadable& e) {
    return e.what();
  }
  return {};
}

PlanInput input_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::uint64_t sum = 0xcbf29ce484222325u;
  for (std::istreambuf_iterator<char> byte(in), end; byte != end; ++byte)
    sum = (sum ^ static_cast<unsigned char>(*byte)) * 0x100000001b3u;
  return {file.string(), fmt::format("{:016x}", sum)};
}

}  // namespace

std::vector<PlanInput> inputs_of(const std::string& robot, const model::CoveredArm& arm) {
  std::vector<PlanInput> inputs{input_of(runtime::find_model_file(robot))};
  TiXmlDocument document(arm.urdf);
  if (arm.urdf.empty() || !document.LoadFile() || document.RootElement() == nullptr) return inputs;
  inputs.push_back(input_of(arm.urdf));
  const TiXmlElement& robot_element = *document.RootElement();
  const std::set<std::string> judged = judged_links(robot_element, arm.base, arm.tip);
  std::set<fs::path> meshes;
  for (auto* link = robot_element.FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link")) {
    const char* name = link->Attribute("name");
    if (name == nullptr || !judged.contains(name)) continue;
    for (const TiXmlElement* shape : shapes_of(*link, arm.use_visual)) {
      const TiXmlElement* geometry = shape->FirstChildElement("geometry");
      const auto* mesh = geometry != nullptr ? geometry->FirstChildElement("mesh") : nullptr;
      const char* file = mesh != nullptr ? mesh->Attribute("filename") : nullptr;
      if (file == nullptr) continue;
      try {
        meshes.insert(mesh_file(arm.urdf, file, arm.mesh_paths));
      } catch (const Unreadable&) {  // said of the link, or excused
      }
    }
  }
  std::ranges::transform(meshes, std::back_inserter(inputs), input_of);
  return inputs;
}

std::vector<std::string> changed_inputs(const PlanFile& plan, const std::vector<PlanInput>& now) {
  const auto name = [](const PlanInput& input) { return fs::path(input.file).filename(); };
  std::vector<std::string> changes;
  for (const PlanInput& input : now) {
    const auto same = [&](const PlanInput& p) {
      return p.sum == input.sum && name(p) == name(input);
    };
    if (std::ranges::none_of(plan.inputs, same))
      changes.push_back(input.file + ": not as it was when this was planned");
  }
  for (const PlanInput& input : plan.inputs) {
    if (std::ranges::count(now, name(input), name) == 0)
      changes.push_back(input.file + ": the arm was planned with it, now it has none of this name");
  }
  return changes;
}

std::vector<std::string> geometry_gaps(const model::CoveredArm& arm) {
  if (arm.urdf.empty()) return {};
  TiXmlDocument document(arm.urdf);
  if (!document.LoadFile() || document.RootElement() == nullptr)
    return {arm.urdf + " cannot be read again"};
  std::map<std::string, LinkCover> covers;
  for (const model::CoveredLink& link : arm.links) covers[link.link].add(link.parts);
  const TiXmlElement& robot = *document.RootElement();
  const std::set<std::string> judged = judged_links(robot, arm.base, arm.tip);
  std::vector<std::string> gaps;
  for (auto* link = robot.FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link")) {
    const char* name = link->Attribute("name");
    if (name == nullptr || (!judged.contains(name) && !covers.contains(name)) ||
        std::ranges::count(arm.arm.unchecked, name) > 0)
      continue;
    if (const std::string gap = gap_of(*link, arm, covers[name]); !gap.empty())
      gaps.push_back(fmt::format("link {}: {}", name, gap));
  }
  return gaps;
}

}  // namespace mimesis::tool
