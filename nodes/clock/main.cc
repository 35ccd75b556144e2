#include "nodes/clock/clock_node.h"

int main(int argc, char** argv) { return mimesis::clock::run_clock(argc, argv); }
