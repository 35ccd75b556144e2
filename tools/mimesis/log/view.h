#pragma once
#include <string>
#include <vector>

#include "tools/mimesis/log/new_log.h"
#include "tools/mimesis/log/view_layers.h"

namespace mimesis::tool {

struct ViewOptions {
  std::vector<std::string> inputs;  ///< logs, taken as one
  OutputOptions output;
  ViewLayers layers;
  bool json = false;
};

/// `mimesis log view`: everything of the inputs, and drawings for viewers on topics view/... beside
/// it. Returns the exit code. @throws ConfigError
int log_view(const ViewOptions& options);

}  // namespace mimesis::tool
