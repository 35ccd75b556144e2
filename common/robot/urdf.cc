#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>
#include <string_view>

#include "common/error.h"
#include "common/robot/robot_tree.h"
#include "common/robot/urdf_model.h"

#ifdef __SANITIZE_ADDRESS__
// urdfdom's links own each other: those of a loop, which it does not refuse, are never freed.
extern "C" const char* __lsan_default_suppressions() { return "leak:liburdfdom\n"; }
#endif

namespace mimesis::robot {
namespace {

/// urdfdom reports errors as log lines only: this object keeps them while it lives. The first one
/// is the error, the later ones its place.
class Errors final : public console_bridge::OutputHandler {
 public:
  Errors() : previous_(console_bridge::getOutputHandler()) {
    console_bridge::useOutputHandler(this);
  }
  ~Errors() override { console_bridge::useOutputHandler(previous_); }
  Errors(const Errors&) = delete;
  Errors& operator=(const Errors&) = delete;
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR) {
      text_ += (text_.empty() ? "" : "; ") + text;
    }
  }
  const std::string& text() const { return text_; }

 private:
  console_bridge::OutputHandler* previous_;
  std::string text_;
};

std::string read_text(const std::string& file) {
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  if (!in || !(text << in.rdbuf())) {  // of a folder, too
    throw ConfigError(file + ": " + (errno != 0 ? std::strerror(errno) : "empty") +
                      ", expected a URDF file");
  }
  return text.str();
}

/// Where the outermost element begins, or a document type with entities, which are not read. npos:
/// no XML.
std::size_t root_element(const std::string& text) {
  std::size_t at = text.starts_with("\xEF\xBB\xBF") ? 3 : 0;
  while ((at = text.find_first_not_of(" \t\r\n", at)) != text.npos && text[at] == '<') {
    const std::string_view rest = std::string_view(text).substr(at);
    if (rest.size() > 1 && rest[1] != '?' && rest[1] != '!') return at;
    const std::string_view end = rest.starts_with("<!--") ? "-->" : ">";
    if (rest.starts_with("<!DOCTYPE") && rest.find('[') < rest.find('>')) return at;
    at = text.find(end, at);
    if (at == text.npos) break;
    at += end.size();
  }
  return text.npos;
}

/// Why the text is no URDF, by what it is instead; empty: it may be one.
std::string other_kind(const std::string& text) {
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) return "is UTF-16";
  if (text.starts_with("version https://git-lfs")) return "is a pointer of Git LFS (git lfs pull)";
  const std::size_t at = root_element(text);
  if (at == text.npos) return "is no XML";
  if (text[at + 1] == '!') return "holds <!DOCTYPE [>";
  const std::string root = text.substr(at + 1, text.find_first_of(" \t\r\n/>", at) - at - 1);
  if (root != "robot") return "holds <" + printable(root) + ">";
  return printable(text, "\t\r\n") == text ? "" : "is no UTF-8";
}

/// Exporters write <inertial/> for links without mass, which urdfdom refuses.
void drop_empty_inertials(std::string& text) {
  constexpr std::string_view kTag = "<inertial", kSpace = " \t\r\n";
  for (std::size_t begin = 0; (begin = text.find(kTag, begin)) != text.npos; ++begin) {
    std::size_t end = text.find_first_not_of(kSpace, begin + kTag.size());
    if (end != text.npos && text[end] == '>') end = text.find_first_not_of(kSpace, end + 1);
    const std::string_view rest = std::string_view(text).substr(std::min(end, text.size()));
    if (rest.starts_with("/>") || rest.starts_with("</inertial"))
      text.erase(begin, text.find('>', end) + 1 - begin);
  }
}

/// Some exporters leave it out, and urdfdom wants one.
void name_robot(std::string& text, const std::string& name) {
  const std::size_t begin = root_element(text) + std::strlen("<robot");
  const std::string_view tag = std::string_view(text).substr(begin, text.find('>', begin) - begin);
  for (std::size_t at = 0; (at = tag.find("name", at + 1)) != tag.npos;) {
    const std::size_t next = tag.find_first_not_of(" \t\r\n", at + 4);
    if (std::isspace(tag[at - 1]) != 0 && next != tag.npos && tag[next] == '=') return;
  }
  text.insert(begin, " name=\"" + name + '"');
}

/// The first macro outside of comments, "line 7: <xacro:arm", empty if there is none: what it
/// stands for would be missing. A property that is left over says nothing.
std::string find_macro(const std::string& text) {
  const auto until = [&](const char* what, std::size_t from) {
    return std::min(text.find(what, from), text.size());
  };
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t comment = until("<!--", at);
    const std::string_view part = std::string_view(text).substr(at, comment - at);
    std::size_t macro = part.find("${");
    for (std::size_t tag = 0; (tag = part.find("<xacro:", tag)) != part.npos; ++tag)
      if (!part.substr(tag).starts_with("<xacro:property")) macro = std::min(macro, tag);
    if (macro != part.npos) {
      const auto line = 1 + std::ranges::count(text.substr(0, at + macro), '\n');
      return "line " + std::to_string(line) + ": " +
             std::string(part.substr(macro, part.find_first_of(" \t\r\n/>}", macro) - macro));
    }
    at = until("-->", comment);
    if (at < text.size()) at += 3;
  }
  return "";
}

/// urdfdom leaves out the shape of a link whose material has no name, and a colour needs none.
void name_materials(std::string& text) {
  constexpr std::string_view kTag = "<material";
  int count = 0;
  for (std::size_t at = 0; (at = text.find(kTag, at)) != text.npos;) {
    at += kTag.size();
    const std::size_t next = text.find_first_not_of(" \t\r\n", at);
    if (next != text.npos && (text[next] == '>' || text[next] == '/'))
      text.insert(at, " name=\"unnamed_" + std::to_string(++count) + '"');
  }
}

}  // namespace

urdf::ModelInterfaceSharedPtr parse_urdf(const std::string& file) {
  std::string text = read_text(file);
  if (const std::string why = other_kind(text); !why.empty())
    throw ConfigError(file + ": " + why + ", expected <robot>: a URDF file");
  if (const std::string macro = find_macro(text); !macro.empty())
    throw ConfigError(file + ": is xacro (" + printable(macro) +
                      "), expected the URDF that `xacro FILE` prints");
  name_robot(text, "robot");
  name_materials(text);
  drop_empty_inertials(text);
  const Errors errors;
  urdf::ModelInterfaceSharedPtr model;
  std::string why;
  try {
    model = urdf::parseURDF(text);
  } catch (const std::exception& e) {
    why = e.what();
  }
  // urdfdom gives a model back when it could not read a link, and what it had of it: half a link.
  if (!model || !errors.text().empty()) {
    if (why.empty()) why = errors.text().empty() ? "not XML" : errors.text();
    for (char& c : why) c = c == '\n' || c == '\r' ? ' ' : c;
    throw ConfigError(file + ": " + why + " (expected a URDF robot)");
  }
  return model;
}

Eigen::Isometry3d pose_of(const urdf::Pose& p) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  const urdf::Rotation& r = p.rotation;
  X.linear() = Eigen::Quaterniond(r.w, r.x, r.y, r.z).normalized().toRotationMatrix();
  X.translation() = vector_of(p.position);
  return X;
}

namespace {

Inertia inertia(const urdf::Link& link) {
  Inertia out;
  if (!link.inertial) return out;
  const urdf::Inertial& in = *link.inertial;
  const Eigen::Isometry3d X = pose_of(in.origin);
  out.mass_kg = in.mass;
  out.com_m = X.translation();
  Eigen::Matrix3d I;
  I << in.ixx, in.ixy, in.ixz, in.ixy, in.iyy, in.iyz, in.ixz, in.iyz, in.izz;
  out.about_com_kg_m2 = X.linear() * I * X.linear().transpose();
  return out;
}

void set_joint(const urdf::Joint& joint, const std::string& where, Link& out) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  out.joint = joint.name;
  out.X_PJ = pose_of(joint.parent_to_joint_origin_transform);
  switch (joint.type) {
    case urdf::Joint::FIXED:
      return;
    case urdf::Joint::REVOLUTE:
    case urdf::Joint::CONTINUOUS:
      out.type = JointType::revolute;
      break;
    case urdf::Joint::PRISMATIC:
      out.type = JointType::prismatic;
      break;
    default:
      throw ConfigError(where + "type, expected revolute, continuous, prismatic or fixed");
  }
  if (joint.mimic) {
    out.mimics = joint.mimic->joint_name;
    out.mimic_factor = joint.mimic->multiplier;
    out.mimic_offset = joint.mimic->offset;
  }
  out.axis = vector_of(joint.axis);
  if (!(out.axis.norm() > 1e-9))
    throw ConfigError(where + "axis of no length, expected a direction");
  out.axis.normalize();
  out.lower = -kNone;
  out.upper = out.max_speed = out.max_effort = kNone;
  if (joint.limits) {
    out.max_speed = joint.limits->velocity;
    out.max_effort = joint.limits->effort;
    if (joint.type != urdf::Joint::CONTINUOUS) {
      out.lower = joint.limits->lower;
      out.upper = joint.limits->upper;
    }
  }
}

void walk(const urdf::Link& link, int parent, const std::string& file, std::vector<Link>& out) {
  Link mine;
  mine.name = link.name;
  mine.parent = parent;
  mine.inertia = inertia(link);
  if (link.parent_joint) {
    set_joint(*link.parent_joint, file + ": joint '" + link.parent_joint->name + "': ", mine);
  }
  const int index = static_cast<int>(out.size());
  out.push_back(mine);
  for (const auto& child : link.child_links) walk(*child, index, file, out);
}

}  // namespace

RobotTree read_urdf(const std::string& file) {
  const urdf::ModelInterfaceSharedPtr model = parse_urdf(file);
  std::vector<Link> links;
  walk(*model->getRoot(), -1, file, links);
  for (const auto& [name, link] : model->links_) {  // urdfdom takes loops beside the root
    if (std::ranges::find(links, name, &Link::name) == links.end()) {
      throw ConfigError(file + ": link '" + name + "' hangs in a loop, expected a tree from '" +
                        links[0].name + "'");
    }
  }
  try {
    return {model->getName(), std::move(links)};
  } catch (const ConfigError& e) {
    throw ConfigError(file + ": " + e.what());
  }
}

}  // namespace mimesis::robot
