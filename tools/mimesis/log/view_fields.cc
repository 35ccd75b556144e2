#include "tools/mimesis/log/view_fields.h"

#include <algorithm>
#include <cmath>

namespace mimesis::tool {
namespace {

constexpr double kLeft = -0.2, kWidth = 1.2;    // of the curves along x of W [m]
constexpr double kPlane = 1.25, kBoard = 1.26;  // y of the curves and of the board behind them [m]
constexpr double kBottom = 0.15, kRow = 0.17;  // z of the board's lower edge, height of a field [m]
constexpr double kMargin = 0.25;               // left of the curves, for their names [m]
// In recorded runs fields rest at -3 and rise to 16: the line u = 0 is low in the row.
constexpr double kZeroLine = 0.04, kScale = 0.0075;  // [m], of one unit of activity [m]
constexpr double kSmallest = -4.0, kLargest = 16.0;  // activity that stays within the row [1]
constexpr model::Rgba kRest{0.25, 0.45, 0.9, 1.0}, kZero{0.55, 0.55, 0.55, 1.0},
    kActive{1.0, 0.55, 0.1, 1.0}, kText{0.95, 0.95, 0.95, 1.0}, kBack{0.1, 0.11, 0.13, 1.0};

model::Rgba mixed(const model::Rgba& from, const model::Rgba& to, double share) {
  return {std::lerp(from.r, to.r, share), std::lerp(from.g, to.g, share),
          std::lerp(from.b, to.b, share), 1.0};
}

void draw_curve(foxglove::SceneEntity& entity, const v1::Field& field, double z_zero) {
  auto& zero = model::add_line(entity, foxglove::LinePrimitive::LINE_STRIP, 1.0, kZero);
  model::add_point(zero, {kLeft, kPlane, z_zero});
  model::add_point(zero, {kLeft + kWidth, kPlane, z_zero});
  auto& curve = model::add_line(entity, foxglove::LinePrimitive::LINE_STRIP, 3.0, kZero);
  const double step = kWidth / std::max(1, field.u_size() - 1);
  for (int i = 0; i < field.u_size(); ++i) {
    const double u = std::isfinite(field.u(i)) ? field.u(i) : 0.0;
    const double shown = std::clamp(u, kSmallest, kLargest);
    model::add_point(curve, {kLeft + i * step, kPlane, z_zero + kScale * shown});
    model::set(activity_color(u), *curve.add_colors());
  }
  model::add_label(entity, {kLeft - 0.5 * kMargin, kPlane, z_zero + 0.04}, 0.06, field.name(),
                   kText);
}

}  // namespace

model::Rgba activity_color(double u) {
  const double share = std::tanh(0.5 * u);
  return share < 0.0 ? mixed(kZero, kRest, -share) : mixed(kZero, kActive, share);
}

foxglove::SceneUpdate to_board(const v1::FieldActivity& fields) {
  foxglove::SceneUpdate update;
  const std::chrono::nanoseconds stamp(fields.header().stamp_ns());
  foxglove::SceneEntity& entity = model::add_entity(update, "fields", "world", stamp);
  const double height = kRow * fields.fields_size();
  const Eigen::Vector3d middle(kLeft + 0.5 * (kWidth - kMargin), kBoard, kBottom + 0.5 * height);
  model::add_box(entity, Eigen::Isometry3d(Eigen::Translation3d(middle)),
                 {kWidth + kMargin + 0.1, 0.01, height}, kBack);
  for (int i = 0; i < fields.fields_size(); ++i) {
    draw_curve(entity, fields.fields(i), kBottom + height - (i + 1) * kRow + kZeroLine);
  }
  return update;
}

}  // namespace mimesis::tool
