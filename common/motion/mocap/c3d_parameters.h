#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/motion/mocap/c3d_words.h"

namespace mimesis::mocap {

/// The parameter section of a C3D file. Names are upper case, "POINT:RATE".
class C3dParameters {
 public:
  /// Reads the records from `begin` on. The chain ends where it says so, where it leaves
  /// [begin, limit) or at what is no record (a name that is not printable).
  /// @throws ConfigError where the data of a record leave the file's parameters
  C3dParameters(const C3dWords& words, std::size_t begin, std::size_t limit);

  std::size_t end() const { return end_; }  ///< behind the last record
  /// First element; whole numbers signed, or unsigned.
  std::optional<double> number(const std::string& name) const;
  std::optional<double> count(const std::string& name) const;
  /// All elements of NAME, NAME2, NAME3, ... as far as they are there.
  std::vector<double> numbers(const std::string& name, bool is_unsigned = false) const;
  /// Strings of NAME, NAME2, ...: the first dimension is their length. Without blanks at the end.
  std::vector<std::string> texts(const std::string& name) const;

 private:
  struct Parameter {
    int type = 0;                               // -1 characters, 1 bytes, 2 words, 4 floats
    std::size_t at = 0, count = 0, length = 0;  // of the data; length: the first dimension
  };
  void read_record(std::size_t at, std::size_t limit);
  std::size_t read_data(std::size_t at, std::size_t limit, const std::string& name, Parameter& p);
  double value(const Parameter& p, std::size_t index, bool is_unsigned) const;
  const Parameter* find(const std::string& name) const;

  const C3dWords& words_;
  std::size_t end_ = 0;
  std::map<int, std::string> groups_;
  std::map<std::pair<int, std::string>, Parameter> parameters_;
};

}  // namespace mimesis::mocap
