#include "nodes/crowd/certificate/rule_certificates.h"

#include <utility>

#include "common/error.h"
#include "nodes/crowd/certificate/say.h"
#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {

RuleCertificate refused(std::string why, std::vector<std::string> change) {
  RuleCertificate c;
  c.guarantee = Guarantee::none;
  c.why = std::move(why);
  c.change = std::move(change);
  return c;
}

RuleCertificate alone(int n) {
  RuleCertificate c;
  c.why = say("N = ", n, ": the Laplacian is 0, there is nobody to agree with");
  return c;
}

Extremes extremes_of(const GraphSettings& settings, int n,
                     std::optional<RuleCertificate>& refusal) {
  try {
    const CouplingGraph graph = coupling(settings, n);
    if (settings.topology == Topology::none || !graph.connected()) {
      refusal = refused(say("the coupling graph of ", n,
                            " agents is not connected: lambda_2 = 0, its parts do not agree"),
                        {"join the parts by links: lambda+ > 0"});
      return {};
    }
    return extremes(graph);
  } catch (const ConfigError& e) {
    refusal = refused(e.what(), {"another graph, or more agents"});
    return {};
  }
}

double connectivity_without_link(const GraphSettings& settings, int n) {
  return connectivity_without_link(coupling(settings, n));
}

}  // namespace mimesis::crowd
