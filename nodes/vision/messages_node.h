#pragma once
#include "nodes/vision/table_watcher.h"
#include "proto/foxglove/image.pb.h"
#include "proto/vision.pb.h"

namespace mimesis::vision {

/// What the watcher knows, as messages (headers are filled in by the ports).
v1::Blobs blobs_message(const TableWatcher& watcher);
v1::Observation observation_message(const ActionRecognizer& action);
v1::TeacherScene scene_message(const TableWatcher& watcher);
/// Overlay for viewers: boxes around the blobs, axis of the hand, a line of symbols.
foxglove::ImageAnnotations annotations_message(const TableWatcher& watcher);

}  // namespace mimesis::vision
