#pragma once
#include <string>

#include "nodes/cognition/network_spec.h"

namespace mimesis::cognition {

/// Reads a simulation of dnf-composer (github.com/Jgocunha/dynamic-neural-field-composer, JSON):
/// its fields without the gate f₁, on circular or open axes, one neuron a cell; lateral Gaussian
/// and Mexican hat kernels; Gaussian kernels between fields as links; Gaussian stimuli as sites
/// with an input "stimulus" each; 1-D. Noise is left out: equal inputs give equal bits here.
///
/// Their elements act one after the other within a step, ours at once: with a single field all
/// steps but the first are the same, with several the activity is theirs up to some steps of delay.
/// @throws ConfigError "file: element 'NAME': what" for other elements, and for what does not fit
NetworkSpec load_composer(const std::string& file);

}  // namespace mimesis::cognition
