#pragma once
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace mimesis::tool {

/// How rows of several topics become one table.
/// previous: a row per message of the first topic, with the last of each other one at or before it.
/// nearest:  the same with the one nearest in time, the earlier of two.
/// outer:    a row per time at which any topic has a message, with empty cells for the others.
enum class Join { previous, nearest, outer };

using Cells = std::vector<std::string>;

/// Joins rows that come in the order of time. Holds the rows of one time; for nearest, those since
/// the last message of the rarest topic.
class RowJoin {
 public:
  /// @param widths  cells of each topic
  /// @param out     takes the time and the cells of all topics side by side
  RowJoin(Join how, std::vector<std::size_t> widths,
          std::function<void(std::uint64_t time_ns, const Cells& row)> out);
  void add(std::size_t topic, std::uint64_t time_ns, Cells cells);
  void finish();  ///< last call

 private:
  struct Sample {
    std::uint64_t time_ns = 0;
    std::shared_ptr<const Cells> cells;  ///< null: none
  };
  struct Row {
    std::uint64_t time_ns = 0;
    std::vector<Sample> samples;  ///< per topic
    std::vector<bool> settled;    ///< per topic: no later message can be nearer
  };
  bool complete(const Row& row, std::uint64_t now_ns) const;
  void add_outer(std::size_t topic, const Sample& sample);
  void update(Row& row, std::size_t topic, const Sample& sample) const;
  void emit(std::uint64_t now_ns);
  void emit_first();

  Join how_;
  std::vector<std::size_t> widths_;
  std::function<void(std::uint64_t, const Cells&)> out_;
  std::vector<Sample> last_;  ///< per topic
  std::deque<Row> rows_;      ///< not yet complete
};

}  // namespace mimesis::tool
