#include "nodes/synthesizer/drawer/drawer_model.h"

#include <gtest/gtest.h>
#include <iostream>

namespace mimesis::synthesizer {
TEST(Draft, Model) {
  const auto data = generate_drawer_data(mocap::standard_body(), {}, {});
  const auto model = learn_drawer_model(data);
  std::cout << model.first_quality_squared << " " << model.quality_squared << "\n";
  for (auto& a : model.action) std::cout << a.name << " Q " << a.quality << " Q2 " << a.quality_squared << "\n";
}
}
