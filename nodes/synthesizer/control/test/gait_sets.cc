#include "nodes/synthesizer/control/test/gait_sets.h"

#include <Eigen/Dense>
#include <complex>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include "common/math/circle.h"
#include "nodes/synthesizer/demix/mixture.h"

namespace mimesis::synthesizer::testing {
namespace {

using Eigen::Index;
constexpr double kCmuUnit_m = 0.0254 / 0.45;

std::vector<std::string> split(const std::string& line, char by) {
  std::vector<std::string> parts;
  std::istringstream in(line);
  for (std::string part; std::getline(in, part, by);) parts.push_back(part);
  return parts;
}

/// Horizontal travel of the root between two frames of a CMU BVH; 0 if there is no such file.
double travel_m(const std::string& file, long first, long last) {
  std::ifstream in(file);
  std::string line;
  while (std::getline(in, line) && line.find("Frame Time") == std::string::npos) {
  }
  Eigen::Vector3d from = Eigen::Vector3d::Zero(), p = from;
  for (long frame = 0; std::getline(in, line); ++frame) {
    std::istringstream numbers(line);
    numbers >> p.x() >> p.y() >> p.z();
    if (frame == first) from = p;
    if (frame == last) return kCmuUnit_m * std::hypot(p.x() - from.x(), p.z() - from.z());
  }
  return 0.0;
}

/// "dataset-1_walk_happy_001.bvh" -> "happy", "..walk-left_normal.." -> "left".
std::string style_of(const std::string& clip) {
  const auto words = split(clip, '_');
  if (words.size() < 4) return "walk";
  const auto dash = words[1].rfind('-');
  return dash == std::string::npos ? words[2] : words[1].substr(dash + 1);
}

}  // namespace

std::string shared_folder() {
  const char* shared = std::getenv("MIMESIS_SHARED");
  const std::string folder = shared ? shared : std::string(MIMESIS_SOURCE_DIR) + "/../shared";
  return std::filesystem::exists(folder + "/data/mocap/sets/A.csv") ? folder : "";
}

mocap::Trials gait_set(const std::string& name, const std::string& clip) {
  const std::string mocap_folder = shared_folder() + "/data/mocap/";
  std::ifstream in(mocap_folder + "sets/" + name + ".csv");
  mocap::Trials set;
  std::vector<std::vector<double>> samples;
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    const auto f = split(line, ',');
    if (f[0].find(clip) == std::string::npos) continue;
    const int cycle = std::stoi(f[1]);
    if (set.trials.empty() || set.trials.back().clip != f[0] || set.trials.back().cycle != cycle) {
      mocap::Trial t;
      t.clip = f[0];
      t.style = style_of(f[0]);
      t.cycle = cycle;
      t.first_frame = std::stol(f[2]);
      t.last_frame = std::stol(f[3]);
      t.duration_s = std::stod(f[4]);
      t.step_length_m = travel_m(mocap_folder + "cmu_bvh/" + f[0], t.first_frame, t.last_frame);
      set.trials.push_back(t);
    }
    if (set.trials.size() == 1) set.rows.push_back(f[5] + "." + f[6]);
    samples.emplace_back();
    for (std::size_t i = 7; i < f.size(); ++i) samples.back().push_back(std::stod(f[i]));
  }
  set.samples.resize(static_cast<Index>(samples.size()), static_cast<Index>(samples[0].size()));
  for (std::size_t r = 0; r < samples.size(); ++r) {
    for (std::size_t t = 0; t < samples[r].size(); ++t) {
      set.samples(static_cast<Index>(r), static_cast<Index>(t)) = samples[r][t];
    }
  }
  return set;
}

namespace {

using Complex = std::complex<double>;
constexpr Index kHarmonics = 16;  // the sets are low-passed at 8 Hz

/// N×F: coefficients of harmonics 1..F, so that x(t) = Σ Re(c_f e^{ift}).
Eigen::MatrixXcd harmonics(const Eigen::MatrixXd& x) {
  const Index length = x.cols();
  Eigen::MatrixXcd basis(length, kHarmonics);
  for (Index t = 0; t < length; ++t) {
    for (Index f = 0; f < kHarmonics; ++f) {
      basis(t, f) = std::polar(
          2.0 / static_cast<double>(length),
          -math::kTwoPi * static_cast<double>((f + 1) * t) / static_cast<double>(length));
    }
  }
  return x.cast<Complex>() * basis;
}

Eigen::MatrixXd samples_of(const Eigen::MatrixXcd& c, Index length) {
  Eigen::MatrixXcd basis(kHarmonics, length);
  for (Index t = 0; t < length; ++t) {
    for (Index f = 0; f < kHarmonics; ++f) {
      basis(f, t) = std::polar(
          1.0, math::kTwoPi * static_cast<double>((f + 1) * t) / static_cast<double>(length));
    }
  }
  return (c * basis).real();
}

Eigen::RowVectorXcd delayed(const Eigen::RowVectorXcd& source, double delay_rad) {
  Eigen::RowVectorXcd out = source;
  for (Index f = 0; f < kHarmonics; ++f) {
    out[f] *= std::polar(1.0, -static_cast<double>(f + 1) * delay_rad);
  }
  return out;
}

/// Delays, weights, sources in turn, on spectra.
struct Alternation {
  Eigen::MatrixXcd x;  // N×F, N = trials·R
  Index rows, trials;
  Eigen::MatrixXcd sources;  // K×F
  Eigen::MatrixXd delay;     // R×K
  Eigen::MatrixXd weight;    // N×K

  Eigen::MatrixXcd shifted(Index r) const {
    Eigen::MatrixXcd s(sources.rows(), kHarmonics);
    for (Index k = 0; k < sources.rows(); ++k) s.row(k) = delayed(sources.row(k), delay(r, k));
    return s;
  }

  void find_weights(Index r) {
    const Eigen::MatrixXcd s = shifted(r);
    const Eigen::MatrixXd gram = (s * s.adjoint()).real();
    for (Index i = 0; i < trials; ++i) {
      const Eigen::VectorXd right = (s.conjugate() * x.row(i * rows + r).transpose()).real();
      weight.row(i * rows + r) = gram.ldlt().solve(right).transpose();
    }
  }

  void find_delay(Index r, Index k) {
    Eigen::MatrixXcd cross(trials, kHarmonics);
    const Eigen::MatrixXcd s = shifted(r);
    for (Index i = 0; i < trials; ++i) {
      Eigen::RowVectorXcd rest = x.row(i * rows + r) - weight.row(i * rows + r) * s;
      rest += weight(i * rows + r, k) * s.row(k);
      cross.row(i) = rest.cwiseProduct(sources.row(k).conjugate());
    }
    double best = -1.0;
    constexpr int kGrid = 400;
    for (int g = 0; g < kGrid; ++g) {
      const double phi = std::numbers::pi * g / kGrid;  // the other half turn: sign, mostly
      for (const double at : {phi, phi - std::numbers::pi}) {
        Eigen::VectorXcd turn(kHarmonics);
        for (Index f = 0; f < kHarmonics; ++f) {
          turn[f] = std::polar(1.0, static_cast<double>(f + 1) * at);
        }
        const double pooled = (cross * turn).real().squaredNorm();
        if (pooled > best * (1.0 + 1e-12)) {
          best = pooled;
          delay(r, k) = at;
        }
      }
    }
  }

  void find_sources() {
    for (Index f = 0; f < kHarmonics; ++f) {
      Eigen::MatrixXcd a(x.rows(), sources.rows());
      for (Index n = 0; n < x.rows(); ++n) {
        for (Index k = 0; k < sources.rows(); ++k) {
          a(n, k) =
              weight(n, k) * std::polar(1.0, -static_cast<double>(f + 1) * delay(n % rows, k));
        }
      }
      Eigen::MatrixXcd gram = a.adjoint() * a;
      gram.diagonal().array() += 1e-9 * gram.real().trace();
      sources.col(f) = gram.ldlt().solve(a.adjoint() * x.col(f));
    }
    for (Index k = 0; k < sources.rows(); ++k) {
      const double rms = sources.row(k).norm() / std::numbers::sqrt2;
      sources.row(k) /= rms;
      weight.col(k) *= rms;
    }
  }
};

}  // namespace

MotionModel tied_model(const mocap::Trials& trials, int sources, int iterations) {
  const Index rows = trials.rows_per_trial(), length = trials.samples.cols();
  const Eigen::VectorXd mean = trials.samples.rowwise().mean();
  Alternation a{harmonics(trials.samples.colwise() - mean),
                rows,
                static_cast<Index>(trials.trials.size()),
                Eigen::MatrixXcd::Zero(sources, kHarmonics),
                Eigen::MatrixXd::Zero(rows, sources),
                Eigen::MatrixXd::Zero(trials.samples.rows(), sources)};
  for (int k = 0; k < sources; ++k) a.sources(k, k) = std::numbers::sqrt2;
  for (int i = 0; i < iterations; ++i) {
    for (Index r = 0; r < rows; ++r) {
      for (Index k = 0; k < sources; ++k) {
        a.find_delay(r, k);
        a.find_weights(r);
      }
    }
    if (i + 1 < iterations) a.find_sources();
  }
  MotionModel model;
  model.rows = trials.rows;
  model.tied = true;
  model.sources = samples_of(a.sources, length);
  Eigen::MatrixXd fit(trials.samples.rows(), length);
  for (std::size_t i = 0; i < trials.trials.size(); ++i) {
    const Index at = static_cast<Index>(i) * rows;
    model.patterns.push_back(
        {trials.trials[i], mean.segment(at, rows), a.weight.middleRows(at, rows), a.delay});
    const Pattern& p = model.patterns.back();
    fit.middleRows(at, rows) = synthesize(model, p.mean_rad, p.weight_rad, p.delay_rad);
  }
  model.quality = demix::quality(trials.samples, fit);
  model.quality_squared = demix::quality_squared(trials.samples, fit);
  return model;
}

Eigen::MatrixXd synthesize(const MotionModel& model, const Eigen::VectorXd& mean_rad,
                           const Eigen::MatrixXd& weight_rad, const Eigen::MatrixXd& delay_rad) {
  const Eigen::MatrixXcd sources = harmonics(model.sources);
  Eigen::MatrixXcd c = Eigen::MatrixXcd::Zero(weight_rad.rows(), kHarmonics);
  for (Index r = 0; r < c.rows(); ++r) {
    for (Index k = 0; k < sources.rows(); ++k) {
      c.row(r) += weight_rad(r, k) * delayed(sources.row(k), delay_rad(r, k));
    }
  }
  return samples_of(c, model.sources.cols()).colwise() + mean_rad;
}

}  // namespace mimesis::synthesizer::testing
