#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/pipeline/registry/operator.h"
#include "levelset/deform/deformation.h"
#include "levelset/progress.h"

/// The action `deform`: solids, meshes, point clouds and patches through a lattice of control
/// points or a cage.
namespace pipeline {

[[nodiscard]] Operator deformOperator();

/// Options of deformed(). Empty ones have the defaults of `deform`.
struct DeformValueOptions {
  std::optional<double> voxelSize = {};  ///< voxel size of a level set, world units
  std::optional<double> halfWidth = {};  ///< half width of a level set, voxels
  std::optional<double> tolerance = {};  ///< tolerance of a mesh, world units
  /// As mapping::DeformPatchesOptions.
  const levelset::NarrowBand* onto = nullptr;
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

struct DeformedValue {
  Value value;
  levelset::FoldCertificate certificate;
  // As levelset::DeformMeshResult; 0 without a mesh.
  std::size_t halvedEdges = 0;
  double bend = 0;
  double largestSnap = 0;  ///< as mapping::DeformPatchesResult; 0 without patches
};

/// Deforms a level set, a mesh, a point cloud or patches, as `deform` does.
/// @throws as levelset::deformBand(), deformMesh(), deformPoints() and mapping::deformPatches()
[[nodiscard]] DeformedValue deformed(const Value& operand, const levelset::Deformation& map,
                                     const DeformValueOptions& options);

/// The certificate as it is in the report.
[[nodiscard]] nlohmann::ordered_json foldCertificateJson(
    const levelset::FoldCertificate& certificate);

}  // namespace pipeline
