#pragma once
#include <string>

#include "nodes/cognition/network_spec.h"

namespace mimesis::cognition {

/// The spec with links of low rank, by pairs of sites, instead of those that babbling
/// acquires. "PG" belongs to "PG-AT" and to "PG-BT".
inline NetworkSpec wired(NetworkSpec a) {
  a.babbling.clear();
  for (LinkSpec& link : a.links) {
    if (link.learns != "babbling") continue;
    link.learns = "never";
    link.form = "low_rank";
    for (const std::string& x : a.fields[a.field_index(link.from)].sites) {
      for (const std::string& y : a.fields[a.field_index(link.to)].sites) {
        if (x.find(y) != std::string::npos || y.find(x) != std::string::npos) {
          link.pairs.push_back(x + ">" + y);
        }
      }
    }
  }
  return a;
}

}  // namespace mimesis::cognition
