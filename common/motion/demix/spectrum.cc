#include "common/motion/demix/spectrum.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>

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

}  // namespace mimesis::demix
