#include "nodes/crowd/engine/walk.h"

#include <algorithm>

#include "common/math/vector_clones.h"
#include "nodes/crowd/engine/walk_rows.h"

namespace mimesis::crowd {

void WalkField::set_gait(const SpeedFunction& gait, const HeadingSway& of_heading) {
  mean_g = gait.mean();
  std::copy_n(gait.cosine().begin(), cosine.size(), cosine.begin());
  std::copy_n(gait.sine().begin(), sine.size(), sine.begin());
  sway = of_heading;
  sways = !sway.none();
}

void WalkSums::add(const WalkSums& o) {
  count += o.count;
  cos_phase += o.cos_phase;
  sin_phase += o.sin_phase;
  error += o.error;
  cos_heading += o.cos_heading;
  sin_heading += o.sin_heading;
}

MIMESIS_VECTOR_CLONES
WalkSums walk_sums(const WalkField& field, const Table& table, int first, int last) {
  return rows::sum_rows(field, table, first, last);
}

MIMESIS_VECTOR_CLONES
WalkSums walk(const WalkField& field, Table& table, int first, int last) {
  return rows::walk_rows(field, table, first, last);
}

}  // namespace mimesis::crowd
