#include "nodes/cognition/composer_file.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "common/error.h"
#include "common/runtime/param_source.h"

namespace mimesis::cognition {
namespace {

using Json = nlohmann::ordered_json;

/// Their kernels end at 5 σ.
constexpr double kCutoff = 5.0;
/// A Heaviside function, as steep as the exponential can tell.
constexpr double kSteep = 1e6;

class Composer {
 public:
  Composer(std::string file, const Json& root) : file_(std::move(file)) {
    const bool bare = root.is_array();  // before they had a header
    spec_.dt_s = bare ? 0.001 : root.value("deltaT", 1.0) * 0.001;
    for (const Json& e : bare ? root : root.at("elements")) {
      const auto name = e.at("uniqueName").get<std::string>();
      if (!elements_.emplace(name, e).second) fail(name, "there is another of this name");
      order_.push_back(name);
    }
    for (const std::string& name : order_) {
      if (kind(name) == "neural field") add_field(name);
    }
    for (const std::string& name : order_) {
      if (kind(name) == "neural field") add_inputs(name);
    }
    spec_.place = [path = file_](const std::string&) { return path; };
  }
  NetworkSpec take() { return std::move(spec_); }

 private:
  [[noreturn]] void fail(const std::string& name, const std::string& what) const {
    throw ConfigError(fmt::format("{}: element '{}': {}", file_, name, what));
  }
  const Json& element(const std::string& name, const std::string& of) const {
    const auto it = elements_.find(name);
    if (it == elements_.end()) fail(of, "its input '" + name + "' is no element");
    return it->second;
  }
  std::string kind(const std::string& name) const { return elements_.at(name).at("label").at(1); }
  std::vector<std::string> inputs(const std::string& name) const {
    std::vector<std::string> all;
    const Json list = elements_.at(name).value("inputs", Json());
    for (const Json& input : list) {
      if (input.at(1) != "output")
        fail(name, "takes " + input.at(1).dump() + ", expected \"output\"");
      all.push_back(input.at(0));
      element(all.back(), name);
    }
    return all;
  }
  double number(const std::string& name, const char* key) const {
    const auto value = elements_.at(name).at(key).get<double>();
    if (!std::isfinite(value)) fail(name, std::string(key) + " is not finite");
    return value;
  }
  int cells(const std::string& name) const {
    return static_cast<int>(std::lround(number(name, "x_max") / number(name, "d_x")));
  }
  void same_size(const std::string& name, const std::string& field) const {
    if (cells(name) == cells(field)) return;
    fail(name,
         fmt::format("has {} cells, expected the {} of {}", cells(name), cells(field), field));
  }

  void add_field(const std::string& name) {
    const Json& activation = elements_.at(name).at("activationFunction");
    const auto type = activation.at("type").get<std::string>();
    FieldSpec f;
    f.name = name;
    f.bistable = false;
    FieldParams& p = f.params;
    p.neurons = cells(name);
    p.tau_s = number(name, "tau") * 0.001;
    p.resting_level = number(name, "restingLevel");
    if (type == "sigmoid") {
      p.slope = activation.at("steepness").get<double>();
    } else if (type == "abs_sigmoid") {
      p.slope = activation.at("beta").get<double>();
    } else if (type == "heaviside") {
      p.slope = kSteep;
    } else {
      fail(name, "its activation is '" + type + "', expected sigmoid, abs_sigmoid or heaviside");
    }
    p.rational = type == "abs_sigmoid";
    p.threshold2 = activation.value("x_shift", 0.0);
    p.gated = false;
    p.excitation = p.inhibition = 0.0;
    p.cutoff = kCutoff;
    spec_.fields.push_back(std::move(f));
  }

  void add_inputs(const std::string& name) {
    FieldSpec& field = spec_.fields[spec_.field_index(name)];
    bool lateral = false, circular = false, any = false;
    const auto close = [&](const std::string& input) {
      const auto closed = elements_.at(input).at("circular").get<bool>();
      if (any && closed != circular)
        fail(input, "circular differs from the other inputs of " + name);
      any = true;
      circular = closed;
      field.params.circular = closed;
    };
    for (const std::string& input : inputs(name)) {
      const std::string what = kind(input);
      if (what == "normal noise" || what == "correlated normal noise") continue;
      if (what != "gauss stimulus" && what != "gauss kernel" && what != "mexican hat kernel") {
        fail(input,
             "is a " + what +
                 ", which is not read; expected gauss or mexican hat kernel, gauss stimulus");
      }
      same_size(input, name);
      close(input);
      if (what == "gauss stimulus") {
        add_stimulus(field, input);
        continue;
      }
      const auto sources = inputs(input);
      if (sources.size() != 1 || kind(sources[0]) != "neural field") {
        fail(input, "expected one neural field as its input");
      }
      same_size(input, sources[0]);
      if (sources[0] != name) {
        add_coupling(sources[0], name, input);
        continue;
      }
      if (lateral) fail(input, "is a second lateral kernel of " + name);
      lateral = true;
      add_lateral(field.params, input);
    }
  }

  /// Peak of a kernel of theirs: they divide by the sum of its cells, if asked to.
  double peak(const std::string& name, const char* amplitude, double width, int range) const {
    double sum = 1.0;
    for (int i = 1; elements_.at(name).at("normalized").get<bool>() && i <= range; ++i) {
      const double g = std::exp(-0.5 * i * i / (width * width));
      sum +=
          g * (elements_.at(name).at("circular").get<bool>() && 2 * i == cells(name) ? 1.0 : 2.0);
    }
    return number(name, amplitude) / sum;
  }
  int range(const std::string& name, double width) const {
    const int reach = static_cast<int>(std::ceil(kCutoff * width)), n = cells(name);
    return std::min(reach, elements_.at(name).at("circular").get<bool>() ? n / 2 : n - 1);
  }

  void add_lateral(FieldParams& p, const std::string& kernel) {
    p.inhibition = -number(kernel, "amplitudeGlobal");
    if (kind(kernel) == "gauss kernel") {
      p.width = number(kernel, "width");
      p.excitation = peak(kernel, "amplitude", p.width, range(kernel, p.width));
      return;
    }
    p.width = number(kernel, "widthExc");
    p.surround_width = number(kernel, "widthInh");
    const int reach = range(kernel, std::max(p.width, p.surround_width));
    p.excitation = peak(kernel, "amplitudeExc", p.width, reach);
    p.surround = peak(kernel, "amplitudeInh", p.surround_width, reach);
  }

  void add_stimulus(FieldSpec& field, const std::string& stimulus) {
    const double width = number(stimulus, "width"), n = field.params.neurons;
    // Their first cell is 1.
    double at = number(stimulus, "position") / number(stimulus, "d_x") - 1.0;
    if (at < 0.0 && field.params.circular) at += n;
    double sum = 1.0;
    if (elements_.at(stimulus).at("normalized").get<bool>()) {
      sum = 0.0;
      for (int x = 0; x < field.params.neurons; ++x) {
        double d = std::abs(x - at);
        if (field.params.circular) d = std::min(d, n - d);
        sum += std::exp(-0.5 * d * d / (width * width));
      }
    }
    field.sites.push_back(stimulus);
    field.at.push_back(at);
    field.spread.push_back(width);
    spec_.inputs.push_back(
        {"stimulus", field.name, number(stimulus, "amplitude") / sum, {stimulus}});
  }

  void add_coupling(const std::string& from, const std::string& to, const std::string& kernel) {
    if (kind(kernel) != "gauss kernel" || number(kernel, "amplitudeGlobal") != 0.0) {
      fail(kernel, "between two fields expected a gauss kernel with amplitudeGlobal 0");
    }
    const double width = number(kernel, "width");
    const double full = peak(kernel, "amplitude", width, range(kernel, width));
    LinkSpec link;
    link.from = from;
    link.to = to;
    link.gain = full * width * std::sqrt(2.0 * std::numbers::pi);
    link.form = "gaussian";
    link.width = width;
    spec_.links.push_back(std::move(link));
  }

  std::string file_;
  std::map<std::string, Json> elements_;
  std::vector<std::string> order_;
  NetworkSpec spec_;
};

}  // namespace

NetworkSpec load_composer(const std::string& file) {
  const std::string path = runtime::find_model_file(file);
  std::ifstream in(path);
  if (!in) throw ConfigError("cannot read " + path);
  try {
    return Composer(path, Json::parse(in)).take();
  } catch (const Json::exception& e) {
    throw ConfigError(path + ": is no simulation of dnf-composer: " + e.what());
  }
}

}  // namespace mimesis::cognition
