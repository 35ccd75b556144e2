#include "common/motion/model/model_json.h"

#include <cmath>

namespace mimesis::synthesizer {

void Node::fail(const std::string& found, const std::string& expected) const {
  throw ConfigError((path_.empty() ? "the file" : path_) + " is " + found + ", expected " +
                    expected);
}

Node Node::at(std::string_view key) const {
  if (!value_.is_object()) fail(value_.type_name(), "an object");
  const auto it = value_.find(key);
  const std::string path = path_.empty() ? std::string(key) : path_ + '.' + std::string(key);
  if (it == value_.end()) throw ConfigError(path + " is missing");
  return {*it, path};
}

Node Node::at(std::size_t index) const {
  return {value_.at(index), path_ + '[' + std::to_string(index) + ']'};
}

bool Node::has(std::string_view key) const { return value_.is_object() && value_.contains(key); }

std::size_t Node::size() const {
  if (!value_.is_array()) fail(value_.type_name(), "an array");
  return value_.size();
}

void Node::expect_size(std::size_t count) const {
  if (size() != count) {
    fail("an array of " + std::to_string(size()), std::to_string(count) + " elements");
  }
}

std::string Node::text() const {
  if (!value_.is_string()) fail(value_.type_name(), "a text");
  return value_.get<std::string>();
}

bool Node::boolean() const {
  if (!value_.is_boolean()) fail(value_.type_name(), "true or false");
  return value_.get<bool>();
}

long Node::integer() const {
  if (!value_.is_number_integer()) fail(value_.type_name(), "a whole number");
  return value_.get<long>();
}

double Node::number() const {
  if (!value_.is_number()) fail(value_.type_name(), "a number");
  const auto x = value_.get<double>();
  if (!std::isfinite(x)) fail("not finite", "a number");
  return x;
}

std::vector<std::string> Node::texts() const {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < size(); ++i) out.push_back(at(i).text());
  return out;
}

std::vector<double> Node::numbers() const {
  std::vector<double> out;
  for (std::size_t i = 0; i < size(); ++i) out.push_back(at(i).number());
  return out;
}

Eigen::VectorXd Node::vector(Eigen::Index count) const {
  expect_size(static_cast<std::size_t>(count));
  const std::vector<double> values = numbers();
  return Eigen::Map<const Eigen::VectorXd>(values.data(), count);
}

Eigen::Vector3d Node::point() const { return vector(3); }

Eigen::MatrixXd Node::matrix(Eigen::Index rows, Eigen::Index cols) const {
  if (rows >= 0) expect_size(static_cast<std::size_t>(rows));
  const auto count = static_cast<Eigen::Index>(size());
  if (cols < 0) cols = count == 0 ? 0 : static_cast<Eigen::Index>(at(std::size_t{0}).size());
  Eigen::MatrixXd out(count, cols);
  for (Eigen::Index r = 0; r < count; ++r) {
    out.row(r) = at(static_cast<std::size_t>(r)).vector(cols).transpose();
  }
  return out;
}

Json to_json(const Eigen::VectorXd& v) { return std::vector<double>(v.begin(), v.end()); }

Json to_json(const Eigen::MatrixXd& m) {
  Json out = Json::array();
  for (Eigen::Index r = 0; r < m.rows(); ++r) out.push_back(to_json(Eigen::VectorXd(m.row(r))));
  return out;
}

}  // namespace mimesis::synthesizer
