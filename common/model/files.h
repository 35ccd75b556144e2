#pragma once
#include <optional>
#include <string>

#include "common/kin/arm.h"
#include "common/kin/table.h"
#include "proto/scene.pb.h"

namespace mimesis::model {

/// Reads an arm (models/lwr4.yaml). @throws ConfigError "file:line:col: ..." (see
/// runtime::load_params).
kin::ArmModel load_arm(const std::string& file);

/// Reads a table (models/bridge_table.yaml). `bridge_height`: lower edge of the bar above the table
/// [m], instead of the file's. @throws ConfigError as above.
kin::Table load_table(const std::string& file, std::optional<double> bridge_height = {});

/// The same table as a message, without header.
v1::Scene to_proto(const kin::Table& table);
/// And back. Positions are taken as they are; the caller has checked that they are finite.
kin::Table from_proto(const v1::Scene& scene);

}  // namespace mimesis::model
