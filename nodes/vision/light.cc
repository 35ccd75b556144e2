#include "nodes/vision/light.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mimesis::vision {
namespace {

using Eigen::Vector3d;

/// Median of the bytes at first, first + step, ...
double median_byte(std::span<const std::uint8_t> bytes, std::size_t first, std::size_t step) {
  std::array<int, 256> histogram{};
  int count = 0;
  for (std::size_t i = first; i < bytes.size(); i += step, ++count) ++histogram[bytes[i]];
  int below = 0;
  std::size_t value = 0;
  while (value < 255 && 2 * (below + histogram[value]) < count) below += histogram[value++];
  // Within the bin, by its share: finer than one level.
  const double inside = histogram[value] > 0 ? (0.5 * count - below) / histogram[value] : 0.5;
  return static_cast<double>(value) - 0.5 + inside;
}

constexpr std::size_t kStride = 7;  // coprime to usual widths: samples spread over all columns

/// Gain [0.4, 2.5] of green, and of blue and red against it.
constexpr double kBrightest = 2.5, kWhitest = 1.6;

/// What one thing says of a logarithm of the light.
struct Vote {
  double value, weight;
};

/// Median of the classes' votes, of one as heavy as the heaviest for what is believed without them,
/// and of the table's: no class alone changes anything, it may be another thing of its colour.
double agreed(std::vector<Vote> votes, double believed, const std::optional<double>& table) {
  // Many pixels of one colour, which several classes do not contradict.
  const double table_weight = votes.size() > 1 ? 4.0 : 1.0;
  double heaviest = 0.0, sum = 0.0, below = 0.0;
  for (const Vote& v : votes) heaviest = std::max(heaviest, v.weight);
  votes.push_back({believed, heaviest});
  if (table) votes.push_back({*table, table_weight * heaviest});
  for (const Vote& v : votes) sum += v.weight;
  std::ranges::stable_sort(votes, {}, &Vote::value);
  std::optional<double> lower;  // with half of the weight on either side all between is a median
  for (const Vote& v : votes) {
    below += v.weight;
    if (!lower && 2.0 * below >= sum) lower = v.value;
    if (2.0 * below > sum) return std::clamp(believed, *lower, v.value);
  }
  return believed;
}

/// Blue, green and red of the chroma and luma that were taught.
Vector3d bgr_of(const ColorSpot& spot) {
  const double blue = spot.y + (spot.mean.x() - 128.0) / 0.492,
               red = spot.y + (spot.mean.y() - 128.0) / 0.877;
  return {blue, (spot.y - 0.299 * red - 0.114 * blue) / 0.587, red};
}

}  // namespace

Vector3d median_bgr(const image::Image& image) {
  constexpr std::size_t kStep = 3 * kStride;
  return {median_byte(image.bgr, 0, kStep), median_byte(image.bgr, 1, kStep),
          median_byte(image.bgr, 2, kStep)};
}

Vector3d median_bgr(const YuyvImage& image) {
  constexpr std::size_t kStep = 4 * kStride;
  return bgr_of_yuyv(median_byte(image.bytes, 0, kStep), median_byte(image.bytes, 1, kStep),
                     median_byte(image.bytes, 3, kStep));
}

void ColorCount::add(const Vector3d& bgr) {
  const auto level = [&bgr](int c) { return static_cast<unsigned>(bgr[c]) >> 3; };
  const unsigned cell = level(0) | level(1) << 5 | level(2) << 10;
  if (of_cell_[cell]++ == 0) met_.push_back(static_cast<std::uint16_t>(cell));
}

void ColorCount::finish(const Vector3d& median_bgr) {
  median_ = median_bgr;
  cells_.clear();
  for (const unsigned cell : met_) {
    cells_.push_back(
        {{8.0 * (cell & 31) + 4.0, 8.0 * (cell >> 5 & 31) + 4.0, 8.0 * (cell >> 10) + 4.0},
         static_cast<double>(of_cell_[cell])});
    of_cell_[cell] = 0;
  }
  met_.clear();
}

void ColorCount::count(const image::Image& image) {
  const std::uint8_t* p = image.bgr.data();
  for (std::size_t i = 0; i + 2 < image.bgr.size(); i += 3 * kStride)
    add(Vector3d(p[i], p[i + 1], p[i + 2]));
  finish(vision::median_bgr(image));
}

void ColorCount::count(const YuyvImage& image) {
  const std::uint8_t* p = image.bytes.data();
  for (std::size_t i = 0; i + 3 < image.bytes.size(); i += 4 * kStride)
    add(bgr_of_yuyv(p[i], p[i + 1], p[i + 3]));
  finish(vision::median_bgr(image));
}

std::optional<Vector3d> ColorCount::filling_bgr() const {
  constexpr double kHalf = 0.5, kChroma = 10.0, kDarker = 0.4, kBrighter = 1.6;
  const Yuv median = to_yuv(median_);
  double all = 0.0, like = 0.0;
  for (const Cell& cell : cells_) {
    all += cell.count;
    const Yuv c = to_yuv(cell.bgr);
    const double scale = median.y / std::max(c.y, 1.0);
    if (scale < 1.0 / kBrighter || scale > 1.0 / kDarker) continue;
    const double u = 128.0 + scale * (c.u - 128.0), v = 128.0 + scale * (c.v - 128.0);
    if (std::abs(u - median.u) < kChroma && std::abs(v - median.v) < kChroma) like += cell.count;
  }
  if (like < kHalf * all) return std::nullopt;
  return median_;
}

Light Light::of(const Vector3d& gain_bgr) {
  return {{std::log(gain_bgr[0] / gain_bgr[1]), std::log(gain_bgr[2] / gain_bgr[1])},
          std::log(gain_bgr[1])};
}

Vector3d Light::gain_bgr() const {
  return std::exp(bright) * Vector3d(std::exp(white[0]), 1.0, std::exp(white[1]));
}

Light Light::bounded() const {
  const double white_most = std::log(kWhitest), bright_most = std::log(kBrightest);
  return {white.cwiseMax(-white_most).cwiseMin(white_most),
          std::clamp(bright, -bright_most, bright_most)};
}

std::optional<Vector3d> gain_by_table(const image::Image& image, const Vector3d& table_bgr) {
  ColorCount colors;
  colors.count(image);
  const auto filling = colors.filling_bgr();
  if (!filling || table_bgr.isZero()) return std::nullopt;
  const Vector3d gain = table_bgr.cwiseQuotient(filling->cwiseMax(1.0));
  if (!Light::of(gain).is_light()) return std::nullopt;
  return gain;
}

LightMeter::LightMeter(const ColorSpots& taught, const Vector3d& table_bgr,
                       const Vector3d& gain_bgr)
    : table_(table_bgr), taught_(taught), lesson_(Light::of(gain_bgr)), gain_(gain_bgr) {}

const Vector3d& LightMeter::follow_table(const Vector3d& median_bgr) {
  if (table_.isZero()) return gain_;
  const Vector3d median = median_bgr.cwiseMax(1.0);
  approach(table_.cwiseQuotient(median).cwiseMax(1.0 / kBrightest).cwiseMin(kBrightest));
  return gain_;
}

void LightMeter::approach(const Vector3d& gain_bgr) {
  constexpr double kFollow = 0.2;  // share of a new picture
  gain_ = started_ ? Vector3d(gain_ + kFollow * (gain_bgr - gain_)) : gain_bgr;
  started_ = true;
}

LightMeter::Sights LightMeter::look(const Vector3d& gain_bgr) const {
  Sights out;
  for (const ColorCount::Cell& cell : colors_.cells()) {
    if (cell.bgr.maxCoeff() >= kChannelEnd) continue;  // tells no chromaticity
    const Yuv c = to_yuv(gain_bgr.cwiseProduct(cell.bgr));
    const Kind kind = taught_->nearest(c);
    if (kind == Kind::none) continue;
    const auto k = static_cast<std::size_t>(kind);
    // The nearer to what was taught the more: others of nearly its colour are farther off.
    const double weight = cell.count * std::exp(-0.5 * taught_->of[k]->distance2(c));
    out[k].count += cell.count;
    out[k].weight += weight;
    out[k].luma += cell.count * c.y / gain_bgr[1];
    out[k].over_luma += weight / c.y * cell.bgr;
  }
  for (std::size_t k = 1; k < kKinds; ++k) {
    constexpr double kFew = 10.0;  // pixels of those counted
    // Not taught, but the box of skin: any luma.
    if (out[k].count < kFew || taught_->of[k]->y == 0.0) out[k].count = 0.0;
  }
  return out;
}

int LightMeter::classes(const Sights& sights) {
  return static_cast<int>(
      std::ranges::count_if(sights, [](const Seen& seen) { return seen.count > 0.0; }));
}

Light LightMeter::consensus(const Sights& sights, const std::optional<Light>& table) const {
  constexpr double kDark = 6.0, kLevels = 5.0;  // levels of a channel: least; uncertain by
  constexpr double kSurface = 0.05;             // standard deviation of a colour, as a share
  std::array<std::vector<Vote>, 2> votes;       // blue, red
  const auto weight = [](double variance) { return 1.0 / (2.0 * kSurface * kSurface + variance); };
  for (std::size_t k = 1; k < kKinds; ++k) {
    const Seen& seen = sights[k];
    if (seen.count == 0.0) continue;
    const ColorSpot& spot = *taught_->of[k];
    const Vector3d taught = bgr_of(spot).cwiseMax(kDark),
                   now = (spot.y / seen.weight * seen.over_luma).cwiseMax(kDark);
    const Light light = Light::of(taught.cwiseQuotient(now));
    const Vector3d noise = (kLevels * taught.cwiseInverse()).array().square();
    votes[0].push_back({light.white[0], weight(noise[0] + noise[1])});
    votes[1].push_back({light.white[1], weight(noise[2] + noise[1])});
  }
  const auto white = [&](int i) {
    return agreed(votes[static_cast<std::size_t>(i)], lesson_.white[i],
                  table ? std::optional(table->white[i]) : std::nullopt);
  };
  return {{white(0), white(1)}, table ? table->bright : lesson_.bright};
}

double LightMeter::brightness(const Sights& sights) const {
  std::vector<double> bright;
  for (std::size_t k = 1; k < kKinds; ++k) {
    const Seen& seen = sights[k];
    if (seen.count > 0.0) bright.push_back(std::log(taught_->of[k]->y * seen.count / seen.luma));
  }
  std::ranges::sort(bright);
  return bright[(bright.size() - 1) / 2];
}

bool LightMeter::may_be(const Light& table, const Sights& sights) const {
  constexpr double kWhite = 0.2, kBright = 0.4;
  return classes(sights) > 0 &&
         (table.white - consensus(sights, std::nullopt).white).cwiseAbs().maxCoeff() < kWhite &&
         std::abs(table.bright - brightness(sights)) < kBright;
}

const Vector3d& LightMeter::follow_taught() {
  constexpr double kReturn = 0.005;
  constexpr int kFirst = 3, kSome = 2;  // rounds: what is seen depends on the light; classes
  const auto filling = colors_.filling_bgr();
  std::optional<Light> table;
  if (filling && !table_.isZero()) table = Light::of(table_.cwiseQuotient(filling->cwiseMax(1.0)));
  const bool fills = table.has_value();
  Sights sights = look(gain_);
  if (table && !may_be(*table, sights)) {  // a lamp was switched, or it is no table
    const Sights in_its = look(table->gain_bgr());
    const bool more = classes(in_its) >= kSome && classes(in_its) > classes(sights);
    if (more && table->is_light() && may_be(*table, in_its)) {
      sights = in_its;
    } else {
      table.reset();
    }
  }
  const bool seen = classes(sights) > 0;
  Light light = seen ? consensus(sights, table).bounded() : Light::of(gain_);
  for (int round = 1; seen && round < kFirst && !started_; ++round)
    light = consensus(look(light.gain_bgr()), table).bounded();
  say(light, fills && !table);
  if (seen) approach(light.gain_bgr());
  if (!seen) gain_ += kReturn * (lesson_.gain_bgr() - gain_);
  return gain_;
}

void LightMeter::say(const Light& light, bool other_table) {
  constexpr double kWhite = 0.15, kBright = 0.4;
  remark_.clear();
  const Light before = Light::of(gain_);
  const double jump = std::max((light.white - before.white).cwiseAbs().maxCoeff() / kWhite,
                               std::abs(light.bright - before.bright) / kBright);
  if (started_ && jump > 1.0 && !jumps_) {
    const Vector3d of_lesson = lesson_.gain_bgr().cwiseQuotient(light.gain_bgr());
    remark_ = fmt::format(
        "light: it jumped to {:.2f} of the lesson's in blue, {:.2f} in green, {:.2f} in red",
        of_lesson[0], of_lesson[1], of_lesson[2]);
  } else if (other_table && !other_table_) {
    remark_ =
        "light: what fills the picture has not the colour of the lesson's table; it is not taken "
        "for light";
  }
  jumps_ = jump > (jumps_ ? 0.5 : 1.0);
  other_table_ = other_table;
}

}  // namespace mimesis::vision
