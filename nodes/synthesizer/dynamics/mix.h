#pragma once

namespace mimesis::synthesizer {

/// rows[r] += share · Σ_b basis[b] · series[b·stride + r] for all r < stride. basis_count a
/// multiple of 4, stride of 16. Vectorised over the rows, so that characters share a series without
/// gathering.
void add_mix(const float* series, const float* basis, int basis_count, int stride, float share,
             float* rows);

}  // namespace mimesis::synthesizer
