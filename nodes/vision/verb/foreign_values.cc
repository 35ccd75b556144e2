#include "nodes/vision/verb/foreign_values.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tinyxml.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cctype>

#include "common/error.h"
#include "common/runtime/value_text.h"

namespace mimesis::tool::foreign {

using Eigen::Isometry3d;
using Eigen::Matrix3d;

[[noreturn]] void fail(const Place& place, const std::string& what) {
  throw ConfigError(to_string(place) + ": " + printable(what));  // words of the file are in it
}

namespace {

/// One element of OpenCV's XML as its YAML would be: elements named _ are items.
Yaml from_xml(const TiXmlElement& e, const std::string& file) {
  Yaml out;
  out.place = {file, e.Row(), e.Column()};
  for (auto* child = e.FirstChildElement(); child != nullptr; child = child->NextSiblingElement()) {
    Yaml value = from_xml(*child, file);
    if (child->ValueStr() == "_") {
      out.kind = Yaml::Kind::sequence;
      out.items.push_back(std::move(value));
      continue;
    }
    const std::string key = printable(child->ValueStr());
    if (out.find(key) != nullptr) fail(value.place, "key '" + key + "' appears twice");
    out.kind = Yaml::Kind::map;
    out.entries.push_back({key, value.place, std::move(value)});
  }
  const char* text = e.GetText();
  if (text == nullptr || out.kind != Yaml::Kind::empty) return out;
  Yaml word;
  word.kind = Yaml::Kind::scalar;
  word.place = out.place;
  word.text = printable(text);
  if (e.ValueStr() != "data" && word.text.find(' ') == std::string::npos) return word;
  out.kind = Yaml::Kind::sequence;
  const std::string all = text;
  constexpr const char* kSpaces = " \t\r\n";
  for (std::size_t at = all.find_first_not_of(kSpaces); at < all.size();) {
    const std::size_t end = std::min(all.find_first_of(kSpaces, at), all.size());
    word.text = printable(all.substr(at, end - at));
    out.items.push_back(word);
    at = all.find_first_not_of(kSpaces, end);
  }
  return out;
}

Yaml read_xml(const ForeignFile& file) {
  constexpr int kMaxNesting = 50;  // the parser calls itself for each level
  int depth = 0;
  for (std::size_t i = 0; i + 1 < file.text.size(); ++i) {
    if (file.text[i] != '<') continue;
    const char next = file.text[i + 1];
    depth += next == '/' ? -1 : (next == '?' || next == '!' ? 0 : 1);
    if (depth > kMaxNesting) throw ConfigError(file.name + ": nested too deeply");
  }
  TiXmlDocument document;
  document.Parse(file.text.c_str(), nullptr, TIXML_ENCODING_UTF8);
  if (document.Error())
    fail({file.name, document.ErrorRow(), document.ErrorCol()}, document.ErrorDesc());
  const TiXmlElement* root = document.RootElement();
  if (root == nullptr || root->ValueStr() != "opencv_storage")
    throw ConfigError(file.name + ": is XML, but not OpenCV's: expected <opencv_storage>");
  return from_xml(*root, file.name);
}

/// OpenCV begins with %YAML:1.0 and takes "key:value" without a space, both of which are no YAML.
std::string from_opencv(std::string text) {
  text[0] = '#';
  for (std::size_t line = 0; line < text.size(); line = text.find('\n', line)) {
    const std::size_t key = text.find_first_not_of(" \n", line);
    if (key == std::string::npos) break;
    std::size_t end = key;
    while (end < text.size() && (std::isalnum(static_cast<unsigned char>(text[end])) != 0 ||
                                 text[end] == '_' || text[end] == '.'))
      ++end;
    line = end;
    if (end > key && end + 1 < text.size() && text[end] == ':' &&
        std::string_view(" \r\n").find(text[end + 1]) == std::string_view::npos)
      text.insert(end + 1, 1, ' ');
  }
  return text;
}

}  // namespace

Yaml read_text(const ForeignFile& file) {
  std::string text = file.text;
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
  if (const std::size_t at = text.find_first_not_of(" \t\r\n"); at < text.size() && text[at] == '<')
    return read_xml({file.name, text});
  if (text.starts_with("%YAML:")) text = from_opencv(std::move(text));
  text.erase(text.find_last_not_of(" \t\r\n") + 1);
  if (text.ends_with("\n---")) text.erase(text.size() - 3);  // behind an echoed message
  return runtime::parse_yaml(text, file.name);
}

double number(const Yaml& value, const std::string& key) {
  std::string_view text = value.text;
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto found = value.kind == Yaml::Kind::scalar ? runtime::to_double(text) : std::nullopt;
  if (!found) fail(value.place, key + ": expected a finite number, found " + value.described());
  return *found;
}

Numbers numbers(const Yaml& value, const std::string& key) {
  const Yaml* list = value.kind == Yaml::Kind::map ? value.find("data") : &value;
  if (list == nullptr || list->kind != Yaml::Kind::sequence) {
    if (list != nullptr && list->kind == Yaml::Kind::empty) return {};
    fail(value.place, key + ": expected rows, cols and data, or a list of numbers");
  }
  Numbers out;
  for (const Yaml& item : list->items) {
    if (item.kind != Yaml::Kind::sequence) out.push_back(number(item, key));
    for (const Yaml& each : item.items) out.push_back(number(each, key));
  }
  const Yaml *rows = value.find("rows"), *cols = value.find("cols");
  if (rows != nullptr && cols != nullptr &&
      number(*rows, key) * number(*cols, key) != static_cast<double>(out.size())) {
    fail(value.place, fmt::format("{}: {} rows of {} cols, but {} numbers", key, rows->text,
                                  cols->text, out.size()));
  }
  return out;
}

Value find(const Yaml& map, const Keys& keys) {
  Value found;
  for (const std::string& key : keys) {
    const Yaml* yaml = map.find(key);
    if (yaml == nullptr) continue;
    if (found) fail(yaml->place, fmt::format("{} and {} both, expected one", found.key, key));
    found = {yaml, key};
  }
  return found;
}

Value need(const Yaml& map, const Keys& keys) {
  const Value found = find(map, keys);
  if (!found) {
    fail(map.place,
         fmt::format("{} is missing{}", keys[0],
                     keys.size() == 1
                         ? ""
                         : fmt::format(" (or {})", fmt::join(keys.begin() + 1, keys.end(), ", "))));
  }
  return found;
}

Numbers numbers(const Value& value, std::size_t size) {
  Numbers out = numbers(*value.yaml, value.key);
  if (out.size() != size)
    fail(value.yaml->place,
         fmt::format("{}: expected {} numbers, found {}", value.key, size, out.size()));
  return out;
}

Matrix3d rotation(const Matrix3d& given, const Place& place, const std::string& key) {
  constexpr double kRounded = 1e-3;
  if (!((given * given.transpose() - Matrix3d::Identity()).norm() < kRounded) ||
      given.determinant() < 0.0) {
    fail(place, key + ": is no rotation matrix");
  }
  const Eigen::JacobiSVD<Matrix3d> svd(given, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();  // the nearest one
}

Matrix3d rotation(const Value& value) {
  const Numbers n = numbers(value, 9);
  return rotation(Matrix3d(Matrix3d::Map(n.data()).transpose()), value.yaml->place, value.key);
}

Isometry3d pose(const Value& value) {
  const Numbers n = numbers(value, 16);
  const Eigen::Matrix4d m = Eigen::Matrix4d::Map(n.data()).transpose();
  if ((m.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() > 1e-9)
    fail(value.yaml->place, value.key + ": expected a last row 0 0 0 1");
  Isometry3d X = Isometry3d::Identity();
  X.linear() = rotation(m.topLeftCorner<3, 3>(), value.yaml->place, value.key);
  X.translation() = m.topRightCorner<3, 1>();
  return X;
}

}  // namespace mimesis::tool::foreign
