#include "nodes/planner/roadmap_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string_view>
#include <type_traits>

#include "common/error.h"

namespace mimesis::planner {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::string_view kMagic = "MIMROAD1";
constexpr std::uint32_t kMostNodes = 1'000'000;

/// 64-bit FNV-1a.
std::uint64_t hash_of(std::string_view bytes) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return hash;
}

template <class T>
requires std::is_arithmetic_v<T>
void put(std::string& out, T value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void put_all(std::string& out, const Eigen::Ref<const Eigen::MatrixXd>& m) {
  for (const auto& column : m.colwise()) {
    for (const double x : column) put(out, x);
  }
}

/// Takes values off the front.
class Taker {
 public:
  Taker(const std::string& file, std::string_view bytes) : file_(file), bytes_(bytes) {}

  template <class T>
  T take() {
    if (bytes_.size() < sizeof(T)) fail("ends too early");
    T value;
    std::memcpy(&value, bytes_.data(), sizeof value);
    bytes_.remove_prefix(sizeof value);
    return value;
  }
  std::size_t left() const { return bytes_.size(); }
  [[noreturn]] void fail(const std::string& what) const { throw ConfigError(file_ + ": " + what); }

 private:
  const std::string& file_;
  std::string_view bytes_;
};

}  // namespace

Roadmap arm_roadmap(const kin::ArmModel& arm, const RoadmapSettings& settings, double margin_m) {
  CollisionChecker checker(arm, {}, margin_m);
  return build_roadmap(checker, Eigen::MatrixXd(arm.dof(), 0), settings);
}

std::uint64_t arm_hash(const kin::ArmModel& arm) {
  std::string bytes;
  for (const kin::DhLink& link : arm.links) {
    for (const double x : {link.a, link.alpha, link.d, link.offset}) put(bytes, x);
    put(bytes, static_cast<char>(2 * link.modified + link.slides));
  }
  put_all(bytes, arm.X_LE.matrix());
  put_all(bytes, arm.q_min);
  put_all(bytes, arm.q_max);
  for (const kin::SafetyBall& ball : arm.balls) {
    put(bytes, ball.frame);
    put(bytes, ball.group);
    put_all(bytes, ball.center);
    put(bytes, ball.radius);
  }
  for (const auto& [a, b] : arm.self_pairs) {
    put(bytes, a);
    put(bytes, b);
  }
  return hash_of(bytes);
}

void save_roadmap(const Roadmap& roadmap, const kin::ArmModel& arm, const std::string& file) {
  std::string bytes(kMagic);
  put(bytes, arm_hash(arm));
  put(bytes, static_cast<std::uint32_t>(roadmap.nodes().rows()));
  put(bytes, static_cast<std::uint32_t>(roadmap.size()));
  put_all(bytes, roadmap.nodes());
  for (std::size_t i = 0; i < roadmap.links().size(); ++i) {
    const std::span<const Link> links = roadmap.links()[i];
    put(bytes, static_cast<std::uint32_t>(links.size()));
    for (const Link& link : links) put(bytes, static_cast<std::uint32_t>(link.to));
  }
  put(bytes, hash_of(bytes));
  std::ofstream out(file, std::ios::binary);
  out << bytes;
  out.close();
  if (!out) throw ConfigError(file + ": not written: " + std::strerror(errno));
}

Roadmap load_roadmap(const std::string& file, const kin::ArmModel& arm) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(in), {});
  if (!in) throw ConfigError(file + ": not read: " + std::strerror(errno));
  const std::string_view all = bytes;
  if (!all.starts_with(kMagic) || all.size() < kMagic.size() + sizeof(std::uint64_t))
    throw ConfigError(file + ": expected a roadmap of `mimesis plan roadmap`");
  const std::string_view content = all.substr(0, all.size() - sizeof(std::uint64_t));
  if (Taker(file, all.substr(content.size())).take<std::uint64_t>() != hash_of(content))
    throw ConfigError(file + ": damaged, its hash is another");
  Taker taker(file, content.substr(kMagic.size()));
  const std::string remedy =
      fmt::format("; make it again: mimesis plan roadmap {} -o {}", arm.name, file);
  if (taker.take<std::uint64_t>() != arm_hash(arm))
    taker.fail("made for another arm, or the file of '" + arm.name + "' has changed" + remedy);
  const auto n = taker.take<std::uint32_t>(), count = taker.take<std::uint32_t>();
  if (n != static_cast<std::uint32_t>(arm.dof()) || count == 0 || count > kMostNodes ||
      taker.left() / sizeof(double) / n < count)
    taker.fail(fmt::format("{} nodes of {} joints cannot be", count, n));
  Eigen::MatrixXd nodes(n, count);
  for (double& q : nodes.reshaped()) q = taker.take<double>();
  const auto& q = nodes.array();
  if (!(nodes.allFinite() && (q.colwise() - arm.q_min.array()).minCoeff() >= -1e-9 &&
        (q.colwise() - arm.q_max.array()).maxCoeff() <= 1e-9))
    taker.fail("a node is outside the limits of the joints");
  NeighbourLists links(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto size = taker.take<std::uint32_t>();
    if (size > taker.left() / sizeof(std::uint32_t)) taker.fail("ends too early");
    links[i].reserve(size);
    for (std::uint32_t k = 0; k < size; ++k) {
      const auto to = taker.take<std::uint32_t>();
      if (to >= count || to == i) taker.fail(fmt::format("node {} has a link to node {}", i, to));
      links[i].push_back({static_cast<int>(to), (nodes.col(to) - nodes.col(i)).norm()});
    }
  }
  if (taker.left() > 0) taker.fail("goes on behind its last link");
  return {std::move(nodes), links};
}

}  // namespace mimesis::planner
