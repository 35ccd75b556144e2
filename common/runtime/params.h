#pragma once
#include <functional>
#include <initializer_list>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace mimesis::runtime {

/// Walks through a struct of parameters. One `visit` per struct serves reading (YAML, --set),
/// ranges, the effective set in the log, and --help. Keys end in their unit. Ranges are closed. A
/// default that is itself out of range, not among the choices or of another size means that the
/// key must be given.
class ParamVisitor {
 public:
  virtual ~ParamVisitor() = default;
  virtual void operator()(std::string_view key, double& value, double lo, double hi) = 0;
  virtual void operator()(std::string_view key, int& value, int lo, int hi) = 0;
  virtual void operator()(std::string_view key, bool& value) = 0;
  virtual void operator()(std::string_view key, std::string& value) = 0;  ///< any text
  /// One of `choices`.
  virtual void operator()(std::string_view key, std::string& value,
                          std::initializer_list<std::string_view> choices) = 0;
  /// A file or folder that the node reads; empty: none. `kind`, for people: "arm", "motion model".
  /// With `in_models` it must exist: as given, in models/, or (./) beside the file with the name.
  virtual void file(std::string_view key, std::string& value, std::string_view /*kind*/,
                    bool /*in_models*/ = true) {
    (*this)(key, value);
  }
  /// Every element within [lo, hi]; `size` elements unless 0.
  virtual void operator()(std::string_view key, std::vector<double>& value, double lo, double hi,
                          std::size_t size) = 0;
  virtual void operator()(std::string_view key, std::vector<std::string>& value) = 0;
  /// A nested struct under `key`: `v.group("drive", [&](auto& g) { drive.visit(g); })`.
  virtual void group(std::string_view key, const std::function<void(ParamVisitor&)>& visit) = 0;
  /// A list of nested structs; use the function `list` below.
  virtual void elements(std::string_view key, std::size_t size,
                        const std::function<void(std::size_t)>& resize,
                        const std::function<void(ParamVisitor&, std::size_t)>& visit) = 0;

  /// Parameters that `visit` visits may change while the node runs, if it has `change(const
  /// Params&)`: `v.changeable([&] { v("gain", gain, 0.0, 1.0); })`.
  template <class Visit>
  void changeable(const Visit& visit) {
    const bool before = std::exchange(changeable_, true);
    visit();
    changeable_ = before;
  }

 protected:
  bool changeable_ = false;  ///< what is visited now
};

/// A list of structs that have `visit`: `list(v, "balls", balls)`.
template <class T>
void list(ParamVisitor& v, std::string_view key, std::vector<T>& items) {
  v.elements(
      key, items.size(), [&](std::size_t n) { items.resize(n); },
      [&](ParamVisitor& g, std::size_t i) { items[i].visit(g); });
}

/// Reads a whole YAML file into a struct that has `visit`: robots, scenes, calibrations. Relative
/// `file` names are looked up in the working folder, then in the project's `models/` (source tree
/// or installed).
/// @throws ConfigError "file:line:col: ..." for an unknown key, a bad value, a duplicate or a
/// missing file.
void load_params(const std::string& file, const std::function<void(ParamVisitor&)>& visit);

}  // namespace mimesis::runtime
