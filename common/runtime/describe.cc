#include "common/runtime/describe.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/error.h"
#include "common/json_text.h"
#include "common/runtime/log.h"
#include "common/runtime/own_topics.h"
#include "common/runtime/value_text.h"
#include "proto/foxglove/log.pb.h"
#include "proto/params.pb.h"
#include "proto/runtime.pb.h"
#include "proto/steps.pb.h"

namespace mimesis::runtime {
namespace {

using google::protobuf::Message;
using Json = nlohmann::ordered_json;

/// Ends the construction of a node of which enough is known.
struct Known {};

class SilentIn final : public InChannel {
 public:
  std::optional<Received> pop() override { return std::nullopt; }
  void reject(const Received&, std::string_view) override {}
  const InCounters& counters() const override { return counters_; }

 private:
  InCounters counters_;
};

class SilentOut final : public OutChannel {
 public:
  void send(const Message&, Time) override {}
  std::uint64_t next_seq() const override { return 1; }
  std::size_t subscribers() const override { return 0; }
};

class DescribingBus final : public Bus {
 public:
  DescribingBus(const std::string& name, bool lockstep, bool whole, Declared& declared)
      : name_(name), lockstep_(lockstep), whole_(whole), declared_(declared), outside_(declared) {}

  std::unique_ptr<InChannel> subscribe(std::string_view port, const Message& prototype,
                                       const InOptions& options) override {
    declared_.ports.push_back({std::string(port), prototype.GetDescriptor(), true, options, {}});
    return std::make_unique<SilentIn>();
  }
  std::unique_ptr<OutChannel> advertise(std::string_view port, const Message& prototype,
                                        const OutOptions& options) override {
    declared_.ports.push_back({std::string(port), prototype.GetDescriptor(), false, {}, options});
    return std::make_unique<SilentOut>();
  }
  void serve(std::string_view name, const Message& request, const Message& response,
             Handler) override {
    declared_.services.push_back(
        {std::string(name), request.GetDescriptor(), response.GetDescriptor()});
  }
  tl::expected<std::string, Status> call(std::string_view, const std::string&,
                                         std::chrono::milliseconds) override {
    return tl::unexpected(Status{"a description calls nobody"});
  }
  bool lockstep() const override { return lockstep_; }
  void ports_end() override {
    declared_.complete = true;
    if (!whole_) throw Known{};
  }
  void refusals_end() override { throw Known{}; }
  Outside& outside() override { return outside_; }
  const std::string& node() const override { return name_; }
  const std::string& directory() const override { return directory_; }

 private:
  class NoOutside final : public Outside {
   public:
    explicit NoOutside(Declared& declared) : declared_(declared) {}
    bool replaying() const override { return true; }
    void record(std::string_view, std::string_view) override {}
    std::string replay(std::string_view) override { return {}; }
    void written(std::string_view, std::string_view) override {}
    bool describing() const override { return true; }
    void opens(const Opening& opening) override { declared_.opened.push_back(opening); }

   private:
    Declared& declared_;
  };

  std::string name_, directory_ = "/dev/null";
  bool lockstep_, whole_;
  Declared& declared_;
  NoOutside outside_;
};

std::string& meanings() {
  static std::string lines = "\n";
  return lines;
}

std::string meaning_of(const std::string& key) {
  const std::string& all = meanings();
  const std::string head = "\n" + key.substr(key.rfind('.') + 1) + "\t";
  const std::size_t at = all.find(head);
  if (at == std::string::npos) return {};
  return all.substr(at + head.size(), all.find('\n', at + 1) - at - head.size());
}

/// The unit at the end of a meaning, "rate of steps [Hz]", else the suffix of the key
/// (proto/README.md). [1] is no unit, nor is a source that stands there.
std::string unit_of(const std::string& key, const std::string& meaning) {
  if (meaning.ends_with(']')) {
    const std::string unit = meaning.substr(meaning.rfind('[') + 1);
    const bool source = unit.starts_with("M1");
    return source || unit == "1]" ? "" : unit.substr(0, unit.size() - 1);
  }
  constexpr std::array<std::pair<std::string_view, std::string_view>, 16> kUnits{
      {{"_rad_s2", "rad/s²"},
       {"_m_s2", "m/s²"},
       {"_rad_s", "rad/s"},
       {"_m_s", "m/s"},
       {"_n_m", "N m"},
       {"_n_s", "N s"},
       {"_1_s", "1/s"},
       {"_1_m", "1/m"},
       {"_rad", "rad"},
       {"_hz", "Hz"},
       {"_kg", "kg"},
       {"_px", "px"},
       {"_ns", "ns"},
       {"_s", "s"},
       {"_m", "m"},
       {"_n", "N"}}};
  const auto* unit =
      std::ranges::find_if(kUnits, [&](const auto& suffix) { return key.ends_with(suffix.first); });
  return unit != kUnits.end() ? std::string(unit->second) : "";
}

std::string_view policy_word(Policy policy) {
  constexpr std::array kNames = {"latest", "queue", "reliable"};
  return kNames.at(static_cast<std::size_t>(policy));
}

/// Values are written as YAML; all but the counts of lists, "(3)", are JSON too.
Json value_of(const std::string& text) {
  Json value = Json::parse(text.starts_with('(') ? text.substr(1, text.size() - 2) : text, nullptr,
                           /*allow_exceptions=*/false);
  return value.is_discarded() ? Json(text) : value;
}

Json port_json(const Declared::Port& port) {
  Json json{{"name", port.name},
            {"direction", port.input ? "in" : "out"},
            {"type", port.type->full_name()}};
  if (port.input) {
    json["policy"] = policy_word(port.in.policy);
    if (port.in.policy == Policy::queue) json["depth"] = port.in.depth;
    json["optional"] = port.in.optional;
    json["sole"] = port.in.author != Author::any;
  } else {
    json["latched"] = port.out.latched;
  }
  return json;
}

Json param_json(const ParamInfo& info, const ParamInfo& present) {
  const std::string meaning = meaning_of(info.key), unit = unit_of(info.key, meaning);
  Json json{{"key", info.key},
            {"type", info.type},
            {"default", value_of(info.value)},
            {"value", value_of(present.value)}};
  if (!unit.empty()) json["unit"] = unit;
  if (info.range) json["range"] = {info.range->first, info.range->second};
  if (!info.choices.empty()) json["choices"] = info.choices;
  if (info.size != 0) json["size"] = info.size;
  if (!info.file_of.empty()) json["file"] = info.file_of;
  json["allowed"] = info.allowed;
  json["changeable"] = info.changeable;
  json["help"] = meaning;
  return json;
}

/// "'brsk' is none of the model's: walk, brisk": the known words stand behind the unknown one.
std::string suggestion_in(const std::string& line) {
  if (line.find("did you mean") != std::string::npos) return {};
  for (std::size_t open = line.find('\''); open != std::string::npos;) {
    const std::size_t close = line.find('\'', open + 1);
    if (close == std::string::npos) break;
    std::vector<std::string> words(1);
    for (const char c : line.substr(close + 1)) {
      if (c == '\n') break;  // another mistake
      if (std::string_view(" ,:;'").find(c) == std::string_view::npos)
        words.back() += c;
      else if (!words.back().empty())
        words.emplace_back();
    }
    const std::string found = did_you_mean(line.substr(open + 1, close - open - 1), words);
    if (!found.empty()) return found;
    open = line.find('\'', close + 1);
  }
  return {};
}

/// Path, "buses.0.can", of the parameter with this value.
std::string path_of_value(const std::vector<std::string>& flat, const std::string& value) {
  for (const std::string& entry : flat) {
    if (entry.ends_with("=" + value)) return entry.substr(0, entry.size() - value.size() - 1);
  }
  return {};
}

using Values = std::vector<std::pair<std::string, std::string>>;

std::vector<ParamInfo> values_of(AnyNode& node) {
  return param_values([&node](ParamVisitor& v) { node.visit(v); });
}

std::string with_unit(const std::string& key) {
  const std::string unit = param_unit(key);
  return unit.empty() ? "" : " " + unit;
}

/// @throws ConfigError with one line for each value that is refused: "camera.noise: 50 is outside
/// [0, 40]"
void demand_changeable(const std::string& owner, const AnyNode& node,
                       const std::vector<ParamInfo>& infos, const Values& sets) {
  std::vector<std::string> keys, lines;
  for (const ParamInfo& info : infos) keys.push_back(info.key);
  for (const auto& [key, value] : sets) {
    const auto info = std::ranges::find(infos, key, &ParamInfo::key);
    if (info == infos.end()) {
      lines.push_back(
          fmt::format("{}.{}: unknown parameter{}", owner, key, did_you_mean(key, keys)));
    } else if (!info->changeable || !node.changeable()) {
      lines.push_back(fmt::format(
          "{}.{}: cannot change while the node runs: set it in the launch file or by --set", owner,
          key));
    }
  }
  if (!lines.empty()) throw ConfigError(fmt::format("{}", fmt::join(lines, "\n")));
}

void change(const std::string& owner, AnyNode& node, const Values& sets) {
  const std::vector<ParamInfo> before = values_of(node);
  demand_changeable(owner, node, before, sets);
  try {
    node.change([&](const VisitParams& visit) {
      const Yaml nothing;
      const Variables variables(nothing);
      ParamReader reader(owner, nullptr, variables, sets);
      visit(reader);
      reader.finish();
    });
  } catch (const ConfigError& e) {
    std::string line = e.what();
    constexpr std::string_view kPlace = "--set: ";
    for (std::size_t at; (at = line.find(kPlace)) != std::string::npos;)
      line.erase(at, kPlace.size());
    if (sets.size() == 1 && line.ends_with(']')) line += with_unit(sets.front().first);
    throw ConfigError(line);
  }
  const std::vector<ParamInfo> after = values_of(node);
  for (std::size_t i = 0; i < std::min(before.size(), after.size()); ++i) {
    if (before[i].value == after[i].value) continue;
    info("parameter {}: {} instead of {}{}", after[i].key, after[i].value, before[i].value,
         with_unit(after[i].key));
  }
}

constexpr std::array kLevelNames{"debug", "info", "warn", "error"};  // as enum class Level

/// @throws ConfigError
Level level_of(const std::string& name) {
  const auto level = std::ranges::find(kLevelNames, name);
  if (level == kLevelNames.end()) {
    throw ConfigError(fmt::format("log level '{}': expected one of {}{}", name,
                                  fmt::join(kLevelNames, ", "),
                                  did_you_mean(name, {kLevelNames.begin(), kLevelNames.end()})));
  }
  return static_cast<Level>(level - kLevelNames.begin());
}

v1::ParamSet answer(AnyNode& node, bool described) {
  v1::ParamSet all;
  for (const ParamInfo& info : values_of(node)) {
    v1::Param& param = *all.add_params();
    param.set_key(info.key);
    param.set_value(info.value);
    param.set_changeable(info.changeable && node.changeable());
    if (!described) continue;
    param.set_type(info.type);
    param.set_unit(param_unit(info.key));
    param.set_allowed(info.allowed);
    param.set_meaning(param_meaning(info.key));
  }
  return all;
}

}  // namespace

void declare(const CreateNode& create, const std::string& name, bool lockstep, bool whole,
             Declared& declared) {
  DescribingBus bus(name, lockstep, whole, declared);
  try {
    create(bus);
    declared.complete = true;
  } catch (const Known&) {
  }
}

std::string description(const NodeAbout& about, const Declared& declared,
                        const std::vector<ParamInfo>& defaults,
                        const std::vector<ParamInfo>& present, const std::vector<std::string>& flat,
                        const ParamSource& source) {
  Json json{{"program", fmt::format("mimesis_{}", about.name)},
            {"version", MIMESIS_VERSION},
            {"about", about.about},
            {"complete", declared.complete},
            {"ports", Json::array()},
            {"services", Json::array()},
            {"parameters", Json::array()},
            {"opens", Json::array()}};
  for (const Declared::Port& port : declared.ports) json["ports"].push_back(port_json(port));
  for (const auto& [name, type] : {std::pair(kHealthPort, v1::Health::descriptor()),
                                   {kLogPort, foxglove::Log::descriptor()},
                                   {kStartPort, v1::NodeStart::descriptor()},
                                   {kStepsPort, v1::StepLog::descriptor()}}) {
    json["ports"].push_back(port_json({.name = std::string(name), .type = type}));
    json["ports"].back()["own"] = true;
  }
  for (const Declared::Service& service : declared.services) {
    json["services"].push_back({{"name", service.name},
                                {"request", service.request->full_name()},
                                {"response", service.response->full_name()}});
  }
  for (std::size_t i = 0; i < std::min(defaults.size(), present.size()); ++i)
    json["parameters"].push_back(param_json(defaults[i], present[i]));
  for (const Opening& opened : declared.opened) {
    const std::string path = path_of_value(flat, opened.address);
    json["opens"].push_back({{"kind", opened.kind},
                             {"address", opened.address},
                             {"role", opened.role},
                             {"of", opened.of},
                             {"parameter", path},
                             {"place", to_string(source.place_of(path))}});
  }
  return json_text(json);
}

std::string ports_text(const Declared& declared) {
  std::string lines;
  for (const Declared::Port& port : declared.ports) {
    std::string kind = port.input ? std::string(policy_word(port.in.policy)) : "";
    if (port.input && port.in.policy == Policy::queue) kind += fmt::format("({})", port.in.depth);
    if (port.input && port.in.author != Author::any) kind += ", of one node";
    if (port.input && port.in.optional) kind += ", optional";
    if (!port.input && port.out.latched) kind = "latched";
    lines += fmt::format("  {:<4}{:<24} {:<28} {}\n", port.input ? "in" : "out", port.name,
                         port.type->full_name(), kind);
  }
  for (const Declared::Service& service : declared.services) {
    lines += fmt::format("  service {:<20} {} -> {}\n", service.name, service.request->full_name(),
                         service.response->full_name());
  }
  return lines;
}

std::string params_text(const std::vector<ParamInfo>& infos) {
  std::string lines;
  for (const ParamInfo& info : infos) {
    lines += fmt::format("  {:<28} {:<16} {}{}\n", info.key, info.value, info.allowed,
                         info.changeable ? ", changeable" : "");
    const std::string meaning = meaning_of(info.key);
    if (!meaning.empty()) lines += fmt::format("      {}\n", meaning);
  }
  return lines;
}

std::string placed(const std::string& line, const std::string& owner,
                   const std::vector<ParamInfo>& defaults, const VisitParams& visit,
                   const ParamSource& source) {
  const std::vector<ParamInfo> infos = param_infos(visit);
  const auto at = [&](const std::string& path, const std::string& name, const std::string& rest) {
    const std::string place = to_string(source.place_of(path));
    return fmt::format("{}{}{}.{}: {}{}", place, place.empty() ? "" : ": ", owner, name, rest,
                       suggestion_in(rest));
  };
  const std::size_t colon = line.find(": ");
  std::string key = line.substr(0, colon);
  if (key.starts_with(owner + ".")) key.erase(0, owner.size() + 1);
  const std::string shown = key;
  for (std::size_t open; (open = key.find('[')) != std::string::npos;) {  // practice[0]
    key[open] = '.';
    key.erase(std::min(key.find(']'), key.size() - 1), 1);
  }
  const std::string first = key.substr(0, key.find('.'));
  for (const ParamInfo& info : infos) {
    if (colon != std::string::npos && info.key.substr(0, info.key.find('.')) == first)
      return at(key, shown, line.substr(colon + 2));
  }
  // Two parameters may name one file: the default is right.
  std::vector<ParamInfo> files;
  std::ranges::copy_if(infos, std::back_inserter(files), [](const ParamInfo& info) {
    return !info.file_of.empty() && info.value.size() > 2;
  });
  std::stable_partition(files.begin(), files.end(), [&](const ParamInfo& info) {
    return std::ranges::none_of(defaults, [&](const ParamInfo& other) {
      return other.key == info.key && other.value == info.value;
    });
  });
  for (const ParamInfo& info : files) {
    const std::string file = info.value.substr(1, info.value.size() - 2);
    const std::size_t named = line.starts_with(file + ":") ? 0 : line.find("/" + file + ":");
    if (named >= colon) continue;
    const std::size_t behind = line.find(file, named) + file.size();
    if (line.compare(behind, 2, ": ") == 0) return at(info.key, info.key, line);
    std::size_t end = 0;  // of the first lines: a file of another kind has nothing right
    for (int i = 0; i < 3 && end < line.size(); ++i)
      end = std::min(line.find('\n', end + 1), line.size());
    return at(info.key, info.key,
              fmt::format("'{}' cannot be read, expected the file of: {}\n{}", file, info.file_of,
                          line.substr(0, end)));
  }
  for (const std::string& entry : flat_params(visit)) {
    const std::size_t equals = entry.find('=');
    const std::string value = entry.substr(equals + 1);
    if (!value.empty() && line.find("'" + value + "'") != std::string::npos)
      return at(entry.substr(0, equals), entry.substr(0, equals), line);
  }
  return line.starts_with(owner + ".") ? line : owner + ": " + line;
}

std::string param_meaning(const std::string& key) { return meaning_of(key); }
std::string param_unit(const std::string& key) { return unit_of(key, meaning_of(key)); }

bool explain(const char* lines) {
  meanings() += lines;
  return true;
}

void serve_params(Bus& bus, AnyNode& node) {
  bus.serve("params", v1::ParamRequest::default_instance(), v1::ParamSet::default_instance(),
            [&node, owner = bus.node(), level = std::string()](
                const std::string& bytes) mutable -> tl::expected<std::string, Status> {
              v1::ParamRequest request;
              if (!request.ParseFromString(bytes)) return tl::unexpected(Status{"not a request"});
              Values sets;
              for (const v1::ParamValue& set : request.set())
                sets.emplace_back(set.key(), set.value());
              try {
                const bool levelled = !request.log_level().empty();
                const Level least = levelled ? level_of(request.log_level()) : Level::info;
                if (!sets.empty()) change(owner, node, sets);
                if (levelled) set_log_level(least);
                if (levelled) level = request.log_level();
              } catch (const ConfigError& e) {
                return tl::unexpected(Status{e.what()});
              }
              v1::ParamSet all = answer(node, request.described());
              all.set_log_level(level);
              return all.SerializeAsString();
            });
}

}  // namespace mimesis::runtime
