#pragma once
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/runtime/params.h"
#include "common/runtime/variables.h"
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
  void operator()(std::string_view key, std::vector<double>& value, double lo, double hi,
                  std::size_t size) override;
  void operator()(std::string_view key, std::vector<std::string>& value) override;
  void group(std::string_view key, const VisitParams& visit) override;
  void elements(std::string_view key, std::size_t size,
                const std::function<void(std::size_t)>& resize,
                const std::function<void(ParamVisitor&, std::size_t)>& visit) override;

  /// Call after the visit. @throws ConfigError with all mistakes, those of the file in its order.
  void finish();

 private:
  struct Found {  // a value for the key being visited
    const Yaml* yaml = nullptr;
    std::string path;
  };

  Found look_up(std::string_view key);
  std::string scalar(const Found& found, std::string_view expected, bool& ok);
  std::vector<Yaml> sequence(const Found& found, bool& ok);
  void report_unknown_keys();
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
  std::vector<std::string> paths_;  // of all keys visited
  std::vector<Mistake> mistakes_;
  // The map being read:
  const Yaml* map_ = nullptr;
  std::string prefix_;
  std::vector<std::string> keys_;
};

}  // namespace mimesis::runtime
