#pragma once
#include "common/runtime/params.h"
#include "nodes/walker/tasks/stack.h"

namespace mimesis::walker {

/// YAML of a stack of tasks. An empty list of tasks is walking_stack()'s.
void visit_stack(runtime::ParamVisitor& v, StackSettings& settings);

}  // namespace mimesis::walker
