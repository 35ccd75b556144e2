#include "common/runtime/run_node.h"
#include "nodes/synthesizer/synthesizer_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<mimesis::synthesizer::SynthesizerNode>(
      argc, argv,
      {.name = "synthesizer",
       .about = "Generates whole-body motion from learned primitives (thesis 3.3-3.7)"});
}
