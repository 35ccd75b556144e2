#include "tools/mimesis/log/export_join.h"

#include <algorithm>
#include <iterator>

namespace mimesis::tool {

RowJoin::RowJoin(Join how, std::vector<std::size_t> widths,
                 std::function<void(std::uint64_t, const Cells&)> out)
    : how_(how), widths_(std::move(widths)), out_(std::move(out)), last_(widths_.size()) {}

void RowJoin::add(std::size_t topic, std::uint64_t time_ns, Cells cells) {
  const Sample sample{time_ns, std::make_shared<const Cells>(std::move(cells))};
  emit(time_ns);
  if (how_ == Join::outer) return add_outer(topic, sample);
  for (Row& row : rows_) update(row, topic, sample);
  last_[topic] = sample;
  if (topic != 0) return;
  rows_.push_back({time_ns, last_, std::vector<bool>(widths_.size(), false)});
  rows_.back().settled[topic] = true;
}

void RowJoin::add_outer(std::size_t topic, const Sample& sample) {
  auto row = std::ranges::find_if(rows_, [&](const Row& r) { return !r.settled[topic]; });
  if (row == rows_.end()) {
    rows_.push_back({sample.time_ns, std::vector<Sample>(widths_.size()),
                     std::vector<bool>(widths_.size(), false)});
    row = std::prev(rows_.end());
  }
  row->samples[topic] = sample;
  row->settled[topic] = true;
}

void RowJoin::update(Row& row, std::size_t topic, const Sample& sample) const {
  if (row.settled[topic]) return;
  Sample& present = row.samples[topic];
  if (sample.time_ns == row.time_ns) {
    present = sample;
  } else if (how_ == Join::nearest) {
    const bool nearer =
        !present.cells || sample.time_ns - row.time_ns < row.time_ns - present.time_ns;
    if (nearer) present = sample;
    row.settled[topic] = true;
  }
}

bool RowJoin::complete(const Row& row, std::uint64_t now_ns) const {
  if (how_ != Join::nearest) return now_ns > row.time_ns;
  return std::ranges::all_of(row.settled, [](bool settled) { return settled; });
}

void RowJoin::emit(std::uint64_t now_ns) {
  while (!rows_.empty() && complete(rows_.front(), now_ns)) emit_first();
}

void RowJoin::emit_first() {
  Cells all;
  for (std::size_t topic = 0; topic < widths_.size(); ++topic) {
    const auto& cells = rows_.front().samples[topic].cells;
    if (cells) {
      all.insert(all.end(), cells->begin(), cells->end());
    } else {
      all.resize(all.size() + widths_[topic]);
    }
  }
  out_(rows_.front().time_ns, all);
  rows_.pop_front();
}

void RowJoin::finish() {
  while (!rows_.empty()) emit_first();
}

}  // namespace mimesis::tool
