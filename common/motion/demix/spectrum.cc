#include "common/motion/demix/spectrum.h"

#include <complex>
#include <unsupported/Eigen/FFT>

#include "common/math/vector_clones.h"

namespace mimesis::demix {

Eigen::MatrixXd to_spectrum(const Eigen::MatrixXd& x, Eigen::Index harmonics, Eigen::Index half) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(2 * half, x.rows());
  if (x.rows() == 0) return out;
  const double scale = std::sqrt(2.0 / static_cast<double>(x.cols()));
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  Eigen::VectorXd row(x.cols());
  Eigen::VectorXcd bins;
  for (Eigen::Index n = 0; n < x.rows(); ++n) {
    row = x.row(n);
    fft.fwd(bins, row);
    out.col(n).head(harmonics) = scale * bins.segment(1, harmonics).real();
    out.col(n).segment(half, harmonics) = scale * bins.segment(1, harmonics).imag();
  }
  return out;
}

Eigen::MatrixXd from_spectrum(const Eigen::MatrixXd& spectrum, Eigen::Index samples) {
  const Eigen::Index half = spectrum.rows() / 2;
  const Eigen::Index harmonics = std::min(half, harmonic_count(samples));
  const double scale = std::sqrt(static_cast<double>(samples) / 2.0);
  Eigen::MatrixXd out(spectrum.cols(), samples);
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  Eigen::VectorXcd bins(samples / 2 + 1);
  Eigen::VectorXd row(samples);
  for (Eigen::Index n = 0; n < spectrum.cols(); ++n) {
    bins.setZero();
    for (Eigen::Index f = 0; f < harmonics; ++f) {
      bins[f + 1] = scale * std::complex<double>(spectrum(f, n), spectrum(half + f, n));
    }
    fft.inv(row, bins, samples);
    out.row(n) = row;
  }
  return out;
}

namespace {

using Index = Eigen::Index;
// Eight lanes with every instruction set: the same bits. GNU vectors keep their alignment only as
// typedefs written out.
using Lanes8 [[gnu::vector_size(64), gnu::aligned(8), gnu::may_alias]] = double;
using Lanes4 [[gnu::vector_size(32), gnu::aligned(8), gnu::may_alias]] = double;
using Floats16 [[gnu::vector_size(64), gnu::aligned(4), gnu::may_alias]] = float;
using Ints16 [[gnu::vector_size(64), gnu::aligned(4), gnu::may_alias]] = int;

/// Inlined by force: it is compiled for the instruction set of the clone that calls it.
[[gnu::always_inline]] inline double dot(const double* p, const double* q, Index length) {
  Lanes8 sum = {};
  for (Index l = 0; l < length; l += 8) {
    sum += *reinterpret_cast<const Lanes8*>(p + l) * *reinterpret_cast<const Lanes8*>(q + l);
  }
  const Lanes4 half =
      __builtin_shufflevector(sum, sum, 0, 1, 2, 3) + __builtin_shufflevector(sum, sum, 4, 5, 6, 7);
  return (half[0] + half[2]) + (half[1] + half[3]);
}

/// With the number of others known to the compiler; 0: any.
template <int N>
[[gnu::always_inline]] inline int best_gain_of(const GainTerms& terms, int place, float* scratch) {
  const Index count = N == 0 ? terms.count : N;
  Floats16 few[N + 1];
  // L⁻¹ of the others' inner products with s
  Floats16* v = N == 0 ? reinterpret_cast<Floats16*>(scratch) : few;
  float* gains = scratch + 16 * count;
  Floats16 most = {};
  Ints16 here = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15}, where = here;
  for (Index j = 0; j < terms.grid; j += 16) {
    Floats16 room = {};
    room += terms.energy;
    for (Index o = 0; o < count; ++o) {
      Floats16 value = *reinterpret_cast<const Floats16*>(terms.others[o] + j);
      for (Index q = 0; q < o; ++q) value -= terms.factor[o + q * terms.stride] * v[q];
      value *= terms.factor[o + o * terms.stride];
      v[o] = value;
      room -= value * value;
    }
    Floats16 sum = {};
    for (Index i = 0; i < terms.group; ++i) {
      Floats16 rest = *reinterpret_cast<const Floats16*>(terms.data + i * terms.grid + j);
      for (Index o = 0; o < count; ++o) rest -= terms.weight[o + i * terms.stride] * v[o];
      if (terms.nonnegative) rest = rest > 0.0f ? rest : rest * 0.0f;
      sum += rest * rest;
    }
    Floats16 least = {};
    least += terms.least_room;
    const Floats16 gain = sum / (room > least ? room : least);
    *reinterpret_cast<Floats16*>(gains + j) = gain;
    const Ints16 more = gain > most;
    most = more ? gain : most;
    where = more ? here : where;
    here += 16;
  }
  float largest = gains[place];
  for (int lane = 0; lane < 16; ++lane) {
    if (most[lane] > largest) {
      largest = most[lane];
      place = where[lane];
    }
  }
  return place;
}

}  // namespace

MIMESIS_VECTOR_CLONES
void shift_spectrum(const double* source, double phi, Index half, double* z, double* dz) {
  // e^{−ifφ} = c − is, four harmonics at a time, turned on by e^{−4iφ}
  const double c1 = std::cos(phi), s1 = std::sin(phi);
  const double c2 = c1 * c1 - s1 * s1, s2 = 2.0 * c1 * s1;
  const double c3 = c2 * c1 - s2 * s1, s3 = s2 * c1 + c2 * s1;
  const double c4 = c2 * c2 - s2 * s2, s4 = 2.0 * c2 * s2;
  Lanes4 c = {c1, c2, c3, c4}, s = {s1, s2, s3, s4}, f = {1.0, 2.0, 3.0, 4.0};
  for (Index i = 0; i < half; i += 4) {
    const Lanes4 a = *reinterpret_cast<const Lanes4*>(source + i);
    const Lanes4 b = *reinterpret_cast<const Lanes4*>(source + half + i);
    const Lanes4 re = a * c + b * s, im = b * c - a * s;
    *reinterpret_cast<Lanes4*>(z + i) = re;
    *reinterpret_cast<Lanes4*>(z + half + i) = im;
    if (dz != nullptr) {
      *reinterpret_cast<Lanes4*>(dz + i) = f * im;
      *reinterpret_cast<Lanes4*>(dz + half + i) = -f * re;
    }
    const Lanes4 next = c * c4 - s * s4;
    s = s * c4 + c * s4;
    c = next;
    f += 4.0;
  }
}

MIMESIS_VECTOR_CLONES
void inner_products(const double* a, Index na, const double* b, Index nb, Index length,
                    double* out) {
  for (Index j = 0; j < nb; ++j) {
    for (Index i = 0; i < na; ++i) out[i + j * na] = dot(a + i * length, b + j * length, length);
  }
}

MIMESIS_VECTOR_CLONES
void gram_matrix(const double* a, Index n, Index length, double* out) {
  for (Index j = 0; j < n; ++j) {
    for (Index i = j; i < n; ++i) {
      out[i + j * n] = out[j + i * n] = dot(a + i * length, a + j * length, length);
    }
  }
}

MIMESIS_VECTOR_CLONES
void correlate(const double* table, const double* u, Index quarter, Index half, double* out) {
  for (Index i = 0; i < quarter; i += 8) {
    Lanes8 odd_cos = {}, odd_sin = {}, even_cos = {}, even_sin = {};
    const double* at = table + i;
    for (Index f = 0; f < half; f += 2) {  // harmonics f + 1 (odd) and f + 2
      odd_cos += u[f] * *reinterpret_cast<const Lanes8*>(at);
      odd_sin += u[half + f] * *reinterpret_cast<const Lanes8*>(at + quarter);
      even_cos += u[f + 1] * *reinterpret_cast<const Lanes8*>(at + 2 * quarter);
      even_sin += u[half + f + 1] * *reinterpret_cast<const Lanes8*>(at + 3 * quarter);
      at += 4 * quarter;
    }
    // cos and sin of f(−θ), f(π − θ), f(π + θ) differ from those of fθ in signs only
    const Lanes8 cos_sum = even_cos + odd_cos, cos_rest = even_cos - odd_cos;
    const Lanes8 sin_sum = even_sin + odd_sin, sin_rest = even_sin - odd_sin;
    *reinterpret_cast<Lanes8*>(out + i) = cos_sum - sin_sum;
    *reinterpret_cast<Lanes8*>(out + quarter + i) = cos_sum + sin_sum;
    *reinterpret_cast<Lanes8*>(out + 2 * quarter + i) = cos_rest + sin_rest;
    *reinterpret_cast<Lanes8*>(out + 3 * quarter + i) = cos_rest - sin_rest;
  }
}

MIMESIS_VECTOR_CLONES
int best_gain(const GainTerms& terms, int place, float* scratch) {
  switch (terms.count) {
    case 1:
      return best_gain_of<1>(terms, place, scratch);
    case 2:
      return best_gain_of<2>(terms, place, scratch);
    case 3:
      return best_gain_of<3>(terms, place, scratch);
    case 4:
      return best_gain_of<4>(terms, place, scratch);
    default:
      return best_gain_of<0>(terms, place, scratch);
  }
}

}  // namespace mimesis::demix
