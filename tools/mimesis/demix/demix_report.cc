#include "tools/mimesis/demix/demix_report.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>

#include "common/motion/demix/sisa.h"
#include "common/motion/demix/spectrum.h"
#include "tools/mimesis/demix/demix_plots.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

using demix::Delays;
using demix::Mixture;

Method measure(const std::string& name, const mocap::Trials& set, const Mixture& mixture,
               Delays delays) {
  const Eigen::MatrixXd fit = mixture.reconstruct();
  return {name, static_cast<int>(mixture.sources.rows()),
          demix::parameter_count(mixture, set, delays), demix::quality(set.samples, fit),
          demix::quality_squared(set.samples, fit)};
}

/// "lhip" of "lhip.x".
std::string joint_of(const std::string& row) { return row.substr(0, row.rfind('.')); }

std::vector<JointError> joint_errors(const mocap::Trials& set, const Mixture& mixture) {
  const Eigen::MatrixXd error = mixture.reconstruct() - set.samples;
  const auto rows = static_cast<std::size_t>(set.rows_per_trial());
  std::vector<JointError> out;
  for (std::size_t first = 0; first < rows;) {
    std::size_t last = first + 1;
    while (last < rows && joint_of(set.rows[last]) == joint_of(set.rows[first])) ++last;
    double squares = 0.0;
    for (std::size_t i = 0; i < set.trials.size(); ++i) {
      const auto block = static_cast<Eigen::Index>(i * rows + first);
      squares += error.middleRows(block, static_cast<Eigen::Index>(last - first)).squaredNorm();
    }
    const auto values =
        static_cast<double>(set.trials.size() * (last - first)) * static_cast<double>(error.cols());
    out.push_back({joint_of(set.rows[first]), std::sqrt(squares / values)});
    first = last;
  }
  return out;
}

nlohmann::ordered_json to_json(const Method& m) {
  return {{"name", m.name},
          {"sources", m.sources},
          {"parameters", m.parameters},
          {"Q", m.quality},
          {"Q2", m.quality_squared}};
}

/// A short period has fewer of them than sources may be asked for.
int most_harmonics(const mocap::Trials& set) {
  return static_cast<int>(demix::harmonic_count(set.samples.cols()));
}

}  // namespace

DemixReport make_report(const mocap::Trials& set, const Mixture& mixture, const std::string& name,
                        Delays delays) {
  DemixReport r;
  r.trials = set.trials.size();
  r.rows = set.rows.size();
  r.samples = set.samples.cols();
  r.method = measure(name, set, mixture, delays);
  const int k = r.method.sources, most = static_cast<int>(demix::rank(set));
  r.others.push_back(measure("principal components (PCA)", set,
                             demix::principal_components(set, std::min(k, most)), Delays::none));
  r.others.push_back(measure("independent components (FastICA)", set,
                             demix::independent_components(set, std::min(k, most)), Delays::none));
  r.others.push_back(measure("sinusoids, free phases", set,
                             demix::sinusoids(set, std::min(k, most_harmonics(set))),
                             Delays::free));
  const int equal = std::min(demix::components_of_equal_size(set, r.method.parameters), most);
  r.others.push_back(measure("PCA of about as many parameters", set,
                             demix::principal_components(set, equal), Delays::none));
  r.joints = joint_errors(set, mixture);
  return r;
}

void print(const DemixReport& report) {
  std::cout << fmt::format("{} trials of {} rows, {} samples a period\n", report.trials,
                           report.rows, report.samples);
  const bool bold = use_colour(STDOUT_FILENO);
  Table table({"method", "sources", "parameters", "Q", "Q2"});
  const auto row = [&table](const Method& m) {
    table.row({m.name, std::to_string(m.sources), std::to_string(m.parameters),
               fmt::format("{:.4f}", m.quality), fmt::format("{:.4f}", m.quality_squared)});
  };
  row(report.method);
  for (const Method& m : report.others) row(m);
  table.print(std::cout, bold);
  std::cout << '\n';
  Table joints({"joint", "rms error [rad]"});
  for (const JointError& j : report.joints) joints.row({j.joint, fmt::format("{:.4f}", j.rms_rad)});
  joints.print(std::cout, bold);
}

nlohmann::ordered_json to_json(const DemixReport& r) {
  nlohmann::ordered_json others = nlohmann::ordered_json::array(), joints = others;
  for (const Method& m : r.others) others.push_back(to_json(m));
  for (const JointError& j : r.joints)
    joints.push_back({{"joint", j.joint}, {"rms_rad", j.rms_rad}});
  nlohmann::ordered_json out = {{"trials", r.trials}, {"rows", r.rows}, {"samples", r.samples}};
  out.update(to_json(r.method));
  out["others"] = others;
  out["joints"] = joints;
  return out;
}

std::vector<std::string> plot_demixing(const std::string& folder, const std::string& name,
                                       const mocap::Trials& set, const Mixture& mixture,
                                       demix::SisaOptions options, int up_to) {
  std::filesystem::create_directories(folder);
  const auto path = [&](const char* what) {
    return (std::filesystem::path(folder) / (name + what)).string();
  };
  std::vector<std::string> files = {path("-sources.png"), path("-quality.png")};
  synthesizer::plot_sources(files[0], mixture.sources, mixture.fixed, name + ": sources");
  synthesizer::QualityCurve ours{options.tied ? "anechoic, tied delays" : "anechoic", {}, {}},
      pca{"PCA", {}, {}, true}, sines{"sinusoids, free phases", {}, {}, true};
  const auto add = [&set](synthesizer::QualityCurve& curve, int k, const Mixture& m) {
    curve.sources.push_back(k);
    curve.quality.push_back(demix::quality(set.samples, m.reconstruct()));
  };
  const int given = static_cast<int>(options.fixed.rows());
  for (int k = 1; k <= std::min(up_to, static_cast<int>(demix::rank(set))); ++k) {
    options.sources = k;
    if (k > given) add(ours, k, demix::sisa(set, options).mixture);
    add(pca, k, demix::principal_components(set, k));
    if (k <= most_harmonics(set)) add(sines, k, demix::sinusoids(set, k));
  }
  synthesizer::plot_quality(files[1], {ours, pca, sines}, "Q", name + ": quality and sources");
  return files;
}

}  // namespace mimesis::tool
