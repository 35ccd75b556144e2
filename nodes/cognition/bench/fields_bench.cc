// Speed of eq. 2.1 and of the network of seven fields, on one core.
#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numeric>
#include <unsupported/Eigen/FFT>
#include <vector>

#include "nodes/cognition/network_file.h"
#include "nodes/cognition/test/wired.h"
#include "nodes/cognition/trial.h"

namespace mimesis::cognition {
namespace {

constexpr double kDt_s = 0.001;

FieldParams sized(std::int64_t neurons) {
  FieldParams p;
  p.neurons = static_cast<int>(neurons);
  return p;
}

/// A self-sustained peak in the middle, so that no case profits from a field at rest.
template <class Real>
void ignite(NeuralField<Real>& field) {
  for (int t = 0; t < 200; ++t) {
    for (std::size_t i = 0; i < field.input().size(); ++i) {
      const double d = (static_cast<double>(i) - 0.5 * field.params().neurons) / 5.0;
      field.input()[i] = static_cast<Real>(6.0 * std::exp(-0.5 * d * d));
    }
    field.step();
  }
}

template <class Real>
void field_step(benchmark::State& state) {
  NeuralField<Real> field(sized(state.range(0)), kDt_s);
  ignite(field);
  for (auto _ : state) {
    field.step();
    benchmark::DoNotOptimize(field.activity().data());
  }
  state.SetItemsProcessed(state.iterations());  // field-steps/s
}
BENCHMARK(field_step<float>)->Name("field_step/float")->Arg(101)->Arg(128)->Arg(256)->Arg(512);
BENCHMARK(field_step<double>)->Name("field_step/double")->Arg(101)->Arg(128)->Arg(256)->Arg(512);

/// A plane of N x N neurons.
template <class Real>
void plane_step(benchmark::State& state) {
  FieldParams p = sized(state.range(0));
  p.rows = p.neurons;
  p.excitation = 0.5;
  p.inhibition = 0.15;
  NeuralField<Real> field(p, kDt_s);
  for (auto _ : state) {
    for (std::size_t y = 24; y < 40; ++y) field.input()[y * 64 + 32] = Real(3);
    field.step();
    benchmark::DoNotOptimize(field.activity().data());
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(plane_step<float>)->Name("plane_step/float")->Arg(64);
BENCHMARK(plane_step<double>)->Name("plane_step/double")->Arg(64);

/// Two populations, and a step of the shunted rule between two of them.
template <class Real>
void transient_step(benchmark::State& state) {
  FieldParams p = sized(64);
  p.inhibition = 0.0;
  p.threshold1 = 0.0;
  p.excitation = 1.3;
  p.width = 3.0;
  p.decay = 0.6;
  NeuralField<Real> a(p, kDt_s), b(p, kDt_s);
  Link<Real> link(64, 64, 1.0);
  link.fill(Real(0.1));
  for (auto _ : state) {
    a.input()[32] = b.input()[32] = Real(4);
    a.step();
    b.step();
    link.learn_shunted(b.activity(), b.rate(), a.rate(), {}, kDt_s);
    benchmark::DoNotOptimize(b.activity().data());
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(transient_step<float>)->Name("transient_pair_learning/float");
BENCHMARK(transient_step<double>)->Name("transient_pair_learning/double");

/// The field equation in plain Eigen: dense kernel matrix, array expressions.
template <class Real>
void eigen_dense(benchmark::State& state) {
  using Vector = Eigen::Array<Real, Eigen::Dynamic, 1>;
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  const FieldParams p = sized(state.range(0));
  NeuralField<Real> ours(p, kDt_s);
  ignite(ours);
  Vector u = Eigen::Map<const Vector>(ours.activity().data(), p.neurons);
  const Vector input = Vector::Zero(p.neurons);
  const Matrix w = Matrix::NullaryExpr(p.neurons, p.neurons, [&](Eigen::Index i, Eigen::Index j) {
    const double d = static_cast<double>(i - j) / p.width;  // cut off as ours is
    return std::abs(d) > 4.0 ? Real(0) : static_cast<Real>(p.excitation * std::exp(-0.5 * d * d));
  });
  const auto h = static_cast<Real>(p.resting_level), beta = static_cast<Real>(p.slope);
  const auto theta1 = static_cast<Real>(p.threshold1), theta2 = static_cast<Real>(p.threshold2);
  const auto inhibition = static_cast<Real>(p.inhibition), a = static_cast<Real>(kDt_s / p.tau_s);
  Vector f1(p.neurons), f2(p.neurons), lateral(p.neurons);
  for (auto _ : state) {
    f1 = Real(1) / (Real(1) + (-beta * (u - theta1)).exp());
    f2 = Real(1) / (Real(1) + (-beta * (u - theta2)).exp());
    lateral.matrix().noalias() = w * f2.matrix();
    u += a * (h - u + input + f1 * (lateral - inhibition * f2.sum()));
    benchmark::DoNotOptimize(u.data());
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(eigen_dense<float>)
    ->Name("peer/eigen_dense/float")
    ->Arg(101)
    ->Arg(128)
    ->Arg(256)
    ->Arg(512);
BENCHMARK(eigen_dense<double>)
    ->Name("peer/eigen_dense/double")
    ->Arg(101)
    ->Arg(128)
    ->Arg(256)
    ->Arg(512);

/// u of a peer must be ours, step by step; else the case ends with an error.
template <class Real, class Step>
bool equal(benchmark::State& state, NeuralField<Real>& ours, std::vector<Real>& u,
           const Step& step) {
  double apart = 0.0;
  for (int t = 0; t < 200; ++t) {
    ours.step(), step();
    for (std::size_t i = 0; i < ours.activity().size(); ++i)
      apart = std::max(apart, std::abs(static_cast<double>(u[i] - ours.activity()[i])));
  }
  state.counters["apart"] = apart;
  if (apart < 2e-3) return true;
  state.SkipWithError("the outputs differ");
  return false;
}

/// The convolution by Fourier transform (Eigen's kissfft; FFTW, which is GPL, is 1.5 M
/// field-steps/s for 128 floats of a quiet core with -march=native in our own study), zeros beyond
/// the axis.
template <class Real>
void fourier(benchmark::State& state) {
  using Complex = std::complex<Real>;
  const FieldParams p = sized(state.range(0));
  NeuralField<Real> ours(p, kDt_s);
  ignite(ours);
  const auto n = static_cast<std::size_t>(p.neurons);
  const auto halo = static_cast<std::size_t>(std::ceil(4.0 * p.width));
  std::size_t padded = 1;
  while (padded < n + halo) padded *= 2;
  Eigen::FFT<Real> fft;
  fft.SetFlag(Eigen::FFT<Real>::HalfSpectrum);
  std::vector<Real> rate(padded), sums(padded), u(ours.activity().begin(), ours.activity().end());
  std::vector<Complex> spectrum, kernel;
  for (std::size_t j = 0; j <= halo; ++j) {
    const double d = static_cast<double>(j) / p.width;
    rate[j] = rate[(padded - j) % padded] =
        static_cast<Real>(p.excitation * std::exp(-0.5 * d * d));
  }
  fft.fwd(kernel, rate);
  std::ranges::fill(rate, Real(0));
  const auto h = static_cast<Real>(p.resting_level), beta = static_cast<Real>(p.slope);
  const auto theta1 = static_cast<Real>(p.threshold1), theta2 = static_cast<Real>(p.threshold2);
  const auto inhibition = static_cast<Real>(p.inhibition), a = static_cast<Real>(kDt_s / p.tau_s);
  const auto step = [&] {
    for (std::size_t i = 0; i < n; ++i)
      rate[i] = Real(1) / (Real(1) + std::exp(-beta * (u[i] - theta2)));
    const Real all = std::accumulate(rate.begin(), rate.end(), Real(0));
    fft.fwd(spectrum, rate);
    for (std::size_t i = 0; i < spectrum.size(); ++i) spectrum[i] *= kernel[i];
    fft.inv(sums, spectrum, static_cast<Eigen::Index>(padded));
    for (std::size_t i = 0; i < n; ++i) {
      const Real gate = Real(1) / (Real(1) + std::exp(-beta * (u[i] - theta1)));
      u[i] += a * (h - u[i] + gate * (sums[i] - inhibition * all));
    }
  };
  if (!equal(state, ours, u, step)) return;
  for (auto _ : state) {
    step();
    benchmark::DoNotOptimize(u.data());
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(fourier<float>)->Name("peer/eigen_fft/float")->Arg(101)->Arg(128)->Arg(256)->Arg(512);
BENCHMARK(fourier<double>)->Name("peer/eigen_fft/double")->Arg(101)->Arg(128)->Arg(256)->Arg(512);

/// The scheme of dnf-composer: a kernel cut off, here where ours is, slid along the rates between
/// zeros, in plain loops.
template <class Real>
void sliding_kernel(benchmark::State& state) {
  const FieldParams p = sized(state.range(0));
  NeuralField<Real> ours(p, kDt_s);
  ignite(ours);
  const auto n = static_cast<std::size_t>(p.neurons);
  const auto halo = static_cast<std::size_t>(std::ceil(4.0 * p.width));
  std::vector<Real> kernel(2 * halo + 1), u(ours.activity().begin(), ours.activity().end());
  for (std::size_t j = 0; j < kernel.size(); ++j) {
    const double d = (static_cast<double>(j) - static_cast<double>(halo)) / p.width;
    kernel[j] = static_cast<Real>(p.excitation * std::exp(-0.5 * d * d));
  }
  const auto h = static_cast<Real>(p.resting_level), beta = static_cast<Real>(p.slope);
  const auto theta1 = static_cast<Real>(p.threshold1), theta2 = static_cast<Real>(p.threshold2);
  const auto inhibition = static_cast<Real>(p.inhibition), a = static_cast<Real>(kDt_s / p.tau_s);
  std::vector<Real> rate(n + 2 * halo), input(n), lateral(n);
  const auto step = [&] {
    for (std::size_t i = 0; i < n; ++i)
      rate[halo + i] = Real(1) / (Real(1) + std::exp(-beta * (u[i] - theta2)));
    const Real all = std::accumulate(rate.begin(), rate.end(), Real(0));
    for (std::size_t i = 0; i < n; ++i) {
      Real sum = 0;
      for (std::size_t j = 0; j < kernel.size(); ++j) sum += kernel[j] * rate[i + j];
      lateral[i] = sum - inhibition * all;
    }
    for (std::size_t i = 0; i < n; ++i) {
      const Real gate = Real(1) / (Real(1) + std::exp(-beta * (u[i] - theta1)));
      u[i] += a * (h - u[i] + input[i] + gate * lateral[i]);
    }
  };
  if (!equal(state, ours, u, step)) return;
  for (auto _ : state) {
    step();
    benchmark::DoNotOptimize(u.data());
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(sliding_kernel<float>)->Name("peer/sliding_kernel/float")->Arg(101)->Arg(128)->Arg(512);
BENCHMARK(sliding_kernel<double>)->Name("peer/sliding_kernel/double")->Arg(101)->Arg(128)->Arg(512);

/// Seven fields, twelve links, which all learn if `learn`; all layers active. Items:
/// network-steps/s.
template <class Real, bool learn, bool low_rank = false>
void network_step(benchmark::State& state) {
  NetworkSpec spec = learn || low_rank ? wired(load_network()) : load_network();
  for (LinkSpec& link : spec.links) {
    if (learn) link.form = "dense", link.learns = "success";
  }
  for (FieldSpec& f : spec.fields) f.params.neurons = static_cast<int>(state.range(0));
  FieldNetwork<Real> network(spec);
  const Demonstration shown = task::parse_demonstration("precision,above,high,light");
  rehearse(network, shown);
  run_trial(network, {.shown = shown});
  const Stimulus task = task_stimulus(spec);
  for (auto _ : state) {
    network.step(task, learn);
    benchmark::DoNotOptimize(network.field(Layer::pf).activity().data());
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(network_step<float, false>)->Name("network_step/float")->Arg(128)->Arg(256);
BENCHMARK(network_step<float, false, true>)
    ->Name("network_step/low_rank/float")
    ->Arg(128)
    ->Arg(256);
BENCHMARK(network_step<float, true>)->Name("network_step/learning/float")->Arg(128)->Arg(256);
BENCHMARK(network_step<double, false>)->Name("network_step/double")->Arg(128);

}  // namespace
}  // namespace mimesis::cognition
