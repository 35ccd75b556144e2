// The values of a struct of parameters as text: for the log (YAML) and for --help (one line each).
#include <fmt/format.h>

#include <utility>

#include "common/runtime/param_source.h"

namespace mimesis::runtime {
namespace {

std::string quoted_text(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '\n') {
      out += "\\n";
      continue;
    }
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

std::string flow(const std::vector<double>& values) {
  return fmt::format("[{}]", fmt::join(values, ", "));
}

std::string flow(const std::vector<std::string>& values) {
  std::string out;
  for (const std::string& value : values) out += (out.empty() ? "" : ", ") + quoted_text(value);
  return "[" + out + "]";
}

/// What the two writers share: the value as text and what is allowed, for a key.
class Writer : public ParamVisitor {
 public:
  void operator()(std::string_view key, double& value, double lo, double hi) override {
    leaf(key, fmt::format("{}", value), fmt::format("[{}, {}]", lo, hi));
  }
  void operator()(std::string_view key, int& value, int lo, int hi) override {
    leaf(key, fmt::format("{}", value), fmt::format("[{}, {}] whole", lo, hi));
  }
  void operator()(std::string_view key, bool& value) override {
    leaf(key, fmt::format("{}", value), "true or false");
  }
  void operator()(std::string_view key, std::string& value) override {
    leaf(key, quoted_text(value), "text");
  }
  void operator()(std::string_view key, std::string& value,
                  std::initializer_list<std::string_view> choices) override {
    leaf(key, quoted_text(value), fmt::format("one of {}", fmt::join(choices, ", ")));
  }
  void operator()(std::string_view key, std::vector<double>& value, double lo, double hi,
                  std::size_t size) override {
    leaf(key, flow(value),
         fmt::format("{} in [{}, {}]", size != 0 ? fmt::format("{} numbers", size) : "numbers", lo,
                     hi));
  }
  void operator()(std::string_view key, std::vector<std::string>& value) override {
    leaf(key, flow(value), "list of text");
  }

  std::string out;

 protected:
  virtual void leaf(std::string_view key, const std::string& value, const std::string& allowed) = 0;
};

class YamlWriter final : public Writer {
 public:
  void group(std::string_view key, const VisitParams& visit) override {
    line(fmt::format("{}:", key));
    indent_ += 2;
    visit(*this);
    indent_ -= 2;
  }
  void elements(std::string_view key, std::size_t size, const std::function<void(std::size_t)>&,
                const std::function<void(ParamVisitor&, std::size_t)>& visit) override {
    line(fmt::format("{}:{}", key, size == 0 ? " []" : ""));
    indent_ += 4;
    for (std::size_t i = 0; i < size; ++i) {
      dash_ = true;
      visit(*this, i);
    }
    indent_ -= 4;
  }

 private:
  void leaf(std::string_view key, const std::string& value, const std::string&) override {
    line(fmt::format("{}: {}", key, value));
  }
  void line(const std::string& text) {
    const std::size_t spaces = dash_ ? indent_ - 2 : indent_;
    out += std::string(spaces, ' ') + (dash_ ? "- " : "") + text + "\n";
    dash_ = false;
  }

  std::size_t indent_ = 0;
  bool dash_ = false;  // the next line starts an element of a list
};

/// One entry per value: "view.focal_px=740", "axes.0.node=1".
class FlatWriter final : public Writer {
 public:
  void group(std::string_view key, const VisitParams& visit) override {
    const std::string outer = std::exchange(prefix_, prefix_ + std::string(key) + ".");
    visit(*this);
    prefix_ = outer;
  }
  void elements(std::string_view key, std::size_t size, const std::function<void(std::size_t)>&,
                const std::function<void(ParamVisitor&, std::size_t)>& visit) override {
    for (std::size_t i = 0; i < size; ++i) {
      group(fmt::format("{}.{}", key, i), [&](ParamVisitor& v) { visit(v, i); });
    }
  }

  std::vector<std::string> entries;

 private:
  void leaf(std::string_view key, const std::string& value, const std::string&) override {
    const bool bare = value.starts_with('"') && value.find_first_of(" \\") == std::string::npos;
    entries.push_back(
        fmt::format("{}{}={}", prefix_, key, bare ? value.substr(1, value.size() - 2) : value));
  }

  std::string prefix_;
};

class HelpWriter final : public Writer {
 public:
  void group(std::string_view key, const VisitParams& visit) override {
    const std::string outer = prefix_;
    prefix_ += std::string(key) + ".";
    visit(*this);
    prefix_ = outer;
  }
  void elements(std::string_view key, std::size_t size, const std::function<void(std::size_t)>&,
                const std::function<void(ParamVisitor&, std::size_t)>&) override {
    leaf(key, fmt::format("({})", size), "list");
  }

 private:
  void leaf(std::string_view key, const std::string& value, const std::string& allowed) override {
    out += fmt::format("  {:<28} {:<16} {}\n", prefix_ + std::string(key), value, allowed);
  }

  std::string prefix_;
};

}  // namespace

std::string dump_params(const VisitParams& visit) {
  YamlWriter writer;
  visit(writer);
  return writer.out;
}

std::vector<std::string> flat_params(const VisitParams& visit) {
  FlatWriter writer;
  visit(writer);
  return std::move(writer.entries);
}

std::string describe_params(const VisitParams& visit) {
  HelpWriter writer;
  visit(writer);
  return writer.out;
}

}  // namespace mimesis::runtime
