#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/motion/demix/baselines.h"
#include "common/motion/demix/sisa.h"
#include "tools/mimesis/demix/trial_files.h"

namespace mimesis::tool {

/// One way to describe the set, and how well it does.
struct Method {
  std::string name;
  int sources = 0;
  std::int64_t parameters = 0;                  ///< means apart
  double quality = 0.0, quality_squared = 0.0;  ///< Q, Q2
};

struct JointError {
  std::string joint;
  double rms_rad = 0.0;  ///< over its rows, trials and samples
};

struct DemixReport {
  std::size_t trials = 0, rows = 0;
  Eigen::Index samples = 0;
  Method method;
  std::vector<Method> others;  ///< on the same set
  std::vector<JointError> joints;
};

/// Q and Q2 of a mixture, beside principal components, sinusoids, and as many principal components
/// as have the same number of parameters.
DemixReport make_report(const mocap::Trials& set, const demix::Mixture& mixture,
                        const std::string& name, demix::Delays delays);

void print(const DemixReport& report);
nlohmann::ordered_json to_json(const DemixReport& report);

/// NAME-sources.png and NAME-quality.png in the folder: Q against K for 1..up_to sources of the
/// method and the others. Returns the files. @param options  sources is not used
std::vector<std::string> plot_demixing(const std::string& folder, const std::string& name,
                                       const mocap::Trials& set, const demix::Mixture& mixture,
                                       demix::SisaOptions options, int up_to);

}  // namespace mimesis::tool
