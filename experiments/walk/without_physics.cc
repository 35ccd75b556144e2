// Replaces the figures in a build without DART: every figure is listed and refuses to
// run.
#include <stdexcept>
#include <string>

#include "experiments/walk/figures.h"

namespace mimesis::walk {
namespace {

auto refusal(const std::string& name) {
  return [name](const PlotDir&) -> reproduce::Report {
    throw std::runtime_error(
        name + ": built without physics; tools/setup walking, then configure and build again");
  };
}

}  // namespace

std::vector<reproduce::Figure> figures() {
  std::vector<reproduce::Figure> out;
  for (const Title& t : kTitles) {
    out.push_back({t.name, t.title, t.source, t.rows, refusal(t.name), t.cpu_minutes});
  }
  return out;
}

}  // namespace mimesis::walk
