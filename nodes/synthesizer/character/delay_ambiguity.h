#pragma once
#include <span>
#include <vector>

#include "nodes/synthesizer/character/parameters.h"

namespace mimesis::synthesizer {

/// A shift that leaves a periodic source as it was, up to a factor: s(t − δ) ≈ ρ·s(t).
struct SelfSimilarity {
  double shift_rad;   ///< δ in [−π, π]
  double similarity;  ///< ρ, the autocorrelation there: near +1, or near −1 (same with the sign
                      ///< turned)
};

/// The shifts with |ρ| >= `min_similarity`: extrema of the source's autocorrelation, δ = 0 first.
/// `source`: one period, uniform samples.
std::vector<SelfSimilarity> self_similarities(const Eigen::Ref<const Eigen::RowVectorXd>& source,
                                              double min_similarity);

struct Disambiguation {
  int changed = 0;               ///< delays that now stand elsewhere, but for whole turns
  double worst_error_rad = 0.0;  ///< largest rms change of a row's component, |w|·√(1−ρ²)
};

/// Makes the free delays of a set of patterns comparable, so that they can be blended linearly [M18
/// 3.4]. A source with s(t − qT/n) ≈ ±s(t) can stand at φ or at φ + 2πq/n with the same or the
/// opposite weight, and the demixing takes either. Each delay is replaced by the equivalent
/// φ̃ = φ − δ, w̃ = ρ·w that brings it nearest to those of the other patterns: the smallest sum of
/// |wₚw_q|(φ̃ₚ − φ̃_q)² over the pairs, among the choices around each pattern. The circular group of
/// a row and source is then moved by whole turns to a mean in [−π, π]. Sources below `fixed` and
/// rows whose delays agree (tied delays) stay as they are.
/// `sources`: K×T, of the model. O(R·K·P²·E) for P patterns and E equivalents.
/// @pre sizes that fit, min_similarity within (0, 1]
Disambiguation remove_delay_ambiguities(const Eigen::MatrixXd& sources, int fixed,
                                        std::span<MotionParameters> patterns,
                                        double min_similarity = 0.95);

}  // namespace mimesis::synthesizer
