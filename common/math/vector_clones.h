#pragma once

/// Before a function with hot loops: one body, several instruction sets, chosen when the program
/// starts. The operations are the same and nothing is contracted (-ffp-contract=off), so the
/// results are the same bits. The sanitizers do not survive the resolvers.
#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define MIMESIS_VECTOR_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define MIMESIS_VECTOR_CLONES
#endif
