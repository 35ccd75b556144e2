#pragma once
#include <Eigen/Core>

namespace mimesis::synthesizer {

struct StyleContentOptions {
  int styles = 1;      ///< dimensions of style
  int centres = 6;     ///< radial basis functions along each goal input, K in the text
  double width = 1.0;  ///< σ of the basis functions, in distances of the centres
  int iterations = 30;
  /// How style values are begun. The text takes s = |R|, all positive: where the styles lie on both
  /// sides of their mean the products R∘s average out and the directions are begun by noise; they
  /// may turn over along the goals and stay so. `principal` begins with the main directions of the
  /// residuals around each goal, turned to agree with their neighbours.
  enum class Start { principal, norm };
  Start start = Start::principal;
};

/// Separates what a motion does (goal, known) from how it is done (style, not known), [M18 3.4.3]:
/// features (weights of primitives) X ≈ M(g) + s·V(g), with the mean M and the style directions V
/// smooth functions of the goal by radial basis functions Ψ, and a style value s per motion.
/// In turns: V = Ψ(ΨᵀΨ)†Ψᵀ(R∘s), with residuals R = X − M, and sᵢ = Vᵢ·Rᵢ / |Vᵢ|.
/// With several styles R∘s is R sᵀ and Vᵢ/|Vᵢ| the nearest orthonormal matrix; style values are
/// distances along unit directions, in the unit of the features.
///
/// At a new goal the text prints ṽ = ψ(ΨᵀΨ)†ΨᵀR for the direction. That is zero, since R has
/// nothing left in the span of Ψ; meant is (R∘s), as in the iteration.
class StyleContent {
 public:
  /// `goals` N×G, `features` N×F; goal inputs are scaled to [0, 1] over the data.
  /// @throws ConfigError for sizes that do not fit, styles outside 1..F, numbers not finite.
  StyleContent(const Eigen::MatrixXd& goals, const Eigen::MatrixXd& features,
               const StyleContentOptions& options = {});

  Eigen::VectorXd mean(const Eigen::VectorXd& goal) const;        ///< F
  Eigen::MatrixXd directions(const Eigen::VectorXd& goal) const;  ///< F×S, orthonormal
  /// Style values of a motion with these features, S.
  Eigen::VectorXd style_of(const Eigen::VectorXd& goal, const Eigen::VectorXd& feature) const;
  /// Features of a motion to that goal in that style, F.
  Eigen::VectorXd feature(const Eigen::VectorXd& goal, const Eigen::VectorXd& style) const;
  /// Style values found for the N training motions, N×S.
  const Eigen::MatrixXd& styles() const { return style_; }

  /// Which style to use at a goal, given the one of the last time step with its standard deviation
  /// [M18 3.4.3]: the mean of p(s | g)·N(s; prior), with p(s | g) a kernel density over the
  /// training motions of similar goals. Without prior (infinite deviation) it is the plain mean,
  /// which may lie between two ways to move, where no motion is. `kernel`: width in style values
  /// and, relative to the range of the goals, in goals.
  struct Kernel {
    double style = 0.1, goal = 0.15;
  };
  Eigen::VectorXd infer_style(const Eigen::VectorXd& goal, const Eigen::VectorXd& prior,
                              double prior_deviation, const Kernel& kernel) const;

 private:
  Eigen::RowVectorXd basis(const Eigen::VectorXd& goal) const;  // ψ, K
  Eigen::VectorXd scaled(const Eigen::VectorXd& goal) const;
  void start(const Eigen::MatrixXd& residual, const Eigen::MatrixXd& psi, bool by_norm);
  void regress(const Eigen::MatrixXd& residual);
  Eigen::MatrixXd directions_at(const Eigen::RowVectorXd& psi) const;

  StyleContentOptions options_;
  Eigen::VectorXd low_, range_;
  Eigen::MatrixXd goals_;      // N×G, scaled
  Eigen::MatrixXd centres_;    // K×G, scaled
  Eigen::MatrixXd smoother_;   // (ΨᵀΨ)†Ψᵀ, K×N
  Eigen::MatrixXd mean_;       // K×F
  Eigen::MatrixXd direction_;  // K×(F·S)
  Eigen::MatrixXd style_;      // N×S
};

}  // namespace mimesis::synthesizer
