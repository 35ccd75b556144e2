#pragma once
#include "common/motion/demix/sisa.h"

namespace mimesis::demix {

struct WignerOptions {
  int sources = 4;         ///< K
  int turns = 12;          ///< iterations of (3.6), (3.7) and cross-correlation
  int factor_turns = 200;  ///< multiplicative updates of (3.6) in each
};

/// Anechoic demixing by the marginals of Wigner-Ville spectra [M18 eq. 3.4-3.7]: for sources that
/// are independent, |F ξₙ|² = Σ wₙₖ² |F sₖ|² (3.6) gives the amplitudes by non-negative matrix
/// factorisation, and the first moments (3.7) the slopes of the sources' phases. With e^{−iωτ} for
/// a delay τ the sign before τₙₖ in (3.7) is minus. Slopes between harmonics are taken modulo 2π,
/// next to those the present sources predict. Delays follow by cross-correlation, weights by
/// regression; (3.6) starts again from the weights that this gives. The best turn is kept: unlike
/// sisa() this does not minimise the error itself. The gauge of sources and the errors are those of
/// sisa(). Deterministic.
SisaResult wigner(const mocap::Trials& set, const WignerOptions& options);

}  // namespace mimesis::demix
