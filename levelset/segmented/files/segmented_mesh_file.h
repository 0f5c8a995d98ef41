#pragma once

#include <filesystem>
#include <string>

#include "levelset/progress.h"
#include "levelset/segmented/meshing/segmented_to_mesh.h"

namespace levelset {

struct WriteSegmentedMeshOptions {
  std::string format = {};  ///< "ply" or "obj", with ".gz" appended if compressed; empty: by name
  Progress progress = {};
};

/// Writes the interfaces of a partition with the labels on both sides of each triangle. PLY has
/// them as the properties `front` and `behind` of the faces; the normals point to `front`. OBJ has
/// one group for each pair of labels, "interface_FRONT_BEHIND". These are the formats that hold
/// attributes, see holdsAttributes().
/// @throws UsageError for another format; IoError; Cancelled
void writeSegmentedMesh(const std::filesystem::path& path, const SegmentedMesh& mesh,
                        const WriteSegmentedMeshOptions& options = {});

}  // namespace levelset
