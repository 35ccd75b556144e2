#include "common/motion/demix/mixture.h"

#include <cmath>
#include <unsupported/Eigen/FFT>

namespace mimesis::demix {

Eigen::MatrixXd Mixture::reconstruct() const {
  const Eigen::Index count = weights.rows(), length = sources.cols();
  Eigen::MatrixXd x = means.replicate(1, length);
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  for (Eigen::Index k = 0; k < sources.rows(); ++k) {
    if (k < fixed) {
      x += weights.col(k) * sources.row(k);
      continue;
    }
    const Eigen::VectorXd source = sources.row(k);
    Eigen::VectorXcd spectrum, shifted;
    Eigen::VectorXd delayed(length);
    fft.fwd(spectrum, source);
    for (Eigen::Index n = 0; n < count; ++n) {
      shifted = spectrum;
      for (Eigen::Index f = 1; f < shifted.size(); ++f) {
        shifted[f] *= std::polar(1.0, -static_cast<double>(f) * delay_rad(n, k));
      }
      // the shifted Nyquist bin of a real signal is its real part
      if (length % 2 == 0) shifted[length / 2] = shifted[length / 2].real();
      fft.inv(delayed, shifted, length);
      x.row(n) += weights(n, k) * delayed.transpose();
    }
  }
  return x;
}

namespace {

double relative_error_squared(const Eigen::MatrixXd& x, const Eigen::MatrixXd& x_hat) {
  const Eigen::MatrixXd a = x.colwise() - x.rowwise().mean();
  const Eigen::MatrixXd b = x_hat.colwise() - x_hat.rowwise().mean();
  return (a - b).squaredNorm() / a.squaredNorm();
}

}  // namespace

double quality(const Eigen::MatrixXd& x, const Eigen::MatrixXd& x_hat) {
  return 1.0 - std::sqrt(relative_error_squared(x, x_hat));
}

double quality_squared(const Eigen::MatrixXd& x, const Eigen::MatrixXd& x_hat) {
  return 1.0 - relative_error_squared(x, x_hat);
}

}  // namespace mimesis::demix
