#pragma once
#include <optional>
#include <string>
#include <vector>

#include "nodes/crowd/certificate/certificate.h"

namespace mimesis::crowd {

// Parts of `certify`, one for each rule.

/// @param phases_agree  rule III brings them together
RuleCertificate certify_frequency(const FrequencyRule& rule, int n, const GaitRange& gait);
RuleCertificate certify_length(const LengthRule& rule, int n, const GaitRange& gait,
                               bool phases_agree);
/// Writes phase and tracking. @param beat_gain_1_s  of GaitRange
void certify_phase(const PhaseRule& rule, int n, double beat_gain_1_s, Certificate& all);
/// @param stretch  of the longest steps, 1 + limit of rule II
RuleCertificate certify_heading(const HeadingRule& rule, int n, const GaitRange& gait,
                                double stretch);

/// Guarantee::none.
RuleCertificate refused(std::string why, std::vector<std::string> change);
/// Guarantee::off, as there are fewer than two.
RuleCertificate alone(int n);
/// Extremes of the Laplacian; or, in `refusal`, why there is no guarantee.
Extremes extremes_of(const GraphSettings& settings, int n, std::optional<RuleCertificate>& refusal);
/// λ⁺ without its worst link. @pre extremes_of did not refuse
double connectivity_without_link(const GraphSettings& settings, int n);

}  // namespace mimesis::crowd
