#pragma once
#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "common/error.h"

/// Reading of JSON that tells where it does not fit. Paths are as in "patterns[3].mean_rad".
namespace mimesis::synthesizer {

using Json = nlohmann::ordered_json;

/// A value in the file, and the way to it.
class Node {
 public:
  Node(const Json& value, std::string path) : value_(value), path_(std::move(path)) {}

  Node at(
      std::string_view key) const;   ///< @throws ConfigError if it is no object, or lacks the key
  Node at(std::size_t index) const;  ///< of an array of at least that size
  bool has(std::string_view key) const;  ///< an object that has the key
  bool is_null() const { return value_.is_null(); }
  std::size_t size() const;  ///< of an array
  /// Of an array, which must have `count` elements.
  void expect_size(std::size_t count) const;

  std::string text() const;
  bool boolean() const;
  long integer() const;
  double number() const;  ///< finite
  std::vector<std::string> texts() const;
  std::vector<double> numbers() const;
  Eigen::VectorXd vector(Eigen::Index size) const;
  Eigen::Vector3d point() const;
  /// Array of `rows` arrays of `cols` numbers; -1: as many as there are, the same in all rows.
  Eigen::MatrixXd matrix(Eigen::Index rows, Eigen::Index cols) const;

  [[noreturn]] void fail(const std::string& found, const std::string& expected) const;

 private:
  const Json& value_;
  std::string path_;
};

Json to_json(const Eigen::VectorXd& v);
Json to_json(const Eigen::MatrixXd& m);  ///< array of its rows

}  // namespace mimesis::synthesizer
