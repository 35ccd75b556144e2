#include "tools/mimesis/log/play_curves.h"

#include <algorithm>
#include <cmath>

#include "tools/mimesis/field_text.h"
#include "tools/mimesis/log/field_columns.h"

namespace mimesis::tool {
namespace {

constexpr std::uint32_t kMostColumns = 20'000;
constexpr std::size_t kTogether = 2048;  // messages that are read between two looks at the lock

void include(MinMaxPyramid::Range& range, double least, double largest) {
  range.least = std::fmin(range.least, least);  // of a number and NaN: the number
  range.largest = std::fmax(range.largest, largest);
}

}  // namespace

void MinMaxPyramid::add(double value) {
  std::size_t i = values_.size();
  values_.push_back(value);
  for (std::vector<Range>& level : levels_) {
    i /= kWidth;
    if (i == level.size()) level.emplace_back();
    include(level[i], value, value);
  }
}

MinMaxPyramid::Range MinMaxPyramid::range(std::size_t begin, std::size_t end) const {
  Range all;
  const auto single = [&](std::size_t level, std::size_t i) {
    if (level == 0) return include(all, values_[i], values_[i]);
    const Range& node = levels_[level - 1][i];
    include(all, node.least, node.largest);
  };
  for (std::size_t level = 0; begin < end; ++level, begin /= kWidth, end /= kWidth) {
    if (level == levels_.size()) {
      for (; begin < end; ++begin) single(level, begin);
      break;
    }
    for (; begin < end && begin % kWidth != 0; ++begin) single(level, begin);
    for (; begin < end && end % kWidth != 0; --end) single(level, end - 1);
  }
  return all;
}

void draw_curve(std::span<const double> at_s, const MinMaxPyramid& series, double from_s,
                double to_s, std::uint32_t columns, v1::PlayerCurve& out) {
  const auto index = [&](auto it) { return static_cast<std::size_t>(it - at_s.begin()); };
  std::size_t begin = index(std::ranges::lower_bound(at_s, from_s));
  std::size_t end = index(std::ranges::upper_bound(at_s, to_s));
  begin -= begin > 0 ? 1 : 0;  // so that lines enter and leave the window
  end += end < at_s.size() ? 1 : 0;
  const auto point = [&](double t, double y) {
    out.add_position_s(t);
    out.add_value(y);
  };
  const std::uint32_t n = std::clamp<std::uint32_t>(columns, 1, kMostColumns);
  if (end - begin <= std::size_t{2} * n) {
    for (std::size_t i = begin; i < end; ++i) point(at_s[i], series.values()[i]);
    return;
  }
  const double width_s = (to_s - from_s) / n;
  for (std::uint32_t column = 0; begin < end; ++column) {
    const auto after = std::upper_bound(at_s.begin() + static_cast<std::ptrdiff_t>(begin),
                                        at_s.begin() + static_cast<std::ptrdiff_t>(end),
                                        column < n ? from_s + (column + 1) * width_s : to_s + 1e18);
    const std::size_t next = index(after);
    if (next == begin) continue;
    const auto [least, largest] = series.range(begin, next);
    const bool rises = series.values()[begin] <= series.values()[next - 1];
    point(at_s[begin], rises ? least : largest);
    if (least != largest) point(at_s[next - 1], rises ? largest : least);
    begin = next;
  }
}

v1::PlayerCurves PlayCurves::draw(const v1::PlayerCurvesAsk& ask) {
  const std::lock_guard lock(mutex_);
  std::map<std::string, std::vector<std::string>> fresh;  // paths by topic
  const auto find = [&](const v1::PlayerField& wanted) -> std::pair<Fields*, std::size_t> {
    for (Fields& fields : all_) {
      const auto path = std::ranges::find(fields.paths, wanted.path());
      if (fields.topic == wanted.topic() && path != fields.paths.end())
        return {&fields, static_cast<std::size_t>(path - fields.paths.begin())};
    }
    return {nullptr, 0};
  };
  for (const v1::PlayerField& wanted : ask.fields()) {
    auto& paths = fresh[wanted.topic()];
    if (find(wanted).first == nullptr && std::ranges::find(paths, wanted.path()) == paths.end())
      paths.push_back(wanted.path());
  }
  for (auto& [topic, paths] : fresh) {
    if (paths.empty()) continue;
    Fields& fields = all_.emplace_back();
    fields.topic = topic;
    fields.series.resize(paths.size());
    fields.problems.resize(paths.size());
    fields.paths = std::move(paths);
  }
  if (!reader_.joinable() && !all_.empty())
    reader_ = std::jthread([this](const std::stop_token& stop) { read(stop); });
  news_.notify_one();
  v1::PlayerCurves out;
  for (const v1::PlayerField& wanted : ask.fields()) {
    const auto [fields, i] = find(wanted);
    v1::PlayerCurve& curve = *out.add_curves();
    draw_curve(fields->at_s, fields->series[i], ask.from_s(), ask.to_s(), ask.columns(), curve);
    curve.set_read_s(fields->read_s);
    curve.set_whole(fields->whole);
    curve.set_problem(fields->problems[i]);
  }
  return out;
}

void PlayCurves::read(const std::stop_token& stop) {
  for (;;) {
    Fields* fields = nullptr;
    {
      std::unique_lock lock(mutex_);
      if (!news_.wait(lock, stop, [this] { return next_ < all_.size(); })) return;
      fields = &all_[next_++];
    }
    read(*fields, stop);
    const std::lock_guard lock(mutex_);
    fields->whole = true;
  }
}

void PlayCurves::read(Fields& fields, const std::stop_token& stop) {
  const auto reader =
      playback_.reader({[&](const log::Channel& channel) { return channel.topic == fields.topic; },
                        playback_.start_ns(), playback_.end_ns() + 1});
  std::vector<double> at_s, values;  // read, not yet handed over
  const auto hand_over = [&](double read_s) {
    const std::lock_guard lock(mutex_);
    fields.at_s.insert(fields.at_s.end(), at_s.begin(), at_s.end());
    for (std::size_t i = 0; i < values.size(); ++i)
      fields.series[i % fields.paths.size()].add(values[i]);
    fields.read_s = read_s;
    at_s.clear(), values.clear();
  };
  std::vector<std::optional<FieldColumns>> columns(fields.paths.size());
  /// Does it for a field, which ends with the problem that it throws.
  const auto attempt = [&](std::size_t i, const auto& act) {
    try {
      act();
    } catch (const ConfigError& error) {
      columns[i].reset();
      const std::lock_guard lock(mutex_);
      fields.problems[i] = error.what();
    }
  };
  for (std::size_t i = 0; i < columns.size(); ++i)
    attempt(i, [&] { columns[i].emplace(FieldQuery{fields.topic, fields.paths[i]}); });
  LogDecoder decoder;
  while (const Item* item = stop.stop_requested() ? nullptr : reader->next()) {
    const google::protobuf::Message* message = decoder.decode(*item);
    if (message == nullptr) continue;
    at_s.push_back(playback_.position_s(item->message->log_time));
    for (std::size_t i = 0; i < columns.size(); ++i) {
      double value = std::numeric_limits<double>::quiet_NaN();
      if (columns[i]) {
        attempt(i, [&] {
          columns[i]->visit(*message, [&](const auto&, const FieldColumns::Value& v) {
            value = field_number(v.message, v.field, v.index);
          });
        });
      }
      values.push_back(value);
    }
    if (at_s.size() >= kTogether) hand_over(at_s.back());
  }
  hand_over(playback_.position_s(playback_.end_ns()));
}

}  // namespace mimesis::tool
