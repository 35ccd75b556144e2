#pragma once
#include <span>
#include <vector>

#include "common/image/rig.h"
#include "nodes/vision/hand/cma_es.h"
#include "nodes/vision/hand/skin_density.h"

namespace mimesis::vision {

struct HandTrackerSetup {
  double length_m = 0.185;  ///< wrist crease to tip of the middle finger; two cameras refine it
  int population = 24;      ///< candidates of a generation [1]
  int generations = 40;     ///< generations for a picture [1]
  std::uint64_t seed = 1;

  // Weights of the cost, found on seeds that no reported figure uses.
  double evidence_weight = 0.05;  ///< of a cell's log ratio: neighbouring cells depend [1]
  double shading_weight = 0.4;    ///< of luma against colour [1]
  double forearm_weight = 1.0;    ///< of skin on the forearm [1]
  double motion_weight = 0.3;     ///< of leaving the prediction [1]
  double habit_weight = 1.0;      ///< of unusual joint angles [1]
  double momentum = 0.5;          ///< share of the last motion that is predicted to go on [1]
  double shape_weight = 1.0;      ///< of a shape unlike the published one [1]
  double learning_rate = 0.05;    ///< of the densities, per picture
  /// One camera knows the depth badly: standard deviation of it about that at the start; 0: free.
  double depth_sd_m = 0.06;
};

/// Estimate of the hand after a picture.
struct HandEstimate {
  bool found = false;     ///< the pose explains this picture
  HandPose pose;          ///< frame of the first camera
  double score = 0.0;     ///< mean log ratio of the cells the hand covers [nat]
  double likeness = 0.0;  ///< score over what it usually is [1]
};

/// Follows a hand in pictures of one or two calibrated cameras: a model of 26 degrees of freedom is
/// fitted to each picture by maximal mutual information between what the model predicts of a cell
/// (hand or background, direction of its normal) and what is seen there (colour, luma)
/// [M18 2.2.1; Viola & Wells, IJCV 24(2):137-154, 1997]. The joint densities are those of earlier
/// fitted pictures, changed slowly: mutual information of a single picture with densities of its
/// own is maximal elsewhere. For luma and normal the joint density is a linear law with Gaussian
/// residual. Same inputs, same bits; step() does not allocate.
class HandTracker {
 public:
  /// @throws ConfigError if there are not one or two cameras with pictures of the same size.
  HandTracker(const HandTrackerSetup& setup, std::span<const image::Camera> cameras);

  /// Begins near one of some poses at the same place (in the frame of the first camera), 40 mm and
  /// 30° off at most.
  void start(std::span<const HandPose> guesses);
  void start(const HandPose& guess) { start(std::span(&guess, 1)); }
  /// Takes the newest picture of a camera. `hidden` says of its cells where something known lies,
  /// which may be before the hand; empty: nowhere.
  void see(std::size_t camera, const image::Image& image,
           std::span<const std::uint8_t> hidden = {});
  /// Fits the hand to what was seen of each camera.
  const HandEstimate& step();
  const HandEstimate& step(std::span<const image::Image* const> images);
  int cell_px() const { return eyes_.front().density.factor(); }
  const HandEstimate& estimate() const { return estimate_; }
  const HandModel& model() const { return model_; }

  /// Pose in frame T of the cameras' calibration.
  Eigen::Vector3d p_TH() const { return eye_T_ + R_TC_ * estimate_.pose.p_CH; }
  Eigen::Matrix3d R_TH() const { return R_TC_ * estimate_.pose.R_CH; }
  Eigen::Vector3d wrist_T() const { return eye_T_ + R_TC_ * model_.wrist(estimate_.pose); }
  double length_m() const { return model_.length_m(estimate_.pose); }
  HandPose from_T(const Eigen::Vector3d& p_TH, const Eigen::Matrix3d& R_TH, bool left) const;

 private:
  struct Eye {
    Eye(SkinDensity d, int width, int height) : density(std::move(d)), raster(width, height) {}
    RasterCamera camera;
    SkinDensity density;
    Evidence evidence;
    HandRaster raster;
    Shading shading;
    /// Sums over cells of (1, n)(1, n)ᵀ, (1, n) luma, luma², fading.
    Eigen::Matrix4d normals = Eigen::Matrix4d::Zero();
    Eigen::Vector4d with_luma = Eigen::Vector4d::Zero();
    double luma2 = 0.0;
    std::vector<float> nx, ny, nz;
    std::vector<std::uint8_t> hidden;
  };
  HandPose moved(const HandPose& from, std::span<const double> x) const;
  double cost(const HandPose& from, std::span<const double> x);
  double mean_ratio(const HandPose& pose);
  /// Searches around `around`, which it replaces. Returns the cost.
  double search(HandPose& around, CmaEs& cma, int generations, double sigma, bool resume);
  void try_postures(HandPose& pose);
  HandPose perturbed(const HandPose& from, double distance_m, double angle_rad);
  void close_fingers(HandPose& pose, double share) const;
  void relocate();
  void judge();
  void allow_shape();
  void learn(double rate);
  void learn_shading(Eye& eye, double rate);

  HandTrackerSetup setup_;
  HandModel model_;
  Eigen::Vector3d eye_T_;
  Eigen::Matrix3d R_TC_;
  std::vector<Eye> eyes_;
  int dimensions_;
  std::array<double, 3> people_sd_;     ///< of shapes: palm, breadth, length
  std::array<double, 3> shape_step_{};  ///< by which it may change with a picture
  CmaEs fine_, coarse_;
  std::mt19937_64 random_;
  HandCapsules capsules_;
  std::vector<double> costs_, zero_, best_;
  HandEstimate estimate_;
  HandPose last_;    ///< of the picture before
  HandPose anchor_;  ///< where it is sought
  std::vector<HandPose> guesses_;
  double usual_score_ = 0.0, depth_m_ = 0.0;
  int settled_ = 0;  ///< pictures in a row that were followed well
  int shaped_ = 0;   ///< pictures that the shape was learned from
  bool begun_ = false, moving_ = false, seeking_ = false;
  int lost_ = 0;  ///< pictures since the hand was found
};

}  // namespace mimesis::vision
