#include "nodes/synthesizer/dynamics/character_batch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "common/error.h"
#include "common/math/circle.h"
#include "nodes/synthesizer/dynamics/mixture_lanes.h"
#include "nodes/synthesizer/dynamics/posture.h"
#include "nodes/synthesizer/dynamics/root_cycle.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kLongestPart = 1.0 / 120.0;  // s
// in place of a pattern: the character's shares of all patterns; a series of its own
constexpr int kBlend = -1, kOwn = -2;
constexpr int kLegJoints[6] = {mocap::kLeftHip,  mocap::kLeftKnee,  mocap::kLeftAnkle,
                               mocap::kRightHip, mocap::kRightKnee, mocap::kRightAnkle};

int row_of(const motion::MotionModel& model, int body_row) {
  const auto found =
      std::find(model.rows.begin(), model.rows.end(), mocap::body_row_name(body_row));
  return found == model.rows.end() ? -1 : static_cast<int>(found - model.rows.begin());
}

}  // namespace

/// 16 characters.
struct CharacterBatch::Tile {
  HopfLanes hopf;
  TravelLanes travel;
  FeetLanes feet;
  PointLanes point;
  HopfLanes::Lane cosine, sine;  // of the phase
  // place and heading of H in W
  double x[kLanes] = {}, y[kLanes] = {}, cos_heading[kLanes], sin_heading[kLanes] = {};
  double heading[kLanes] = {};  // for the turns; the rotation itself is the pair above

  Tile() {
    std::fill_n(cos_heading, kLanes, 1.0);
    std::fill_n(cosine, kLanes, 1.0);
    std::fill_n(sine, kLanes, 0.0);
  }
};

struct CharacterBatch::Data {
  Data(const motion::MotionModel& model, int count_, const CharacterOptions& options_)
      : options(options_),
        count(count_),
        maker(model, options_.harmonics, options_.tolerance_rad),
        samples(std::max(512, 4 * static_cast<int>(model.sources.cols()))),
        patterns(static_cast<int>(model.patterns.size())),
        tied(model.tied),
        body(model.body) {}

  float* series(int i) {
    MIMESIS_ASSERT(options.individual && i >= 0 && i < count);
    return own.data() + static_cast<std::size_t>(i) * static_cast<std::size_t>(maker.size());
  }
  float* table(int p, int first_row) {
    const auto stride = static_cast<std::size_t>(maker.row_stride());
    return tables.data() + (static_cast<std::size_t>(p) * static_cast<std::size_t>(samples + 3) +
                            static_cast<std::size_t>(first_row)) *
                               stride;
  }
  float* root(int p, int first_row) {
    return roots.data() + (static_cast<std::size_t>(p) * static_cast<std::size_t>(samples + 3) +
                           static_cast<std::size_t>(first_row)) *
                              kRootStride;
  }
  float* row(int i) {
    return angles.data() +
           static_cast<std::size_t>(i) * static_cast<std::size_t>(maker.row_stride());
  }
  Tile& tile(int i) {
    MIMESIS_ASSERT(i >= 0 && i < count);
    return tiles[static_cast<std::size_t>(i / kLanes)];
  }
  void set_shares(int i, std::span<const double> shares) {
    MIMESIS_ASSERT(static_cast<int>(shares.size()) == patterns);
    float* share = beta.data() + static_cast<std::size_t>(i) * shares.size();
    for (std::size_t p = 0; p < shares.size(); ++p) share[p] = static_cast<float>(shares[p]);
  }
  Eigen::Vector3d in_world(int i, const Lane* p);
  void step(Tile& tile, int first, double dt_s);
  void tabulate(const motion::MotionModel& model);
  void learn_roots(const motion::MotionModel& model);
  void add_rows(int i, int lane);
  void add_root(int i, int lane, Tile& tile);
  void synthesize(Tile& tile, int first);
  void stand_feet(Tile& tile, int first);

  CharacterOptions options;
  int count, parts = 1;
  MotionSeries maker;
  int samples;  ///< samples of a table, a period
  int patterns;
  bool tied;
  BodyLanes body;
  std::array<int, mocap::kBodyRows> rows{};  ///< the model's row of a body row, or -1
  std::vector<float> tables;                 ///< tables of the patterns
  std::vector<float> roots;                  ///< theirs of root_cycle.h, at the same phases
  std::vector<float> own;                    ///< series of the characters, if individual
  std::vector<int> from;                     ///< pattern of each character, or kBlend, kOwn
  std::vector<float> beta;                   ///< shares of the patterns, of each character
  std::vector<float> angles;                 ///< row_stride() a character
  std::vector<Tile> tiles;
  // buffers of the tile at work
  std::vector<float> basis;  ///< basis_count() a character
  int cell[kLanes] = {};
  alignas(64) float taps[4 * kLanes] = {};
  alignas(64) Lane angle[mocap::kBodyRows] = {};
  RotationLanes rotation{};
};

CharacterBatch::CharacterBatch(const motion::MotionModel& model, int count,
                               const CharacterOptions& options) {
  MIMESIS_ASSERT(count >= 1 && options.dt_s > 0.0 && options.dt_s <= 0.1);
  data_ = std::make_unique<Data>(model, count, options);
  Data& d = *data_;
  d.parts = static_cast<int>(std::ceil(options.dt_s / kLongestPart - 1e-9));
  const std::size_t n = static_cast<std::size_t>(count);
  const std::size_t lanes = (n + kLanes - 1) / kLanes * kLanes;
  if (options.individual) d.own.resize(n * static_cast<std::size_t>(d.maker.size()));
  d.from.assign(lanes, 0);
  d.beta.resize(lanes * static_cast<std::size_t>(d.patterns));
  d.angles.resize(lanes * static_cast<std::size_t>(d.maker.row_stride()));
  d.tiles.resize(lanes / kLanes);
  d.basis.resize(static_cast<std::size_t>(kLanes * d.maker.basis_count()));
  d.tabulate(model);
  for (std::size_t b = 0; b < d.rows.size(); ++b) d.rows[b] = row_of(model, static_cast<int>(b));
  d.learn_roots(model);
  const double duration = model.patterns.front().trial.duration_s;
  for (Tile& tile : d.tiles) {  // the lanes beyond the last character run along
    std::fill_n(tile.hopf.x1, kLanes, 1.0);
    std::fill_n(tile.hopf.omega, kLanes, math::kTwoPi / (duration > 0.0 ? duration : 1.0));
  }
  settle();
}

void CharacterBatch::settle() {
  for (std::size_t t = 0; t < data_->tiles.size(); ++t) {
    Tile& tile = data_->tiles[t];
    std::fill_n(tile.travel.fresh, kLanes, 1.0F);
    std::fill_n(tile.feet.fresh, kLanes, 1.0F);
    data_->step(tile, static_cast<int>(t) * kLanes, 0.0);
    std::fill_n(tile.travel.fresh, kLanes, 1.0F);
    std::fill_n(tile.feet.fresh, kLanes, 1.0F);
  }
}

void CharacterBatch::Data::tabulate(const motion::MotionModel& model) {
  std::vector<float> one(static_cast<std::size_t>(maker.size()));
  tables.resize(static_cast<std::size_t>(patterns) * static_cast<std::size_t>(samples + 3) *
                static_cast<std::size_t>(maker.row_stride()));
  for (int p = 0; p < patterns; ++p) {
    const motion::Pattern& q = model.patterns[static_cast<std::size_t>(p)];
    maker.make(q.mean_rad, q.weight_rad, q.delay_rad, one.data());
    maker.tabulate(one.data(), samples, table(p, 0));
  }
}

void CharacterBatch::Data::learn_roots(const motion::MotionModel& model) {
  constexpr std::size_t kBody = mocap::kBodyRows;
  std::vector<float> cycle(static_cast<std::size_t>(samples) * kBody, 0.0F);
  roots.resize(static_cast<std::size_t>(patterns) * static_cast<std::size_t>(samples + 3) *
               kRootStride);
  for (int p = 0; p < patterns; ++p) {
    for (int n = 0; n < samples; ++n) {
      const float* values = table(p, n + 1);
      for (std::size_t b = 0; b < kBody; ++b) {
        if (rows[b] >= 0) cycle[static_cast<std::size_t>(n) * kBody + b] = values[rows[b]];
      }
    }
    const std::vector<float> learned =
        learn_root(body, cycle, model.patterns[static_cast<std::size_t>(p)].trial.duration_s);
    for (int n = -1; n <= samples + 1; ++n) {
      const auto at = static_cast<std::size_t>((n + samples) % samples) * kRootStride;
      std::copy_n(learned.data() + at, kRootStride, root(p, n + 1));
    }
  }
}

CharacterBatch::~CharacterBatch() = default;
CharacterBatch::CharacterBatch(CharacterBatch&&) noexcept = default;
CharacterBatch& CharacterBatch::operator=(CharacterBatch&&) noexcept = default;

int CharacterBatch::size() const { return data_->count; }
int CharacterBatch::rows() const { return data_->maker.rows(); }
const MotionSeries& CharacterBatch::series() const { return data_->maker; }

void CharacterBatch::set_pattern(int i, int p) {
  MIMESIS_ASSERT(i >= 0 && i < data_->count && p >= 0 && p < data_->patterns);
  data_->from[static_cast<std::size_t>(i)] = p;
}

void CharacterBatch::set_parameters(int i, const Eigen::Ref<const Eigen::VectorXd>& mean_rad,
                                    const Eigen::Ref<const Eigen::MatrixXd>& weight_rad,
                                    const Eigen::Ref<const Eigen::MatrixXd>& delay_rad,
                                    std::span<const double> beta) {
  data_->maker.make(mean_rad, weight_rad, delay_rad, data_->series(i));
  data_->set_shares(i, beta);
  data_->from[static_cast<std::size_t>(i)] = kOwn;
}

void CharacterBatch::set_blend(int i, std::span<const double> beta) {
  Data& d = *data_;
  MIMESIS_ASSERT(d.tied && i >= 0 && i < d.count);
  d.set_shares(i, beta);
  d.from[static_cast<std::size_t>(i)] = kBlend;
}

void CharacterBatch::set_frequency(int i, double omega_rad_s) {
  MIMESIS_ASSERT(omega_rad_s >= 0.0 && std::isfinite(omega_rad_s));
  data_->tile(i).hopf.omega[i % kLanes] = omega_rad_s;
}

void CharacterBatch::set_phase(int i, double phase_rad) {
  MIMESIS_ASSERT(std::isfinite(phase_rad));
  Tile& tile = data_->tile(i);
  tile.hopf.x1[i % kLanes] = std::cos(phase_rad);
  tile.hopf.x2[i % kLanes] = std::sin(phase_rad);
  tile.travel.fresh[i % kLanes] = 1.0F;
}

void CharacterBatch::set_external(int i, double phase_rad, double alpha_1_s) {
  MIMESIS_ASSERT(std::isfinite(phase_rad) && alpha_1_s >= 0.0 && alpha_1_s <= 100.0);
  HopfLanes& hopf = data_->tile(i).hopf;
  hopf.external1[i % kLanes] = std::cos(phase_rad);
  hopf.external2[i % kLanes] = std::sin(phase_rad);
  hopf.alpha[i % kLanes] = alpha_1_s;
}

void CharacterBatch::set_root(int i, const Eigen::Vector2d& position_W_m, double heading_rad) {
  Tile& tile = data_->tile(i);
  const int l = i % kLanes;
  tile.x[l] = position_W_m.x();
  tile.y[l] = position_W_m.y();
  tile.heading[l] = heading_rad;
  tile.cos_heading[l] = std::cos(heading_rad);
  tile.sin_heading[l] = std::sin(heading_rad);
  tile.feet.fresh[l] = 1.0F;
}

void CharacterBatch::set_turn(int i, double rate_rad_s) {
  data_->tile(i).travel.turn_rate[i % kLanes] = static_cast<float>(rate_rad_s);
}

void CharacterBatch::step() {
  for (std::size_t t = 0; t < data_->tiles.size(); ++t) {
    data_->step(data_->tiles[t], static_cast<int>(t) * kLanes, data_->options.dt_s);
  }
}

/// Adds up the rows of character i, in lane l of the tile at work.
void CharacterBatch::Data::add_rows(int i, int l) {
  const auto c = static_cast<std::size_t>(i);
  const int stride = maker.row_stride();
  float* values = row(i);
  std::fill_n(values, stride, 0.0F);
  if (from[c] == kOwn) {
    add_mix(series(i), basis.data() + l * maker.basis_count(), maker.basis_count(), stride, 1.0F,
            values);
  } else if (from[c] == kBlend) {
    const float* share = beta.data() + c * static_cast<std::size_t>(patterns);
    for (int p = 0; p < patterns; ++p) {
      if (share[p] != 0.0F) add_mix(table(p, cell[l]), taps + 4 * l, 4, stride, share[p], values);
    }
  } else {
    add_mix(table(from[c], cell[l]), taps + 4 * l, 4, stride, 1.0F, values);
  }
}

/// Adds up how its pelvis travels and its feet stand.
void CharacterBatch::Data::add_root(int i, int l, Tile& tile) {
  alignas(64) float sum[kRootStride] = {};
  const auto c = static_cast<std::size_t>(i);
  const float* tap = taps + 4 * l;
  if (from[c] >= 0) {
    add_mix(root(from[c], cell[l]), tap, 4, kRootStride, 1.0F, sum);
  } else {
    const float* share = beta.data() + c * static_cast<std::size_t>(patterns);
    for (int p = 0; p < patterns; ++p) {
      if (share[p] != 0.0F) add_mix(root(p, cell[l]), tap, 4, kRootStride, share[p], sum);
    }
  }
  for (int r = 0; r < kRootRows; ++r) tile.travel.row[r][l] = sum[r];
}

/// Rows of the 16 characters, and their body rows side by side in `angle`.
void CharacterBatch::Data::synthesize(Tile& tile, int first) {
  HopfLanes::Lane cosine, sine;
  directions(tile.hopf, cosine, sine);
  table_taps(cosine, sine, samples, cell, taps);
  for (int l = 0; l < kLanes; ++l) {
    const double s = sine[l] * tile.cosine[l] - cosine[l] * tile.sine[l];
    tile.travel.advanced[l] = static_cast<float>(std::asin(std::clamp(s, -1.0, 1.0)));
    tile.cosine[l] = cosine[l];
    tile.sine[l] = sine[l];
  }
  if (options.individual) {
    basis_values(cosine, sine, maker.harmonics(), maker.slow_functions() > 0, maker.basis_count(),
                 basis.data());
  }
  for (int l = 0; l < kLanes; ++l) {
    add_rows(first + l, l);
    add_root(first + l, l, tile);
    const float* values = row(first + l);
    for (std::size_t b = 0; b < rows.size(); ++b) {
      if (rows[b] >= 0) angle[b][l] = values[rows[b]];
    }
  }
}

void CharacterBatch::Data::stand_feet(Tile& tile, int first) {
  plant_feet(static_cast<float>(options.dt_s), rotation, tile.travel, angle, tile.point, tile.feet);
  for (const int joint : kLegJoints) {
    for (int b = 3 * joint; b < 3 * joint + 3; ++b) {
      const int r = rows[static_cast<std::size_t>(b)];
      if (r < 0) continue;
      for (int l = 0; l < kLanes; ++l) row(first + l)[r] = angle[b][l];
    }
  }
}

void CharacterBatch::Data::step(Tile& tile, int first, double dt_s) {
  if (dt_s > 0.0) advance(tile.hopf, dt_s, parts);
  synthesize(tile, first);
  posture(body, angle, rotation, tile.point);
  travel(static_cast<float>(dt_s), tile.travel);
  if (options.foot_lock) stand_feet(tile, first);
  for (int l = 0; l < kLanes; ++l) {
    const double c = tile.cos_heading[l], s = tile.sin_heading[l];
    const double dx = tile.travel.dx[l], dy = tile.travel.dy[l];
    const double dc = tile.travel.cos_turn[l], ds = tile.travel.sin_turn[l];
    tile.x[l] += c * dx - s * dy;
    tile.y[l] += s * dx + c * dy;
    const double nc = c * dc - s * ds, ns = s * dc + c * ds, n = std::sqrt(nc * nc + ns * ns);
    tile.cos_heading[l] = nc / n;
    tile.sin_heading[l] = ns / n;
    tile.heading[l] += static_cast<double>(tile.travel.turn[l]);
  }
}

double CharacterBatch::phase(int i) const {
  const Eigen::Vector2d x = state(i);
  return math::wrap_two_pi(std::atan2(x.y(), x.x()));
}

Eigen::Vector2d CharacterBatch::state(int i) const {
  const HopfLanes& hopf = data_->tile(i).hopf;
  return {hopf.x1[i % kLanes], hopf.x2[i % kLanes]};
}

std::span<const float> CharacterBatch::angles(int i) const {
  MIMESIS_ASSERT(i >= 0 && i < data_->count);
  return {data_->row(i), static_cast<std::size_t>(rows())};
}

RootPose CharacterBatch::root(int i) const {
  const Tile& tile = data_->tile(i);
  const int l = i % kLanes;
  const double rate = 1.0 / data_->options.dt_s;
  const double c = tile.travel.cos_turn[l], s = tile.travel.sin_turn[l];
  const double dx = tile.travel.dx[l], dy = tile.travel.dy[l];
  const double angle = std::atan2(tile.sin_heading[l], tile.cos_heading[l]);
  RootPose pose;
  pose.position_W_m = {tile.x[l], tile.y[l]};
  pose.height_m = tile.travel.height[l];
  pose.heading_rad = tile.heading[l] + math::wrap_pi(angle - tile.heading[l]);
  pose.velocity_H_m_s = {(c * dx + s * dy) * rate, (c * dy - s * dx) * rate};
  pose.yaw_rate_rad_s = tile.travel.turn[l] * rate;
  const Lane* row = tile.travel.row;
  pose.support = row[kRootRightStands][l] > row[kRootLeftStands][l] ? mocap::kRight : mocap::kLeft;
  return pose;
}

Eigen::Vector3d CharacterBatch::Data::in_world(int i, const Lane* p) {
  const Tile& t = tile(i);
  const int l = i % kLanes;
  const double x = p[0][l], y = p[1][l], c = t.cos_heading[l], s = t.sin_heading[l];
  return {t.x[l] + c * x - s * y, t.y[l] + s * x + c * y,
          static_cast<double>(p[2][l]) + static_cast<double>(t.travel.height[l])};
}

Eigen::Vector3d CharacterBatch::joint_W_m(int i, int body_joint) const {
  MIMESIS_ASSERT(body_joint >= 0 && body_joint < mocap::kBodyJoints);
  return data_->in_world(i, data_->tile(i).point.joint[body_joint]);
}
Eigen::Vector3d CharacterBatch::heel_W_m(int i, int side) const {
  return data_->in_world(i, data_->tile(i).point.foot[side == mocap::kLeft ? 0 : 2]);
}
Eigen::Vector3d CharacterBatch::toe_W_m(int i, int side) const {
  return data_->in_world(i, data_->tile(i).point.foot[side == mocap::kLeft ? 1 : 3]);
}

}  // namespace mimesis::synthesizer
