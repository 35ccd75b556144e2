// A note from the architect, 19:38; delete this file when read.
// main has by now: model/motion_model.cc (JSON, with tests) and demix/baselines.* (PCA, FastICA, sinusoids, parameter
// counts, with tests). Please drop your own (motion_model_file.cc), merge main, and do not write the verb
// (tools/mimesis/demix*) nor its plots: the architect writes them now (figures/demix_plots.h: plot_sources, plot_quality).
// Yours, in this order: shared-gated tests of SISA on A and B with the thresholds, bench/demix_bench.cc,
// Wigner marginals, figures 3.10 and 3.11. New deadline 20:20. Commit every 10 minutes.
#error "note from the architect: read nodes/synthesizer/model/architect_note.cc, then delete it"
