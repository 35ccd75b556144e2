#pragma once
#include <functional>
#include <memory>
#include <string_view>
#include <utility>

#include "common/runtime/bus.h"
#include "common/runtime/params.h"
#include "common/time.h"

namespace mimesis::runtime {

/// Name and one line for --help.
struct NodeAbout {
  std::string_view name;
  std::string_view about;
};

/// A node as `run` sees it; written by NodeAdapter, never by hand.
class AnyNode {
 public:
  virtual ~AnyNode() = default;
  virtual void visit(ParamVisitor& v) = 0;  ///< its parameters
  virtual void create(Bus& bus) = 0;        ///< constructs the node; may throw ConfigError
  virtual void step(Time now) = 0;
  virtual void stop(Time now) noexcept = 0;  ///< last call: actuators to a safe state
  /// a stop request waits (bounded) for at_rest
  virtual bool comes_to_rest() const { return false; }
  virtual bool at_rest() const { return true; }
  virtual double rate_hz() const = 0;
  virtual double robot_rate_hz() const {
    return 0.0;
  }                                     ///< 0: moves no robot; may throw ConfigError
  virtual void set_rate_hz(double) {}   ///< to that of the robot
  virtual double offset_s() const = 0;  ///< time of the first step within the period
  /// It takes other parameters while it runs.
  virtual bool changeable() const { return false; }
  /// Between two steps: `read` changes a copy of the parameters, which the node then takes; both
  /// may throw ConfigError, then nothing changes.
  virtual void change(
      const std::function<void(const std::function<void(ParamVisitor&)>&)>& /*read*/) {}
};

/// Parses the command line, loads parameters, joins the graph, steps at the node's rate on the
/// graph's clock until SIGINT, SIGTERM or the end of simulated time, stops the node. Returns the
/// exit code: 0 stopped on request, 1 failed, 2 configuration.
int run(int argc, char** argv, const NodeAbout& about, AnyNode& node);

/// `Node` has: `using Params` (with `rate_hz`, optionally `offset_s`, and `visit`), a constructor
/// `(const Params&, Bus&)`, `step(Time)`, optionally `stop(Time) noexcept`, and `bool at_rest()
/// const` if it should continue to step (for 1.5 s at most) after a stop request until it is.
/// A node that takes other parameters while it runs has `void change(const Params&)`, called
/// between two steps with values that differ only in parameters that `visit` declares as
/// changeable; a ConfigError refuses them. `Params` of a node that moves a robot also has `double
/// robot_rate_hz() const`: the robot's file owns the rate, so `rate_hz` becomes it, and another one
/// that is given is refused.
template <class Node>
class NodeAdapter final : public AnyNode {
 public:
  void visit(ParamVisitor& v) override { params_.visit(v); }
  void create(Bus& bus) override { node_ = std::make_unique<Node>(params_, bus); }
  void step(Time now) override { node_->step(now); }
  void stop(Time now) noexcept override {
    if constexpr (requires { node_->stop(now); }) {
      if (node_) node_->stop(now);
    }
    node_.reset();
  }
  bool comes_to_rest() const override {
    return requires(const Node& node) { node.at_rest(); };
  }
  bool at_rest() const override {
    if constexpr (requires(const Node& node) { node.at_rest(); }) return node_->at_rest();
    return true;
  }
  double rate_hz() const override { return params_.rate_hz; }
  double robot_rate_hz() const override {
    if constexpr (requires { params_.robot_rate_hz(); }) return params_.robot_rate_hz();
    return 0.0;
  }
  void set_rate_hz(double rate_hz) override { params_.rate_hz = rate_hz; }
  bool changeable() const override {
    return requires(Node & node, const typename Node::Params& params) { node.change(params); };
  }
  void change(const std::function<void(const std::function<void(ParamVisitor&)>&)>& read) override {
    if constexpr (requires { node_->change(params_); }) {
      typename Node::Params params = params_;
      read([&params](ParamVisitor& v) { params.visit(v); });
      node_->change(params);
      params_ = std::move(params);
    }
  }
  double offset_s() const override {
    if constexpr (requires { params_.offset_s; }) return params_.offset_s;
    return 0.0;
  }

 private:
  typename Node::Params params_;
  std::unique_ptr<Node> node_;
};

/// The whole main() of a node: run() of a NodeAdapter.
template <class Node>
int run_node(int argc, char** argv, const NodeAbout& about) {
  NodeAdapter<Node> adapter;
  return run(argc, argv, about, adapter);
}

}  // namespace mimesis::runtime
