#pragma once
#include <assimp/anim.h>
#include <assimp/scene.h>

#include <Eigen/Geometry>
#include <assimp/Importer.hpp>
#include <map>
#include <string>

#include "common/error.h"

namespace mimesis::mocap {

/// A motion file as assimp reads it: where its nodes are, frame by frame, as a player shows them.
class ForeignScene {
 public:
  explicit ForeignScene(const std::string& file) : scene_(importer_.ReadFile(file, 0)) {
    if (scene_ == nullptr) throw ConfigError(importer_.GetErrorString());
    if (scene_->mNumAnimations != 1) throw ConfigError(file + ": expected one animation");
    const aiAnimation& animation = *scene_->mAnimations[0];
    for (unsigned c = 0; c < animation.mNumChannels; ++c) {
      tracks_[animation.mChannels[c]->mNodeName.C_Str()] = animation.mChannels[c];
    }
  }

  unsigned frames() const { return tracks_.begin()->second->mNumRotationKeys; }
  /// Seconds of a frame.
  double time(unsigned frame) const {
    const double ticks = scene_->mAnimations[0]->mTicksPerSecond;
    return tracks_.begin()->second->mRotationKeys[frame].mTime / ticks;
  }
  /// Place of a node, or of a point in its frame, in the file's axes and unit.
  Eigen::Vector3d place(const std::string& name, unsigned frame,
                        const aiVector3D& point = aiVector3D()) const {
    aiMatrix4x4 all;
    for (const aiNode* node = scene_->mRootNode->FindNode(name.c_str()); node != nullptr;
         node = node->mParent) {
      all = local(*node, frame) * all;
    }
    const aiVector3D p = all * point;
    return Eigen::Vector3d(p.x, p.y, p.z);
  }

 private:
  aiMatrix4x4 local(const aiNode& node, unsigned frame) const {
    const auto found = tracks_.find(node.mName.C_Str());
    if (found == tracks_.end()) return node.mTransformation;
    const aiNodeAnim& track = *found->second;
    aiVector3D scale, place;
    aiQuaternion turn;
    node.mTransformation.Decompose(scale, turn, place);
    if (track.mNumPositionKeys > 0) {
      place = track.mPositionKeys[std::min(frame, track.mNumPositionKeys - 1)].mValue;
    }
    if (track.mNumRotationKeys > 0)
      turn = track.mRotationKeys[std::min(frame, track.mNumRotationKeys - 1)].mValue;
    return aiMatrix4x4(scale, turn, place);
  }

  Assimp::Importer importer_;
  const aiScene* scene_;
  std::map<std::string, const aiNodeAnim*> tracks_;
};

}  // namespace mimesis::mocap
