#pragma once
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/runtime/params.h"
#include "common/runtime/yaml_document.h"

namespace mimesis::runtime {

/// Visits a struct of parameters and writes into it what YAML and --set give. Collects mistakes.
class ParamReader final : public ParamVisitor {
 public:
  using VisitParams = std::function<void(ParamVisitor&)>;

  /// @param section a map, or null
  ParamReader(std::string_view owner, const Yaml* section, const Variables& variables,
              const std::vector<std::pair<std::string, std::string>>& sets);

  void operator()(std::string_view key, double& value, double lo, double hi) override;
  void operator()(std::string_view key, int& value, int lo, int hi) override;
  void operator()(std::string_view key, bool& value) override;
  void operator()(std::string_view key, std::string& value) override;
  void operator()(std::string_view key, std::string& value,
                  std::initializer_list<std::string_view> choices) override;
  void file(std::string_view key, std::string& value, std::string_view kind,
            bool in_models) override;
  void operator()(std::string_view key, std::vector<double>& value, double lo, double hi,
                  std::size_t size) override;
  void operator()(std::string_view key, std::vector<std::string>& value) override;
  void group(std::string_view key, const VisitParams& visit) override;
  void elements(std::string_view key, std::size_t size,
                const std::function<void(std::size_t)>& resize,
                const std::function<void(ParamVisitor&, std::size_t)>& visit) override;

  /// Call after the visit. @throws ConfigError with all mistakes, those of the file in its order.
  void finish();

  /// Paths of the section that the visit does not know are no mistakes, but listed here.
  void leave_unknown(std::vector<std::string>* unknown) { unknown_ = unknown; }

 private:
  struct Found {  // a value for the key being visited
    const Yaml* yaml = nullptr;
    std::string path;
  };

  Found look_up(std::string_view key);
  // Nothing if it is absent or, with a mistake noted, wrong.
  std::optional<std::string> scalar(const Found& found, std::string_view expected);
  template <class T>
  std::optional<T> number(const Found& found, T lo, T hi);
  std::optional<std::vector<Yaml>> sequence(const Found& found);
  template <class T, class Read>
  void read_list(std::string_view key, std::vector<T>& value, std::size_t size, const Read& read);
  void report_unknown_keys();
  void demand(const Found& found, bool has_default, const std::string& expected);
  void mistake(const Place& place, const std::string& path, const std::string& what);
  void enter(const std::string& path, const Yaml* map, const VisitParams& visit);
  std::string path_of(std::string_view key) const;

  struct Mistake {
    Place place;
    std::string line;
  };

  std::string owner_;
  const Variables& variables_;
  std::map<std::string, Yaml, std::less<>> sets_;  // by path; scalars
  std::set<std::string, std::less<>> used_sets_;
  std::vector<std::string> paths_;  // paths of all keys visited
  std::vector<Mistake> mistakes_;
  std::vector<std::string>* unknown_ = nullptr;
  // The map being read:
  const Yaml* map_ = nullptr;
  Place here_;  // of the innermost map that the file has
  std::string prefix_;
  std::vector<std::string> keys_;
};

using VisitParams = std::function<void(ParamVisitor&)>;

/// Source of a node's parameters: a section of a YAML file, then --set; the last one wins.
class ParamSource {
 public:
  /// @param reference "" (defaults only), "FILE", or "FILE#KEY.KEY" for a section of a file, such
  /// as
  ///   `launch/imitation.yaml#nodes.camera.params`; a section whose last key is absent is empty.
  ///   Names that a `for` on the way to the section binds count as arguments.
  /// @param args "NAME=VALUE" of arguments the file declares, replacing their defaults
  /// @param sets "KEY=VALUE", nested keys with dots, elements of lists by index:
  /// "balls.0.radius_m=0.1";
  ///   lists as "1,2,3" or "[1, 2, 3]"
  /// @throws ConfigError "file:line:col: what, expected what", see read_yaml
  ParamSource(const std::string& reference, const std::vector<std::string>& args,
              const std::vector<std::string>& sets);
  /// All of a document, see parse_yaml().
  explicit ParamSource(Yaml document) : document_(std::move(document)), section_(&document_) {}

  /// Reads into the struct behind `visit`. Every mistake is found, one per line of the error:
  ///   launch/crowd.yaml:7:22: crowd.k_1_s: 50 is outside [0.001, 10]
  /// @param owner put before the keys in messages: the node's name; may be empty
  /// @param unknown  takes the section's keys that are not known; null: each is a mistake
  /// @throws ConfigError for unknown keys, values of a wrong type, out of range or not among the
  /// choices.
  void read(std::string_view owner, const VisitParams& visit,
            std::vector<std::string>* unknown = nullptr) const;

  /// Whether the file's section or --set has this key, which has no dots.
  bool gives(std::string_view key) const;

  /// Where the value of "groups.0.count" was written, or the nearest around it: for mistakes that
  /// show only when all values are known.
  Place place_of(std::string_view path) const;

  ParamSource(const ParamSource&) = delete;
  ParamSource& operator=(const ParamSource&) = delete;

 private:
  Yaml document_;
  const Yaml* section_ = nullptr;             // part of document_, null if empty
  std::set<std::string, std::less<>> bound_;  // names of `for` on the way to it
  std::vector<std::string> args_;
  std::vector<std::pair<std::string, std::string>> sets_;
};

/// The values behind `visit` as YAML, two spaces per level: the effective set for the log.
std::string dump_params(const VisitParams& visit);

/// One "key=value" per value, for one line of the log: view.focal_px=740. Text with spaces is
/// quoted.
std::vector<std::string> flat_params(const VisitParams& visit);

/// A parameter as --describe and --help show it.
struct ParamInfo {
  std::string key;        ///< "view.focal_px"; "axes.N.node" of each element of a list
  std::string type;       ///< number, integer, bool, text, numbers, texts, list
  std::string value;      ///< present one, as YAML
  std::string allowed{};  ///< range or choices, for people
  std::optional<std::pair<double, double>> range{};  ///< closed
  std::vector<std::string> choices{};
  std::size_t size = 0;     ///< number of elements that a list must have; 0: any
  std::string file_of{};    ///< kind of the file it names; empty: it names none
  bool changeable = false;  ///< while the node runs
};
/// All parameters behind `visit`, with their present values. Elements of empty lists are made for
/// the time of the call.
std::vector<ParamInfo> param_infos(const VisitParams& visit);
/// The same for each value: "axes.0.node" of each element that there is.
std::vector<ParamInfo> param_values(const VisitParams& visit);

/// Path of a file named in a parameter: as given, else in this folder of the project (source tree,
/// or share/mimesis beside the program's bin/). @throws ConfigError that names the places searched.
std::string find_project_file(const std::string& folder, const std::string& file);
/// Path of a file as find_project_file finds it in models/.
std::string find_model_file(const std::string& file);

}  // namespace mimesis::runtime
